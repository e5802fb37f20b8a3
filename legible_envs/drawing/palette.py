"""The colours of the paper that everything is drawn on."""

from __future__ import annotations

from typing import Final

__all__ = ["HEAT", "PAGE"]

PAGE: Final[dict[str, str]] = {
    "ink": "#3a2d25",
    "ink_soft": "#8a7868",
    "page": "#fbf6ec",
    "hud": "#4a3a30",
    "hud_text": "#f8eedd",
    "warning": "#ff8a7a",
    "obstacle": "#38d3e8",
    "obstacle_light": "#a5f0f7",
    "obstacle_edge": "#e23b3b",
}
"""Colours as ``#rrggbb`` by what they paint: texts, the strip above a game, virtual obstacles."""

HEAT: Final = ("#fff4c2", "#fdd27a", "#f79d55", "#e2604f", "#b02e62", "#6b1d66")
"""Ramp from 0 to 1, evenly spaced, steadily darker, told apart by colour-blind readers too."""
