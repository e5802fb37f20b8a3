"""The same drawings as vectors: shapes drawn on a sheet in unit coordinates, written as elements of SVG.

What draws on a :class:`~legible_envs.drawing.canvas.Canvas` draws on a :class:`SvgCanvas` too, so that pages show what
pictures show.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Final, Protocol

from legible_envs.drawing.canvas import Point, points_of_arc

__all__ = ["UNIT", "Pen", "SvgCanvas"]

UNIT: Final = 1000
"""Side of a unit in the coordinates of SVG, which are whole numbers."""


class Pen(Protocol):
    """What drawings need of a sheet; lengths in units, y down, colours as ``#rrggbb``."""

    def circle(self, x: float, y: float, radius: float, colour: str, opacity: float = 1.0) -> None:
        """A filled circle."""

    def ellipse(self, x: float, y: float, rx: float, ry: float, colour: str, opacity: float = 1.0) -> None:
        """A filled ellipse with the given half-axes."""

    def rectangle(
        self, x: float, y: float, wide: float, tall: float, colour: str, opacity: float = 1.0, *, radius: float = 0.0
    ) -> None:
        """A filled rectangle, its corners rounded by ``radius`` units."""

    def polygon(self, points: Iterable[Point], colour: str, opacity: float = 1.0) -> None:
        """A filled polygon."""

    def stroke(self, points: Sequence[Point], width: float, colour: str, opacity: float = 1.0) -> None:
        """A line through the points with round joints and ends."""

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


class SvgCanvas:
    """A sheet that keeps every shape as an element; :attr:`elements` is what was drawn, the first at the bottom.

    Example:
        >>> canvas = SvgCanvas()
        >>> canvas.circle(0.5, 0.5, 0.25, "#ffffff", 0.5)
        >>> canvas.symbol("dot")
        '<symbol id="dot" viewBox="0 0 1000 1000"><circle cx="500" cy="500" r="250" fill="#fff" opacity=".5"/></symbol>'
    """

    def __init__(self) -> None:
        self.elements: list[str] = []

    def _add(self, shape: str, paint: str, opacity: float) -> None:
        clear = "" if opacity >= 1 else f' opacity="{f"{opacity:.3g}".removeprefix("0")}"'
        self.elements.append(f"<{shape} {paint}{clear}/>")

    def circle(self, x: float, y: float, radius: float, colour: str, opacity: float = 1.0) -> None:
        """A filled circle."""
        self._add(f'circle cx="{_at(x)}" cy="{_at(y)}" r="{_at(radius)}"', _fill(colour), opacity)

    def ellipse(self, x: float, y: float, rx: float, ry: float, colour: str, opacity: float = 1.0) -> None:
        """A filled ellipse with the given half-axes."""
        self._add(f'ellipse cx="{_at(x)}" cy="{_at(y)}" rx="{_at(rx)}" ry="{_at(ry)}"', _fill(colour), opacity)

    def rectangle(
        self, x: float, y: float, wide: float, tall: float, colour: str, opacity: float = 1.0, *, radius: float = 0.0
    ) -> None:
        """A filled rectangle, its corners rounded by ``radius`` units."""
        corner = f' rx="{_at(min(radius, wide / 2, tall / 2))}"' if radius else ""
        shape = f'rect x="{_at(x)}" y="{_at(y)}" width="{_at(wide)}" height="{_at(tall)}"{corner}'
        self._add(shape, _fill(colour), opacity)

    def polygon(self, points: Iterable[Point], colour: str, opacity: float = 1.0) -> None:
        """A filled polygon."""
        self._add(f'path d="{_path(list(points))}Z"', _fill(colour), opacity)

    def stroke(self, points: Sequence[Point], width: float, colour: str, opacity: float = 1.0) -> None:
        """A line through the points with round joints and ends."""
        ends = 'stroke-linecap="round" stroke-linejoin="round"'
        paint = f'fill="none" stroke="{_short(colour)}" stroke-width="{_at(width)}" {ends}'
        self._add(f'path d="{_path(points)}"', paint, opacity)

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

    def symbol(self, name: str, tall: float = 1.0) -> str:
        """What was drawn as a ``<symbol>`` one unit wide and ``tall`` high, to be shown by ``<use href="#name">``."""
        return f'<symbol id="{name}" viewBox="0 0 {UNIT} {_at(tall)}">{"".join(self.elements)}</symbol>'


def _at(length: float) -> int:
    return round(length * UNIT)


def _path(points: Sequence[Point]) -> str:
    """A path through points: the first as it is, the others as steps, which are shorter to write."""
    pixels = [(_at(x), _at(y)) for x, y in points]
    steps = [f"{b[0] - a[0]} {b[1] - a[1]}" for a, b in itertools.pairwise(pixels)]
    return f"M{pixels[0][0]} {pixels[0][1]}l{' '.join(steps)}".replace(" -", "-")


def _fill(colour: str) -> str:
    return f'fill="{_short(colour)}"'


def _short(colour: str) -> str:
    """``#rrggbb`` as ``#rgb`` where that is the same colour."""
    return f"#{colour[1]}{colour[3]}{colour[5]}" if colour[1::2] == colour[2::2] else colour
