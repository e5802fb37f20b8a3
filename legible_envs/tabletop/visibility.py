"""Kernels: shortest paths of a point among oriented rectangles ("boxes") on a table.

A box is a row ``(x, y, cos, sin, half_length, half_width)``: an obstacle already grown by the hand. A point is free if
it lies on the table and outside the interior of every box; the boundary of a box is free. To make that exact in
floating point, a box *blocks* as if it were smaller by ``SHRINK`` = 1e-9 m on each side, while paths bend at its true
corners. A shortest path bends only at corners of boxes: where two boxes cross, and where a box meets the edge of the
table, the free region is reflex the other way, so these points are never needed. Corners inside another box or off the
table are dropped.

Unused entries of the corner tables are never read: each kernel is told ``count``, the number of kept corners.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.compiled import kernel

__all__ = [
    "SHRINK",
    "Floats",
    "clear",
    "corners_between",
    "first_corner",
    "grow",
    "is_free",
    "keep_corners",
    "nearest_free",
    "norm",
    "path_tables",
    "write_path",
]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

SHRINK = 1e-9


@kernel
def norm(dx: float, dy: float) -> float:
    """Length of a vector (a table is no place for overflow, so the plain formula does)."""
    return np.sqrt(dx * dx + dy * dy)


@kernel
def grow(x: float, y: float, angle: float, length: float, width: float, hand: float, box: Floats) -> None:
    """Write to ``box [6]`` an obstacle of ``length x width`` with ``hand`` added on each of its sides."""
    box[0] = x
    box[1] = y
    box[2] = np.cos(angle)
    box[3] = np.sin(angle)
    box[4] = 0.5 * length + hand
    box[5] = 0.5 * width + hand


@kernel
def inside(boxes: Floats, x: float, y: float) -> bool:
    """Whether a point lies in the interior of any of ``boxes [m, 6]``."""
    for i in range(len(boxes)):
        dx = x - boxes[i, 0]
        dy = y - boxes[i, 1]
        if (
            abs(dx * boxes[i, 2] + dy * boxes[i, 3]) <= boxes[i, 4] - SHRINK
            and abs(dy * boxes[i, 2] - dx * boxes[i, 3]) <= boxes[i, 5] - SHRINK
        ):
            return True
    return False


@kernel
def on_table(x: float, y: float, size: tuple[float, float]) -> bool:
    """Whether a point lies on the table of ``(width, depth)``, its edge included."""
    return -SHRINK <= x <= size[0] + SHRINK and -SHRINK <= y <= size[1] + SHRINK


@kernel
def is_free(boxes: Floats, x: float, y: float, size: tuple[float, float]) -> bool:
    """Whether the hand's centre may be here."""
    return on_table(x, y, size) and not inside(boxes, x, y)


