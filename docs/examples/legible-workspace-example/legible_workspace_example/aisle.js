"use strict";
// Draws aisles: a layout is its drawing, four rows between bars.
function makePlace(data, { svg }) {
  const { bays, goods, colours } = data.place;
  function board(layout) {
    const rows = layout.split("\n").map((row) => row.slice(1, -1));
    const names = [...layout].filter((letter) => goods[letter]).map((letter) => goods[letter]);
    const picture = svg("svg", { viewBox: `0 0 ${bays * 32} 128`, class: "board table", role: "img", "aria-label": `Aisle: ${names.join(", ")}` });
    rows.forEach((row, y) => [...row].forEach((letter, x) => {
      const fill = letter === " " ? "#f0e9dd" : colours[letter];
      picture.append(svg("rect", { x: x * 32 + 1, y: y * 32 + 1, width: 30, height: 30, rx: 4, fill }));
      if (!goods[letter]) return;
      const label = svg("text", { x: x * 32 + 16, y: y * 32 + 20, "text-anchor": "middle", style: "fill: #fff" }, svg("title"));
      label.prepend(letter);
      label.lastChild.textContent = goods[letter];
      picture.append(label);
    }));
    return picture;
  }
  return { board, asText: (layout) => layout, inWords: (label) => `${data.axes[1].name}: ${label}` };
}
