// Draws tables: the same shapes in the same places as the pictures of the environment. Millimetres, y down.
import { svg, word } from "./dom.js";
import { hexOf, inkOn, mix, use } from "./sheet.js";

const MM = 1000, MARGIN = 0.018, LINE = 1.2, DARK = "#1d120a";
const FREE = 0, HAND = 1, ROBOT = 2;
const BAR = [58, 12], OPEN = 66;
const degrees = (radians) => (-radians * 180) / Math.PI;

export class TableBoard {
  constructor(scene, measures) {
    this.scene = scene;
    this.measures = measures;
    this.colours = measures.colours;
    const { table } = scene.layout;
    [this.width, this.depth] = table.size.map((v) => v * MM);
    this.margin = (this.width * MARGIN) / (1 - 2 * MARGIN);
    const [wide, tall] = [this.width + 2 * this.margin, this.depth + 2 * this.margin];
    const box = { viewBox: `${-this.margin} ${-this.margin} ${wide} ${tall}`, "aria-hidden": "true", focusable: "false" };
    this.ratio = wide / tall;
    this.floor = svg("svg", { ...box, class: "layer" });
    this.top = svg("svg", { ...box, class: "layer moving" });
    this.surface(scene.layout, table);
    this.objects = scene.layout.objects.map((object) => this.object(object));
    this.layers = Object.fromEntries(["lying", "marks", "robot", "start", "hand", "belief", "pointer"].map((name) => [name, svg("g", { class: name })]));
    this.top.append(...Object.values(this.layers));
    this.actors(table);
  }

  up(y) { return this.depth - y * MM; }

  box([x0, y0, x1, y1], fill, radius, edge) {
    return svg("rect", { x: x0 * MM, y: this.up(y1), width: (x1 - x0) * MM, height: (y1 - y0) * MM, rx: radius, fill, ...(edge ? { stroke: edge, "stroke-width": 2.2 } : {}) });
  }

  // A rectangle round the origin, `grow` larger on the whole.
  plate([long, wide], grow, fill, radius = 0) {
    const [w, h] = [long * MM + grow, wide * MM + grow];
    return svg("rect", { x: -w / 2, y: -h / 2, width: w, height: h, rx: Math.min(radius, w / 2, h / 2), fill });
  }

  placed(x, y, angle, ...children) {
    return svg("g", { transform: `translate(${x * MM} ${this.up(y)}) rotate(${degrees(angle)})` }, ...children);
  }

  surface(layout, table) {
    const { colours, floor } = this, [width, depth] = table.size;
    const rim = (0.8 * this.margin) / MM, inset = 1.1 / MM, pad = 0.0225 + 0.008;
    floor.append(this.box([-rim, -rim, width + rim, depth + rim], colours.rim, 22), this.box([0, 0, width, depth], colours.top, 12));
    for (const [area, name, grow] of [[table.region, "region", pad], [table.assembly, "assembly", 0]]) {
      const [x0, y0, x1, y1] = area;
      const shown = [Math.max(x0 - grow, 0) + inset, Math.max(y0 - grow, 0) + inset, Math.min(x1 + grow, width) - inset, Math.min(y1 + grow, depth) - inset];
      floor.append(this.box(shown, colours[name], 13, colours[`${name}_line`]));
    }
    for (const [name, [x, y]] of Object.entries(this.scene.slots)) {
      const object = layout.objects.find((one) => one.name === name);
      if (!object) continue;
      const size = object.size || [0.045, 0.045], faint = mix(hexOf(object.colour, this.measures.named), colours.slot, 0.68);
      floor.append(this.placed(x, y, object.angle || 0, this.plate(size, 4, colours.slot_line, 6), this.plate(size, 0.8, colours.slot, 6), ...this.glyph(object, 0.62 * Math.min(...size) * MM, faint, colours.slot)));
    }
    const ink = mix(colours.start, colours.top, 0.15), hand = Math.max(table.hand * MM, 12);
    for (const [x, y] of Object.values(table.starts)) {
      const at = { cx: x * MM, cy: this.up(y) };
      floor.append(svg("circle", { ...at, r: hand - 1.75, fill: "none", stroke: ink, "stroke-width": 3.5 }), svg("circle", { ...at, r: 5, fill: ink }));
    }
    for (const { at: [x, y], angle, size } of layout.obstacles) {
      floor.append(this.placed(x, y, angle, this.plate(size, 1.6, colours.obstacle_edge), this.plate(size, -1.6, colours.obstacle)));
    }
  }

