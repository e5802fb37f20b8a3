// What the page is made of: elements, words, and what is said to screen readers.
export const study = JSON.parse(document.getElementById("study").textContent);

// A short text of the study; {name} in it is filled in.
export function word(key, values = {}) {
  const text = Object.hasOwn(study.words, key) ? study.words[key] : key;
  return text.replace(/\{(\w+)\}/g, (whole, name) => (Object.hasOwn(values, name) ? String(values[name]) : whole));
}

function fill(node, props, children) {
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

// Strings become text, never markup.
export const el = (tag, props = {}, ...children) => fill(document.createElement(tag), props, children);
export const svg = (tag, props = {}, ...children) => fill(document.createElementNS("http://www.w3.org/2000/svg", tag), props, children);

// A text of the study that the server made of Markdown, in which it shows HTML as it is written.
export function prose(html) {
  const box = el("div", { class: "text" });
  box.innerHTML = html;
  for (const link of box.querySelectorAll("a[href]")) fill(link, { target: "_blank", rel: "noopener noreferrer" }, []);
  for (const table of box.querySelectorAll("table")) table.replaceWith(el("div", { class: "scroll" }, table.cloneNode(true)));
  return box;
}

export function button(text, onclick, props = {}) {
  return el("button", { type: "button", onclick, ...props }, text);
}

// Disables a button that was pressed until the server has answered.
export function once(node, act) {
  node.addEventListener("click", () => {
    if (node.getAttribute("aria-disabled") === "true") return;
    if (act() === false) return;
    node.setAttribute("aria-disabled", "true");
    setTimeout(() => node.removeAttribute("aria-disabled"), 4000);
  });
  return node;
}

const live = document.getElementById("live");
export function announce(text) {
  live.textContent = "";
  if (text) setTimeout(() => { live.textContent = text; }, 30);
}

// A card: texts of the study bring their own heading, or `title` is one.
export function card(title, ...children) {
  const element = el("article", { class: "card" }, ...children);
  if (title && !element.querySelector("h1")) element.prepend(el("h1", {}, title));
  element.querySelector("h1")?.setAttribute("tabindex", "-1");
  return element;
}

// A question in front of everything else; resolves to whether it was answered by `yes`.
export function ask(text, yes, no, { danger = false } = {}) {
  return new Promise((resolve) => {
    const dialog = el("dialog", { class: "dialog", "aria-label": text }, el("p", {}, text));
    const end = (answer) => { dialog.close(); dialog.remove(); resolve(answer); };
    dialog.append(el("div", { class: "buttons" },
      button(no, () => end(false), { class: danger ? "primary" : "" }),
      button(yes, () => end(true), { class: danger ? "danger" : "primary" })));
    dialog.addEventListener("cancel", () => { dialog.remove(); resolve(false); });
    document.body.append(dialog);
    dialog.showModal();
  });
}

export const prefersStill = matchMedia("(prefers-reduced-motion: reduce)");
export const isCoarse = () => matchMedia("(pointer: coarse)").matches;
