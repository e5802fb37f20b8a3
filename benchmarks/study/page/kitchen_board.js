// Draws kitchens: the same parts in the same places as the pictures of the environment.
import { svg, word } from "./dom.js";
import { mix, use } from "./sheet.js";

const S = 100;  // a tile
const SEAM = 0.6;  // by which one reaches under the next, so that nothing shows between them
const AROUND = [[-1, 0], [0, 1], [1, 0], [0, -1], [-1, 1], [1, 1], [1, -1], [-1, -1]];
const AWAY = [[1, 0], [-1, 0], [0, -1], [0, 1]];  // where the floor is, by the side opposite to it
const STATIONS = "TOCFDPS";
const RAW = "#9cc4d6";
const NORTH = 0;

export class KitchenBoard {
  constructor(scene, measures) {
    this.scene = scene;
    this.measures = measures;
    const [height, width] = scene.shape;
    const box = { viewBox: `0 0 ${width * S} ${height * S}`, "aria-hidden": "true", focusable: "false" };
    this.floor = svg("svg", { ...box, class: "layer" });
    this.top = svg("svg", { ...box, class: "layer moving" });
    for (let row = 0; row < height; row += 1) for (let col = 0; col < width; col += 1) this.floor.append(...this.cell(row, col));
    this.pots = svg("g");
    this.items = svg("g");
    this.chefs = svg("g");
    this.top.append(this.pots, this.items, this.chefs);
    this.drawn = new Map();
    this.ratio = width / height;
  }

  symbol(row, col) {
    return this.scene.cells[row]?.[col];
  }

  // The parts of one cell from below: the choice that pictures of kitchens make.
  cell(row, col) {
    const at = (dy, dx) => this.symbol(row + dy, col + dx);
    const solid = (dy, dx) => ![undefined, " ", "V"].includes(at(dy, dx));
    const part = (name, side = S) => use(`k-${name}`, col * S, row * S, side);
    const symbol = at(0, 0), odd = (row + col) % 2;
    if (symbol === " " || symbol === "V") {
      const floor = part(`floor-${solid(-1, 0) + 2 * solid(0, -1)}${odd}`, S + SEAM);
      if (symbol === " ") return [floor];
      return [floor, part("light", S + SEAM / 4), ...AROUND.flatMap(([dy, dx], bit) => (at(dy, dx) === "V" ? [] : [part(`edge-${bit}`)]))];
    }
    const counter = part(`counter-${solid(1, 0) ? 0 : 1}${odd}`, S + SEAM);
    if (!STATIONS.includes(symbol)) return [counter];
    const away = AWAY.findIndex(([dy, dx]) => [" ", "V"].includes(at(dy, dx)));
    return [counter, part(symbol === "S" ? `S-${Math.max(0, away)}` : symbol)];
  }

  // An item round a point, in tiles.
  item([kind, contents], x, y, radius) {
    const { part } = this.measures;
    const one = (name, r, cx = x, cy = y) => use(`k-item-${name}`, (cx - r / part / 2) * S, (cy - r / part / 2) * S, (r / part) * S);
    if (kind === "dish") return [one("dish", radius * 1.12)];
    if (kind !== "soup") return [one(kind, radius)];
    const colour = this.broth(contents.length ? contents : ["onion"]);
    return [
      one("dish", radius * 1.12),
      this.circle(x, y, radius * 0.86, mix(colour, "#4a1d08", 0.45)),
      this.circle(x, y + radius * 0.04, radius * 0.8, colour),
      ...this.pieces(contents, x, y + radius * 0.02, radius * 0.78),
    ];
  }

  pieces(contents, x, y, radius) {
    const { part, pieces } = this.measures;
    return (pieces[contents.length] || []).map(([dx, dy, size], i) => {
      const side = (size * radius) / part;
      return use(`k-item-${contents[i]}`, (x + dx * radius - side / 2) * S, (y + dy * radius - side / 2) * S, side * S);
    });
  }

  broth(contents) {
    const { colours } = this.measures;
    const colour = contents.slice(1).reduce((mixed, kind, i) => mix(mixed, colours[kind], 1 / (i + 2)), colours[contents[0]]);
    return mix(colour, "#ffcf87", 0.22);
  }

  circle(x, y, radius, fill) {
    return svg("circle", { cx: x * S, cy: y * S, r: radius * S, fill });
  }

