// A practice or a round: what is said before it begins, then the game with everything around it.
import { announce, button, card, el, isCoarse, once, prose, study, word } from "./dom.js";
import { load } from "./sheet.js";

const isKitchen = study.domain === "overcooked";
const REST = 1100;  // milliseconds that a finished game stays in sight

const named = { Space: () => word("key_space"), Period: () => ".", Comma: () => ",", Enter: () => "Enter" };
const keyName = (code) => named[code]?.() || code.replace(/^(Key|Digit|Numpad|Arrow)/, "");

function keysHint(keys) {
  const moves = ["north", "west", "south", "east"].map((way) => keys[way] || []);
  const most = Math.max(...moves.map((codes) => codes.length));
  const sets = Array.from({ length: most }, (_, i) => moves.map((codes) => codes[i]).filter(Boolean));
  const move = sets.map((set) => (set.every((code) => code.startsWith("Arrow")) ? word("key_arrows") : set.map(keyName).join(" "))).join(" / ");
  const list = (codes = []) => codes.map(keyName).join(" / ");
  return word("keys_hint", { move, interact: list(keys.interact), stay: list(keys.stay) });
}

function parts(screen) {
  const found = [];
  if (screen.kind === "round" && screen.conditions > 1) found.push(word("part", { n: screen.condition_number, total: screen.conditions }));
  if (screen.kind === "practice" && screen.attempts > 1) found.push(word("attempt", { n: screen.attempt, total: screen.attempts }));
  return found;
}

const heading = (screen) => word(screen.kind === "practice" ? "practice_heading" : "round_heading");
// A device that is touched has no keys to speak of.
const hints = (screen) => {
  if (isKitchen) return isCoarse() ? [] : [keysHint(screen.keys)];
  return [word("pointer_hint"), word(isCoarse() ? "touch_hint" : "table_keys_hint")];
};
const hintList = (screen) => hints(screen).length > 0 && el("ul", { class: "hints" }, ...hints(screen).map((text) => el("li", {}, text)));

function before(screen, connection) {
  load(isKitchen ? "kitchen" : "table").catch(() => {});
  const go = once(button(word("begin"), null, { class: "primary large", "data-first": true }), () => connection.send({ type: "next" }));
  const isAgain = screen.kind === "practice" && screen.attempt > 1;
  return {
    element: card(heading(screen),
      parts(screen).length > 0 && el("p", { class: "eyebrow" }, parts(screen).join(" · ")),
      isAgain && el("p", { class: "notice", role: "alert" }, word("practice_again")),
      prose(screen.html),
      hintList(screen),
      el("div", { class: "buttons" }, go)),
    again: () => go.removeAttribute("aria-disabled"),
    refused: () => go.removeAttribute("aria-disabled"),
  };
}

function instructions(screen) {
  const dialog = el("dialog", { class: "dialog wide", "aria-label": word("show_instructions") }, prose(screen.html), hintList(screen) || "");
  dialog.append(el("div", { class: "buttons" }, button(word("back"), () => dialog.close(), { class: "primary" })));
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

function playing(screen, connection) {
  const stage = el("div", { class: "stage" }), hud = el("div", { class: "hud" }), panel = el("div", { class: "panel" });
  const toast = el("p", { class: "toast", role: "status", hidden: true });
  const foot = el("div", { class: "foot" },
    el("span", {}, parts(screen).join(" · ") || heading(screen)),
    button(word("show_instructions"), () => instructions(screen), { class: "quiet" }));
  const element = el("section", { class: `game ${isKitchen ? "kitchen" : "table"}`, "aria-label": heading(screen) }, hud, stage, panel, foot, toast);
  let play = null, latest = screen, isClosed = false;
  const view = {
    isGame: true,
    until: 0,
    element,
    over(isFinished) {
      view.until = performance.now() + REST;
      toast.textContent = word(isFinished ? "game_over" : "out_of_steps");
      toast.hidden = false;
      announce(toast.textContent);
    },
    take: (message) => { if (play) play.take(message); else if (message.state) latest = { ...latest, state: message.state }; },
    refused: (message) => play?.take(message),
    again: (next) => { if (play) play.again(next); else latest = next; },
    lost: () => play?.lost(),
    close() { isClosed = true; play?.close(); },
  };
  const start = async () => {
    const [measures, module] = await Promise.all([load(isKitchen ? "kitchen" : "table"), import(isKitchen ? "./kitchen_play.js" : "./table_play.js")]);
    if (isClosed) return;
    play = module.play({ screen: latest, connection, measures, stage, hud, panel, over: view.over });
    play.focus();
  };
  start().catch((error) => {
    connection.note("error", error.stack || error);
    stage.replaceChildren(el("p", { class: "notice bad", role: "alert" }, word("server_error")));
  });
  return view;
}

export const roundScreen = (screen, connection) => (screen.begun ? playing(screen, connection) : before(screen, connection));
