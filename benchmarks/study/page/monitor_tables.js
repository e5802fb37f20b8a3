// The smaller tables of the monitor: balance of orders and endings, errors, volume of the data.
import { el } from "./dom.js";

const time = new Intl.DateTimeFormat(undefined, { dateStyle: "short", timeStyle: "medium" });
const number = new Intl.NumberFormat();

export function balance(found) {
  const most = Math.max(1, ...found.orders.map((order) => order.complete + order.active + order.ended));
  const bar = (n, kind) => n > 0 && el("progress", { class: kind, max: most, value: n, "aria-label": `${n} ${kind}` });
  const rows = found.orders.map((order) => el("tr", {},
    el("th", { scope: "row" }, String(order.number + 1)),
    el("td", { class: "conditions" }, order.conditions.join(" → ") || "drawn for each"),
    el("td", { class: "counts" }, ...["complete", "active", "ended"].map((kind) => bar(order[kind], kind)),
      el("span", {}, `${order.complete} complete, ${order.active} active, ${order.ended} ended`))));
  const endings = Object.entries(found.endings).map(([state, n]) => el("li", {}, `${state.replace("_", " ")}: `, el("strong", {}, number.format(n))));
  return [
    rows.length ? el("table", { class: "orders" }, el("thead", {}, el("tr", {}, ...["Order", "Conditions", "Participants"].map((text) => el("th", { scope: "col" }, text)))), el("tbody", {}, ...rows)) : el("p", { class: "hint" }, "Nobody has joined."),
    endings.length > 0 && el("ul", { class: "endings" }, ...endings),
  ].filter(Boolean);
}

export function problems(events) {
  if (!events.length) return el("p", { class: "hint" }, "Nothing went wrong.");
  return el("ol", { class: "log", tabindex: "0", "aria-label": "Error log, newest first" }, ...events.map((event) => el("li", { "data-kind": event.kind },
    el("time", {}, time.format(new Date(event.at * 1000))), " ", el("strong", {}, event.participant || "server"), " ", event.kind.replace("_", " "), el("code", {}, event.detail === "{}" ? "" : event.detail))));
}

function size(bytes) {
  const units = ["bytes", "kB", "MB", "GB"];
  const power = Math.min(units.length - 1, Math.floor(Math.log10(Math.max(1, bytes)) / 3));
  return `${(bytes / 1000 ** power).toFixed(power ? 1 : 0)} ${units[power]}`;
}

export function volume(found, overview) {
  const rows = Object.entries(found.rows).map(([name, n]) => el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, number.format(n))));
  return [
    el("p", {}, el("strong", {}, size(found.bytes)), " in the database"),
    el("table", { class: "volume-rows" }, el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "Table"), el("th", { scope: "col" }, "Rows"))), el("tbody", {}, ...rows)),
    el("p", { class: "hint" }, `Design ${overview.study.design}. ${overview.connections} open connections, monitors included.`),
  ];
}
