// Questionnaires: each kind of item as plain form controls, checked here so that nobody waits, and again by the server.
import { announce, button, card, el, once, prose, word } from "./dom.js";

let ids = 0;

// What an item says when it is asked for its value: `read()` gives {name: value}, null where nothing was answered.
function options(item, texts, values, { many = false, group = item.name } = {}) {
  const name = `q${(ids += 1)}`;
  const inputs = texts.map((text, i) => el("input", { type: many ? "checkbox" : "radio", name, value: i, id: `${name}-${i}` }));
  const chosen = () => values.filter((_, i) => inputs[i].checked);
  const read = () => ({ [group]: many ? chosen() : (chosen()[0] ?? null) });
  return { inputs, read, labels: texts.map((text, i) => el("label", { for: inputs[i].id }, inputs[i], el("span", {}, text))) };
}

function likert(item, group = item.name) {
  const points = Array.from({ length: item.points }, (_, i) => i + 1);
  const each = item.labels.length === item.points && item.points > 2;
  const texts = points.map((n) => (each ? item.labels[n - 1] : String(n)));
  const { inputs, labels, read } = options(item, texts, points, { group });
  const box = el("div", { class: each ? "scale worded" : "scale" }, ...labels);
  if (!each && item.labels.length === 2) {
    inputs[0].setAttribute("aria-label", `1, ${item.labels[0]}`);
    inputs.at(-1).setAttribute("aria-label", `${item.points}, ${item.labels[1]}`);
    return { body: el("div", {}, box, el("div", { class: "ends", "aria-hidden": "true" }, ...item.labels.map((text) => el("span", {}, text)))), read, first: inputs[0] };
  }
  return { body: box, read, first: inputs[0] };
}

function slider(item, label) {
  const id = `q${(ids += 1)}`;
  const middle = item.low + Math.round((item.high - item.low) / item.step / 2) * item.step;
  const input = el("input", { type: "range", id, min: item.low, max: item.high, step: item.step, value: middle, class: "untouched", "aria-labelledby": label });
  const shown = el("output", { for: id }, word("move_slider"));
  input.setAttribute("aria-valuetext", word("move_slider"));
  let isTouched = false;
  const touch = () => {
    isTouched = true;
    input.classList.remove("untouched");
    input.setAttribute("aria-valuetext", input.value);
    shown.textContent = input.value;
    input.style.setProperty("--share", (input.value - item.low) / (item.high - item.low));
  };
  // A value is chosen by any touch, the one in the middle by staying there: a click, or a key.
  for (const kind of ["input", "change", "pointerup"]) input.addEventListener(kind, touch);
  input.addEventListener("keydown", (event) => { if ([" ", "Enter"].includes(event.key)) { event.preventDefault(); touch(); } });
  const ends = el("div", { class: "ends" }, el("span", {}, item.labels[0] || String(item.low)), shown, el("span", {}, item.labels[1] || String(item.high)));
  const number = () => Number(Number(input.value).toPrecision(12));
  return { body: el("div", { class: "slider" }, input, ends), read: () => ({ [item.name]: isTouched ? number() : null }), first: input };
}

function choice(item) {
  const { inputs, labels, read } = options(item, item.options, item.options, { many: item.several });
  const hint = el("p", { class: "hint" }, word(item.several ? "choose_several" : "choose_one"));
  return { body: el("div", {}, hint, el("div", { class: "choices" }, ...labels)), read, first: inputs[0] };
}

function text(item, label) {
  const area = el("textarea", { rows: 3, maxlength: item.most, "aria-labelledby": label });
  const left = el("p", { class: "hint counter" });
  const count = () => { left.textContent = word("characters_left", { n: item.most - area.value.length }); };
  area.addEventListener("input", count);
  count();
  return { body: el("div", {}, area, left), read: () => ({ [item.name]: area.value.trim() ? area.value : null }), first: area };
}

