"""From metres on the table to pixels of a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from legible_envs.support.validation import integer
from legible_envs.tabletop.objects import Table

__all__ = ["Frame", "check_width"]

MOST_PIXELS: Final = 2**24
"""Of a picture; those of 4,096 pixels squared have as many."""


def check_width(width: int) -> int:
    """The width of a picture as given, if it can be drawn."""
    return integer("width", width, 120, 4096, unit="pixels")


@dataclass(frozen=True)
class Frame:
    """Where a table lies in a picture ``width`` pixels wide: a small margin round it, ``y = 0`` at the lower edge.

    Attributes:
        width: Pixels.
        size: ``(width, depth)`` of the table in metres.
    """

    width: int
    size: tuple[float, float]

    @classmethod
    def of(cls, table: Table, width: int) -> Frame:
        """The frame of a table.

        Raises:
            ValueError: A width out of range, or a table so narrow that the picture would be too high.
        """
        frame = cls(check_width(width), table.size)
        if frame.width * frame.height > MOST_PIXELS:
            raise ValueError(
                f"a picture {frame.width} pixels wide of a table of {table.size[0]:g} x {table.size[1]:g} m would be "
                f"{frame.height:,} pixels high; expected at most {MOST_PIXELS:,} pixels in all"
            )
        return frame

    @property
    def margin(self) -> int:
        """Pixels round the table."""
        return max(3, round(self.width * 0.018))

    @property
    def scale(self) -> float:
        """Pixels per metre."""
        return (self.width - 2 * self.margin) / self.size[0]

    @property
    def height(self) -> int:
        """Pixels."""
        return round(self.size[1] * self.scale) + 2 * self.margin

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """``(column, row)`` of a point on the table."""
        return self.margin + x * self.scale, self.height - self.margin - y * self.scale

    def unit(self, x: float, y: float) -> tuple[float, float]:
        """The same on a canvas on which one unit is the picture's width."""
        column, row = self.pixel(x, y)
        return column / self.width, row / self.width

    def length(self, metres: float) -> float:
        """Metres as a share of the picture's width."""
        return metres * self.scale / self.width
