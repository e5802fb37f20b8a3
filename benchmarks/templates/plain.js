"use strict";
// Shows layouts as the text they are written in, for workspaces whose presenter draws nothing.
function makePlace(data, { el }) {
  const board = (layout) => el("div", { class: "board plain", role: "img", "aria-label": layout }, el("code", {}, layout));
  return { board, asText: (layout) => layout, inWords: (label) => `${data.axes[1].name}: ${label}` };
}
