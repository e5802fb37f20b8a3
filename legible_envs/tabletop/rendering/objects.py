"""Objects as small pictures: a box in its colour with its shape on top."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np

from legible_envs.drawing.canvas import Canvas, Image, Sprite, mix, paste, text_sprite
from legible_envs.tabletop.objects import TableObject
from legible_envs.tabletop.rendering.frame import Frame
from legible_envs.tabletop.rendering.glyphs import draw_glyph, initial
from legible_envs.tabletop.rendering.palette import TABLE, hex_of, ink_on

__all__ = ["colour_of", "outline", "paste_centred", "paste_object"]

_TURN: Final = math.radians(2.0)  # angles are drawn to this step, so that sprites can be kept


def colour_of(obj: TableObject) -> str:
    """The colour of an object as ``#rrggbb``.

    Raises:
        ValueError: It has none that can be drawn.
    """
    try:
        return hex_of(obj.colour)
    except ValueError as error:
        raise ValueError(f"object {obj.name!r}: {error}") from None


def outline(
    x: float, y: float, wide: float, tall: float, turn: float = 0.0, radius: float = 0.0
) -> list[tuple[float, float]]:
    """Points of a rectangle with rounded corners, y down, turned counter-clockwise as seen."""
    radius = min(radius, wide / 2, tall / 2)
    corners = [(1, -1, -90), (1, 1, 0), (-1, 1, 90), (-1, -1, 180)]
    points = []
    for sx, sy, first in corners:
        for step in range(7 if radius else 1):
            a = math.radians(first + 15 * step)
            u = sx * (wide / 2 - radius) + (radius * math.cos(a) if radius else 0)
            v = sy * (tall / 2 - radius) + (radius * math.sin(a) if radius else 0)
            points.append((u, v))
    c, s = math.cos(turn), math.sin(turn)
    return [(x + u * c + v * s, y - u * s + v * c) for u, v in points]


def paste_centred(image: Image, sprite: Sprite, column: float, row: float) -> None:
    """Lay a sprite over an image, its middle at a pixel."""
    height, width = sprite.colour.shape[:2]
    paste(image, sprite, round(row - height / 2), round(column - width / 2))


MOST_ACROSS: Final = 4096
"""Pixels of an object's diagonal."""


def paste_object(
    image: Image,
    frame: Frame,
    obj: TableObject,
    x: float,
    y: float,
    angle: float | None = None,
    *,
    faded: bool = False,
    lifted: bool = False,
) -> None:
    """Draw an object with its centre at a point on the table.

    Args:
        image: The image to draw on.
        frame: Where the table lies in it.
        obj: The object: its colour, shape and size.
        x: Metres.
        y: Metres.
        angle: Radians; the object's own if None.
        faded: Whether it does not matter now.
        lifted: Whether it is carried, and throws a longer shadow.

    Raises:
        ValueError: It has no colour that can be drawn, or is far larger than the picture.
    """
    if math.hypot(*obj.size) * frame.scale > MOST_ACROSS:
        raise ValueError(
            f"object {obj.name!r} of {obj.size[0]:g} x {obj.size[1]:g} m is too large to be drawn on a table of "
            f"{frame.size[0]:g} x {frame.size[1]:g} m: more than {MOST_ACROSS:,} pixels across"
        )
    turn = obj.angle if angle is None else float(angle)
    sprite = _sprite(
        colour_of(obj),
        obj.shape,
        obj.size,
        round(turn / _TURN),
        obj.movable,
        faded,
        lifted,
        round(frame.scale * 64),
    )
    paste_centred(image, sprite, *frame.pixel(float(x), float(y)))


@lru_cache(maxsize=2048)
def _sprite(
    colour: str,
    shape: str,
    size: tuple[float, float],
    step: int,
    movable: bool,
    faded: bool,
    lifted: bool,
    scale64: int,
) -> Sprite:
    scale, turn = scale64 / 64, step * _TURN
    side = max(6, 2 * math.ceil((math.hypot(*size) + 0.016) * scale / 2))
    canvas = Canvas(side)
    one = scale / side  # units of the canvas in a metre
    long, wide = size[0] * one, size[1] * one
    least, line = min(long, wide), max(0.0012 * one, 0.7 / side)
    body = mix(colour, TABLE["top"], 0.55) if faded else colour
    edge = mix(body, "#1d120a", 0.22 if faded else 0.45)
    if movable:
        drop = (0.005 if lifted else 0.0022) * one
        canvas.polygon(outline(0.5 + drop, 0.5 + drop, long, wide, turn, 0.12 * least), "#3a2415", 0.30)
    else:
        canvas.polygon(outline(0.5, 0.5, long + 6 * line, wide + 6 * line, turn, 0.3 * least), TABLE["fixed"])
    canvas.polygon(outline(0.5, 0.5, long, wide, turn, 0.14 * least), edge)
    canvas.polygon(outline(0.5, 0.5, long - 2 * line, wide - 2 * line, turn, 0.12 * least), body)
    ink = mix(ink_on(colour), body, 0.25) if faded else ink_on(colour)
    if shape == "bin":
        canvas.polygon(outline(0.5, 0.5, long - 0.16 * least, wide - 0.16 * least, turn, 0.1 * least), edge)
        inside = mix(body, "#1d120a", 0.62)
        canvas.polygon(outline(0.5, 0.5, long - 0.24 * least, wide - 0.24 * least, turn, 0.08 * least), inside)
    else:
        draw_glyph(canvas, shape, 0.5, 0.5, 0.74 * least, turn, ink, body)
    return _lettered(canvas.sprite(), initial(shape), round(0.8 * least * side), ink)


def _lettered(sprite: Sprite, letter: str, size: int, ink: str) -> Sprite:
    """The sprite with a letter in its middle."""
    if not letter or size < 5:
        return sprite
    words = text_sprite(letter, size, ink)
    rows, cols = words.colour.shape[:2]
    height, width = sprite.colour.shape[:2]
    if rows > height or cols > width:
        return sprite
    top, left = (height - rows + 1) // 2, (width - cols + 1) // 2
    inside = (slice(top, top + rows), slice(left, left + cols))
    colour, through = sprite.colour.copy(), sprite.through.copy()
    colour[inside] = words.colour + (colour[inside] * words.through >> 8)
    through[inside] = through[inside] * words.through >> 8
    return Sprite(np.minimum(colour, 255), through)
