// The participant's page: joins or comes back, then shows whatever screen the server says.
import { announce, ask, button, el, study, word } from "./dom.js";
import { Connection } from "./connection.js";
import * as screens from "./screens.js";
import { deviceScreen } from "./device.js";
import { questionnaireScreen } from "./questionnaire.js";
import { roundScreen } from "./round.js";

const main = document.getElementById("main"), banner = document.getElementById("banner");
const bar = document.getElementById("progress"), leave = document.getElementById("withdraw");
const MAKERS = {
  device: deviceScreen, consent: screens.consent, text: screens.text, practice: roundScreen, round: roundScreen,
  questionnaire: questionnaireScreen, pause: screens.pause, end: screens.end,
};
let connection = null, view = null, shown = null, later = 0, errors = 0;

// -- looks ----------------------------------------------------------------------------------------------------------

function luminance(colour) {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255)
    .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function paint() {
  if (!/^#[0-9a-f]{6}$/i.test(study.accent)) return;
  const root = document.documentElement.style;
  root.setProperty("--chosen", study.accent);
  root.setProperty("--on-accent", luminance(study.accent) > 0.18 ? "#16120f" : "#ffffff");
}

// -- screens --------------------------------------------------------------------------------------------------------

function place(next, { focus = true } = {}) {
  view?.close?.();
  view = next;
  document.body.classList.toggle("playing", Boolean(next.isGame));
  main.replaceChildren(next.element);
  scrollTo(0, 0);
  if (focus) (next.element.querySelector("[data-first]") || next.element.querySelector("h1") || next.element).focus({ preventScroll: true });
}

function progress(share) {
  bar.hidden = false;
  bar.setAttribute("aria-valuenow", Math.round(share * 100));
  bar.firstElementChild.style.setProperty("--share", share);
}

// A finished round stays in sight for a moment.
function show(screen) {
  clearTimeout(later);
  const rest = (view?.until || 0) - performance.now();
  if (rest > 0) {
    later = setTimeout(() => show(screen), rest);
    return;
  }
  const key = [screen.name, screen.kind, screen.attempt, screen.begun].join("/");
  leave.hidden = screen.kind === "end";
  progress(screen.progress);
  if (key === shown && view?.again) {
    view.again(screen);
    return;
  }
  shown = key;
  const maker = MAKERS[screen.kind];
  if (screen.kind === "end") connection.end();
  if (maker) place(maker(screen, connection));
}

// -- the server speaks ----------------------------------------------------------------------------------------------

let warning = null;

function warn(seconds) {
  warning?.close();
  const end = performance.now() + seconds * 1000;
  const text = el("p");
  const dialog = el("dialog", { class: "dialog", "aria-label": word("idle_warning", { seconds }) }, text);
  const tick = () => { text.textContent = word("idle_warning", { seconds: Math.max(0, Math.ceil((end - performance.now()) / 1000)) }); };
  const timer = setInterval(tick, 250);
  const close = () => { clearInterval(timer); dialog.close(); dialog.remove(); warning = null; };
  const here = () => { connection.note("active"); close(); };
  dialog.append(el("div", { class: "buttons" }, button(word("still_here"), here, { class: "primary" })));
  dialog.addEventListener("cancel", (event) => { event.preventDefault(); here(); });
  warning = { close };
  tick();
  document.body.append(dialog);
  dialog.showModal();
}

function heard(message) {
  if (message.type === "screen") {
    warning?.close();
    show(message);
  } else if (message.type === "replaced") {
    ended(word("other_tab"));
  } else if (message.type === "warning") {
    warn(message.seconds);
  } else if (message.type === "refused" && !message.state) {
    if (!message.fatal) view?.refused?.(message);
  } else {
    view?.take?.(message);
  }
}

function ended(text) {
  connection.isOver = true;
  shown = null;
  leave.hidden = true;
  warning?.close();
  tell("");
  place(screens.notice(text));
}

function tell(text) {
  banner.hidden = !text;
  banner.textContent = text;
}

function changed(state) {
  if (state === "open") tell("");
  if (state === "lost") {
    tell(word("reconnecting"));
    warning?.close();
    view?.lost?.();
  }
  if (state === "replaced") ended(word("other_tab"));
  if (state === "unknown") {
    history.replaceState(null, "", location.pathname + location.search);
    connection = null;
    welcome();
  }
}

// -- what happens to the page ---------------------------------------------------------------------------------------

function listen() {
  const note = (kind, detail) => connection?.note(kind, detail);
  addEventListener("focus", () => note("focus"));
  addEventListener("blur", () => note("blur"));
  document.addEventListener("visibilitychange", () => note(document.hidden ? "hidden" : "visible"));
  document.addEventListener("fullscreenchange", () => note("fullscreen", document.fullscreenElement ? "on" : "off"));
  let resized = 0;
  addEventListener("resize", () => {
    clearTimeout(resized);
    resized = setTimeout(() => note("resize", `${innerWidth}x${innerHeight}`), 300);
  });
  const failed = (text) => { if (errors++ < 5) note("error", text); };
  addEventListener("error", (event) => failed(`${event.message} ${event.filename}:${event.lineno}`));
  addEventListener("unhandledrejection", (event) => failed(event.reason?.stack || event.reason));
  // Reading and filling in are signs of life that nothing else tells the server about.
  let last = 0;
  const alive = () => {
    const now = performance.now();
    if (now - last < 20_000 || view?.isGame) return;
    last = now;
    note("active");
  };
  for (const kind of ["keydown", "pointerdown", "pointermove", "scroll"]) addEventListener(kind, alive, { passive: true, capture: true });
  leave.addEventListener("click", async () => {
    if (await ask(word("withdraw_question"), word("withdraw_yes"), word("withdraw_no"), { danger: true })) connection?.send({ type: "withdraw" });
  });
}

// -- the beginning --------------------------------------------------------------------------------------------------

async function join() {
  const query = Object.fromEntries(new URLSearchParams(location.search));
  const answer = await fetch(new URL("api/join", document.baseURI), {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ query }), credentials: "omit",
  });
  const data = await answer.json();
  if (!answer.ok) {
    place(answer.status === 403 ? screens.told(data.reason) : screens.welcome(join, word("server_error")));
    return;
  }
  // Only in the fragment: it is sent to no server, and nothing rests in the browser.
  history.replaceState(null, "", `${location.pathname}${location.search}#${data.token}`);
  open(data.token);
}

function open(token) {
  connection = new Connection(token, heard, changed);
}

function welcome() {
  place(study.can_join ? screens.welcome(join) : screens.told(study.reason || study.welcome), { focus: false });
}

paint();
listen();
if (location.hash.length > 1) {
  announce(word("connecting"));
  open(decodeURIComponent(location.hash.slice(1)));
} else {
  welcome();
}
