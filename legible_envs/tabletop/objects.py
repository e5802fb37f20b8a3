"""The table, the boxes on it to reach for, and virtual obstacles: plain values, in metres."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.support.names import is_whole
from legible_envs.support.validation import entries, flag, is_real, real, shown

__all__ = [
    "CUBE",
    "FARTHEST",
    "LONGEST",
    "MAX_STARTS",
    "MOST_OBJECTS",
    "MOST_OBSTACLES",
    "OBSTACLE_SIZE",
    "Table",
    "TableObject",
    "VirtualObstacle",
    "rectangle",
    "rectangles_overlap",
]

CUBE: Final = 0.045
OBSTACLE_SIZE: Final = (0.30, 0.01)

MOST_OBJECTS: Final = 128
"""Objects of a table."""
MOST_OBSTACLES: Final = 64
"""Virtual obstacles of a table; shortest paths around them take time as their cube."""
_TOUCH: Final = 1e-9
LONGEST: Final = 100.0
"""Metres: of a side of the table, an object or an obstacle."""
MAX_STARTS: Final = 64
"""Places that reaches may start from."""
FARTHEST: Final = 1000.0
"""Metres from the corner of the table to anything."""

Point = tuple[float, float]


def numbers(value: Any, count: int, what: str, *, positive: bool = False) -> tuple[float, ...]:
    """``count`` finite numbers as a tuple.

    Raises:
        LayoutError: Another value; ``what`` says where.
    """
    found = entries(value) or [value]
    ok = len(found) == count and all(map(is_real, found))
    if not ok or (positive and min(found) <= 0):
        kind = "positive number" if positive else "finite number"
        raise LayoutError(f"{what} must be {count} {kind}{'s' if count > 1 else ''}, got {shown(value)}", rule="number")
    return tuple(float(v) for v in found)


def point(value: Any, what: str) -> Point:
    """A finite ``(x, y)``, not absurdly far away; see :func:`numbers`."""
    x, y = numbers(value, 2, what)
    if max(abs(x), abs(y)) > FARTHEST:
        raise LayoutError(f"{what} must be within {FARTHEST:g} m, got {shown(value)}", rule="number")
    return x, y


def lengths(value: Any, what: str, least: float = 0.0) -> Point:
    """A length and a width, neither zero nor absurdly large; see :func:`numbers`."""
    long, wide = numbers(value, 2, what, positive=True)
    if not least <= min(long, wide) <= max(long, wide) <= LONGEST:
        between = f"from {least:g} to {LONGEST:g} m" if least else f"at most {LONGEST:g} m"
        raise LayoutError(f"{what} must be {between}, got {shown(value)}", rule="number")
    return long, wide


def rectangle(x: float, y: float, angle: float, length: float, width: float) -> npt.NDArray[np.float64]:
    """``(4, 2)`` corners of an oriented rectangle, counter-clockwise; ``length`` lies along ``angle``."""
    along = np.array([math.cos(angle), math.sin(angle)]) * (length / 2)
    across = np.array([-math.sin(angle), math.cos(angle)]) * (width / 2)
    return np.array([x, y]) + np.array([-along - across, along - across, along + across, -along + across])


def rectangles_overlap(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> bool:
    """Whether two ``(4, 2)`` rectangles share more than their boundary (separating axes, touching up to 1e-9 m)."""
    for corners in (a, b):
        for edge in (corners[1] - corners[0], corners[3] - corners[0]):
            axis = edge / np.hypot(*edge)
            p, q = a @ axis, b @ axis
            if min(p.max(), q.max()) - max(p.min(), q.min()) <= _TOUCH:
                return False
    return True


def check_encodable(what: str, name: str) -> None:
    """Refuse half of a character (a lone surrogate), which no file and no terminal can hold."""
    if not is_whole(name):
        raise LayoutError(f"{what} holds half of a surrogate pair, which no text can: {name!r}", rule="name")


@dataclass(frozen=True, slots=True)
class TableObject:
    """A box that lies on the table; a person reaches for its centre.

    Attributes:
        name: Unique name; the goal's name in the task.
        at: ``(x, y)`` of its centre in metres.
        colour: Any CSS-like colour name.
        shape: The shape drawn on it, such as ``"circle"``.
        size: ``(length, width)`` in metres, at most 100; a cube of 4.5 cm by default.
        angle: Direction of its length in radians, counter-clockwise from the x-axis.
        movable: Whether a design may put it elsewhere.
    """

    name: str
    at: Point
    colour: str = "grey"
    shape: str = "square"
    size: Point = (CUBE, CUBE)
    angle: float = 0.0
    movable: bool = True

    def __post_init__(self) -> None:
        for attribute in ("name", "colour", "shape"):
            value = getattr(self, attribute)
            if not isinstance(value, str) or not value:
                raise LayoutError(f"an object's {attribute} must be a non-empty text, got {value!r}", rule="name")
            check_encodable(f"an object's {attribute}", value)
        what = f"object {self.name!r}: `"
        object.__setattr__(self, "at", point(self.at, what + "at`"))
        object.__setattr__(self, "size", lengths(self.size, what + "size`"))
        object.__setattr__(self, "angle", numbers(self.angle, 1, what + "angle`")[0])
        movable = flag(what + "movable`", self.movable, error=partial(LayoutError, rule="schema"))
        object.__setattr__(self, "movable", movable)

    @property
    def corners(self) -> npt.NDArray[np.float64]:
        """``(4, 2)`` corners."""
        return rectangle(*self.at, self.angle, *self.size)


@dataclass(frozen=True, slots=True)
class VirtualObstacle:
    """A projected barrier a hand does not cross: an oriented rectangle.

    Attributes:
        at: ``(x, y)`` of its centre in metres.
        angle: Direction of its length in radians, counter-clockwise from the x-axis.
        size: ``(length, width)`` in metres.
    """

    at: Point
    angle: float = 0.0
    size: Point = OBSTACLE_SIZE

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", point(self.at, "an obstacle's `at`"))
        object.__setattr__(self, "angle", numbers(self.angle, 1, "an obstacle's `angle`")[0])
        object.__setattr__(self, "size", lengths(self.size, "an obstacle's `size`"))

    @property
    def corners(self) -> npt.NDArray[np.float64]:
        """``(4, 2)`` corners, not grown."""
        return rectangle(*self.at, self.angle, *self.size)


@dataclass(frozen=True, slots=True)
class Table:
    """The table: where objects may lie, where they are built together, and where the hand starts.

    Attributes:
        size: ``(width, depth)`` in metres, from 0.01 to 100; the person sits at ``y = 0``.
        region: ``(x0, y0, x1, y1)`` in which centres of movable objects may lie.
        assembly: ``(x0, y0, x1, y1)`` of the assembly zone.
        starts: ``(x, y)`` of every place a reach may start from, by name.
        hand: Half the width of the hand in metres; obstacles are grown by it.
    """

    size: Point = (1.2, 0.8)
    region: tuple[float, float, float, float] = (0.10, 0.20, 0.80, 0.70)
    assembly: tuple[float, float, float, float] = (0.90, 0.20, 1.10, 0.70)
    starts: Mapping[str, Point] = field(default_factory=lambda: {"home": (0.60, 0.05), "assembly": (1.00, 0.45)})
    hand: float = 0.025

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", lengths(self.size, "the table's `size`", 0.01))
        for name in ("region", "assembly"):
            x0, y0, x1, y1 = numbers(getattr(self, name), 4, f"the table's `{name}`")
            if not (0 <= x0 < x1 <= self.size[0] and 0 <= y0 < y1 <= self.size[1]):
                raise LayoutError(
                    f"the table's `{name}` must be (x0, y0, x1, y1) with x0 < x1, y0 < y1 on a table of {self.size} m, "
                    f"got {getattr(self, name)!r}",
                    rule="table",
                )
            object.__setattr__(self, name, (x0, y0, x1, y1))
        if not isinstance(self.starts, Mapping) or not self.starts:
            raise LayoutError(f"the table's `starts` must name at least one point, got {self.starts!r}", rule="table")
        if len(self.starts) > MAX_STARTS:
            raise LayoutError(f"a table has at most {MAX_STARTS} `starts`, got {len(self.starts):,}", rule="table")
        starts = {str(name): point(at, f"start {name!r}") for name, at in self.starts.items()}
        for name in starts:
            check_encodable(f"the name of start {name!r}", name)
        for name, (x, y) in starts.items():
            if not (0 <= x <= self.size[0] and 0 <= y <= self.size[1]):
                raise LayoutError(f"start {name!r} at ({x:g}, {y:g}) is off the table of {self.size} m", rule="start")
        object.__setattr__(self, "starts", starts)
        hand = numbers(self.hand, 1, "the table's `hand`")[0]
        object.__setattr__(self, "hand", real("the table's `hand`", hand, 0, error=partial(LayoutError, rule="number")))

    def __hash__(self) -> int:
        return hash((self.size, self.region, self.assembly, tuple(self.starts.items()), self.hand))

    def to_dict(self) -> dict[str, Any]:
        """Plain data, the keyword arguments of this class."""
        return {
            "size": list(self.size),
            "region": list(self.region),
            "assembly": list(self.assembly),
            "starts": {name: list(at) for name, at in self.starts.items()},
            "hand": self.hand,
        }