@kernel
def clear(boxes: Floats, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the straight way between two points touches the interior of no box (separating axes, no division)."""
    mx, my = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    dx, dy = 0.5 * (x1 - x0), 0.5 * (y1 - y0)
    for i in range(len(boxes)):
        cos, sin = boxes[i, 2], boxes[i, 3]
        a, b = boxes[i, 4] - SHRINK, boxes[i, 5] - SHRINK
        rx, ry = mx - boxes[i, 0], my - boxes[i, 1]
        u, v = rx * cos + ry * sin, ry * cos - rx * sin
        du, dv = dx * cos + dy * sin, dy * cos - dx * sin
        if abs(u) <= a + abs(du) and abs(v) <= b + abs(dv) and abs(u * dv - v * du) <= a * abs(dv) + b * abs(du):
            return False
    return True


@kernel
def keep_corners(boxes: Floats, size: tuple[float, float], corners: Floats) -> int:
    """Write the corners of ``boxes [m, 6]`` a path may bend at to ``corners [4m, 2]``; returns how many."""
    count = 0
    for i in range(len(boxes)):
        cos, sin = boxes[i, 2], boxes[i, 3]
        for k in range(4):
            along = boxes[i, 4] if k == 1 or k == 2 else -boxes[i, 4]
            across = boxes[i, 5] if k >= 2 else -boxes[i, 5]
            x = boxes[i, 0] + along * cos - across * sin
            y = boxes[i, 1] + along * sin + across * cos
            if is_free(boxes, x, y, size):
                corners[count, 0] = x
                corners[count, 1] = y
                count += 1
    return count


@kernel
def corners_between(boxes: Floats, corners: Floats, count: int, between: Floats) -> None:
    """Write straight distances of kept corners to ``between [4m, 4m]``; inf where a box is in the way."""
    for i in range(count):
        between[i, i] = 0.0
        for j in range(i):
            distance = np.inf
            if clear(boxes, corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1]):
                distance = norm(corners[i, 0] - corners[j, 0], corners[i, 1] - corners[j, 1])
            between[i, j] = distance
            between[j, i] = distance


@kernel
def path_tables(
    boxes: Floats, corners: Floats, count: int, between: Floats, goals: Floats, lengths: Floats, after: Ints
) -> None:
    """Dijkstra from every goal over the kept corners.

    Args:
        boxes: ``[m, 6]``.
        corners: ``[4m, 2]``.
        count: Kept corners.
        between: ``[4m, 4m]`` from :func:`corners_between`.
        goals: ``[n, 2]``.
        lengths: ``[n, 4m]`` out: length of the shortest path from each corner to each goal; inf where there is none.
        after: ``[n, 4m]`` out: the next corner on it, -1 for the goal itself. Of equally short ways the one found
            first: straight on, then the corner nearest to the goal, then of the lowest number.
    """
    done = np.empty(len(corners), dtype=np.bool_)
    for g in range(len(goals)):
        best = lengths[g]
        x, y = goals[g, 0], goals[g, 1]
        for i in range(count):
            done[i] = False
            after[g, i] = -1
            best[i] = np.inf
            if clear(boxes, corners[i, 0], corners[i, 1], x, y):
                best[i] = norm(corners[i, 0] - x, corners[i, 1] - y)
        for _ in range(count):
            nearest = -1
            for i in range(count):
                if not done[i] and best[i] < np.inf and (nearest < 0 or best[i] < best[nearest]):
                    nearest = i
            if nearest < 0:
                break
            done[nearest] = True
            for i in range(count):
                length = best[nearest] + between[nearest, i]
                if length < best[i]:
                    best[i] = length
                    after[g, i] = nearest


@kernel
def first_corner(
    boxes: Floats, corners: Floats, count: int, lengths: Floats, x: float, y: float, goal_x: float, goal_y: float
) -> tuple[float, int]:
    """Length of the shortest path from a free point to one goal, and its first corner.

    Args:
        boxes: ``[m, 6]``.
        corners: ``[4m, 2]``.
        count: Kept corners.
        lengths: ``[4m]`` from each corner to the goal.
        x: Of the point.
        y: Of the point.
        goal_x: Of the goal.
        goal_y: Of the goal.

    Returns:
        ``(length, corner)``; corner -1 where the way is straight, and length inf where there is none.
    """
    if clear(boxes, x, y, goal_x, goal_y):
        return norm(goal_x - x, goal_y - y), -1
    best, first = np.inf, -1
    for i in range(count):
        length = norm(corners[i, 0] - x, corners[i, 1] - y) + lengths[i]
        if length < best and clear(boxes, x, y, corners[i, 0], corners[i, 1]):
            best, first = length, i
    return best, first


@kernel
def write_path(corners: Floats, after: Ints, first: int, start: Floats, goal: Floats, path: Floats) -> int:
    """Write the points of a shortest path to ``path [4m + 2, 2]``; returns how many.

    Args:
        corners: ``[4m, 2]``.
        after: ``[4m]`` next corner on the way to the goal.
        first: The first corner, -1 for a straight way.
        start: ``[2]``.
        goal: ``[2]``.
        path: Out.
    """
    path[0] = start
    count = 1
    while first >= 0:
        path[count] = corners[first]
        count += 1
        first = after[first]
    path[count] = goal
    return count + 1


@kernel
def consider(
    boxes: Floats, size: tuple[float, float], x: float, y: float, along: tuple[float, float], t: float, best: Floats
) -> None:
    """Keep in ``best [3]`` (distance, x, y) the nearest free point to ``best [3:5]`` seen so far."""
    px, py = x + t * along[0], y + t * along[1]
    distance = norm(px - best[3], py - best[4])
    if distance < best[0] and is_free(boxes, px, py, size):
        best[0] = distance
        best[1] = px
        best[2] = py


@kernel
def nearest_free(boxes: Floats, size: tuple[float, float], x: float, y: float) -> tuple[float, float]:
    """The free point nearest to a point (first put on the table); NaN where the boxes cover the whole table.

    The nearest free point to one inside boxes lies on a box's side: at the foot of the perpendicular, or where free
    pieces of that side end (a corner, a crossing with another box's side, the edge of the table).
    """
    x = min(max(x, 0.0), size[0])
    y = min(max(y, 0.0), size[1])
    if not inside(boxes, x, y):
        return x, y
    best = np.array([np.inf, np.nan, np.nan, x, y])
    for i in range(len(boxes)):
        for side in range(4):
            cos, sin = boxes[i, 2], boxes[i, 3]
            half, out = boxes[i, 4], boxes[i, 5]
            if side >= 2:  # a quarter turn
                cos, sin = -sin, cos
                half, out = out, half
            if side % 2:
                cos, sin = -cos, -sin
            middle_x, middle_y = boxes[i, 0] + out * sin, boxes[i, 1] - out * cos
            along = (cos, sin)
            foot = (x - middle_x) * cos + (y - middle_y) * sin
            consider(boxes, size, middle_x, middle_y, along, min(max(foot, -half), half), best)
            consider(boxes, size, middle_x, middle_y, along, -half, best)
            consider(boxes, size, middle_x, middle_y, along, half, best)
            # crossings with the table's edges and with the four lines that bound each other box
            for axis in range(2):
                speed = along[axis]
                if abs(speed) > 1e-12:
                    at = middle_x if axis == 0 else middle_y
                    for edge in (0.0, size[axis]):
                        t = (edge - at) / speed
                        if abs(t) <= half:
                            consider(boxes, size, middle_x, middle_y, along, t, best)
            for j in range(len(boxes)):
                if j != i:
                    for axis in range(2):
                        nx, ny = boxes[j, 2], boxes[j, 3]
                        reach = boxes[j, 4]
                        if axis == 1:
                            nx, ny = -ny, nx
                            reach = boxes[j, 5]
                        speed = cos * nx + sin * ny
                        if abs(speed) > 1e-12:
                            at = (middle_x - boxes[j, 0]) * nx + (middle_y - boxes[j, 1]) * ny
                            for edge in (-reach, reach):
                                t = (edge - at) / speed
                                if abs(t) <= half:
                                    consider(boxes, size, middle_x, middle_y, along, t, best)
    return best[1], best[2]
