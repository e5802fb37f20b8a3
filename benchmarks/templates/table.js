"use strict";
// Draws tables: a layout is a list of [x, y] of every object, then [x, y, angle] of every obstacle, in tenths of a
// millimetre and hundredths of a degree, y away from the person.
function makePlace(data, { svg, number, plural, heat }) {
  const { size: [width, depth], region, assembly, starts, hand, obstacle, objects, glyphs, colours } = data.place;
  const split = (layout) => [layout.slice(0, objects.length), layout.slice(objects.length)];
  const up = (y) => depth - y;
  const names = (layout) => split(layout)[0].map(([x, y], i) => `${objects[i].name} at ${number(x / 1e4)}, ${number(y / 1e4)} m`);

  function box([x0, y0, x1, y1], fill, line) {
    return svg("rect", { x: x0, y: up(y1), width: x1 - x0, height: y1 - y0, rx: 12, fill, stroke: line, "stroke-width": 2.5 });
  }
  function glyph(object, ink, size) {
    if (object.shape === "bin") return svg("rect", { x: -0.38 * object.size[0], y: -0.38 * object.size[1], width: 0.76 * object.size[0], height: 0.76 * object.size[1], rx: 6, fill: "#0008" });
    if (object.shape === "ring") return svg("circle", { r: 0.3 * size, fill: "none", stroke: ink, "stroke-width": 0.16 * size });
    if (glyphs[object.shape]) return svg("polygon", { points: glyphs[object.shape], transform: `scale(${size})`, fill: ink });
    const letter = svg("text", { "text-anchor": "middle", y: 0.34 * size, style: `font: 700 ${size}px sans-serif; fill: ${ink}` });
    letter.textContent = object.shape[0].toUpperCase();
    return letter;
  }
  function slot(object) {
    const [long, wide] = object.size;
    const group = svg("g", { transform: `translate(${object.slot[0]} ${up(object.slot[1])}) rotate(${-object.angle})` },
      svg("rect", { x: -long / 2 - 2, y: -wide / 2 - 2, width: long + 4, height: wide + 4, rx: 5, fill: colours.slot, stroke: colours.slot_line, "stroke-width": 2 }));
    const ghost = svg("g", { opacity: 0.38 }, glyph(object, object.colour, 0.62 * Math.min(long, wide)));
    group.append(ghost);
    return group;
  }
  function boxOf(object, x, y) {
    const [long, wide] = object.size;
    const group = svg("g", { transform: `translate(${x} ${up(y)}) rotate(${-object.angle})` },
      svg("rect", { x: -long / 2, y: -wide / 2, width: long, height: wide, rx: 0.14 * Math.min(long, wide), fill: object.colour, stroke: "#1d120a88", "stroke-width": 2 }),
      glyph(object, object.ink, 0.74 * Math.min(long, wide)), svg("title"));
    group.lastChild.textContent = object.name;
    return group;
  }
  function pathOf(points) {
    const group = svg("g", { "stroke-linecap": "round", "stroke-linejoin": "round", fill: "none" });
    group.append(svg("polyline", { points: points.map(([x, y]) => `${x},${up(y)}`).join(" "), stroke: colours.rim, "stroke-width": 11 }));
    points.slice(1).forEach(([x, y], i) => {
      const [fromX, fromY, ambiguity] = points[i];
      group.append(svg("line", { x1: fromX, y1: up(fromY), x2: x, y2: up(y), style: `stroke: ${heat(ambiguity / 100)}; stroke-width: 7.5px` }));
    });
    return group;
  }
  function board(layout, paths = []) {
    const [centres, walls] = split(layout);
    const picture = svg("svg", { viewBox: `-16 -16 ${width + 32} ${depth + 32}`, class: "board table", role: "img", "aria-label": `Table: ${names(layout).join("; ")}; ${plural(walls.length, "virtual obstacle")}.` });
    picture.append(svg("rect", { x: -16, y: -16, width: width + 32, height: depth + 32, rx: 24, fill: colours.rim }), svg("rect", { width, height: depth, rx: 12, fill: colours.top }));
    const pad = [region[0] - 30, region[1] - 30, region[2] + 30, region[3] + 30];
    picture.append(box(pad, colours.region, colours.region_line), box(assembly, colours.assembly, colours.assembly_line));
    for (const object of objects) if (object.slot) picture.append(slot(object));
    for (const [x, y] of starts) {
      picture.append(svg("circle", { cx: x, cy: up(y), r: Math.max(hand, 12), fill: "none", stroke: colours.start, "stroke-width": 4 }), svg("circle", { cx: x, cy: up(y), r: 5, fill: colours.start }));
    }
    for (const [x, y, angle] of walls) {
      const [long, wide] = obstacle;
      // Edges lie outside: on a small board they would leave nothing of the cyan, and style sheets widen both.
      const at = { transform: `translate(${x / 10} ${up(y / 10)}) rotate(${-angle / 100})` };
      picture.append(svg("g", at, ...[["edge", 2.4, colours.obstacle_edge], ["light", 0, colours.obstacle]].map(([name, grown, fill]) =>
        svg("rect", { class: `obstacle ${name}`, x: -long / 2 - grown, y: -wide / 2 - grown, width: long + 2 * grown, height: wide + 2 * grown, fill, stroke: fill }))));
    }
    // Ambiguity on top: the clearest reaches first.
    const total = (points) => points.reduce((sum, point) => sum + point[2], 0);
    for (const path of [...paths].sort((a, b) => total(a) - total(b))) picture.append(pathOf(path));
    centres.forEach(([x, y], i) => picture.append(boxOf(objects[i], x / 10, y / 10)));
    return picture;
  }
  function asText(layout) {
    const [centres, walls] = split(layout);
    const metres = (v) => Number((v / 1e4).toFixed(4));
    return JSON.stringify({
      schema: 1,
      table: data.place.table,
      objects: data.place.boxes.map((box, i) => ({ ...box, at: centres[i].map(metres) })),
      obstacles: walls.map(([x, y, angle]) => ({ at: [metres(x), metres(y)], angle: angle / 18000 * Math.PI, size: obstacle.map((v) => v / 1000) })),
    }, null, 1);
  }
  const obstacles = (layout) => layout.length - objects.length;
  const inInitials = (name) => name.split("-").map((part) => part[0]).join("");
  const initials = new Map(objects.map((object) => [inInitials(object.name), object.name]));
  function sample(...parts) {
    return svg("svg", { viewBox: "-30 -30 60 60", class: "sample", "aria-hidden": "true" }, ...parts);
  }
  function boxSample(object) {
    const [long, wide] = object.size, side = Math.max(long, wide);
    return sample(svg("g", { transform: `scale(${56 / side}) translate(0 ${-depth})` }, boxOf({ ...object, angle: 0 }, 0, 0)));
  }
  const used = new Set(data.axes[1].labels.flatMap((label) => String(label).split(" ")));
  const coded = objects.filter((object) => used.has(inInitials(object.name)));
  const codes = coded.length < 2 ? undefined : coded.map((object) => [inInitials(object.name), object.name, boxSample(object)]);
  const codesAbout = "Initials of the objects, from left to right:";
  const bare = { "stroke-width": 5 };
  const marks = [
    [sample(svg("circle", { r: 22, fill: "none", stroke: colours.start, ...bare }), svg("circle", { r: 5, fill: colours.start })), "where the hand starts a reach"],
    ...(data.panels.some((panel) => panel.layout.length > objects.length) ? [[sample(svg("g", { transform: "rotate(-20)" }, svg("rect", { x: -29, y: -8, width: 58, height: 16, fill: colours.obstacle, stroke: colours.obstacle_edge, "stroke-width": 4 }))), "virtual obstacle, which the hand goes round"]] : []),
    ...(objects.some((object) => object.slot) ? [[sample(svg("rect", { x: -22, y: -22, width: 44, height: 44, rx: 6, fill: colours.slot, stroke: colours.slot_line, "stroke-width": 4 })), "where an object belongs"]] : []),
  ];
  const doubt = { title: "How far an observer doubts the true goal: 1 less its probability (Eq. 1)", low: "0", high: "1" };
  const inWords = (label) => String(label).split(" ").map((part) => initials.get(part) || part).join(" · ");

  return { board, asText, obstacles, inWords, codes, codesAbout, marks, doubt };
}