  glyph(object, size, ink, ground) {
    const points = this.measures.glyphs[object.shape];
    if (points) return [svg("polygon", { points, transform: `scale(${size / 1000})`, fill: ink })];
    if (object.shape === "ring") return [svg("circle", { r: 0.4 * size, fill: ink }), svg("circle", { r: 0.22 * size, fill: ground })];
    if (object.shape === "bin") return [];
    const letter = svg("text", { "text-anchor": "middle", y: 0.34 * size, transform: `rotate(${-degrees(object.angle || 0)})`, fill: ink, class: "letter", "font-size": size });
    letter.textContent = object.shape[0].toUpperCase();
    return [letter];
  }

  // The looks of an object: as it lies, faded where it does not matter now, lifted where it is carried.
  looks(object, { faded = false, lifted = false } = {}) {
    const { colours } = this, size = object.size, least = Math.min(...size) * MM, colour = hexOf(object.colour, this.measures.named);
    const body = faded ? mix(colour, colours.top, 0.55) : colour, edge = mix(body, DARK, faded ? 0.22 : 0.45);
    const drop = (lifted ? 5 : 2.2), turn = ((object.angle || 0) * -1);
    const ink = faded ? mix(inkOn(colour), body, 0.25) : inkOn(colour);
    // The shadow falls to the lower right however the object lies.
    const [dx, dy] = [drop * Math.cos(turn) + drop * Math.sin(turn), drop * Math.cos(turn) - drop * Math.sin(turn)];
    const parts = object.movable === false ? [this.plate(size, 6 * LINE, colours.fixed, 0.3 * least)] : [svg("g", { transform: `translate(${dx} ${dy})`, opacity: 0.3 }, this.plate(size, 0, "#3a2415", 0.12 * least))];
    parts.push(this.plate(size, 0, edge, 0.14 * least), this.plate(size, -2 * LINE, body, 0.12 * least));
    if (object.shape === "bin") parts.push(this.plate(size, -0.16 * least, edge, 0.1 * least), this.plate(size, -0.24 * least, mix(body, DARK, 0.62), 0.08 * least));
    return svg("g", {}, ...parts, ...this.glyph(object, 0.74 * least, ink, body));
  }

  object(plain) {
    const object = { shape: "square", colour: "grey", size: [0.045, 0.045], angle: 0, movable: true, ...plain };
    return { ...object, group: svg("g"), kinds: new Map(), kind: "", at: "" };
  }

  actors(table) {
    const { hand_span: span } = this.measures, half = Math.max(table.hand * MM, 12);
    this.half = half;
    const side = 2 * span * half;
    this.hands = [0, 1].map((closed) => use(`t-hand-${closed}`, -side / 2, -side / 2, side));
    this.hand = svg("g", {}, this.hands[0]);
    this.layers.hand.append(this.hand);
    this.gripper = svg("g");
    this.ring = svg("circle", { r: half * 1.15, class: "ring", visibility: "hidden" });
    this.halo = svg("circle", { r: half * 1.7, class: "halo" });
    this.goal = svg("circle", { class: "goal", visibility: "hidden" });
    this.target = svg("circle", { fill: "none", stroke: this.colours.robot, "stroke-width": 4.5, visibility: "hidden" });
    this.layers.marks.append(this.goal, this.target);
    this.layers.start.append(this.halo);
    this.layers.pointer.append(this.ring);
  }

  move(group, x, y, angle = 0) {
    const at = `translate(${(x * MM).toFixed(1)} ${this.up(y).toFixed(1)})${angle ? ` rotate(${degrees(angle).toFixed(1)})` : ""}`;
    if (group.dataset.at === at) return;
    group.dataset.at = at;
    group.setAttribute("transform", at);
  }

