// The monitor: connects with the admin token of the address's fragment, and draws what the server tells.
import { announce, ask, button, el } from "./dom.js";
import { people } from "./monitor_people.js";
import { balance, problems, volume } from "./monitor_tables.js";
import { Watch } from "./monitor_watch.js";

const LONGEST_WAIT = 15_000;
const STATES = { open: ["Pause", "Close"], paused: ["Open", "Close"], closed: ["Open"] };
const BECOMES = { Open: "open", Pause: "paused", Close: "closed" };
const main = document.getElementById("main"), link = document.getElementById("link");
const base = (path) => new URL(path, document.baseURI.split("#")[0]);

let token = decodeURIComponent(location.hash.slice(1)), socket = null, tries = 0, overview = null, mode = "live";
const watch = new Watch((participant) => say({ type: "watch", mode, participant }));

// -- the line to the server ---------------------------------------------------------------------------------------------

function say(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function tellLink(text, isGood) {
  link.textContent = text;
  link.classList.toggle("good", isGood);
}

function connect() {
  const url = base("monitor/socket");
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  socket = new WebSocket(url);
  socket.onopen = () => {
    say({ type: "hello", token });
    if (watch.participant) say({ type: "watch", mode, participant: watch.participant });
  };
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = (event) => {
    if (event.code === 4401) return askForToken("This token is not the study's.");
    tellLink("not connected", false);
    setTimeout(connect, Math.min(LONGEST_WAIT, 500 * 2 ** tries) * (0.5 + Math.random()));
    tries += 1;
  };
}

function take(message) {
  if (message.type === "overview") {
    tries = 0;
    tellLink("live", true);
    overview = message;
    if (!overview.modes[mode]) mode = Object.keys(overview.modes)[0];
    draw();
  } else watch.take(message);
}

function askForToken(problem) {
  tellLink("not connected", false);
  const field = el("input", { type: "password", id: "token", autocomplete: "off", spellcheck: "false", required: true });
  const form = el("form", { class: "card token" }, el("h1", {}, "Monitor"), problem && el("p", { class: "notice bad", role: "alert" }, problem),
    el("p", {}, "Open the monitor by the link that ", el("code", {}, "legible study serve"), " prints, or give the part of it behind the # here."),
    el("label", { for: "token" }, "Admin token"), field, el("div", { class: "buttons" }, el("button", { class: "primary" }, "Open")));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    token = field.value.trim().split("#").pop();
    main.replaceChildren(el("p", { class: "notice" }, "connecting"));
    connect();
  });
  main.replaceChildren(form);
  field.focus();
}

// -- recruitment --------------------------------------------------------------------------------------------------------

async function recruit(word) {
  const state = BECOMES[word];
  if (state === "closed" && !await ask("Close recruitment? Nobody can join then; who has begun may finish. It can be opened again.", "Close", "Cancel", { danger: true })) return;
  const answer = await fetch(base("api/monitor/recruitment"), {
    method: "POST", headers: { authorization: `Bearer ${token}` }, body: JSON.stringify({ mode: "live", state }),
  }).catch(() => null);
  if (!answer?.ok) return announce("Recruitment could not be changed.");
  overview.modes.live.recruitment = state;
  announce(`Recruitment is ${state}.`);
  draw();
}

// -- the page -----------------------------------------------------------------------------------------------------------

const places = {};
function frame() {
  if (places.head?.isConnected) return;
  for (const name of ["modes", "tiles", "recruitment", "people", "balance", "problems", "volume"]) places[name] = el("div", { class: name });
  places.head = el("div", { class: "head" }, places.modes, places.recruitment);
  const section = (title, place, props = {}) => el("section", { class: "box", ...props }, el("h2", {}, title), place);
  main.replaceChildren(places.head, places.tiles, el("div", { class: "columns" },
    section("Participants", places.people, { class: "box wide" }),
    section("Session", watch.element, { class: "box side", id: "session" }),
    section("Orders", places.balance), section("Error log", places.problems), section("Data", places.volume, { class: "box wide" })));
}

// What has not changed stays, so that focus and scroll positions do.
const drawn = new Map();
function put(name, data, make) {
  const looks = JSON.stringify(data);
  if (drawn.get(name) === looks && places[name].firstChild) return;
  drawn.set(name, looks);
  const focused = places[name].contains(document.activeElement) ? document.activeElement.dataset.key : null;
  places[name].replaceChildren(...[make()].flat());
  if (focused) places[name].querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
}

function tiles(found) {
  const connected = found.participants.filter((person) => person.connected).length;
  const ended = Object.entries(found.endings).filter(([state]) => !["active", "complete"].includes(state)).reduce((sum, [, n]) => sum + n, 0);
  const tile = (value, text) => el("div", { class: "tile" }, el("strong", {}, String(value)), el("span", {}, text));
  return [
    tile(connected, "here now"),
    tile(found.endings.active || 0, "active"),
    tile(found.wanted ? `${found.complete} of ${found.wanted}` : found.complete, "complete"),
    tile(ended, "ended otherwise"),
    found.earlier ? tile(found.earlier, "of another design") : "",
  ];
}

function draw() {
  frame();
  const found = overview.modes[mode], names = Object.keys(overview.modes);
  put("modes", [names, mode], () => names.map((name) => button(name === "live" ? "Live" : "Debug", () => { mode = name; watch.leave(); draw(); }, { "aria-pressed": String(name === mode), "data-key": name })));
  put("recruitment", [mode, found.recruitment], () => (mode !== "live" ? [el("p", {}, "Debug participants can always join.")]
    : [el("p", {}, "Recruitment: ", el("strong", { class: found.recruitment }, found.recruitment)),
      ...(STATES[found.recruitment] || []).map((word) => button(word, () => recruit(word), { "data-key": word }))]));
  put("tiles", [found.endings, found.complete, found.wanted, found.earlier, found.participants.map((p) => p.connected)], () => tiles(found));
  people(places.people, found, overview.now, watch.participant, (participant) => { watch.begin(participant); draw(); });
  put("balance", [found.orders, found.endings], () => balance(found));
  put("problems", found.problems, () => problems(found.problems));
  put("volume", [found.volume, overview.connections], () => volume(found.volume, overview));
  watch.about(found.participants.find((person) => person.participant === watch.participant), overview.predictor);
}

if (token) connect();
else askForToken("");
