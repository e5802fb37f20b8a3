"""The colours of the kitchen, shared by the drawings and the report page."""

from __future__ import annotations

from typing import Final

__all__ = ["HEAT", "PALETTE", "PLAYER_COLOURS"]

PALETTE: Final[dict[str, str]] = {
    "floor": "#f3e7d3",
    "floor_alternate": "#ebdcc4",
    "floor_line": "#dccaae",
    "counter": "#c6935f",
    "counter_light": "#d9ad7c",
    "counter_line": "#ae7c4b",
    "counter_front": "#8a5a34",
    "counter_dark": "#6b4326",
    "obstacle": "#38d3e8",
    "obstacle_light": "#a5f0f7",
    "obstacle_edge": "#e23b3b",
    "tomato": "#e2483d",
    "onion": "#e8bf62",
    "cabbage": "#7fb84a",
    "fish": "#5f93c9",
    "dish": "#fbfaf6",
    "pot": "#a9b3bf",
    "serving": "#3f9d72",
    "leaf": "#4f8f3a",
    "crate": "#a8713f",
    "crate_dark": "#7b4d28",
    "steel": "#c3cad2",
    "steel_dark": "#8f98a3",
    "ice": "#d8eef6",
    "stove": "#34373d",
    "flame": "#f28c28",
    "flame_light": "#ffd25a",
    "steam": "#ffffff",
    "progress": "#f5a524",
    "ready": "#35b36b",
    "skin": "#f2c79c",
    "hair": "#5b3a26",
    "cloth": "#fdfbf7",
    "cloth_shade": "#ddd6ca",
    "ink": "#3a2d25",
    "ink_soft": "#8a7868",
    "paper": "#fffaf0",
    "paper_line": "#e4d6bf",
    "hud": "#4a3a30",
    "hud_text": "#f8eedd",
    "warning": "#ff8a7a",
    "page": "#fbf6ec",
    "shadow": "#3a2415",
}
"""Colours as ``#rrggbb`` by what they paint; stations and ingredients carry their own names."""

PLAYER_COLOURS: Final = (
    "#2f74c8",
    "#d5582c",
    "#7a4fb5",
    "#2a9a7b",
    "#c23b77",
    "#8a7a1f",
    "#4d5b6b",
    "#9c5a3c",
    "#1f8fa8",
)
"""Scarf and apron of each player, in the order of the players."""

HEAT: Final = ("#fff4c2", "#fdd27a", "#f79d55", "#e2604f", "#b02e62", "#6b1d66")
"""Ramp from 0 to 1, evenly spaced, steadily darker, told apart by colour-blind readers too."""
