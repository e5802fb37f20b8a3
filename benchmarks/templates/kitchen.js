"use strict";
// Draws kitchens: a layout is a text of one symbol for each cell, row by row. Doubts, where given, are one number for
// each cell: in how many per cent of visits an observer would predict a wrong goal; null where no path crosses.
function makePlace(data, { svg, plural, heat }) {
  const STATIONS = { T: "tomato", O: "onion", C: "cabbage", F: "fish", D: "dish", P: "pot", S: "serving" };
  const SIDE = 48, LIGHT = "V", FLOOR = " ";
  const AROUND = [[-1, 0], [0, 1], [1, 0], [0, -1], [-1, 1], [1, 1], [1, -1], [-1, -1]];
  const AWAY = [[1, 0, 0], [-1, 0, 1], [0, -1, 2], [0, 1, 3]]; // where the floor is, and the side opposite to it
  const [height, width] = data.place.shape;
  const counted = (layout) => [...layout].filter((symbol) => symbol === LIGHT).length;

  function describe(layout, hasDoubts) {
    const places = [];
    [...layout].forEach((symbol, i) => {
      if (STATIONS[symbol]) places.push(`${STATIONS[symbol]} at row ${Math.floor(i / width)}, column ${i % width}`);
    });
    const doubts = hasDoubts ? " Colours tell where goals are confused." : "";
    return `Kitchen: ${places.join("; ")}; ${plural(counted(layout), "virtual obstacle")}.${doubts}`;
  }
  const use = (part, x, y) => svg("use", { href: `#k-${part}`, x: x * SIDE, y: y * SIDE, width: SIDE, height: SIDE });
  // The parts of one cell, from below: the same choice that pictures of kitchens make.
  function cell(layout, row, column) {
    const at = (dy, dx) => row + dy < 0 || row + dy >= height || column + dx < 0 || column + dx >= width ? null : layout[(row + dy) * width + column + dx];
    const solid = (dy, dx) => ![null, FLOOR, LIGHT].includes(at(dy, dx));
    const symbol = at(0, 0), odd = (row + column) % 2;
    if (symbol === FLOOR || symbol === LIGHT) {
      const floor = `floor-${solid(-1, 0) + 2 * solid(0, -1)}${odd}`;
      const edges = AROUND.map(([dy, dx], bit) => (at(dy, dx) === LIGHT ? "" : `edge-${bit}`)).filter(Boolean);
      return symbol === FLOOR ? [floor] : [floor, "light", ...edges];
    }
    const counter = `counter-${solid(1, 0) ? 0 : 1}${odd}`;
    if (!STATIONS[symbol]) return [counter];
    const away = (AWAY.find(([dy, dx]) => at(dy, dx) === FLOOR) || [0, 0, 0])[2];
    return [counter, symbol === "S" ? `S-${away}` : symbol];
  }
  function board(layout, doubts = []) {
    const picture = svg("svg", { viewBox: `0 0 ${width * SIDE} ${height * SIDE}`, class: "board kitchen", role: "img", "aria-label": describe(layout, doubts.length) });
    [...layout].forEach((symbol, i) => {
      const row = Math.floor(i / width), column = i % width, doubt = doubts[i];
      picture.append(...cell(layout, row, column).map((part) => use(part, column, row)));
      if (doubt !== undefined && doubt !== null) {
        const patch = svg("rect", { x: (column + 0.06) * SIDE, y: (row + 0.06) * SIDE, width: 0.88 * SIDE, height: 0.88 * SIDE, rx: 0.14 * SIDE, fill: heat(doubt / 100), opacity: 0.86 }, svg("title"));
        patch.firstChild.textContent = `a wrong goal in ${doubt} % of visits`;
        picture.append(patch);
      } else if (STATIONS[symbol]) {
        const title = svg("title");
        title.textContent = STATIONS[symbol];
        picture.append(svg("rect", { x: column * SIDE, y: row * SIDE, width: SIDE, height: SIDE, fill: "none", "pointer-events": "all" }, title));
      }
    });
    return picture;
  }
  function sample(...parts) {
    return svg("svg", { viewBox: `0 0 ${SIDE} ${SIDE}`, class: "sample", "aria-hidden": "true" }, ...parts.map((part) => use(part, 0, 0)));
  }
  const onCounter = (symbol) => sample("counter-10", symbol === "S" ? "S-0" : symbol);
  const coded = new Set(data.axes[1].labels.join(""));
  const seen = Object.keys(STATIONS).filter((symbol) => data.cells.some((one) => one[5] && one[5].includes(symbol)) || data.panels.some((panel) => panel.layout.includes(symbol)));
  const codes = seen.filter((symbol) => coded.has(symbol)).map((symbol) => [symbol, STATIONS[symbol], onCounter(symbol)]);
  const bits = [...Array(8).keys()].map((bit) => `edge-${bit}`);
  const codesAbout = `${["D", "P", "S"].some((symbol) => coded.has(symbol)) ? "Stations" : "Ingredients"} row by row from the top left:`;
  const others = seen.filter((symbol) => !coded.has(symbol)).map((symbol) => [onCounter(symbol), STATIONS[symbol]]);
  const marks = [...others, [sample("floor-00", "light", ...bits), "virtual obstacle: light on the floor that nobody crosses"]];
  const doubt = { title: "How often an observer who sees the cook there predicts a wrong goal", low: "never", high: "always" };

  function asText(layout) {
    return layout.match(new RegExp(`.{${width}}`, "g")).join("\n");
  }
  const isOrder = (label) => [...String(label)].every((symbol) => STATIONS[symbol]);
  const inWords = (label) => isOrder(label) ? [...label].map((symbol) => STATIONS[symbol]).join(" · ") : String(label);

  return { board, asText, obstacles: counted, inWords, codes, codesAbout, marks, doubt };
}
