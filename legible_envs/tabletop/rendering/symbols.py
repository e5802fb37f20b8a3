"""Hand, gripper and shapes of a table as SVG symbols for pages, drawn by the very functions that draw its pictures."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

from legible_envs.drawing.svg_canvas import UNIT, SvgCanvas
from legible_envs.tabletop.rendering.actors import GRIPPER_SPAN, HAND_SPAN, draw_gripper, draw_hand
from legible_envs.tabletop.rendering.glyphs import GLYPHS
from legible_envs.tabletop.rendering.palette import NAMED, TABLE

__all__ = ["OPENINGS", "table_measures", "table_symbols"]

OPENINGS: Final = tuple(range(20, 121, 10))
"""Millimetres between the jaws of the grippers that are drawn."""

_LINE: Final = 0.0018
"""Metres: outline of a gripper."""


@lru_cache(maxsize=1)
def table_symbols() -> dict[str, str]:
    """What moves on a table as ``<symbol>``, by its id.

    Returns:
        ``t-hand-0`` (open) and ``t-hand-1`` (closed), in the middle of a square whose side is ``2 * HAND_SPAN`` times
        half the palm's width; ``t-gripper-N`` for each of :data:`OPENINGS`, in the middle of a square whose side is the
        opening and ``2 * GRIPPER_SPAN`` more.
    """
    drawn: dict[str, str] = {}
    for closed in (0, 1):
        canvas = SvgCanvas()
        one = 1 / (2 * HAND_SPAN)
        draw_hand(canvas, one, 0.05 * one, bool(closed))
        drawn[f"t-hand-{closed}"] = canvas.symbol(f"t-hand-{closed}")
    for opening in OPENINGS:
        canvas, metres = SvgCanvas(), opening / 1000
        one = 1 / (metres + 2 * GRIPPER_SPAN)
        draw_gripper(canvas, metres, one, _LINE * one)
        drawn[f"t-gripper-{opening}"] = canvas.symbol(f"t-gripper-{opening}")
    return drawn


def table_measures() -> dict[str, Any]:
    """Colours and shapes of tables, as plain data.

    Returns:
        ``colours`` (of ``TABLE``), ``named`` (``#rrggbb`` of the colour names that are printed in a way of their own),
        ``glyphs`` (points of SVG polygons, a unit of 1000 across), ``hand_span``, ``gripper_span``, ``openings``.
    """
    return {
        "colours": dict(TABLE),
        "named": dict(NAMED),
        "glyphs": {
            name: " ".join(f"{round(x * UNIT)},{round(y * UNIT)}" for x, y in points) for name, points in GLYPHS.items()
        },
        "hand_span": HAND_SPAN,
        "gripper_span": GRIPPER_SPAN,
        "openings": list(OPENINGS),
    }
