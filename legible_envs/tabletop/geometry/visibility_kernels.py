"""Kernels: shortest paths of a point among oriented rectangles ("boxes") on a table.

A box is a row ``(x, y, cos, sin, half_length, half_width)``: an obstacle already grown by the hand. A point is free if
it lies on the table and outside the interior of every box; the boundary of a box is free. To make that exact in
floating point, a box *blocks* as if it were smaller by ``SHRINK`` = 1e-9 m on each side, while paths bend at its true
corners. A shortest path bends only at corners of boxes: where two boxes cross, and where a box meets the edge of the
table, the free region is reflex on the other side, so these points are never needed. Corners inside another box or off
the table are dropped.

Unused entries of the corner tables are never read: each kernel is told ``count``, the number of kept corners.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = [
    "SHRINK",
    "Floats",
    "block",
    "clear",
    "corners_between",
    "first_corner",
    "grow",
    "into_box",
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
    """Whether the straight line between two points touches the interior of no box (separating axes, no division)."""
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
def into_box(box: Floats, x: Floats, y: Floats, u: Floats, v: Floats) -> None:
    """Coordinates of points in the frame of a box."""
    cos, sin = box[2], box[3]
    for p in range(len(x)):
        dx, dy = x[p] - box[0], y[p] - box[1]
        u[p] = dx * cos + dy * sin
        v[p] = dy * cos - dx * sin


@kernel
def block(box: Floats, u: Floats, v: Floats, x: float, y: float, slack: Floats) -> None:
    """Raise ``slack`` of points (in the frame of a box) to at least 0 if the box blocks the line to ``(x, y)``.

    The three separating axes of ``clear``; without branches, so that it is vectorised.
    """
    cos, sin = box[2], box[3]
    a, b = box[4] - SHRINK, box[5] - SHRINK
    dx, dy = x - box[0], y - box[1]
    to_u, to_v = dx * cos + dy * sin, dy * cos - dx * sin
    for p in range(len(u)):
        mu, mv = 0.5 * (u[p] + to_u), 0.5 * (v[p] + to_v)
        du, dv = abs(0.5 * (to_u - u[p])), abs(0.5 * (to_v - v[p]))
        # |mu dv - mv du|, with the signs of the step
        cross = abs(mu * (0.5 * (to_v - v[p])) - mv * (0.5 * (to_u - u[p])))
        along, across, turned = a + du - abs(mu), b + dv - abs(mv), a * dv + b * du - cross
        least = along if along < across else across
        least = least if least < turned else turned
        slack[p] = least if least > slack[p] else slack[p]


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
    """Write straight distances of kept corners to ``between [4m, 4m]``; inf where a box blocks the line."""
    for i in range(count):
        between[i, i] = 0.0
        for j in range(i):
            distance = np.inf
            if clear(boxes, corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1]):
                distance = norm(corners[i, 0] - corners[j, 0], corners[i, 1] - corners[j, 1])
            between[i, j] = distance
            between[j, i] = distance


@kernel
def path_tables(boxes: Floats, corners: Floats, count: int, between: Floats, goals: Floats, lengths: Floats) -> None:
    """Shortest paths from the kept corners to every goal.

    Args:
        boxes: ``[m, 6]``.
        corners: ``[4m, 2]``.
        count: Kept corners.
        between: ``[4m, 4m]`` from :func:`corners_between`.
        goals: ``[n, 2]``.
        lengths: ``[n, 4m]`` out: length of the shortest path from each corner to each goal; inf where there is none.
    """
    x, y = corners[:count, 0].copy(), corners[:count, 1].copy()
    u, v, slack = np.empty((len(boxes), count)), np.empty((len(boxes), count)), np.empty(count)
    for i in range(len(boxes)):
        into_box(boxes[i], x, y, u[i], v[i])
    seen, hidden = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    for g in range(len(goals)):
        slack[:] = -1.0
        for i in range(len(boxes)):
            block(boxes[i], u[i], v[i], goals[g, 0], goals[g, 1], slack)
        num_seen, num_hidden = 0, 0
        for i in range(count):
            if slack[i] < 0.0:
                lengths[g, i] = norm(x[i] - goals[g, 0], y[i] - goals[g, 1])
                seen[num_seen] = i
                num_seen += 1
            else:
                lengths[g, i] = np.inf
                hidden[num_hidden] = i
                num_hidden += 1
        go_round(seen[:num_seen], hidden[:num_hidden], between, lengths[g])


@kernel
def go_round(seen: Ints, hidden: Ints, between: Floats, lengths: Floats) -> None:
    """Lengths of paths from corners that do not see the goal, by those that do and by one another.

    Few corners lie on a path: to repeat until nothing changes (Bellman and Ford) beats a queue.
    """
    for i in hidden:
        best = np.inf
        for j in seen:
            best = min(best, lengths[j] + between[j, i])
        lengths[i] = best
    changed = True
    while changed:
        changed = False
        for i in hidden:
            best = lengths[i]
            for j in hidden:
                best = min(best, lengths[j] + between[j, i])
            changed |= best < lengths[i]
            lengths[i] = best


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
        ``(length, corner)``; corner -1 where the path is straight, and length inf where there is none.
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
def write_path(
    boxes: Floats,
    corners: Floats,
    count: int,
    between: Floats,
    lengths: Floats,
    first: int,
    start: Floats,
    goal: Floats,
    path: Floats,
) -> int:
    """Write the points of a shortest path to ``path [4m + 2, 2]``; returns how many.

    Of equally short paths the one that goes straight on, then over the corner nearest to the goal, then over that of
    the lowest number.

    Args:
        boxes: ``[m, 6]``.
        corners: ``[4m, 2]``.
        count: Kept corners.
        between: ``[4m, 4m]`` from :func:`corners_between`.
        lengths: ``[4m]`` from each corner to the goal.
        first: The first corner, -1 for a straight path.
        start: ``[2]``.
        goal: ``[2]``.
        path: Out.
    """
    path[0] = start
    written = 1
    while first >= 0:
        path[written] = corners[first]
        written += 1
        if clear(boxes, corners[first, 0], corners[first, 1], goal[0], goal[1]):
            break
        first = next_corner(first, between, count, lengths)
    path[written] = goal
    return written + 1


@kernel
def next_corner(i: int, between: Floats, count: int, lengths: Floats) -> int:
    """The corner after ``i`` on a path of several; -1 if there is none. All corners nearer to the goal are compared."""
    best, found = np.inf, -1
    for j in range(count):
        if lengths[j] < lengths[i]:
            length = lengths[j] + between[j, i]
            if length < best or (length == best < np.inf and lengths[j] < lengths[found]):
                best, found = length, j
    return found


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
