// One session, as its participant sees it, and what the predictor believes.
import { button, el, study, svg } from "./dom.js";
import { KitchenBoard } from "./kitchen_board.js";
import { load } from "./sheet.js";
import { TableBoard } from "./table_board.js";

const S = 100, isKitchen = study.domain === "overcooked";

export class Watch {
  // `ask(participant)` tells the server whom to watch; "" for nobody.
  constructor(ask) {
    this.ask = ask;
    this.participant = "";
    this.place = el("p", { class: "where-now" });
    this.board = el("div", { class: "board-place" });
    this.goals = el("ol", { class: "goals", "aria-label": "What the predictor believes" });
    this.note = el("p", { class: "hint" });
    this.stop = button("Stop watching", () => { this.leave(); }, { class: "quiet", hidden: true });
    this.element = el("div", {}, this.place, this.board, this.note, this.goals, this.stop);
    this.leave();
  }

  begin(participant) {
    if (this.participant === participant) return this.leave();
    this.clear();
    this.participant = participant;
    this.stop.hidden = false;
    this.place.textContent = `${participant}: waiting for what comes next`;
    this.ask(participant);
    // In one column the session is above the participants.
    document.getElementById("session")?.scrollIntoView({ block: matchMedia("(max-width: 1100px)").matches ? "start" : "nearest" });
  }

  leave() {
    this.clear();
    this.stop.hidden = true;
    this.place.textContent = "Choose a participant to watch their session.";
    if (this.participant) this.ask("");
    this.participant = "";
  }

  clear() {
    this.scene = this.drawing = this.screen = null;
    this.belief = [];
    this.board.replaceChildren();
    this.goals.replaceChildren();
    this.note.textContent = "";
  }

  about(person, predictor) {
    this.predictor = predictor;
    if (!this.participant) return;
    if (person && !person.connected && person.state !== "active") this.place.textContent = `${person.participant}: ${person.state.replace("_", " ")}`;
    else if (person && !person.connected) this.place.textContent = `${person.participant} is not here; at ${person.name || "the start"}`;
  }

  take(message) {
    if (message.participant !== this.participant) return;
    if (message.type === "belief") this.showBelief(message);
    else if (message.message) this.told(message.message);
  }

  told(message) {
    if (message.type === "warning") this.note.textContent = "Warned that they are idle.";
    if (message.type === "state") this.show(message.state);
    if (message.type !== "screen") return;
    this.screen = message;
    this.note.textContent = "";
    this.place.textContent = `${this.participant}: ${message.kind === "end" ? message.ending.replace("_", " ") : message.name}`;
    if (!message.scene) {
      this.drawing = this.overlay = null;
      this.board.replaceChildren();
    } else this.prepare(message);
  }

  async prepare(screen) {
    const measures = await load(isKitchen ? "kitchen" : "table").catch(() => null);
    if (screen !== this.screen) return;
    if (!measures) {
      this.note.textContent = "The drawings could not be loaded.";
      return;
    }
    this.drawing = new (isKitchen ? KitchenBoard : TableBoard)(screen.scene, measures);
    this.scene = screen.scene;
    this.overlay = svg("svg", { viewBox: this.drawing.top.getAttribute("viewBox"), class: "layer", "aria-hidden": "true" });
    const board = el("div", { class: `board${isKitchen ? "" : " table running"}`, role: "img", "aria-label": `The game of ${this.participant}` }, this.drawing.floor, this.drawing.top, this.overlay);
    board.style.setProperty("--ratio", this.drawing.ratio);
    this.board.replaceChildren(el("div", { class: isKitchen ? "kitchen stage" : "table stage" }, board), this.steps = el("p", { class: "hint" }));
    this.board.firstChild.style.setProperty("--ratio", this.drawing.ratio);
    this.show(this.latest?.screen === screen ? this.latest.state : screen.state);
  }

  show(state) {
    this.latest = { screen: this.screen, state };
    if (!this.drawing) return;
    this.drawing.show({ ...state, belief: null });
    const done = isKitchen ? `${state.delivered.length} of ${this.scene.soups.length} soups` : `${state.done} placed, ${state.reaches} reaches`;
    this.steps.textContent = `Step ${state.n} of at most ${this.scene.max_steps}, ${done}, ${state.crossings} crossings of virtual obstacles`;
    this.mark();
  }

  showBelief({ goals, failure }) {
    this.belief = goals;
    if (failure) this.note.textContent = `No belief: ${failure}`;
    else if (this.drawing) this.note.textContent = goals.length ? "" : "Nothing to predict now: no reach has begun.";
    const sorted = [...goals].sort((a, b) => a.name.localeCompare(b.name));
    const title = goals.length ? [el("li", { class: "title" }, `Next goal, as ${this.predictor || "the predictor"} sees it`)] : [];
    this.goals.replaceChildren(...title, ...sorted.map(({ name, p }) => el("li", {}, el("span", {}, name), el("progress", { max: 1, value: p, "aria-label": name }), el("span", { class: "p" }, `${Math.round(100 * p)} %`))));
    this.mark();
  }

  // The belief where the goals are.
  mark() {
    if (!this.overlay) return;
    this.overlay.replaceChildren(...this.belief.filter(({ p }) => p >= 0.01).flatMap(({ at, p }) => {
      const [x, y, r] = isKitchen ? [(at[1] + 0.5) * S, (at[0] + 0.5) * S, 0.46 * S] : [at[0] * 1000, this.drawing.up(at[1]), 44];
      const text = svg("text", { x, y: y + 0.3 * r, "text-anchor": "middle", "font-size": 0.62 * r, class: "belief-text" });
      text.textContent = String(Math.round(100 * p));
      return [svg("circle", { cx: x, cy: y, r, class: "belief-mark", "fill-opacity": 0.15 + 0.6 * p }), text];
    }));
  }
}
