"""The colours of the table, and those of the objects on it."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from legible_envs.drawing.canvas import rgb
from legible_envs.drawing.palette import PAGE

__all__ = ["NAMED", "TABLE", "hex_of", "ink_on"]

TABLE: Final[dict[str, str]] = {
    **PAGE,
    "top": "#efe5d4",
    "rim": "#c9b391",
    "region": "#f8f2e6",
    "region_line": "#dccdb2",
    "assembly": "#dde4e6",
    "assembly_line": "#a9b8bd",
    "slot": "#eef2f3",
    "slot_line": "#8298a0",
    "start": "#6f6256",
    "grown": "#d3edef",
    "skin": "#f0c096",
    "sleeve": "#3f6fae",
    "skin_line": "#8c5a38",
    "steel": "#5b6672",
    "steel_dark": "#2f3843",
    "robot": "#7a4fb5",
    "trail": "#8c5a38",
    "track": "#fffdf8",
    "unsure": "#e08a1e",
    "sure": "#1f7a4d",
    "fixed": "#cfc2ab",
}
"""Colours as ``#rrggbb`` by what they paint."""

NAMED: Final[dict[str, str]] = {
    "red": "#b92d27",
    "green": "#4fb888",
    "blue": "#2b62c0",
    "yellow": "#f5c72f",
    "orange": "#e2761b",
    "purple": "#a173cc",
    "pink": "#e68ab0",
    "brown": "#7d5233",
    "grey": "#8d9196",
    "gray": "#8d9196",
    "white": "#fcfbf8",
    "black": "#2c2b2d",
    "cyan": "#25a5b8",
}
"""How the common colour names are printed: softer than a screen's primaries, and each of another lightness, so that
red and green differ to colour-blind readers too."""


@lru_cache(maxsize=512)
def hex_of(colour: str) -> str:
    """A CSS colour as ``#rrggbb``.

    Raises:
        ValueError: It is none.
    """
    name = colour.strip().lower()
    if name in NAMED:
        return NAMED[name]
    from PIL import ImageColor

    try:
        return "#{:02x}{:02x}{:02x}".format(*ImageColor.getrgb(name)[:3])
    except ValueError:
        raise ValueError(
            f"{colour!r} is no CSS colour; expected a name such as 'red', or '#rrggbb', 'rgb(…)', 'hsl(…)'"
        ) from None


def ink_on(ground: str) -> str:
    """White or nearly black, whichever stands out on a ``#rrggbb`` ground."""
    red, green, blue = rgb(ground)
    return "#2b2320" if 0.299 * red + 0.587 * green + 0.114 * blue > 150 else "#ffffff"
