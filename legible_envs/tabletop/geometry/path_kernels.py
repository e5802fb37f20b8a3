"""Kernels that ask the tables of :mod:`.visibility_kernels` for many points or goals at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.geometry.visibility_kernels import (
    Floats,
    Ints,
    first_corner,
    is_free,
    nearest_free,
    write_path,
)

__all__ = ["batch_free", "batch_lengths", "batch_nearest_free", "batch_paths"]


@kernel
def batch_free(boxes: Floats, size: tuple[float, float], points: Floats) -> npt.NDArray[np.bool_]:
    """``[k]`` whether each of ``points [k, 2]`` is free."""
    free = np.empty(len(points), dtype=np.bool_)
    for k in range(len(points)):
        free[k] = is_free(boxes, points[k, 0], points[k, 1], size)
    return free


@kernel
def batch_nearest_free(boxes: Floats, size: tuple[float, float], points: Floats) -> Floats:
    """``[k, 2]`` the free point nearest to each of ``points [k, 2]``."""
    nearest = np.empty_like(points)
    for k in range(len(points)):
        x, y = nearest_free(boxes, size, points[k, 0], points[k, 1])
        nearest[k, 0] = x
        nearest[k, 1] = y
    return nearest


@kernel
def batch_lengths(
    boxes: Floats, size: tuple[float, float], corners: Floats, goals: Floats, tables: Floats, points: Floats
) -> Floats:
    """``[k, n]`` length of the shortest path from each of ``points [k, 2]`` to each of ``goals [n, 2]``."""
    lengths = np.full((len(points), len(goals)), np.inf)
    for g in range(len(goals)):
        if is_free(boxes, goals[g, 0], goals[g, 1], size):
            for k in range(len(points)):
                x, y = points[k, 0], points[k, 1]
                if is_free(boxes, x, y, size):
                    lengths[k, g] = first_corner(
                        boxes, corners, len(corners), tables[g], x, y, goals[g, 0], goals[g, 1]
                    )[0]
    return lengths


@kernel
def batch_paths(
    boxes: Floats,
    size: tuple[float, float],
    corners: Floats,
    between: Floats,
    goals: Floats,
    tables: Floats,
    start: Floats,
) -> tuple[Floats, Ints]:
    """Shortest paths from ``start [2]`` to each of ``goals [n, 2]``.

    Returns:
        ``paths [n, corners + 2, 2]`` and how many points each has; 0 where there is no path.
    """
    paths = np.empty((len(goals), len(corners) + 2, 2))
    counts = np.zeros(len(goals), dtype=np.int64)
    if is_free(boxes, start[0], start[1], size):
        for g in range(len(goals)):
            if is_free(boxes, goals[g, 0], goals[g, 1], size):
                length, first = first_corner(
                    boxes, corners, len(corners), tables[g], start[0], start[1], goals[g, 0], goals[g, 1]
                )
                if length < np.inf:
                    counts[g] = write_path(
                        boxes, corners, len(corners), between, tables[g], first, start, goals[g], paths[g]
                    )
    return paths, counts
