// The check of the device: what is measured, in words, before anything else.
import { button, card, el, isCoarse, once, word } from "./dom.js";

const PINGS = 7, PATIENCE = 10_000;

async function median(connection) {
  const trips = [];
  for (let i = 0; i < PINGS; i += 1) {
    try {
      trips.push(await connection.ping());
    } catch {
      await new Promise((wait) => setTimeout(wait, 1000));
    }
  }
  trips.sort((a, b) => a - b);
  return trips.length ? trips[Math.floor(trips.length / 2)] : NaN;
}

function pointer() {
  if (matchMedia("(any-pointer: fine)").matches) return "fine";
  return matchMedia("(any-pointer: coarse)").matches ? "touch" : "none";
}

export function deviceScreen(screen, connection) {
  const { needs } = screen;
  const found = { keyboard: false, touched: pointer() === "touch" && isCoarse(), round_trip: NaN };
  const list = el("ul", { class: "checks", "aria-live": "polite" });
  const prompt = el("p", { class: "large prompt", role: "status" });
  const missing = button(word("device_none"), null, { class: "quiet", hidden: true });
  const go = button(word("continue"), null, { class: "primary" });
  let isPatient = true;

  function line(state, text) {
    return el("li", { class: state }, el("span", { class: "mark", "aria-hidden": "true" }, { good: "✓", bad: "✕", open: "…" }[state]), el("span", {}, text));
  }

  function look() {
    const width = innerWidth, height = innerHeight, kind = pointer();
    const fits = width >= needs.min_width && height >= needs.min_height;
    const numbers = { width, height, min_width: needs.min_width, min_height: needs.min_height };
    const lines = [fits ? line("good", word("found_window", numbers)) : line("bad", word("device_size", numbers))];
    const isThere = needs.pointer === "any" || (needs.pointer === "fine" ? kind === "fine" : found.touched || navigator.maxTouchPoints > 0);
    const lack = needs.pointer === "fine" ? "device_pointer_fine" : "device_pointer_touch";
    if (kind !== "none" || needs.pointer !== "any") lines.push(isThere ? line("good", word("found_pointer")) : line("bad", word(lack)));
    if (needs.keyboard) lines.push(line(found.keyboard ? "good" : "open", word(found.keyboard ? "found_keyboard" : "device_press_key")));
    const trip = Math.round(found.round_trip), most = Math.round(needs.max_round_trip);
    const slow = most > 0 && trip > most;
    if (Number.isNaN(trip)) lines.push(line("open", word("device_checking")));
    else lines.push(line(slow ? "bad" : "good", word(slow ? "device_connection" : "found_connection", { round_trip: trip, max_round_trip: most })));
    list.replaceChildren(...lines);
    const isMeasured = !Number.isNaN(trip), waits = needs.keyboard && !found.keyboard;
    prompt.hidden = !(isMeasured && (waits || (fits && !slow && isThere)));
    prompt.textContent = waits ? word("device_press_key") : word("device_ok");
    go.hidden = waits || !isMeasured;
    missing.hidden = !(waits && isMeasured && !isPatient);
  }

  const report = () => connection.send({
    type: "device", keyboard: found.keyboard, pointer: found.touched && needs.pointer === "touch" ? "touch" : pointer(),
    width: innerWidth, height: innerHeight, round_trip: found.round_trip,
  });
  const pressed = (event) => {
    if (!event.isTrusted || !event.code) return;
    if (event.code.startsWith("Arrow")) event.preventDefault();
    found.keyboard = true;
    look();
  };
  const touched = (event) => { if (event.pointerType === "touch") found.touched = true; look(); };
  once(go, report);
  once(missing, report);
  addEventListener("keydown", pressed);
  addEventListener("pointerdown", touched);
  addEventListener("resize", look);
  const timer = setTimeout(() => { isPatient = false; look(); }, PATIENCE);
  median(connection).then((trip) => { found.round_trip = trip; look(); });
  look();
  return {
    element: card(word("device_heading"), list, prompt, el("div", { class: "buttons" }, missing, go)),
    again: () => {},
    close: () => {
      clearTimeout(timer);
      removeEventListener("keydown", pressed);
      removeEventListener("pointerdown", touched);
      removeEventListener("resize", look);
    },
  };
}
