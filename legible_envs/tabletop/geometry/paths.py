"""Shortest paths of the hand on a table, from anywhere to every goal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.tabletop.geometry.path_kernels import batch_free, batch_lengths, batch_nearest_free, batch_paths
from legible_envs.tabletop.geometry.visibility_kernels import corners_between, grow, keep_corners, path_tables

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["ShortestPaths"]

Floats = npt.NDArray[np.float64]


class ShortestPaths:
    """Exact shortest paths of a point among grown obstacles, by a visibility graph built once.

    :class:`~legible_envs.tabletop.layout.TabletopLayout` says where the hand may be. Where several paths are equally
    short, one of them is returned, always the same.

    Args:
        goals: ``(n, 2)`` points.
        obstacles: ``(m, 5)`` rows ``(x, y, angle, length, width)``, not grown.
        hand: Half the hand's width in metres.
        size: ``(width, depth)`` of the table in metres.
        names: Names of the goals; their numbers if None.

    Attributes:
        boxes: ``(m, 6)`` the grown obstacles: ``(x, y, cos, sin, half length, half width)``.
        corners: ``(k, 2)`` corners a path may bend at.
    """

    def __init__(
        self,
        goals: npt.ArrayLike,
        obstacles: npt.ArrayLike = (),
        hand: float = 0.025,
        size: tuple[float, float] = (1.2, 0.8),
        names: tuple[str, ...] | None = None,
    ) -> None:
        self.goals = _points(goals, "goals")
        self.names = tuple(str(i) for i in range(len(self.goals))) if names is None else names
        self.size = (float(size[0]), float(size[1]))
        rows = np.asarray(obstacles, dtype=np.float64).reshape(-1, 5)
        self.boxes = np.empty((len(rows), 6))
        for (x, y, angle, length, width), box in zip(rows.tolist(), self.boxes, strict=True):
            grow(x, y, angle, length, width, hand, box)
        corners = np.empty((4 * len(rows), 2))
        count = keep_corners(self.boxes, self.size, corners)
        self.corners = corners[:count].copy()
        self._between = np.empty((count, count))
        corners_between(self.boxes, self.corners, count, self._between)
        self._lengths = np.empty((len(self.goals), count))
        path_tables(self.boxes, self.corners, count, self._between, self.goals, self._lengths)

    @classmethod
    def of(
        cls, layout: TabletopLayout, goals: npt.ArrayLike | None = None, names: tuple[str, ...] | None = None
    ) -> ShortestPaths:
        """The paths on a layout, to given points; to all its objects, by their names, if None."""
        if goals is None:
            goals, names = layout.centres, layout.goals
        rows = [(*o.at, o.angle, *o.size) for o in layout.obstacles]
        return cls(goals, rows, layout.table.hand, layout.table.size, names)

    @property
    def tables(self) -> Floats:
        """``(n, k)`` length of the shortest path from each of :attr:`corners` to every goal; not to be written to."""
        return self._lengths

    def is_free(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """``(k,)`` whether the hand's centre may be at each of ``(k, 2)`` points."""
        return batch_free(self.boxes, self.size, _points(points, "points"))

    def nearest_free(self, points: npt.ArrayLike) -> Floats:
        """``(k, 2)`` the free point nearest to each of ``(k, 2)`` points, itself where it is free.

        A point off the table is first moved to the nearest one on it. NaN where obstacles cover the whole table.
        """
        return batch_nearest_free(self.boxes, self.size, _points(points, "points"))

    def lengths(self, points: npt.ArrayLike) -> Floats:
        """``(k, n)`` metres from each of ``(k, 2)`` points to every goal; inf where there is no path.

        There is no path from a point that is not free, nor to a goal that is not.
        """
        return batch_lengths(self.boxes, self.size, self.corners, self.goals, self._lengths, _points(points, "points"))

    def polylines(self, start: npt.ArrayLike) -> list[Floats | None]:
        """The ``(j, 2)`` points of a shortest path from a point to every goal, both ends included; None for no path."""
        paths, counts = batch_paths(
            self.boxes,
            self.size,
            self.corners,
            self._between,
            self.goals,
            self._lengths,
            _points(np.asarray(start, dtype=np.float64)[None], "start")[0],
        )
        return [path[:count].copy() if count else None for path, count in zip(paths, counts, strict=True)]

    def polyline(self, start: npt.ArrayLike, goal: int | str) -> Floats:
        """The ``(j, 2)`` points of a shortest path from a point to one goal, by name or number.

        Raises:
            LayoutError: There is no path, or no such goal.
        """
        if isinstance(goal, str):
            if goal not in self.names:
                raise LayoutError(f"no goal {goal!r}; goals: {list(self.names)}", rule="object")
            goal = self.names.index(goal)
        path = self.polylines(start)[goal]
        if path is None:
            raise LayoutError(f"no path from {start!r} to {self.names[goal]}", rule="reachable")
        return path


def _points(points: npt.ArrayLike, what: str) -> Floats:
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise LayoutError(
            f"{what} must be finite numbers of shape (k, 2), got shape {array.shape}"
            + (" with NaN or infinity" if array.ndim == 2 and array.shape[1] == 2 else ""),
            rule="point",
        )
    return array
