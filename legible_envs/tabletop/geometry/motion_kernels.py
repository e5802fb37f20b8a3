"""Kernels: how a hand moves among virtual obstacles, which it crosses, and which objects it touches.

Boxes are rows ``(x, y, cos, sin, half_length, half_width)``, as in :mod:`.visibility_kernels`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.geometry.visibility_kernels import SHRINK, Floats, clear, inside, is_free, norm

__all__ = ["count_entered", "slide", "touch_distances"]

Bools = npt.NDArray[np.bool_]

TURNS = 8


@kernel
def slab(position: float, move: float, half: float) -> tuple[float, float]:
    """The part ``(enter, leave)`` of a move, as fractions of it, during which ``|position| < half``."""
    if move == 0.0:
        return (-np.inf, np.inf) if abs(position) < half else (np.inf, -np.inf)
    low = (-half - position) / move
    high = (half - position) / move
    return min(low, high), max(low, high)


@kernel
def first_contact(boxes: Floats, x: float, y: float, dx: float, dy: float) -> tuple[float, int, bool]:
    """When a point outside all ``boxes [m, 6]`` that moves by ``(dx, dy)`` first enters one.

    Returns:
        The fraction of the move (1 if it enters none), the box (-1), and whether through one of its short sides.
    """
    best, which, is_end = 1.0, -1, False
    for i in range(len(boxes)):
        cos, sin = boxes[i, 2], boxes[i, 3]
        rx, ry = x - boxes[i, 0], y - boxes[i, 1]
        u_in, u_out = slab(rx * cos + ry * sin, dx * cos + dy * sin, boxes[i, 4] - SHRINK)
        v_in, v_out = slab(ry * cos - rx * sin, dy * cos - dx * sin, boxes[i, 5] - SHRINK)
        enter, leave = max(u_in, v_in), min(u_out, v_out)
        if enter < leave and leave > 0.0 and enter < best:
            best, which, is_end = enter, i, u_in > v_in
    return best, which, is_end


@kernel
def on_side(boxes: Floats, i: int, is_end: bool, x: float, y: float) -> tuple[float, float]:
    """A point next to one side of a box, put exactly on it."""
    cos, sin = boxes[i, 2], boxes[i, 3]
    rx, ry = x - boxes[i, 0], y - boxes[i, 1]
    u, v = rx * cos + ry * sin, ry * cos - rx * sin
    if is_end:
        u = boxes[i, 4] if u > 0.0 else -boxes[i, 4]
    else:
        v = boxes[i, 5] if v > 0.0 else -boxes[i, 5]
    return boxes[i, 0] + u * cos - v * sin, boxes[i, 1] + u * sin + v * cos


@kernel
def slide(
    boxes: Floats, size: tuple[float, float], x: float, y: float, dx: float, dy: float
) -> tuple[float, float, bool]:
    """Where a free point ends that is moved by ``(dx, dy)``: it slides along ``boxes [m, 6]`` and the table's edge.

    The rest of the move at a contact goes on along the side touched, so the point never goes further than it was
    told to, and it always ends where it is free.

    Returns:
        ``x``, ``y``, and whether an obstacle or the edge stopped it.
    """
    was_stopped = False
    for _ in range(TURNS):
        to_x, to_y = min(max(x + dx, 0.0), size[0]), min(max(y + dy, 0.0), size[1])
        if to_x != x + dx or to_y != y + dy:
            was_stopped = True
            dx, dy = to_x - x, to_y - y
        part, which, is_end = first_contact(boxes, x, y, dx, dy)
        if which < 0:
            # Adding in place of `to_x` could leave the table by a rounding error.
            return (to_x, to_y, was_stopped) if is_free(boxes, to_x, to_y, size) else (x, y, True)
        was_stopped = True
        part = max(part, 0.0)
        near_x, near_y = on_side(boxes, which, is_end, x + part * dx, y + part * dy)
        if not is_free(boxes, near_x, near_y, size):  # a wedge: stop a hair before it
            part = max(part - 2.0 * SHRINK / norm(dx, dy), 0.0)
            near_x, near_y = x + part * dx, y + part * dy
            if not is_free(boxes, near_x, near_y, size):
                return x, y, True
        x, y = near_x, near_y
        cos, sin = boxes[which, 2], boxes[which, 3]
        along_x, along_y = (-sin, cos) if is_end else (cos, sin)
        left = (1.0 - part) * (dx * along_x + dy * along_y)
        dx, dy = left * along_x, left * along_y
    return x, y, True


@kernel
def count_entered(boxes: Floats, x0: float, y0: float, x1: float, y1: float) -> int:
    """Number of ``boxes [m, 6]`` that a straight move enters or passes through from outside."""
    count = 0
    for i in range(len(boxes)):
        one = boxes[i : i + 1]
        if not inside(one, x0, y0) and not clear(one, x0, y0, x1, y1):
            count += 1
    return count


@kernel
def touch_distances(
    positions: Floats, angles: Floats, half_sizes: Floats, x: float, y: float, distances: Floats
) -> None:
    """Write to ``distances [n]`` how far a point is from each of ``n`` rectangles; 0 inside."""
    for i in range(len(positions)):
        cos, sin = np.cos(angles[i]), np.sin(angles[i])
        rx, ry = x - positions[i, 0], y - positions[i, 1]
        u = max(abs(rx * cos + ry * sin) - half_sizes[i, 0], 0.0)
        v = max(abs(ry * cos - rx * sin) - half_sizes[i, 1], 0.0)
        distances[i] = norm(u, v)
