"""Drawing in unit coordinates: vector shapes rasterised off screen, smoothed, and laid onto plain RGB arrays.

Only this file knows pygame. Its surfaces are used as paper, never as a screen, so no display is opened and none is
needed; everything after rasterising is numpy, which keeps pixels the same wherever the program runs.
"""

from __future__ import annotations

import itertools
import math
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.drawing.palette import HEAT
from legible_envs.support.names import printable

__all__ = [
    "Canvas",
    "Image",
    "Sprite",
    "drawable",
    "heat_colour",
    "load_pygame",
    "mix",
    "paste",
    "points_of_arc",
    "rgb",
    "text_sprite",
]

Image = npt.NDArray[np.uint8]
Point = tuple[float, float]
_FINE: Final = 192  # sprites are drawn at least this fine before they are averaged down
_BAND: Final = 32
LONGEST_LINE: Final = 200
"""Characters of a line of text in a picture."""


def load_pygame() -> Any:
    """Import pygame without its greeting and without leaving a trace in the environment variables."""
    if "pygame" in sys.modules:
        return sys.modules["pygame"]
    before = os.environ.copy()
    os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
    try:
        import pygame
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)
    return pygame


def rgb(colour: str) -> tuple[int, int, int]:
    """``"#rrggbb"`` as three numbers."""
    value = int(colour.lstrip("#"), 16)
    return value >> 16 & 255, value >> 8 & 255, value & 255


def mix(first: str, second: str, share: float) -> str:
    """The colour ``share`` of the way from the first to the second."""
    pairs = zip(rgb(first), rgb(second), strict=True)
    return "#" + "".join(f"{round(a + (b - a) * share):02x}" for a, b in pairs)


def heat_colour(value: float) -> str:
    """The colour of a value from 0 to 1 on the ramp ``HEAT``; values beyond count as the nearer end."""
    place = min(max(value, 0.0), 1.0) * (len(HEAT) - 1)
    below = min(int(place), len(HEAT) - 2)
    return mix(HEAT[below], HEAT[below + 1], place - below)


class Sprite(NamedTuple):
    """A small picture to lay over others: colours already multiplied by opacity, and what shows through.

    Attributes:
        colour: ``(h, w, 3)`` uint16, premultiplied.
        through: ``(h, w, 1)`` uint16, 0 (opaque) to 256 (clear).
    """

    colour: npt.NDArray[np.uint16]
    through: npt.NDArray[np.uint16]


def paste(image: Image, sprite: Sprite, row: int, col: int) -> None:
    """Lay a sprite over an image in place, its top-left corner at the pixel; what lies outside is cut off."""
    height, width = sprite.colour.shape[:2]
    top, left = max(row, 0), max(col, 0)
    bottom, right = min(row + height, image.shape[0]), min(col + width, image.shape[1])
    if top >= bottom or left >= right:
        return
    inside = (slice(top - row, bottom - row), slice(left - col, right - col))
    under = image[top:bottom, left:right]
    under[...] = sprite.colour[inside] + (under * sprite.through[inside] >> 8)


