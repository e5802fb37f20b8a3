"""The robot that cooks with a person: as tall as a chef, of steel, with a visor for a face."""

from __future__ import annotations

from legible_envs.drawing.canvas import mix
from legible_envs.drawing.svg_canvas import Pen
from legible_envs.overcooked.grid import EAST, NORTH, SOUTH, WEST
from legible_envs.overcooked.rendering.palette import PALETTE

__all__ = ["draw_robot"]


def draw_robot(canvas: Pen, colour: str, facing: int) -> None:
    """A robot without hands, on a sheet as tall as a chef's.

    Args:
        canvas: What to draw on.
        colour: The player's colour: of the lamp, the collar and the light in the visor.
        facing: 0 N, 1 S, 2 E, 3 W.
    """
    _body(canvas, colour, facing)
    _head(canvas, colour, facing)


def _body(canvas: Pen, colour: str, facing: int) -> None:
    steel, dark, ink = PALETTE["steel"], PALETTE["steel_dark"], PALETTE["ink"]
    canvas.ellipse(0.5, 1.16, 0.3, 0.09, PALETTE["shadow"], 0.32)
    canvas.rectangle(0.28, 1.08, 0.44, 0.1, ink, radius=0.05)  # wheels
    canvas.rectangle(0.245, 0.74, 0.51, 0.37, mix(dark, ink, 0.45), radius=0.07)
    canvas.rectangle(0.26, 0.74, 0.48, 0.355, steel, radius=0.06)
    canvas.rectangle(0.26, 0.98, 0.48, 0.045, colour)
    if facing == SOUTH:
        canvas.rectangle(0.38, 0.83, 0.24, 0.11, mix(dark, ink, 0.3), radius=0.03)
        for x in (0.43, 0.5, 0.57):
            canvas.circle(x, 0.885, 0.022, mix(colour, "#ffffff", 0.45))
    elif facing == NORTH:
        for y in (0.83, 0.87, 0.91):
            canvas.rectangle(0.38, y, 0.24, 0.018, dark)


def _head(canvas: Pen, colour: str, facing: int) -> None:
    steel, dark, ink = PALETTE["steel"], PALETTE["steel_dark"], PALETTE["ink"]
    rim = mix(dark, ink, 0.45)
    dx = {EAST: 0.03, WEST: -0.03}.get(facing, 0.0)
    canvas.rectangle(0.44, 0.68, 0.12, 0.08, rim)
    canvas.stroke([(0.5, 0.3), (0.5, 0.42)], 0.03, rim)
    canvas.circle(0.5, 0.26, 0.062, rim)
    canvas.circle(0.5, 0.26, 0.048, colour)
    canvas.rectangle(0.255 + dx, 0.385, 0.49, 0.335, rim, radius=0.1)
    canvas.rectangle(0.27 + dx, 0.4, 0.46, 0.305, steel, radius=0.09)
    if facing == NORTH:
        canvas.rectangle(0.36, 0.5, 0.28, 0.1, dark, radius=0.03)
        return
    left, wide = {EAST: (0.47, 0.29), WEST: (0.24, 0.29)}.get(facing, (0.32, 0.36))
    canvas.rectangle(left, 0.475, wide, 0.15, ink, radius=0.06)
    eyes = {EAST: (0.66,), WEST: (0.34,)}.get(facing, (0.42, 0.58))
    for x in eyes:
        canvas.circle(x, 0.55, 0.045, mix(colour, "#ffffff", 0.55))
