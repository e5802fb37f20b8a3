"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (id) => document.getElementById(id);
  const SVG = $("icons").namespaceURI;
  const [rowAxis, columnAxis] = data.axes;

  // -- small helpers ---------------------------------------------------------------------------------------------------

  function el(name, attributes = {}, ...children) {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children.filter((child) => child !== null));
    return node;
  }
  function svg(name, attributes = {}, ...children) {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children);
    return node;
  }
  function number(value, digits = 2) {
    if (value === null || value === undefined) return "–";
    const [whole, rest] = Math.abs(value).toFixed(digits).split(".");
    const spaced = whole.replace(/\B(?=(\d{3})+$)/g, "\u202f");
    return (value < 0 && Number(value.toFixed(digits)) !== 0 ? "\u2212" : "") + spaced + (rest ? "." + rest : "");
  }
  // On a phone charts are drawn smaller than they are laid out; their text is laid out larger.
  const narrow = matchMedia("(max-width: 820px)").matches;
  const plural = (n, word) => `${number(n, 0)} ${word}${n === 1 ? "" : "s"}`;
  function tell(text) {
    $("tip").textContent = text;
    $("tip").hidden = false;
    clearTimeout(tell.timer);
    tell.timer = setTimeout(() => { $("tip").hidden = true; }, 2600);
  }
  // Lightness rises evenly, so equal steps of the score look equal, and the order survives without colour vision.
  const ramp = (t) => `oklch(${(0.3 + 0.62 * t).toFixed(3)} ${(0.1 + 0.05 * Math.sin(Math.PI * t)).toFixed(3)} ${(285 - 185 * t).toFixed(1)})`;

  // The scale of doubt, as in pictures: between two neighbouring colours in proportion.
  function heat(share) {
    const at = Math.min(Math.max(share, 0), 1) * (HEAT.length - 1), below = Math.min(Math.floor(at), HEAT.length - 2);
    const parts = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
    const [from, to] = [parts(HEAT[below]), parts(HEAT[below + 1])];
    return `rgb(${from.map((v, i) => Math.round(v + (to[i] - v) * (at - below))).join(" ")})`;
  }
  const place = makePlace(data, { svg, el, number, plural, heat });
  function scaleOf(low, stops, high) {
    const bar = el("span", { class: "ramp" });
    bar.style.background = `linear-gradient(90deg, ${stops.join(", ")})`;
    return el("span", { class: "scale" }, el("span", {}, low), bar, el("span", {}, high));
  }
  const key = (mark, ...words) => el("span", { class: "key" }, mark, ...words);
  function star(size) {
    const points = Array.from({ length: 10 }, (_, i) => {
      const radius = size / 2 * (i % 2 ? 0.42 : 1), angle = Math.PI * (i / 5 - 0.5);
      return `${(radius * Math.cos(angle)).toFixed(2)},${(radius * Math.sin(angle)).toFixed(2)}`;
    });
    return svg("polygon", { class: "best-mark", points: points.join(" ") });
  }

  // -- the archive -----------------------------------------------------------------------------------------------------

  const cells = data.cells.map(([row, column, objective, legibility, distance, layout], rank) => ({ row, column, objective, legibility, distance, layout, rank }));
  const at = new Map(cells.map((cell) => [cell.row * columnAxis.count + cell.column, cell]));
  const hasCosts = cells.some((cell) => data.objective.name === "legibility" && Math.abs(cell.objective - cell.legibility) > 1e-3);
  const values = cells.map((cell) => cell.objective);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  // The worst cells are much worse than the rest: the ramp starts at the tenth percentile.
  const floorValue = values.length > 20 ? values[Math.floor(values.length * 0.9)] : low;
  const shade = (value) => ramp(high > floorValue ? Math.max(0, Math.min(1, (value - floorValue) / (high - floorValue))) : 1);
  const cellWidth = Math.max(7, Math.min(26, 640 / columnAxis.count));
  const cellHeight = Math.max(6, Math.min(34, 560 / rowAxis.count));
  const longest = Math.max(...columnAxis.labels.map((label) => label.length));
  const scale = narrow && columnAxis.count * cellWidth > 270 ? 1.5 : 1; // a small archive is not drawn smaller
  const margin = { left: scale * Math.max(44, 26 + 6.4 * Math.max(...rowAxis.labels.map((label) => label.length))), top: 4, bottom: scale * (14 + longest * 6.6 + 22) };
  const size = { width: margin.left + columnAxis.count * cellWidth + 2, height: margin.top + rowAxis.count * cellHeight + margin.bottom };
  const cellX = (column) => margin.left + column * cellWidth;
  const cellY = (row) => margin.top + (rowAxis.count - 1 - row) * cellHeight;
  const axisName = (name) => data.texts.axes[name] || name;
  const columnNames = [], rowNames = [];
  let picture, cursor, pinned = cells[0], shown = null;

  function drawMap() {
    picture = svg("svg", { viewBox: `0 0 ${size.width} ${size.height}`, "aria-hidden": "true" });
    picture.style.maxWidth = `${1.6 * size.width}px`; // labels of small archives stay labels
    picture.style.setProperty("--scale", scale);
    const inset = Math.min(1, cellWidth / 12);
    const paint = (cell, attributes) => svg("rect", { x: cell.x + inset, y: cell.y + inset, width: cellWidth - 2 * inset, height: cellHeight - 2 * inset, rx: 2, ...attributes });
    for (let row = 0; row < rowAxis.count; row++) {
      for (let column = 0; column < columnAxis.count; column++) {
        const cell = at.get(row * columnAxis.count + column);
        const place = { x: cellX(column), y: cellY(row) };
        picture.append(cell ? paint(place, { fill: shade(cell.objective), class: "cell", "data-rank": cell.rank }) : paint(place, { class: "empty" }));
      }
    }
    const every = Math.max(1, Math.ceil(13 * scale / cellWidth));
    columnAxis.labels.forEach((label, i) => {
      const x = cellX(i) + cellWidth / 2, y = size.height - margin.bottom + 10 * scale;
      const text = svg("text", { class: "mono", transform: `translate(${x + 3.5 * scale} ${y}) rotate(-90)`, "text-anchor": "end" });
      if (i % every === 0) text.textContent = label;
      columnNames.push(text);
      const title = svg("title");
      title.textContent = (columnAxis.step > 1 ? "from " : "") + place.inWords(label);
      text.append(title);
      picture.append(text);
    });
    const everyRow = Math.max(1, Math.ceil(14 * scale / cellHeight), rowAxis.count > 30 ? 5 : 1);
    rowAxis.labels.forEach((label, i) => {
      const text = svg("text", { x: margin.left - 8, y: cellY(i) + cellHeight / 2 + 4 * scale, "text-anchor": "end" });
      if (i % everyRow === 0) text.textContent = label;
      rowNames.push(text);
      picture.append(text);
    });
    const under = svg("text", { x: margin.left + columnAxis.count * cellWidth / 2, y: size.height - 4 * scale, "text-anchor": "middle" });
    under.textContent = axisName(columnAxis.name) + " →";
    const beside = svg("text", { transform: `translate(${10 * scale} ${margin.top + rowAxis.count * cellHeight / 2}) rotate(-90)`, "text-anchor": "middle" });
    beside.textContent = axisName(rowAxis.name) + " →";
    picture.append(under, beside);
    if (cells.length) {
      const best = star(Math.max(11 * scale, Math.min(0.72 * Math.min(cellWidth, cellHeight), 18)));
      best.setAttribute("transform", `translate(${cellX(cells[0].column) + cellWidth / 2} ${cellY(cells[0].row) + cellHeight / 2})`);
      picture.append(best);
    }
    cursor = svg("g", { visibility: "hidden" }, ...["halo", "cursor"].map((name) => svg("rect", { class: name, width: cellWidth + 4, height: cellHeight + 4, rx: 4 })));
    picture.append(cursor);
    $("map").append(picture);
    drawLegend();
  }
  function drawLegend() {
    if (!cells.length) { $("legend").textContent = "The archive is empty."; return; }
    const stops = Array.from({ length: 17 }, (_, i) => ramp(i / 16));
    const names = { "legibility": hasCosts ? "legibility net of costs" : "legibility", "efficiency": "efficiency (distance, negated)" };
    const parts = [el("span", {}, names[data.objective.name] || data.objective.name), scaleOf((low < floorValue ? "≤ " : "") + number(floorValue), stops, number(high)),
      key(svg("svg", { viewBox: "-9 -9 18 18", class: "sample", "aria-hidden": "true" }, star(16)), "the best"), key(el("span", { class: "swatch chosen" }), "the one shown")];
    if (cells.length < rowAxis.count * columnAxis.count) parts.push(key(el("span", { class: "swatch" }), "none found"));
    if (rowAxis.step * columnAxis.step > 1) parts.push(el("span", {}, `each square: the best of ${rowAxis.step * columnAxis.step} cells`));
    const rows = rowAxis.labels.length * rowAxis.step;
    if (rows < rowAxis.whole) parts.push(el("span", {}, `rows ${rows} to ${rowAxis.whole - 1} are empty and left out`));
    $("legend").append(...parts);
    if (!place.codes?.length) return;
    if (place.codesAbout) $("codes").append(el("span", {}, place.codesAbout));
    for (const [code, word, mark] of place.codes) $("codes").append(key(mark || "", el("b", { class: "code" }, code), word));
  }
  function drawDoubt() {
    if (!place.doubt || !data.panels.some((panel) => panel.paths.length)) return;
    const stops = Array.from({ length: 11 }, (_, i) => heat(i / 10));
    $("doubt").append(el("span", {}, place.doubt.title), scaleOf(place.doubt.low, stops, place.doubt.high));
    for (const [mark, words] of place.marks || []) $("doubt").append(key(mark, words));
  }
  function pairs(items) {
    const list = el("dl", { class: "pairs" });
    for (const [name, value] of items) list.append(el("div", {}, el("dt", {}, name), el("dd", {}, value)));
    return list;
  }
  function show(cell) {
    if (!cell || cell === shown) return;
    shown = cell;
    for (const rect of cursor.children) { rect.setAttribute("x", cellX(cell.column) - 2); rect.setAttribute("y", cellY(cell.row) - 2); }
    cursor.setAttribute("visibility", "visible");
    columnNames.forEach((text, i) => text.classList.toggle("on", i === cell.column));
    rowNames.forEach((text, i) => text.classList.toggle("on", i === cell.row));
    $("board").replaceChildren(cell.layout ? place.board(cell.layout) : el("div", { class: "missing" }, "The page carries the drawings of the best cells only; this layout lies in archive.npz."));
    const obstacles = cell.layout && place.obstacles ? place.obstacles(cell.layout) : data.axes[0].name === "obstacles" ? rowAxis.labels[cell.row] : "–";
    const order = place.inWords(columnAxis.labels[cell.column]);
    const facts = [["Legibility", number(cell.legibility)], ["Distance", `${number(cell.distance, data.texts.distance_digits)} ${data.texts.distance_unit}`.trim()]];
    if (place.obstacles) facts.push(["Obstacles", String(obstacles)]);
    if (!["legibility", "efficiency"].includes(data.objective.name)) facts.unshift([data.objective.name, number(cell.objective)]);
    else if (hasCosts && data.objective.name === "legibility") facts.push(["Net of costs", number(cell.objective)]);
    $("readout").replaceChildren(el("p", { class: "order" }, (columnAxis.step > 1 ? "near " : "") + order), pairs(facts), el("div", { class: "rank" }, `rank ${number(cell.rank + 1, 0)} of ${number(cells.length, 0)}`));
    $("show-previous").disabled = cell.rank === 0;
    $("show-next").disabled = cell.rank === cells.length - 1;
    $("copy").disabled = !cell.layout;
  }
  function pin(cell) {
    if (!cell) return;
    pinned = cell;
    show(cell);
  }
  function under(event) {
    const box = picture.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * size.width, y = (event.clientY - box.top) / box.height * size.height;
    const column = Math.floor((x - margin.left) / cellWidth), row = rowAxis.count - 1 - Math.floor((y - margin.top) / cellHeight);
    if (row < 0 || row >= rowAxis.count || column < 0 || column >= columnAxis.count) return undefined;
    return at.get(row * columnAxis.count + column);
  }
  function neighbour(cell, dRow, dColumn) {
    let found, cost = Infinity;
    for (const other of cells) {
      const ahead = (other.row - cell.row) * dRow + (other.column - cell.column) * dColumn;
      const aside = Math.abs(dRow ? other.column - cell.column : other.row - cell.row);
      // A layout in the same line comes first, however far; else the nearest line that has one.
      const price = aside * 10000 + ahead;
      if (ahead > 0 && price < cost) { found = other; cost = price; }
    }
    return found;
  }
  const KEYS = {
    ArrowUp: (cell) => neighbour(cell, 1, 0), ArrowDown: (cell) => neighbour(cell, -1, 0),
    ArrowRight: (cell) => neighbour(cell, 0, 1), ArrowLeft: (cell) => neighbour(cell, 0, -1),
    Home: () => cells[0], End: () => cells[cells.length - 1],
    n: (cell) => cells[cell.rank + 1], p: (cell) => cells[cell.rank - 1],
  };
  function listen() {
    const map = $("map");
    map.addEventListener("pointermove", (event) => show(under(event) || pinned));
    map.addEventListener("pointerleave", () => show(pinned));
    map.addEventListener("click", (event) => pin(under(event)));
    map.addEventListener("keydown", (event) => {
      const move = KEYS[event.key] || KEYS[event.key.toLowerCase()];
      if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      pin(move(pinned));
    });
    $("show-best").addEventListener("click", () => pin(cells[0]));
    $("show-previous").addEventListener("click", () => pin(cells[pinned.rank - 1]));
    $("show-next").addEventListener("click", () => pin(cells[pinned.rank + 1]));
    $("copy").addEventListener("click", () => copy(place.asText(shown.layout)));
    $("download").addEventListener("click", download);
  }
  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const box = el("textarea", { class: "visually-hidden" });
      box.value = text;
      document.body.append(box);
      box.select();
      document.execCommand("copy");
      box.remove();
    }
    tell("Layout copied; `legible show -` reads it");
  }
  function download() {
    const link = el("a", { download: "legible-report.json" });
    link.href = URL.createObjectURL(new Blob([JSON.stringify(data, null, 1)], { type: "application/json" }));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // -- panels side by side ---------------------------------------------------------------------------------------------

  // A bar from the line at its zero (of detours: at 1, the straight line) to the value.
  function bar(name, value, [from, to], digits, unit = "", zero = 0) {
    const position = (v) => Math.max(0, Math.min(100, (v - from) / (to - from || 1) * 100));
    const [a, b] = [position(Math.min(zero, value)), position(Math.max(zero, value))];
    const fill = el("span", { class: value < zero ? "fill below" : "fill" }), line = el("span", { class: "zero" });
    fill.style.left = a + "%";
    fill.style.width = Math.max(b - a, 0.8) + "%";
    line.style.left = position(zero) + "%";
    return el("div", { class: `bar ${name}` }, el("span", {}, name[0].toUpperCase() + name.slice(1)), el("span", { class: "track", "aria-hidden": "true" }, fill, line), el("span", { class: "value" }, number(value, digits) + (unit ? "\u202f" + unit : "")));
  }
  function drawPanels() {
    const range = (key) => [Math.min(0, ...data.panels.map((c) => c[key])), Math.max(0, ...data.panels.map((c) => c[key]))];
    const [scores, distances] = [range("score"), range("distance")];
    for (const panel of data.panels) {
      $("panels").append(el("figure", {}, place.board(panel.layout, panel.paths),
        el("figcaption", {}, el("div", { class: "name" }, panel.name[0].toUpperCase() + panel.name.slice(1)), el("p", { class: "note" }, panel.note),
          el("div", { class: "bars" }, bar("legibility", panel.score, scores, 2), bar("distance", panel.distance, distances, data.texts.distance_digits, data.texts.distance_unit), panel.detour === null ? null : bar("detour", panel.detour, [1, Math.max(...data.panels.map((c) => c.detour), 1.2)], 2, "×", 1)))));
    }
    drawDoubt();
  }
  function drawBest() {
    for (const cell of data.varied.map((rank) => cells[rank])) {
      const card = el("button", { type: "button", class: "card", "aria-label": `Show the layout of rank ${cell.rank + 1} on the map` }, place.board(cell.layout));
      card.addEventListener("click", () => { pin(cell); $("map").focus({ preventScroll: true }); $("h-archive").scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" }); });
      $("best").append(el("figure", {}, card, el("figcaption", {}, el("div", { class: "name" }, number(cell.objective)), el("p", { class: "note" }, `rank ${number(cell.rank + 1, 0)} · ${place.obstacles ? plural(place.obstacles(cell.layout), "obstacle") + " · " : ""}${number(cell.distance, data.texts.distance_digits)} ${data.texts.distance_unit}`))));
    }
  }

  // -- curves ----------------------------------------------------------------------------------------------------------

  function ticks(from, to, count = 4) {
    const rough = (to - from) / count || 1, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].find((m) => m * power >= rough) * power;
    const list = [];
    for (let v = Math.ceil(from / step - 1e-9) * step; v <= to + step * 1e-6; v += step) list.push(Math.abs(v) < step * 1e-6 ? 0 : v);
    return list;
  }
  const across = (canvas, frame, words) => {
    const text = svg("text", { x: frame.left + (frame.width - frame.left) / 2, y: frame.height - 4, "text-anchor": "middle" });
    text.textContent = words;
    canvas.append(text);
  };
  // As many decimals as the steps between ticks need, so that equal steps look equal.
  function decimals(list) {
    const step = list.length > 1 ? list[1] - list[0] : 1;
    return [0, 1, 2, 3].find((digits) => Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) < 1e-6) ?? 4;
  }
  const compact = (v, digits = v % 1 ? (Math.abs(v) < 1 ? 2 : 1) : 0) => Math.abs(v) >= 1e6 ? number(v / 1e6, v % 1e6 ? 1 : 0) + " M" : Math.abs(v) >= 1e4 ? number(v / 1e3, v % 1e3 ? 1 : 0) + " k" : number(v, digits);
  function axes(frame, xs, [bottom, top], { format = compact, formatX = compact, label = "" }) {
    const { width, height, left, under: below } = frame;
    const x = (v) => left + (v - xs[0]) / (xs[xs.length - 1] - xs[0] || 1) * (width - left - 8);
    const y = (v) => height - below - (v - bottom) / (top - bottom || 1) * (height - below - 8);
    const canvas = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    const up = ticks(bottom, top), along = ticks(xs[0], xs[xs.length - 1]);
    for (const v of up) {
      canvas.append(svg("line", { class: "grid", x1: left, x2: width - 8, y1: y(v), y2: y(v) }));
      const text = svg("text", { x: left - 6, y: y(v) + 4, "text-anchor": "end" });
      text.textContent = format(v, decimals(up));
      canvas.append(text);
    }
    for (const v of along) {
      const text = svg("text", { x: Math.min(x(v), width - 14), y: height - below + 18, "text-anchor": "middle" });
      text.textContent = formatX(v, decimals(along));
      canvas.append(text);
    }
    return { canvas, x, y };
  }
  function drawCurves() {
    const xs = data.history.evaluations;
    const domain = xs.length > 1 ? xs : [0, xs[0]];
    const charts = [["best", "Best " + data.objective.name + (hasCosts ? ", net of costs" : ""), number], ["qd_score", "QD score", (v) => number(v, 0)], ["coverage", "Coverage", (v) => number(v * 100, 1) + " %"]];
    const moves = [];
    for (const [key, title, format] of charts) {
      const points = data.history[key].map((v, i) => [xs[i], v]).filter(([, v]) => v !== null);
      if (!points.length) continue;
      const ys = points.map(([, v]) => v);
      let [bottom, top] = [Math.min(...ys), Math.max(...ys)];
      if (key === "coverage" || (bottom > 0 && bottom < top * 0.6)) bottom = 0;
      if (top === bottom) top = bottom + 1;
      const frame = { width: 380, height: 236, left: 48, under: 46 };
      const { canvas, x, y } = axes(frame, domain, [bottom, top], { format: key === "coverage" ? (v) => number(v * 100, 0) + " %" : compact, label: `${title} against evaluations: ends at ${format(ys[ys.length - 1])}` });
      across(canvas, frame, "layouts scored →");
      const path = points.map(([px, py], i) => `${i ? "L" : "M"}${x(px).toFixed(1)} ${y(py).toFixed(1)}`).join("");
      canvas.append(svg("path", { class: "area", d: `${path}L${x(points[points.length - 1][0])} ${frame.height - frame.under}L${x(points[0][0])} ${frame.height - frame.under}Z` }), svg("path", { class: "line", d: path }));
      if (points.length === 1) canvas.append(svg("circle", { class: "dot", r: 4.5, cx: x(points[0][0]), cy: y(points[0][1]) }));
      const hair = svg("line", { class: "hair", y1: 8, y2: frame.height - frame.under, visibility: "hidden" }), dot = svg("circle", { class: "dot", r: 4.5, visibility: "hidden" });
      canvas.append(hair, dot);
      const output = el("output", {}, format(ys[ys.length - 1]));
      $("curves").append(el("div", { class: "curve" }, el("h3", {}, title, output), canvas));
      moves.push((i) => {
        const visible = i !== null && data.history[key][i] !== null;
        for (const mark of [hair, dot]) mark.setAttribute("visibility", visible ? "visible" : "hidden");
        output.textContent = visible ? `${format(data.history[key][i])} at ${compact(xs[i])}` : format(ys[ys.length - 1]);
        if (!visible) return;
        hair.setAttribute("x1", x(xs[i]));
        hair.setAttribute("x2", x(xs[i]));
        dot.setAttribute("cx", x(xs[i]));
        dot.setAttribute("cy", y(data.history[key][i]));
      });
      canvas.addEventListener("pointermove", (event) => {
        const box = canvas.getBoundingClientRect();
        const at = domain[0] + ((event.clientX - box.left) / box.width * frame.width - frame.left) / (frame.width - frame.left - 8) * (domain[domain.length - 1] - domain[0]);
        let nearest = 0;
        xs.forEach((v, i) => { if (Math.abs(v - at) < Math.abs(xs[nearest] - at)) nearest = i; });
        moves.forEach((move) => move(nearest));
      });
      canvas.addEventListener("pointerleave", () => moves.forEach((move) => move(null)));
    }
  }
  function drawPeople() {
    const { fractions, curves } = data.recorded_play;
    const frame = narrow ? { width: 380, height: 250, left: 48, under: 46 } : { width: 520, height: 300, left: 48, under: 46 };
    const all = curves.flatMap((curve) => curve.values).filter((v) => v !== null);
    const percent = (v) => number(v * 100, 0) + " %";
    const { canvas, x, y } = axes(frame, fractions, [Math.floor(Math.min(...all, 1) * 10) / 10, Math.ceil(Math.max(...all, 0) * 10) / 10], { format: percent, formatX: percent, label: curves.map((curve) => `${curve.label}: ${curve.values.map((v) => number(v, 2)).join(", ")}`).join(". ") });
    const colours = ["var(--warm)", "var(--accent)", "var(--third)", "var(--fourth)", "var(--soft)"];
    const legend = el("div", { class: "legend" });
    curves.forEach((curve, i) => {
      const colour = colours[i % colours.length], dash = i % 2 ? "none" : "6 4";
      const points = curve.values.map((v, n) => [fractions[n], v]).filter(([, v]) => v !== null);
      const line = svg("path", { class: "line", d: points.map(([px, py], n) => `${n ? "L" : "M"}${x(px).toFixed(1)} ${y(py).toFixed(1)}`).join("") });
      line.style.stroke = colour;
      line.style.strokeDasharray = dash;
      canvas.append(line);
      for (const [px, py] of points) {
        const dot = svg("circle", { class: "dot", r: 4, cx: x(px), cy: y(py) }, svg("title"));
        dot.firstChild.textContent = `${curve.label}, ${percent(px)} observed: ${number(py, 3)}`;
        dot.style.fill = colour;
        canvas.append(dot);
      }
      const mark = svg("svg", { viewBox: "0 0 30 12", class: "stroke", "aria-hidden": "true" }, svg("path", { class: "line", d: "M1 6H29" }), svg("circle", { class: "dot", r: 4, cx: 15, cy: 6 }));
      mark.style.setProperty("--colour", colour);
      mark.firstChild.style.strokeDasharray = dash;
      legend.append(key(mark, curve.label));
    });
    across(canvas, frame, "share of the trajectory observed →");
    $("people").append(el("h3", {}, "Goals predicted correctly"), canvas, legend);
  }

  drawMap();
  listen();
  pin(cells[0]);
  if ($("panels")) drawPanels();
  drawBest();
  if ($("curves")) drawCurves();
  if ($("people")) drawPeople();
})();
