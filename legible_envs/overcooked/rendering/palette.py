"""The colours of the kitchen, shared by the drawings and the report page."""

from __future__ import annotations

from typing import Final

from legible_envs.drawing.palette import HEAT, PAGE

__all__ = ["HEAT", "PALETTE", "PLAYER_COLOURS"]

PALETTE: Final[dict[str, str]] = {
    **PAGE,
    "floor": "#f3e7d3",
    "floor_alternate": "#ebdcc4",
    "floor_line": "#dccaae",
    "counter": "#c6935f",
    "counter_light": "#d9ad7c",
    "counter_line": "#ae7c4b",
    "counter_front": "#8a5a34",
    "counter_dark": "#6b4326",
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
    "paper": "#fffaf0",
    "paper_line": "#e4d6bf",
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
