// The participants of the monitor: a row each, which stays the same element while its numbers change.
import { el } from "./dom.js";

const rows = new Map();
const FILTERS = { here: "Here now", active: "Active", ended: "Ended", all: "Everybody" };
let filter = "all";

export function ago(seconds) {
  if (seconds < 90) return `${Math.max(0, Math.round(seconds))} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  if (seconds < 129_600) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86_400)} days`;
}

const isShown = (person) => ({ here: person.connected, active: person.state === "active", ended: person.state !== "active", all: true })[filter];

function facts(person, now) {
  const isActive = person.state === "active";
  const place = person.earlier_design ? "another design" : isActive ? person.name || "start" : "";
  const game = isActive && person.steps ? `${person.steps} steps${person.kind === "practice" ? `, attempt ${person.attempt}` : ""}` : "";
  const [right, asked] = person.attention;
  return {
    state: person.state.replace("_", " "),
    place,
    game,
    order: `${person.order_number + 1}: ${person.conditions.join(" → ")}`,
    seen: person.connected ? (person.idle > 30 ? `idle ${ago(person.idle)}` : "here") : `${ago(now - person.seen)} ago`,
    attention: asked ? `${right} of ${asked}` : "",
  };
}

function makeRow(person, choose) {
  const cell = (name, label) => el("td", { class: name, "data-label": label });
  const row = {
    name: el("button", { type: "button", class: "person", onclick: () => choose(person.participant) }, el("i", { class: "dot" }), person.participant),
    state: cell("state", "State"), bar: el("progress", { max: "1" }), share: el("span", { class: "share" }), place: el("span", { class: "place" }),
    game: el("span", { class: "game-steps" }), order: cell("order", "Order"), seen: cell("seen", "Seen"), attention: cell("attention", "Checks"),
  };
  row.element = el("tr", {}, el("th", { scope: "row" }, row.name), row.state,
    el("td", { class: "where", "data-label": "Where" }, el("div", {}, row.bar, row.share), row.place, row.game), row.order, row.seen, row.attention);
  return row;
}

function fill(row, person, now, watched) {
  const found = facts(person, now);
  const texts = [[row.state, found.state], [row.place, found.place], [row.game, found.game], [row.order, found.order], [row.seen, found.seen], [row.attention, found.attention],
    [row.share, person.screens ? `${person.screen} of ${person.screens}` : ""]];
  for (const [node, text] of texts) if (node.textContent !== text) node.textContent = text;
  const share = person.state === "complete" ? 1 : person.screens ? person.screen / person.screens : 0;
  if (row.bar.value !== share) row.bar.value = share;
  row.bar.setAttribute("aria-label", `${person.participant}: ${person.screen} of ${person.screens} screens`);
  row.element.dataset.state = person.state;
  row.element.classList.toggle("here", person.connected);
  row.element.classList.toggle("failed", person.attention[1] > person.attention[0]);
  row.name.setAttribute("aria-pressed", String(person.participant === watched));
  row.name.setAttribute("aria-label", `Watch ${person.participant}${person.connected ? ", here now" : ""}`);
}

// Draws the table into a place; `choose(participant)` is called for the one whose name is pressed.
export function people(place, found, now, watched, choose) {
  if (!place.firstChild) {
    const redraw = () => place.redraw();
    const buttons = Object.entries(FILTERS).map(([name, text]) => el("button", { type: "button", "data-filter": name, onclick: () => { filter = name; redraw(); } }, text));
    place.body = el("tbody");
    place.none = el("p", { class: "hint" }, "Nobody.");
    const heads = ["Participant", "State", "Where", "Order", "Seen", "Checks"].map((text) => el("th", { scope: "col" }, text));
    place.replaceChildren(el("div", { class: "filters", role: "group", "aria-label": "Whom to show" }, ...buttons), el("table", {}, el("thead", {}, el("tr", {}, ...heads)), place.body), place.none);
  }
  place.redraw = () => people(place, found, now, watched, choose);
  for (const one of place.querySelectorAll("[data-filter]")) one.setAttribute("aria-pressed", String(one.dataset.filter === filter));
  const shown = found.participants.filter(isShown).map((person) => {
    if (!rows.has(person.participant)) rows.set(person.participant, makeRow(person, choose));
    const row = rows.get(person.participant);
    fill(row, person, now, watched);
    return row.element;
  });
  place.none.hidden = shown.length > 0;
  // Only what is in another place moves: moving an element takes its focus away.
  shown.forEach((element, i) => { if (place.body.children[i] !== element) place.body.insertBefore(element, place.body.children[i] || null); });
  while (place.body.children.length > shown.length) place.body.lastChild.remove();
}