class Canvas:
    """A sheet of ``size x size * tall`` pixels on which one unit is ``size`` pixels, origin top left, y down.

    Args:
        size: Pixels of one unit in the finished sprite.
        wide: Width in units.
        tall: Height in units.
    """

    def __init__(self, size: int, *, wide: float = 1.0, tall: float = 1.0) -> None:
        self._pygame = load_pygame()
        self._factor = max(4, math.ceil(_FINE / size))
        self._unit = size * self._factor
        self._pixels = (max(1, round(wide * size)), max(1, round(tall * size)))
        self._sheet = self._new_sheet()

    def _new_sheet(self) -> Any:
        size = tuple(side * self._factor for side in self._pixels)
        return self._pygame.Surface(size, self._pygame.SRCALPHA, 32)

    def _shape(self, colour: str, opacity: float, draw: Callable[[Any, tuple[int, ...]], object]) -> None:
        ink = (*rgb(colour), round(255 * opacity))
        if opacity >= 1:
            draw(self._sheet, ink)
            return
        layer = self._new_sheet()  # pygame's shapes replace pixels; only laying sheets over one another blends
        draw(layer, ink)
        self._sheet.blit(layer, (0, 0))

    def _pixel(self, point: Point) -> tuple[float, float]:
        return point[0] * self._unit, point[1] * self._unit

    def circle(self, x: float, y: float, radius: float, colour: str, opacity: float = 1.0) -> None:
        """A filled circle."""
        self.ellipse(x, y, radius, radius, colour, opacity)

    def ellipse(self, x: float, y: float, rx: float, ry: float, colour: str, opacity: float = 1.0) -> None:
        """A filled ellipse with the given half-axes."""
        steps = [2 * math.pi * i / 64 for i in range(64)]
        self.polygon([(x + rx * math.cos(a), y + ry * math.sin(a)) for a in steps], colour, opacity)

    def rectangle(
        self, x: float, y: float, wide: float, tall: float, colour: str, opacity: float = 1.0, *, radius: float = 0.0
    ) -> None:
        """A filled rectangle, its corners rounded by ``radius`` units."""
        left, top = (round(v) for v in self._pixel((x, y)))
        right, bottom = (round(v) for v in self._pixel((x + wide, y + tall)))
        box, corner = (left, top, right - left, bottom - top), round(radius * self._unit)
        draw = self._pygame.draw.rect
        self._shape(colour, opacity, lambda sheet, ink: draw(sheet, ink, box, border_radius=corner))

    def polygon(self, points: Iterable[Point], colour: str, opacity: float = 1.0) -> None:
        """A filled polygon."""
        pixels = [self._pixel(point) for point in points]
        draw = self._pygame.draw.polygon
        self._shape(colour, opacity, lambda sheet, ink: draw(sheet, ink, pixels))

    def stroke(self, points: Sequence[Point], width: float, colour: str, opacity: float = 1.0) -> None:
        """A line through the points with round joints and ends."""
        pixels, half = [self._pixel(point) for point in points], width * self._unit / 2
        draw = self._pygame.draw

        def ink_line(sheet: Any, ink: tuple[int, ...]) -> None:
            for (x0, y0), (x1, y1) in itertools.pairwise(pixels):
                length = math.hypot(x1 - x0, y1 - y0) or 1.0
                dx, dy = (y1 - y0) / length * half, -(x1 - x0) / length * half
                draw.polygon(
                    sheet, ink, [(x0 + dx, y0 + dy), (x1 + dx, y1 + dy), (x1 - dx, y1 - dy), (x0 - dx, y0 - dy)]
                )
            for x, y in pixels:
                draw.circle(sheet, ink, (x, y), half)

        self._shape(colour, opacity, ink_line)

    def arc(
        self,
        x: float,
        y: float,
        radius: float,
        turns: tuple[float, float],
        width: float,
        colour: str,
        opacity: float = 1.0,
    ) -> None:
        """Part of a ring, from and to in turns clockwise from the top."""
        self.stroke(points_of_arc(x, y, radius, turns), width, colour, opacity)

    def sprite(self) -> Sprite:
        """The finished sprite: every pixel the average of the finer ones under it."""
        wide, tall = self._pixels
        raw = np.frombuffer(self._pygame.image.tobytes(self._sheet, "RGBA"), np.uint8)
        sheet = raw.reshape(tall, self._factor, wide, self._factor, 4)
        colour, through = np.empty((tall, wide, 3), np.uint16), np.empty((tall, wide, 1), np.uint16)
        for top in range(0, tall, _BAND):  # a band at a time: a whole page in floating point would be large
            band = slice(top, top + _BAND)
            fine = sheet[band].astype(np.float64)
            alpha = fine[..., 3:]
            colour[band] = np.rint((fine[..., :3] * alpha / 255).mean(axis=(1, 3)))
            through[band] = np.floor((1 - alpha.mean(axis=(1, 3)) / 255) * 256)
        return Sprite(colour, through)


def text_sprite(text: str, size: int, colour: str) -> Sprite:
    """One line of text in pygame's built-in typeface, about ``size`` pixels high; see :func:`drawable`."""
    return _text_sprite(drawable(text), size, colour)


def drawable(text: str) -> str:
    """A text that can be drawn: what is not seen is written out, and what no picture has room for is cut off."""
    seen = printable(text[: LONGEST_LINE + 1])
    return seen if len(seen) <= LONGEST_LINE else seen[: LONGEST_LINE - 1] + "…"


@lru_cache(maxsize=1024)
def _text_sprite(text: str, size: int, colour: str) -> Sprite:
    pygame = load_pygame()
    if not pygame.font.get_init():
        pygame.font.init()
    factor = 3
    sheet = pygame.font.Font(None, max(4, size) * factor).render(text, True, (255, 255, 255))
    raw = np.frombuffer(pygame.image.tobytes(sheet, "RGBA"), np.uint8).reshape(sheet.get_height(), sheet.get_width(), 4)
    alpha = raw[..., 3].astype(np.float64)
    alpha = np.pad(alpha, ((0, -alpha.shape[0] % factor), (0, -alpha.shape[1] % factor)))
    rows, cols = alpha.shape[0] // factor, alpha.shape[1] // factor
    opacity = alpha.reshape(rows, factor, cols, factor).mean(axis=(1, 3))[..., None] / 255
    ink = np.array(rgb(colour), np.float64)
    return Sprite(np.rint(opacity * ink).astype(np.uint16), np.floor((1 - opacity) * 256).astype(np.uint16))


def points_of_arc(x: float, y: float, radius: float, turns: tuple[float, float]) -> list[Point]:
    """Points along part of a circle, from and to in turns clockwise from the top."""
    count = max(3, math.ceil(abs(turns[1] - turns[0]) * 72) + 1)
    angles = [2 * math.pi * (turns[0] + (turns[1] - turns[0]) * i / (count - 1)) for i in range(count)]
    return [(x + radius * math.sin(a), y - radius * math.cos(a)) for a in angles]
