// The drawings that the server's own functions made: loaded once, shown by <use>.
import { svg } from "./dom.js";

const loaded = new Map();

// Puts the symbols of a file into the page; resolves to the measures that come with them.
export function load(name) {
  if (!loaded.has(name)) {
    const found = fetch(new URL(`static/${name}.svg`, document.baseURI)).then(async (answer) => {
      if (!answer.ok) throw new Error(`${name}.svg: ${answer.status}`);
      const root = document.importNode(new DOMParser().parseFromString(await answer.text(), "image/svg+xml").documentElement, true);
      for (const [key, value] of Object.entries({ width: 0, height: 0, class: "sheet", "aria-hidden": "true" })) root.setAttribute(key, value);
      const measures = JSON.parse(root.dataset.measures);
      root.removeAttribute("data-measures");
      document.body.append(root);
      return measures;
    });
    found.catch(() => loaded.delete(name));
    loaded.set(name, found);
  }
  return loaded.get(name);
}

export const use = (id, x, y, width, height = width, props = {}) => svg("use", { href: `#${id}`, x, y, width, height, ...props });

// Colours as the drawings mix them: "#rrggbb", `share` of the way from the first to the second.
const channels = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
export function mix(first, second, share) {
  const [a, b] = [channels(first), channels(second)];
  return `#${a.map((v, i) => Math.round(v + (b[i] - v) * share).toString(16).padStart(2, "0")).join("")}`;
}

const paper = document.createElement("canvas").getContext("2d");
// Any CSS colour as "#rrggbb"; grey for what is none.
export function hexOf(colour, named = {}) {
  const name = String(colour).trim().toLowerCase();
  if (Object.hasOwn(named, name)) return named[name];
  paper.fillStyle = "#8d9196";
  paper.fillStyle = name;
  return paper.fillStyle.startsWith("#") ? paper.fillStyle : "#8d9196";
}

export function inkOn(ground) {
  const [red, green, blue] = channels(ground);
  return 0.299 * red + 0.587 * green + 0.114 * blue > 150 ? "#2b2320" : "#ffffff";
}
