"""The table as an immutable value: boxes to reach for and virtual obstacles on a table."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.support.text import read_source
from legible_envs.support.validation import integer
from legible_envs.tabletop.objects import (
    MOST_OBJECTS,
    MOST_OBSTACLES,
    OBSTACLE_SIZE,
    Table,
    TableObject,
    VirtualObstacle,
    rectangles_overlap,
)

if TYPE_CHECKING:
    from legible_envs.tabletop.geometry.paths import ShortestPaths
    from legible_envs.tabletop.layout_files import LayoutContent, TaskFileContent

__all__ = ["TabletopLayout"]

SCHEMA: Final = 1
MAX_OBSTACLES: Final = 4
"""Places for obstacles in a genome, unless another number is asked for."""
_EDGE: Final = 1e-9


class TabletopLayout:
    """Boxes and virtual obstacles on a table.

    A value: immutable, hashable, compared by content. All boxes and obstacles that can be drawn are admitted;
    :meth:`validate` says whether a person can work there, and the design rules of a search belong to the workspace.

    Points are ``(x, y)`` in metres, origin front-left as the person sits, ``x`` to the right, ``y`` away from them.
    A person reaches for the centre of an object, over other objects but never across an obstacle: the centre of the
    hand stays on the table and outside every obstacle *grown* by the hand's half-width, that is the rectangle with
    this much added on each of its four sides (its corners stay square, so at a corner the hand keeps up to
    ``sqrt(2)`` half-widths away). The boundary of a grown obstacle is free: a hand may slide along it, and fits
    through a gap of exactly its width.

    Args:
        objects: The boxes, at most 128; their names are the goals.
        obstacles: The virtual obstacles, at most 64.
        table: The table.

    Raises:
        LayoutError: No object at all, too many, or two of one name, or an object called like a start.

    Example:
        >>> layout = TabletopLayout([TableObject("cup", (0.6, 0.5))], [VirtualObstacle((0.6, 0.3))])
        >>> layout.validate()
        >>> layout.paths.lengths([(0.6, 0.05)]).round(3), layout.paths.polyline((0.6, 0.05), "cup").shape
        (array([[0.585]]), (4, 2))
    """

    __slots__ = ("__dict__", "_objects", "_obstacles", "_table")

    def __init__(
        self,
        objects: Iterable[TableObject],
        obstacles: Iterable[VirtualObstacle] = (),
        table: Table | None = None,
    ) -> None:
        self._objects = _at_most(MOST_OBJECTS, "objects", objects)
        self._obstacles = _at_most(MOST_OBSTACLES, "obstacles", obstacles)
        self._table = Table() if table is None else table
        for part, kind in [(o, TableObject) for o in self._objects] + [(o, VirtualObstacle) for o in self._obstacles]:
            if not isinstance(part, kind):
                raise LayoutError(f"expected a {kind.__name__}, got {part!r}", rule="type")
        names = [o.name for o in self._objects]
        repeated = sorted({n for n in names if names.count(n) > 1} | (set(names) & self._table.starts.keys()))
        if not names or repeated:
            raise LayoutError(
                f"objects need names that are unique and not those of starts; repeated: {repeated}"
                if names
                else "a layout needs at least one object",
                rule="name",
            )

    # -- content -------------------------------------------------------------------------------------------------------

    @property
    def objects(self) -> tuple[TableObject, ...]:
        """The boxes, in genome order."""
        return self._objects

    @property
    def obstacles(self) -> tuple[VirtualObstacle, ...]:
        """The virtual obstacles."""
        return self._obstacles

    @property
    def table(self) -> Table:
        """The table."""
        return self._table

    @property
    def goals(self) -> tuple[str, ...]:
        """Names of the objects, in order."""
        return tuple(o.name for o in self._objects)

    @cached_property
    def centres(self) -> npt.NDArray[np.float64]:
        """``(n, 2)`` read-only centres of the objects."""
        array = np.array([o.at for o in self._objects])
        array.setflags(write=False)
        return array

    @property
    def place_names(self) -> tuple[str, ...]:
        """Names of all places: the objects, then the table's starts."""
        return (*self.goals, *self._table.starts)

    @property
    def points(self) -> npt.NDArray[np.float64]:
        """``(n, 2)`` a new array of these places."""
        return np.array([*(o.at for o in self._objects), *self._table.starts.values()])

    def index(self, name: str) -> int:
        """Position of an object in :attr:`objects`.

        Raises:
            LayoutError: No object of this name lies here.
        """
        if name not in self.goals:
            raise LayoutError(f"no object {name!r}; this table has {list(self.goals)}", rule="object")
        return self.goals.index(name)

    def place(self, name: str) -> tuple[float, float]:
        """The point of a start or an object.

        Raises:
            LayoutError: Neither has this name.
        """
        if name in self._table.starts:
            return self._table.starts[name]
        return self._objects[self.index(name)].at

    @cached_property
    def paths(self) -> ShortestPaths:
        """Shortest paths of the hand from anywhere to every object (compiled on first use)."""
        from legible_envs.tabletop.geometry.paths import ShortestPaths

        return ShortestPaths.of(self)

    @cached_property
    def layout_id(self) -> str:
        """Twelve hexadecimal digits that identify the content."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()[:12]

    # -- whether a person can work here --------------------------------------------------------------------------------

    def validate(self) -> None:
        """Check whether a person can work at this table.

        Raises:
            LayoutError: ``rule`` is ``"region"`` (a movable object's centre outside the region), ``"table"`` (an object
                sticks out), ``"overlap"`` (two objects), ``"obstacle"`` (one lies over an object), ``"start"`` or
                ``"covered"`` (a start, or an object's centre, inside a grown obstacle), or ``"reachable"``.
        """
        self._check_objects()
        self._check_obstacles()
        self._check_paths()

    def is_valid(self) -> bool:
        """Whether :meth:`validate` passes."""
        try:
            self.validate()
        except LayoutError:
            return False
        return True

    def _check_objects(self) -> None:
        x0, y0, x1, y1 = self._table.region
        width, depth = self._table.size
        for obj in self._objects:
            x, y = obj.at
            if obj.movable and not (x0 - _EDGE <= x <= x1 + _EDGE and y0 - _EDGE <= y <= y1 + _EDGE):
                raise LayoutError(
                    f"{obj.name} at ({x:g}, {y:g}) lies outside the region x {x0:g}…{x1:g}, y {y0:g}…{y1:g}",
                    rule="region",
                )
            corners = obj.corners
            if (corners < -_EDGE).any() or (corners > np.array([width, depth]) + _EDGE).any():
                raise LayoutError(
                    f"{obj.name} at ({x:g}, {y:g}) sticks out of the table of {width:g} x {depth:g} m", rule="table"
                )
        corners_of = [obj.corners for obj in self._objects]
        reach = [math.hypot(*obj.size) / 2 for obj in self._objects]
        for i, a in enumerate(self._objects):
            for j in range(i):
                b = self._objects[j]
                is_near = math.dist(a.at, b.at) < reach[i] + reach[j]
                if is_near and rectangles_overlap(corners_of[i], corners_of[j]):
                    raise LayoutError(f"{b.name} at {b.at} and {a.name} at {a.at} overlap", rule="overlap")

    def _check_obstacles(self) -> None:
        for number, obstacle in enumerate(self._obstacles, 1):
            for obj in self._objects:
                if rectangles_overlap(obstacle.corners, obj.corners):
                    raise LayoutError(
                        f"obstacle {number} at {obstacle.at} lies over {obj.name} at {obj.at}", rule="obstacle"
                    )

    def _check_paths(self) -> None:
        if not self._obstacles:
            return
        hand = self._table.hand
        starts = list(self._table.starts)
        start_points = np.array([self._table.starts[name] for name in starts])
        for name, is_free in zip(starts, self.paths.is_free(start_points), strict=True):
            if not is_free:
                raise LayoutError(
                    f"start {name!r} at {self._table.starts[name]} lies inside an obstacle grown by the hand's "
                    f"half-width of {hand:g} m",
                    rule="start",
                )
        for obj, is_free in zip(self._objects, self.paths.is_free(self.centres), strict=True):
            if not is_free:
                raise LayoutError(
                    f"{obj.name} at {obj.at} lies inside an obstacle grown by the hand's half-width of {hand:g} m",
                    rule="covered",
                )
        lengths = self.paths.lengths(start_points)
        if np.isinf(lengths).any():
            s, g = (int(i) for i in np.argwhere(np.isinf(lengths))[0])
            raise LayoutError(
                f"{self._objects[g].name} at {self._objects[g].at} cannot be reached from {starts[s]!r}",
                rule="reachable",
            )

    # -- JSON ----------------------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Plain data that :meth:`from_dict` reads back to an equal layout."""
        return {
            "schema": SCHEMA,
            "table": self._table.to_dict(),
            "objects": [
                {
                    "name": o.name,
                    "at": list(o.at),
                    "colour": o.colour,
                    "shape": o.shape,
                    "size": list(o.size),
                    "angle": o.angle,
                    "movable": o.movable,
                }
                for o in self._objects
            ],
            "obstacles": [{"at": list(o.at), "angle": o.angle, "size": list(o.size)} for o in self._obstacles],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TabletopLayout:
        """Read plain data.

        Args:
            data: ``schema`` (1), ``objects`` and optionally ``obstacles`` and ``table``: lists of mappings with the
                attributes of :class:`~legible_envs.tabletop.objects.TableObject` and
                :class:`~legible_envs.tabletop.objects.VirtualObstacle`, and a mapping with those of
                :class:`~legible_envs.tabletop.objects.Table`.

        Raises:
            LayoutError: Another schema, missing or unknown keys, or values that the constructors reject.
        """
        from legible_envs.support.models import as_plain, validated
        from legible_envs.tabletop.layout_files import LayoutContent

        try:
            content = validated(LayoutContent, as_plain(data), "the layout")
        except ValueError as error:
            raise LayoutError(str(error), rule="schema") from error
        return cls.from_content(content)

    @classmethod
    def from_content(cls, content: LayoutContent | TaskFileContent) -> TabletopLayout:
        """The layout of a file that was checked.

        Raises:
            LayoutError: Values that the constructors reject.
        """
        objects = [TableObject(**entry.model_dump()) for entry in content.objects]
        obstacles = [VirtualObstacle(**entry.model_dump()) for entry in content.obstacles]
        return cls(objects, obstacles, Table(**content.table.model_dump(exclude_none=True)))

    def to_json(self, path: str | Path | None = None) -> str:
        """Return the layout as JSON text, and write it to ``path`` if given."""
        text = json.dumps(self.to_dict(), indent=1, ensure_ascii=False)
        if path is not None:
            Path(path).write_text(text + "\n", encoding="utf-8")
        return text

    @classmethod
    def from_json(cls, source: str | Path) -> TabletopLayout:
        """Read a JSON file (a ``Path``, or a string naming a ``.json`` file) or JSON text.

        Raises:
            LayoutError: Not JSON, or not a layout.
            FileNotFoundError: The file does not exist.
        """
        from legible_envs.support.plain_data import parse_json

        where = ""
        try:
            text, where = read_source(source, (".json",))
            return cls.from_dict(parse_json(text))
        except LayoutError as error:
            raise LayoutError(f"{where}{error}", rule=error.rule) from error
        except ValueError as error:
            raise LayoutError(f"{where}{error}", rule="schema") from error

    # -- genomes -------------------------------------------------------------------------------------------------------

    def to_genome(
        self, max_obstacles: int = MAX_OBSTACLES, obstacle_size: tuple[float, float] = OBSTACLE_SIZE
    ) -> npt.NDArray[np.float64]:
        """``float64[2n + 4m]``: centres of the ``n`` movable objects, then ``(active, x, y, angle)`` per obstacle.

        ``active`` is 1 or 0; unused places are all zeros.

        Raises:
            LayoutError: More than ``max_obstacles`` obstacles, or one of another size.
        """
        if any(o.size != tuple(obstacle_size) for o in self._obstacles):
            raise LayoutError(f"a genome holds obstacles of {tuple(obstacle_size)} m only", rule="obstacles")
        integer("max_obstacles", max_obstacles, 0, MOST_OBSTACLES)
        if len(self._obstacles) > max_obstacles:
            raise LayoutError(
                f"the layout has {len(self._obstacles)} obstacles, the genome holds {max_obstacles}", rule="obstacles"
            )
        centres = [x for o in self._objects if o.movable for x in o.at]
        rows = [x for o in self._obstacles for x in (1.0, *o.at, o.angle)]
        return np.array(centres + rows + [0.0] * (4 * (max_obstacles - len(self._obstacles))))

    def with_genome(
        self,
        genome: npt.ArrayLike,
        max_obstacles: int = MAX_OBSTACLES,
        obstacle_size: tuple[float, float] = OBSTACLE_SIZE,
    ) -> TabletopLayout:
        """The layout a genome describes on this table: movable objects put elsewhere, obstacles replaced.

        An obstacle is there where ``active > 0.5``.

        Raises:
            LayoutError: Wrong length, or numbers that are not finite, naming the entry.
        """
        array = np.asarray(genome, dtype=np.float64)
        num_movable = sum(o.movable for o in self._objects)
        length = 2 * num_movable + 4 * max_obstacles
        if array.shape != (length,):
            raise LayoutError(
                f"expected a genome of shape ({length},) for {num_movable} movable objects and {max_obstacles} "
                f"obstacles, got {array.shape}",
                rule="genome",
            )
        if not np.isfinite(array).all():
            i = int(np.flatnonzero(~np.isfinite(array))[0])
            raise LayoutError(f"entry {i} of the genome is {array[i]}; expected finite numbers", rule="genome")
        centres = iter([(x, y) for x, y in array[: 2 * num_movable].reshape(-1, 2).tolist()])
        objects = [replace(o, at=next(centres)) if o.movable else o for o in self._objects]
        obstacles = [
            VirtualObstacle((x, y), angle, obstacle_size)
            for active, x, y, angle in array[2 * num_movable :].reshape(-1, 4).tolist()
            if active > 0.5
        ]
        return TabletopLayout(objects, obstacles, self._table)

    def with_obstacles(self, obstacles: Iterable[VirtualObstacle]) -> TabletopLayout:
        """A copy with other obstacles."""
        return TabletopLayout(self._objects, obstacles, self._table)

    # -- value semantics -----------------------------------------------------------------------------------------------

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TabletopLayout):
            return NotImplemented
        return (self._objects, self._obstacles, self._table) == (other._objects, other._obstacles, other._table)

    def __hash__(self) -> int:
        return hash((self._objects, self._obstacles, self._table))

    def __repr__(self) -> str:
        return f"<TabletopLayout {self.layout_id}: {len(self._objects)} objects, {len(self._obstacles)} obstacles>"

    def __reduce__(self) -> tuple[object, ...]:
        return TabletopLayout, (self._objects, self._obstacles, self._table)

    def __setattr__(self, name: str, value: object) -> None:
        if name in ("_objects", "_obstacles", "_table") and not hasattr(self, name):
            object.__setattr__(self, name, value)
            return
        raise AttributeError(f"layouts are immutable; cannot set {name!r} (see with_genome and with_obstacles)")


def _at_most(most: int, what: str, parts: Iterable[Any]) -> tuple[Any, ...]:
    """The parts of a layout, of which no more are taken than it may have."""
    found = tuple(itertools.islice(parts, most + 1))
    if len(found) > most:
        raise LayoutError(f"a layout has at most {most} {what}, got more", rule=what)
    return found
