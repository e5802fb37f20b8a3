"""The shapes on objects: outlines that are told apart without colour."""

from __future__ import annotations

import math
from typing import Final

from legible_envs.drawing.canvas import Canvas

__all__ = ["GLYPHS", "draw_glyph", "initial"]

Outline = list[tuple[float, float]]


def _regular(corners: int, radius: float, dip: float = 1.0) -> Outline:
    """A polygon round the origin, its first corner on top; every other radius shrunk by ``dip``."""
    count = corners if dip == 1.0 else 2 * corners
    angles = [2 * math.pi * (i / count) for i in range(count)]
    radii = [radius if i % 2 == 0 else radius * dip for i in range(count)] if dip != 1.0 else [radius] * count
    return [(r * math.sin(a), -r * math.cos(a)) for r, a in zip(radii, angles, strict=True)]


def _cross(turned: bool) -> Outline:
    arm, reach = 0.15, 0.46
    quarter = [(arm, -reach), (arm, -arm), (reach, -arm)]
    points: Outline = []
    for _ in range(4):
        points += quarter
        quarter = [(-y, x) for x, y in quarter]
    if not turned:
        return points
    half = math.sqrt(0.5)
    return [((x - y) * half, (x + y) * half) for x, y in points]


def _heart() -> Outline:
    angles = [2 * math.pi * i / 60 for i in range(60)]
    return [
        (
            0.43 * math.sin(a) ** 3,
            -0.03 - (13 * math.cos(a) - 5 * math.cos(2 * a) - 2 * math.cos(3 * a) - math.cos(4 * a)) * 0.0268,
        )
        for a in angles
    ]


_UP: Final = [(x, y + 0.1) for x, y in _regular(3, 0.56)]

GLYPHS: Final[dict[str, Outline]] = {
    "circle": _regular(64, 0.40),
    "square": [(-0.36, -0.36), (0.36, -0.36), (0.36, 0.36), (-0.36, 0.36)],
    "triangle": _UP,
    "star": [(x, y + 0.03) for x, y in _regular(5, 0.54, dip=0.42)],
    "diamond": _regular(4, 0.50),
    "pentagon": _regular(5, 0.46),
    "hexagon": _regular(6, 0.46),
    "plus": _cross(turned=False),
    "cross": _cross(turned=True),
    "heart": _heart(),
}
"""Outlines by name, about one unit across, y down. ``"ring"`` and ``"bin"`` are drawn with holes."""


def draw_glyph(canvas: Canvas, shape: str, x: float, y: float, size: float, turn: float, ink: str, ground: str) -> None:
    """Draw a shape about ``size`` units across round a point.

    Args:
        canvas: The canvas to draw on.
        shape: One of :data:`GLYPHS`, ``"ring"`` or ``"bin"``; of any other word nothing is drawn here, see
            :func:`initial`.
        x: Centre.
        y: Centre.
        size: Units.
        turn: Radians, counter-clockwise.
        ink: Colour.
        ground: Colour of the ground under it.
    """
    cosine, sine = math.cos(turn) * size, math.sin(turn) * size

    def placed(outline: Outline, scale: float = 1.0) -> Outline:
        return [(x + scale * (u * cosine + v * sine), y + scale * (v * cosine - u * sine)) for u, v in outline]

    if shape in GLYPHS:
        canvas.polygon(placed(GLYPHS[shape]), ink)
    elif shape == "ring":
        canvas.polygon(placed(GLYPHS["circle"]), ink)
        canvas.polygon(placed(GLYPHS["circle"], 0.55), ground)


def initial(shape: str) -> str:
    """The letter that stands for a shape that cannot be drawn; empty where it can."""
    return "" if shape in GLYPHS or shape in ("ring", "bin") else shape[0].upper()