  dress(object, kind, layer) {
    if (object.kind !== kind) {
      if (!object.kinds.has(kind)) object.kinds.set(kind, this.looks(object, { faded: kind === "faded", lifted: kind === "lifted" }));
      object.group.replaceChildren(object.kinds.get(kind));
      object.kind = kind;
    }
    if (object.group.parentNode !== layer) layer.append(object.group);
  }

  // Draws a state; `hand` and `robot` are where they are seen now, between two states.
  show(state, positions = state.positions, hand = state.hand, robot = state.robot) {
    const { layers } = this, mayTake = state.goals.some(Boolean);
    this.objects.forEach((object, i) => {
      const [x, y, angle] = positions[i], status = state.status[i];
      if (status === HAND || status === ROBOT) {
        this.dress(object, "lifted", status === HAND ? layers.hand : layers.robot);
        this.move(object.group, ...(status === HAND ? hand : robot || [x, y]).slice(0, 2), angle);
      } else {
        this.dress(object, status === FREE && mayTake && !state.goals[i] ? "faded" : "plain", layers.lying);
        this.move(object.group, x, y, angle);
      }
    });
    const closed = this.hands[state.holding >= 0 ? 1 : 0];
    if (closed.parentNode !== this.hand) this.hand.replaceChildren(closed);
    this.move(this.hand, ...hand);
    this.move(this.halo, ...hand);
    this.showGoal(state);
    this.showRobot(state, robot);
    this.showBelief(state, positions);
  }

  showGoal(state) {
    const is = state.holding >= 0 && state.carry_to;
    this.goal.setAttribute("visibility", is ? "visible" : "hidden");
    if (!is) return;
    this.goal.setAttribute("r", (Math.hypot(...this.objects[state.holding].size) / 2) * MM + 8);
    this.move(this.goal, ...state.carry_to);
  }

  showRobot(state, robot) {
    if (!state.robot) return;
    const [, , holding, target] = state.robot;
    const opening = holding >= 0 ? Math.min(...this.objects[holding].size) * MM + 4 : OPEN;
    const nearest = this.measures.openings.reduce((best, one) => (Math.abs(one - opening) < Math.abs(best - opening) ? one : best));
    if (this.gripper.dataset.opening !== String(nearest)) {
      const side = nearest + 2 * this.measures.gripper_span * MM;
      this.gripper.replaceChildren(use(`t-gripper-${nearest}`, -side / 2, -side / 2, side));
      this.gripper.dataset.opening = nearest;
    }
    if (this.layers.robot.lastChild !== this.gripper) this.layers.robot.append(this.gripper);
    this.move(this.gripper, robot[0], robot[1]);
    const isShown = target >= 0 && state.status[target] === FREE;
    this.target.setAttribute("visibility", isShown ? "visible" : "hidden");
    if (!isShown) return;
    this.target.setAttribute("r", (Math.hypot(...this.objects[target].size) / 2) * MM + 15);
    this.move(this.target, ...state.positions[target].slice(0, 2));
  }

  showBelief(state, positions) {
    const { colours } = this, [wide, tall] = BAR, shown = state.belief || [];
    const looks = JSON.stringify([shown, state.status]);
    if (this.believed === looks) return;
    this.believed = looks;
    this.layers.belief.replaceChildren(...shown.flatMap((value, i) => {
      if (state.status[i] !== FREE || !state.goals[i]) return [];
      const [x, y] = positions[i], left = x * MM - wide / 2, above = this.up(y) - (Math.max(...this.objects[i].size) / 2) * MM - 12 - tall;
      const bar = (fill, width, grow = 0) => svg("rect", { x: left - grow, y: above - grow, width: Math.max(0, width + 2 * grow), height: tall + 2 * grow, fill });
      return [bar(colours.rim, wide, 1.4), bar(colours.track, wide), bar(colours.unsure, wide * Math.min(1, Math.max(0, value)))];
    }));
  }

  // A ring where the pointer is, at once.
  point(at, isTouch = false) {
    this.ring.setAttribute("visibility", at ? "visible" : "hidden");
    if (!at) return;
    this.ring.setAttribute("r", this.half * (isTouch ? 1.9 : 1.15));
    this.move(this.ring, ...at);
  }

  describe(state) {
    return state.holding >= 0 ? word("holding", { item: this.objects[state.holding].name }) : word("holding_nothing");
  }
}
