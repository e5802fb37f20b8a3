// Screens that are mostly text: the welcome, consent, instructions, the pause between sittings, the end.
import { announce, button, card, el, once, prose, study, word } from "./dom.js";

export function welcome(join, problem = "") {
  const go = button(word("begin"), null, { class: "primary large" });
  const error = el("p", { class: "notice bad", role: "alert", hidden: !problem }, problem);
  go.addEventListener("click", async () => {
    if (go.getAttribute("aria-disabled") === "true") return;
    go.setAttribute("aria-disabled", "true");
    error.hidden = true;
    try {
      await join();
    } catch {
      error.textContent = word("server_error");
      error.hidden = false;
    }
    go.removeAttribute("aria-disabled");
  });
  return { element: card("", prose(study.welcome), error, el("div", { class: "buttons" }, go)) };
}

// A text instead of a study: why nobody can join now.
export const told = (html) => ({ element: card("", prose(html)) });
export const notice = (text) => ({ element: el("article", { class: "card centred", tabindex: "-1" }, el("p", { class: "large" }, text)) });

export function text(screen, connection) {
  const go = once(button(word("continue"), null, { class: "primary" }), () => connection.send({ type: "next" }));
  return { element: card("", prose(screen.html), el("div", { class: "buttons" }, go)), again: () => {} };
}

export function consent(screen, connection) {
  const tick = el("input", { type: "checkbox", id: "agree" });
  const agree = once(button(word("agree_button"), null, { class: "primary", "aria-disabled": "true", "aria-describedby": "consent-hint" }), () => connection.send({ type: "consent", agreed: true }));
  const hint = el("p", { class: "hint", id: "consent-hint" }, word("consent_needed"));
  tick.addEventListener("change", () => {
    agree.setAttribute("aria-disabled", String(!tick.checked));
    hint.hidden = tick.checked;
  });
  const refuse = once(button(word("decline"), null), () => connection.send({ type: "consent", agreed: false }));
  const element = card(word("consent_heading"), prose(screen.html), el("label", { class: "tick", for: "agree" }, tick, el("span", {}, word("agree"))), hint, el("div", { class: "buttons" }, refuse, agree));
  return { element, again: () => {} };
}

const inWords = (seconds) => new Intl.DateTimeFormat(study.language, { dateStyle: "full", timeStyle: "short" }).format(new Date(seconds * 1000));

export function pause(screen, connection) {
  const state = el("p", { class: "large", role: "status" });
  const until = screen.until === null ? null : el("p", { class: "hint" }, word("pause_latest", { time: inWords(screen.until) }));
  const go = once(button(word("begin"), null, { class: "primary" }), () => connection.send({ type: "next" }));
  const look = () => {
    const now = Date.now() / 1000;
    const closed = screen.until !== null && now > screen.until, open = screen.from === null || now >= screen.from;
    state.textContent = closed ? word("pause_closed") : open ? word("pause_ready") : word("pause_until", { time: inWords(screen.from) });
    go.hidden = !open && !closed;
  };
  look();
  const timer = setInterval(look, 1000);
  return {
    element: card("", prose(screen.html), state, until, el("div", { class: "buttons" }, go)),
    again: () => {},
    refused: () => { go.removeAttribute("aria-disabled"); },
    close: () => clearInterval(timer),
  };
}

// Addresses of other kinds than web pages are nothing to go to.
function address(text) {
  try {
    const url = new URL(text);
    return ["https:", "http:"].includes(url.protocol) ? url : null;
  } catch {
    return null;
  }
}

function codeBox(code) {
  const box = el("output", { class: "code", id: "code", tabindex: "0", "aria-label": word("your_code") }, code);
  const select = () => getSelection().selectAllChildren(box);
  box.addEventListener("focus", select);
  box.addEventListener("click", select);
  const copy = button(word("copy_code"), async () => {
    try {
      await navigator.clipboard.writeText(code);
    } catch {
      select();  // clipboards need a secure page: the old way does not
      if (!document.execCommand("copy")) return;
    }
    copy.textContent = word("copied");
    announce(word("copied"));
  });
  return el("section", { class: "code-box" }, el("h2", {}, word("your_code")), box, el("p", { class: "hint" }, word("code_hint")), el("div", { class: "buttons" }, copy));
}

const AWAY = 8000;

export function end(screen) {
  const url = address(screen.url), element = card(word("end_heading"), prose(screen.html));
  let timer = 0;
  if (screen.failed?.length) element.append(el("ul", { class: "failed" }, ...screen.failed.map((reason) => el("li", {}, reason))));
  if (url) {
    element.append(el("div", { class: "buttons" }, el("a", { class: "button primary", href: url.href, rel: "noopener noreferrer" }, word("go_back", { host: url.host }))));
    // A page in a frame is left by its button alone: the frame is somebody else's.
    if (window === top && screen.ending === "complete") timer = setTimeout(() => location.assign(url.href), AWAY);
  }
  if (screen.code) element.append(codeBox(screen.code));
  return { element, close: () => clearTimeout(timer) };
}