function matrix(item) {
  const points = Array.from({ length: item.points }, (_, i) => i + 1);
  const each = item.labels.length === item.points;
  const heads = points.map((n) => (each ? item.labels[n - 1] : n === 1 ? item.labels[0] || "1" : n === item.points ? item.labels[1] || String(n) : String(n)));
  const rows = item.rows.map((row, i) => ({ row, name: `${item.name}/${i + 1}`, ...options(item, heads, points, { group: `${item.name}/${i + 1}` }) }));
  const body = el("div", { class: "matrix", role: "group" },
    el("div", { class: "row heads", "aria-hidden": "true" }, el("span"), ...heads.map((head) => el("span", {}, head))),
    ...rows.map(({ row, labels, name }) => el("div", { class: "row", role: "radiogroup", "aria-label": row, "data-answer": name }, el("span", { class: "asked" }, row), ...labels)));
  body.style.setProperty("--points", item.points);
  return { body, read: () => Object.assign({}, ...rows.map((row) => row.read())), first: rows[0]?.inputs[0], firsts: Object.fromEntries(rows.map((row) => [row.name, row.inputs[0]])) };
}

const KINDS = { likert, slider, choice, text, matrix, attention: choice };

function question(item) {
  const label = `q${(ids += 1)}`;
  const made = item.kind === "slider" || item.kind === "text" ? KINDS[item.kind](item, label) : KINDS[item.kind](item);
  const error = el("p", { class: "error", id: `${label}-error`, hidden: true });
  const asked = el("legend", { id: label }, item.text, item.required ? null : el("span", { class: "optional" }, ` (${word("optional")})`));
  const box = el("fieldset", { class: `item ${item.kind}`, "data-item": item.name, "aria-describedby": error.id }, asked, item.help && el("p", { class: "help" }, item.help), made.body, error);
  const answers = () => Object.keys(made.read());
  // Errors by the name of the answer; the control to go to for the first of them, or null.
  function complain(errors) {
    const wrong = answers().filter((name) => errors[name]);
    error.hidden = !wrong.length;
    error.textContent = wrong.length ? word(errors[wrong[0]], { most: item.most }) : "";
    box.classList.toggle("wrong", wrong.length > 0);
    for (const row of box.querySelectorAll("[data-answer]")) row.classList.toggle("wrong", Boolean(errors[row.dataset.answer]));
    return wrong.length ? made.firsts?.[wrong[0]] || made.first : null;
  }
  function missing() {
    if (!item.required) return {};
    const given = made.read();
    return Object.fromEntries(Object.entries(given).filter(([, value]) => value === null || (Array.isArray(value) && !value.length)).map(([name]) => [name, "answer_missing"]));
  }
  box.addEventListener("input", () => { if (box.classList.contains("wrong")) complain(missing()); });
  return { box, read: made.read, complain, missing };
}

export function questionnaireScreen(screen, connection) {
  const begun = performance.now();
  const questions = screen.items.map(question);
  const problem = el("p", { class: "notice bad", role: "alert", hidden: true }, word("answers_incomplete"));

  function complain(errors) {
    const controls = questions.map((one) => one.complain(errors)).filter(Boolean);
    problem.hidden = !Object.keys(errors).length;
    if (!controls.length) return false;
    announce(word("answers_incomplete"));
    controls[0].focus({ preventScroll: true });
    controls[0].closest(".item").scrollIntoView({ block: "center" });
    return true;
  }
  const send = once(button(word("submit"), null, { class: "primary" }), () => {
    if (complain(Object.assign({}, ...questions.map((one) => one.missing())))) return false;
    const values = Object.assign({}, ...questions.map((one) => one.read()));
    return connection.send({ type: "answers", values, seconds: (performance.now() - begun) / 1000 });
  });
  const form = el("form", { novalidate: true, autocomplete: "off" }, problem, ...questions.map((one) => one.box), el("div", { class: "buttons" }, send));
  form.addEventListener("submit", (event) => event.preventDefault());
  return {
    element: card(screen.title, prose(screen.html), form),
    again(next) {
      send.removeAttribute("aria-disabled");
      complain(next.errors || {});
    },
    lost: () => send.removeAttribute("aria-disabled"),
  };
}