  // A small picture of a soup or an item, for orders and hands.
  icon(item) {
    const picture = svg("svg", { viewBox: `0 0 ${S} ${S}`, class: "icon", "aria-hidden": "true" });
    if (item) picture.append(...(Array.isArray(item[0]) ? this.pieces(item[0], 0.5, 0.5, 0.5) : this.item(item, 0.5, 0.48, item[0] === "dish" || item[0] === "soup" ? 0.42 : 0.36)));
    return picture;
  }

  pot([row, col, contents, ticks, cookTime, status]) {
    const { top, gauge, progress } = this.measures;
    const group = svg("g", { transform: `translate(${col * S} ${row * S})` });
    const part = (name) => use(`k-${name}`, 0, 0, S);
    if (status === 2) group.append(part("ready"));
    if (status === 1) group.append(part(`flames-${ticks % 2}`));
    group.append(part("pot"));
    if (contents.length) {
      const colour = status ? this.broth(contents) : RAW;
      group.append(this.circle(0.5, top + 0.012, 0.235, mix(colour, "#3a1606", 0.3)), this.circle(0.5, top + 0.02, 0.222, colour), ...this.pieces(contents, 0.5, top + 0.015, 0.225));
    }
    if (status === 2) group.append(part("steam-0"), part("gauge-full"), use("k-tick", 0.68 * S, 0.01 * S, 0.3 * S));
    if (status === 1) {
      const [x, y, wide, tall] = gauge, share = Math.min(1, ticks / Math.max(1, cookTime));
      group.append(part(`steam-${ticks % 2}`), part("gauge"));
      const width = Math.max(tall, wide * share);
      if (share > 0) {
        group.append(svg("rect", { x: x * S, y: y * S, width: width * S, height: tall * S, rx: 0.05 * S, fill: progress }),
          svg("rect", { x: (x + 0.03) * S, y: (y + 0.02) * S, width: (width - 0.06) * S, height: 0.022 * S, rx: 0.01 * S, fill: "#ffffff", opacity: 0.45 }));
      }
    }
    return group;
  }

  lying([row, col, item]) {
    const group = svg("g", { transform: `translate(${col * S} ${row * S})` });
    const isFood = item[0] !== "dish" && item[0] !== "soup";
    if (isFood) group.append(svg("ellipse", { cx: 0.5 * S, cy: 0.6 * S, rx: 0.24 * S, ry: 0.1 * S, fill: this.measures.shadow, opacity: 0.3 }));
    group.append(...this.item(item, 0.5, 0.44, isFood ? 0.24 : 0.28));
    return group;
  }

  chef({ facing, held }) {
    const { rise, held: places, held_radius: [small, large] } = this.measures;
    const part = (name) => use(`k-${name}-${facing}`, 0, 0, S, (1 + rise) * S);
    const hands = held ? [...this.item(held, ...places[facing], held[0] === "dish" || held[0] === "soup" ? large : small), part("grip")] : [part("hands")];
    return facing === NORTH ? [part("wedge"), ...hands, part("chef")] : [part("wedge"), part("chef"), ...hands];
  }

  // Draws a state; what has not changed stays as it is.
  show(state) {
    this.keep(this.pots, "pots", state.pots, (pot) => this.pot(pot));
    this.keep(this.items, "items", state.counters, (item) => this.lying(item));
    state.players.forEach((player, i) => {
      let group = this.chefs.children[i];
      if (!group) {
        group = svg("g", { class: "chef" });
        this.chefs.append(group);
      }
      const looks = JSON.stringify([player.facing, player.held]);
      if (this.drawn.get(group) !== looks) {
        group.replaceChildren(...this.chef(player));
        this.drawn.set(group, looks);
      }
      group.style.transform = `translate(${player.cell[1] * S}px, ${(player.cell[0] - this.measures.rise) * S}px)`;
    });
  }

  keep(layer, name, entries, draw) {
    const looks = JSON.stringify(entries);
    if (this.drawn.get(name) === looks) return;
    this.drawn.set(name, looks);
    layer.replaceChildren(...entries.map(draw));
  }

  describe(state) {
    const { held } = state.players[0];
    return `${word("kitchen_label")}. ${itemWords(held)}`;
  }
}

export const itemWords = (held) => (held ? word("holding", { item: word(`item_${held[0]}`) }) : word("holding_nothing"));
