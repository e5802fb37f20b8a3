"use strict";
// Draws kitchens: a layout is a text of one symbol for each cell, row by row.
function makePlace(data, { svg, plural }) {
  const STATIONS = { T: "tomato", O: "onion", C: "cabbage", F: "fish", D: "dish", P: "pot", S: "serving" };
  const [height, width] = data.place.shape;

  function describe(layout) {
    const places = [];
    [...layout].forEach((symbol, i) => {
      if (STATIONS[symbol]) places.push(`${STATIONS[symbol]} at row ${Math.floor(i / width)}, column ${i % width}`);
    });
    return `Kitchen: ${places.join("; ")}; ${plural([...layout].filter((s) => s === "V").length, "virtual obstacle")}.`;
  }
  function board(layout) {
    const picture = svg("svg", { viewBox: `0 0 ${width * 48} ${height * 48}`, class: "board", role: "img", "aria-label": describe(layout) });
    [...layout].forEach((symbol, i) => {
      const row = Math.floor(i / width), column = i % width;
      const place = { x: column * 48, y: row * 48, width: 48, height: 48 };
      const floor = (row + column) % 2 ? "floor-alternate" : "floor";
      if (symbol === " " || symbol === "V") picture.append(svg("use", { href: `#s-${floor}`, ...place }));
      if (symbol !== " ") picture.append(svg("use", { href: `#s-${symbol}`, ...place }));
      if (STATIONS[symbol]) {
        const tag = svg("g", {}, svg("rect", { class: "tag", x: place.x + 30, y: place.y + 29, width: 17, height: 17, rx: 4.5 }));
        const letter = svg("text", { class: "letter", x: place.x + 38.5, y: place.y + 42 });
        letter.textContent = symbol;
        tag.append(letter, svg("title"));
        tag.lastChild.textContent = STATIONS[symbol];
        picture.append(tag);
      }
    });
    return picture;
  }
  function asText(layout) {
    return layout.match(new RegExp(`.{${width}}`, "g")).join("\n");
  }
  const obstacles = (layout) => [...layout].filter((symbol) => symbol === "V").length;
  const isOrder = (label) => [...String(label)].every((symbol) => STATIONS[symbol]);
  const inWords = (label) => isOrder(label) ? [...label].map((symbol) => STATIONS[symbol]).join(" · ") : String(label);

  return { board, asText, obstacles, inWords };
}
