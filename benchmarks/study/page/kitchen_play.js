// Plays a kitchen: a key or button is a step, and the server says what came of it.
import { announce, button, el, svg, word } from "./dom.js";
import { use } from "./sheet.js";
import { Hold } from "./hold.js";
import { itemWords, KitchenBoard } from "./kitchen_board.js";

const ACTIONS = { north: 0, south: 1, east: 2, west: 3, stay: 4, interact: 5 };
const INTERACT = ACTIONS.interact, STAY = ACTIONS.stay, MOST_WAITING = 2, COOKING = 1, READY = 2;
const ARROWS = { north: "M0 -26L24 14H-24Z", south: "M0 26L24 -14H-24Z", east: "M26 0L-14 24V-24Z", west: "M-26 0L14 24V-24Z" };

export function play({ screen, connection, measures, stage, hud, panel, over }) {
  const board = new KitchenBoard(screen.scene, measures);
  const actions = new Map(Object.entries(screen.keys).flatMap(([name, codes]) => codes.map((code) => [code, ACTIONS[name]])));
  const frame = el("div", { class: "board", role: "application", tabindex: "0", "aria-label": word("kitchen_label") }, board.floor, board.top);
  const tickets = el("ul", { class: "tickets", "aria-label": word("orders") });
  const served = el("p", { class: "served" }), steps = el("p", { class: "count" });
  const inHands = el("div", { class: "hands" });
  const queue = [];
  let state = screen.state, busy = false, shown = null, lastAct = performance.now();

  // -- steps ----------------------------------------------------------------------------------------------------------

  function step(action, down) {
    if (state.over || !connection.isOpen) return;
    busy = connection.send({ type: "step", n: state.n, action, down, shown });
    lastAct = performance.now();
  }

  // A press while a step is on its way waits for it; a repetition does not.
  function act(action, down, isRepeat) {
    if (document.querySelector("dialog[open]")) return;
    if (!busy) step(action, down);
    else if (!isRepeat && queue.length < MOST_WAITING) queue.push([action, down]);
  }
  const hold = new Hold(act, (action) => action !== INTERACT);

  // While something cooks, time passes without a key.
  const timer = setInterval(() => {
    const isCooking = state.pots.some((pot) => pot[5] === COOKING);
    if (!screen.waiting || !isCooking || busy || document.hidden || document.querySelector("dialog[open]")) return;
    if (performance.now() - lastAct >= screen.waiting * 1000) step(STAY, null);
  }, 40);

  // -- what is seen -----------------------------------------------------------------------------------------------------

  function ticket(soup, isDone) {
    const words = soup.map((kind) => word(`item_${kind}`)).join(", ");
    const mark = isDone && svg("svg", { viewBox: "0 0 10 10", class: "done-mark", "aria-hidden": "true" }, use("k-tick", 0, 0, 10));
    return el("li", { class: isDone ? "ticket done" : "ticket" }, board.icon([soup]), mark, el("span", { class: "visually-hidden" }, isDone ? `${words} ✓` : words));
  }

  function orders() {
    const done = state.delivered.map((soup) => soup.join());
    return screen.scene.soups.map((soup) => {
      const at = done.indexOf(soup.join());
      if (at >= 0) done.splice(at, 1);
      return ticket(soup, at >= 0);
    });
  }

  function draw(before) {
    board.show(state);
    const { held } = state.players[0];
    if (!before || before.delivered.length !== state.delivered.length) tickets.replaceChildren(...orders());
    served.textContent = word("delivered", { n: state.delivered.length, total: screen.scene.soups.length });
    steps.textContent = word("step", { n: state.n });
    if (!before || JSON.stringify(before.players[0].held) !== JSON.stringify(held)) inHands.replaceChildren(board.icon(held), el("span", {}, itemWords(held)));
    frame.setAttribute("aria-label", board.describe(state));
    shown = null;
    requestAnimationFrame((time) => { shown = time; });
  }

  function say(before) {
    const now = [];
    if (JSON.stringify(before.players[0].held) !== JSON.stringify(state.players[0].held)) now.push(itemWords(state.players[0].held));
    const ready = (one) => one.pots.filter((pot) => pot[5] === READY).length;
    const cooking = (one) => one.pots.filter((pot) => pot[5] === COOKING).length;
    if (ready(state) > ready(before)) now.push(word("pot_ready"));
    else if (cooking(state) > cooking(before)) now.push(word("pot_cooking"));
    if (state.delivered.length > before.delivered.length) now.push(word("delivered", { n: state.delivered.length, total: screen.scene.soups.length }));
    if (now.length) announce(now.join(". "));
  }

  function change(next) {
    const before = state;
    state = next;
    draw(before);
    say(before);
    if (state.over && !before.over) {
      hold.clear();
      over(state.orders.length === 0);
    }
  }

  // -- keys and buttons ---------------------------------------------------------------------------------------------------

  function pressed(event) {
    const action = actions.get(event.code);
    if (action === undefined || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const isForButton = ["Space", "Enter"].includes(event.code) && document.activeElement?.tagName === "BUTTON";
    if (isForButton) return;
    event.preventDefault();
    if (!event.repeat) hold.press(event.code, action, event.timeStamp);
  }
  const released = (event) => hold.release(event.code);
  const away = () => hold.clear();

  function control(name, text) {
    const action = ACTIONS[name];
    const picture = ARROWS[name] && svg("svg", { viewBox: "-40 -40 80 80", "aria-hidden": "true" }, svg("path", { d: ARROWS[name] }));
    const key = button(picture || word(text), null, { class: `control ${name}`, "aria-label": word(text) });
    const end = (event) => hold.release(`pointer${event.pointerId}`);
    key.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      key.setPointerCapture(event.pointerId);
      hold.press(`pointer${event.pointerId}`, action, event.timeStamp);
    });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) key.addEventListener(kind, end);
    key.addEventListener("contextmenu", (event) => event.preventDefault());
    // Without a pointer: from the keyboard, or by what reads the screen aloud.
    key.addEventListener("click", (event) => { if (event.detail === 0) act(action, event.timeStamp, false); });
    return key;
  }

  const controls = el("div", { class: "controls", role: "group", "aria-label": word("controls") },
    el("div", { class: "cross" }, control("north", "move_up"), control("west", "move_left"), control("east", "move_right"), control("south", "move_down")),
    el("div", { class: "deeds" }, control("interact", "interact"), control("stay", "wait")));
  frame.style.setProperty("--ratio", board.ratio);
  stage.replaceChildren(frame);
  hud.replaceChildren(tickets, el("div", { class: "counts" }, served, steps));
  panel.replaceChildren(inHands, controls);
  draw(null);
  requestAnimationFrame(() => frame.classList.add("lively"));  // the first picture does not slide in
  addEventListener("keydown", pressed);
  addEventListener("keyup", released);
  addEventListener("blur", away);

  return {
    focus: () => frame.focus({ preventScroll: true }),
    take(message) {
      if (message.type === "refused") queue.length = 0;
      if (message.state) change(message.state);
      busy = false;
      const next = queue.shift();
      if (next) step(...next);
    },
    again(next) {
      queue.length = 0;
      busy = false;
      hold.clear();
      change(next.state);
    },
    lost() {
      queue.length = 0;
      busy = false;
      hold.clear();
    },
    close() {
      clearInterval(timer);
      hold.clear();
      removeEventListener("keydown", pressed);
      removeEventListener("keyup", released);
      removeEventListener("blur", away);
    },
  };
}
