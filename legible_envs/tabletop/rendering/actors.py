"""The person's hand and the robot's gripper, seen from above."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

from legible_envs.drawing.canvas import Canvas, Sprite
from legible_envs.drawing.svg_canvas import Pen
from legible_envs.tabletop.rendering.palette import TABLE

__all__ = [
    "GRIPPER_SPAN",
    "HAND_SPAN",
    "dot_sprite",
    "draw_gripper",
    "draw_hand",
    "gripper_sprite",
    "hand_sprite",
    "ring_sprite",
]


HAND_SPAN: Final = 2.4
"""Half the side of a drawing of a hand, in half-widths of its palm."""
GRIPPER_SPAN: Final = 0.035
"""By how many metres half the side of a drawing of a gripper exceeds half its opening."""


def draw_hand(canvas: Pen, one: float, line: float, closed: bool) -> None:
    """A right hand round the middle of a sheet, pointing up.

    Args:
        canvas: The sheet.
        one: Half the palm's width, in units.
        line: Thickness of its outline, in units.
        closed: Whether it holds something.
    """
    reach = 0.95 if closed else 1.55
    fingers = [((x * 0.44, -0.25), (x * 0.52, -reach + 0.16 * abs(x + 0.4))) for x in (-1.35, -0.45, 0.45, 1.35)]
    thumb = ((-0.45, 0.4), (-1.15, -0.25 if not closed else -0.5))
    for grow, skin in ((line, TABLE["skin_line"]), (0.0, TABLE["skin"])):
        for (x0, y0), (x1, y1) in (*fingers, thumb):
            ends = [(0.5 + one * x0, 0.5 + one * y0), (0.5 + one * x1, 0.5 + one * y1)]
            canvas.stroke(ends, 0.42 * one + 2 * grow, skin)
        canvas.ellipse(0.5, 0.5 + 0.12 * one, 0.86 * one + grow, 0.92 * one + grow, skin)
        cuff = [(0.5, 0.5 + 0.8 * one), (0.5, 0.5 + 1.75 * one)]
        canvas.stroke(cuff, 1.0 * one + 2 * grow, skin)
    sleeve = (0.5 - 0.72 * one, 0.5 + 1.45 * one, 1.44 * one, 0.85 * one)
    canvas.rectangle(*sleeve, TABLE["sleeve"], radius=0.2 * one)


def draw_gripper(canvas: Pen, opening: float, one: float, line: float) -> None:
    """A parallel gripper round the middle of a sheet.

    Args:
        canvas: The sheet.
        opening: Between its jaws, in metres.
        one: A metre, in units.
        line: Thickness of its outline, in units.
    """
    gap = opening / 2 * one
    jaw, long = 0.011 * one, 0.046 * one
    top = 0.5 - gap - 0.016 * one
    for grow, steel, mark in (
        (line, TABLE["steel_dark"], TABLE["steel_dark"]),
        (0.0, TABLE["steel"], TABLE["robot"]),
    ):
        bar = 0.014 * one
        canvas.rectangle(
            0.5 - gap - jaw - grow,
            top - bar / 2 - grow,
            2 * (gap + jaw + grow),
            bar + 2 * grow,
            steel,
            radius=0.004 * one,
        )
        for left in (0.5 - gap - jaw, 0.5 + gap):
            canvas.rectangle(left - grow, top - grow, jaw + 2 * grow, gap + long + 2 * grow, mark, radius=0.004 * one)
        canvas.circle(0.5, top, 0.013 * one + grow, steel)
    canvas.circle(0.5, top, 0.0065 * one, TABLE["robot"])


@lru_cache(maxsize=64)
def hand_sprite(half: float, scale64: int, closed: bool) -> Sprite:
    """A right hand that points away from the person; its palm is ``2 * half`` metres wide, its middle the hand's.

    Args:
        half: Half the hand's width in metres.
        scale64: 64 times the pixels per metre.
        closed: Whether it holds something.
    """
    scale = scale64 / 64
    side = max(12, 2 * math.ceil(HAND_SPAN * half * scale))
    canvas = Canvas(side)
    draw_hand(canvas, half * scale / side, max(0.9 / side, 0.05 * half * scale / side), closed)
    return canvas.sprite()


@lru_cache(maxsize=64)
def gripper_sprite(opening: float, scale64: int) -> Sprite:
    """A parallel gripper whose jaws are ``opening`` metres apart; its middle is between them."""
    scale = scale64 / 64
    side = max(12, 2 * math.ceil((opening / 2 + GRIPPER_SPAN) * scale))
    canvas = Canvas(side)
    draw_gripper(canvas, opening, scale / side, 0.9 / side)
    return canvas.sprite()


@lru_cache(maxsize=256)
def ring_sprite(radius: int, thick: int, colour: str) -> Sprite:
    """A ring of whole pixels: the radius to its middle line, and its breadth."""
    side = 2 * (radius + thick + 1)
    canvas = Canvas(side)
    canvas.arc(0.5, 0.5, radius / side, (0, 1), thick / side, colour)
    return canvas.sprite()


@lru_cache(maxsize=64)
def dot_sprite(size: int, colour: str, tenths: int) -> Sprite:
    """A dot ``size`` half-pixels across, ``tenths`` of it opaque."""
    side = size // 2 + 3
    canvas = Canvas(side)
    canvas.circle(0.5, 0.5, size / 4 / side, colour, tenths / 10)
    return canvas.sprite()
