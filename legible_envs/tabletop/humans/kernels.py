"""Kernels of simulated reaches: the path of a hand with bow and rounded corners, and samples along it.

Grown obstacles are rows as in :mod:`.visibility_kernels`. A hand that ignores obstacles is given none.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.geometry.visibility_kernels import clear, norm

__all__ = ["LEG", "miss_goal", "path_length", "sample_reach", "trace_path"]

Floats = npt.NDArray[np.float64]
Bounds = tuple[float, float, float, float]

LEG = 32
"""Pieces that a leg, from one corner to the next, is made of."""


@kernel
def minimum_jerk(share: float) -> float:
    """Progress at a share of the time, both 0 to 1 (Flash and Hogan, 1985)."""
    return share * share * share * (10.0 - 15.0 * share + 6.0 * share * share)


@kernel
def path_length(path: Floats) -> float:
    """Length of a polyline ``[k, 2]``."""
    length = 0.0
    for k in range(1, len(path)):
        length += norm(path[k, 0] - path[k - 1, 0], path[k, 1] - path[k - 1, 1])
    return length


@kernel
def is_within(bounds: Bounds, x: float, y: float) -> bool:
    """Whether a point lies in ``(x0, y0, x1, y1)``."""
    return bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3]


@kernel
def miss_goal(boxes: Floats, bounds: Bounds, corners: Floats, dx: float, dy: float) -> Floats:
    """A copy of a path ``corners [j, 2]`` whose end is off by ``(dx, dy)``, by less where there is no room."""
    missed = corners.copy()
    last = len(corners) - 1
    share = 1.0
    for _ in range(6):
        x, y = corners[last, 0] + share * dx, corners[last, 1] + share * dy
        if is_within(bounds, x, y) and clear(boxes, corners[last - 1, 0], corners[last - 1, 1], x, y):
            missed[last, 0] = x
            missed[last, 1] = y
            break
        share *= 0.5
    return missed


@kernel
def bow_leg(corners: Floats, leg: int, bow: float, aim: float, path: Floats) -> None:
    """Write one bowed leg into ``path``: both ends, and ``LEG - 1`` points between.

    Args:
        corners: ``[j, 2]``.
        leg: Which one, from ``corners[leg]`` to ``corners[leg + 1]``.
        bow: Greatest deviation to the left, as a share of the leg's length.
        aim: The same of the part that bends to the other side in the second half.
        path: ``[(j - 1) * LEG + 1, 2]``.
    """
    x, y = corners[leg, 0], corners[leg, 1]
    dx, dy = corners[leg + 1, 0] - x, corners[leg + 1, 1] - y
    for k in range(LEG + 1):
        u = k / LEG
        aside = bow * np.sin(np.pi * u) + aim * np.sin(2.0 * np.pi * u) if 0 < k < LEG else 0.0
        path[leg * LEG + k, 0] = x + u * dx - aside * dy
        path[leg * LEG + k, 1] = y + u * dy + aside * dx


@kernel
def leg_is_clear(boxes: Floats, bounds: Bounds, leg: int, path: Floats) -> bool:
    """Whether a leg touches no grown obstacle and stays on the table."""
    for k in range(leg * LEG, (leg + 1) * LEG):
        if not clear(boxes, path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1]):
            return False
        if not is_within(bounds, path[k, 0], path[k, 1]):
            return False
    return True


@kernel
def clearance(boxes: Floats, hand: float, x: float, y: float) -> float:
    """Distance of a point to the nearest obstacle as it is drawn, not grown; inf without any."""
    least = np.inf
    for i in range(len(boxes)):
        dx, dy = x - boxes[i, 0], y - boxes[i, 1]
        u = abs(dx * boxes[i, 2] + dy * boxes[i, 3]) - (boxes[i, 4] - hand)
        v = abs(dy * boxes[i, 2] - dx * boxes[i, 3]) - (boxes[i, 5] - hand)
        least = min(least, norm(max(u, 0.0), max(v, 0.0)))
    return least


@kernel
def round_corner(boxes: Floats, hand: float, corners: Floats, corner: int, radius: float, path: Floats) -> None:
    """Round one corner of ``path`` where the hand's half-width leaves room, by a parabola from leg to leg.

    Grown obstacles have square corners; a round hand may cut them as long as it stays ``hand`` away from the obstacle.

    Args:
        boxes: ``[m, 6]``.
        hand: Half-width.
        corners: ``[j, 2]``.
        corner: Which one, 1 to j - 2.
        radius: How far from the corner rounding begins, in metres; at most half a leg. Halved until there is room.
        path: ``[(j - 1) * LEG + 1, 2]`` legs of :func:`bow_leg`; changed in place.
    """
    at = corner * LEG
    before = norm(corners[corner, 0] - corners[corner - 1, 0], corners[corner, 1] - corners[corner - 1, 1])
    after = norm(corners[corner + 1, 0] - corners[corner, 0], corners[corner + 1, 1] - corners[corner, 1])
    reach = min(radius, 0.5 * before, 0.5 * after)
    for _ in range(5):
        first = int(np.floor(LEG * reach / before)) if before > 0.0 else 0
        last = int(np.floor(LEG * reach / after)) if after > 0.0 else 0
        if first + last < 2:
            return
        rounded = np.empty((first + last + 1, 2))
        has_room = True
        for k in range(first + last + 1):
            v = 0.5 * k / first if k < first else 1.0 - 0.5 * (first + last - k) / max(last, 1)
            a, b, c = (1.0 - v) * (1.0 - v), 2.0 * v * (1.0 - v), v * v
            for axis in range(2):
                rounded[k, axis] = a * path[at - first, axis] + b * path[at, axis] + c * path[at + last, axis]
            has_room = has_room and clearance(boxes, hand, rounded[k, 0], rounded[k, 1]) >= hand
        if has_room:
            path[at - first : at + last + 1] = rounded
            return
        reach *= 0.5


@kernel
def trace_path(
    boxes: Floats, hand: float, bounds: Bounds, corners: Floats, bow: float, aim: float, radius: float, path: Floats
) -> None:
    """The intended path of a hand along a shortest one: each leg bowed where there is room, corners rounded.

    Args:
        boxes: ``[m, 6]`` grown obstacles.
        hand: Half-width, by which they are grown.
        bounds: ``(x0, y0, x1, y1)`` of the table.
        corners: ``[j, 2]`` the shortest path; both ends included.
        bow: Greatest deviation of each leg to the left, as a share of its length.
        aim: The same of the part that bends to the other side in the second half.
        radius: How far from a corner rounding begins, in metres.
        path: ``[(j - 1) * LEG + 1, 2]`` out.
    """
    for leg in range(len(corners) - 1):
        share = 1.0
        for _ in range(8):
            bow_leg(corners, leg, share * bow, share * aim, path)
            if leg_is_clear(boxes, bounds, leg, path):
                break
            share *= 0.6
        else:
            bow_leg(corners, leg, 0.0, 0.0, path)
    for corner in range(1, len(corners) - 1):
        round_corner(boxes, hand, corners, corner, radius, path)


@kernel
def crosses(boxes: Floats, hand: float, states: Floats) -> bool:
    """Whether ``states [T, 2]`` lead through an obstacle as it is drawn, not grown."""
    if len(boxes) == 0:
        return False
    drawn = boxes.copy()
    drawn[:, 4:] -= hand
    for k in range(1, len(states)):
        if not clear(drawn, states[k - 1, 0], states[k - 1, 1], states[k, 0], states[k, 1]):
            return True
    return False


@kernel
def sample_reach(
    boxes: Floats,
    hand: float,
    bounds: Bounds,
    path: Floats,
    skew: float,
    drift: float,
    keep: float,
    noise: float,
    draws: Floats,
    states: Floats,
) -> None:
    """Samples of a reach along a path, at regular times from its first to its last moment.

    Progress is ``mj(1 - (1 - t) ** skew)``. The hand is off the path by a first-order autoregressive drift that fades
    as the goal comes near, and by white noise. Where noise would lead through an obstacle it is halved, and left out
    at last.

    Args:
        boxes: ``[m, 6]`` grown obstacles.
        hand: Half-width, by which they are grown.
        bounds: ``(x0, y0, x1, y1)`` of the table, which the hand does not leave.
        path: ``[k, 2]``.
        skew: 1 is minimum jerk; more is earlier.
        drift: Standard deviation of the drift at the start, on each axis.
        keep: Correlation of the drift from sample to sample.
        noise: Standard deviation of the white noise, on each axis.
        draws: ``[2, T, 2]`` standard normal numbers.
        states: ``[T, 2]`` out.
    """
    along = np.zeros(len(path))
    for k in range(1, len(path)):
        along[k] = along[k - 1] + norm(path[k, 0] - path[k - 1, 0], path[k, 1] - path[k - 1, 1])
    count = len(states)
    share = 1.0
    for attempt in range(5):
        piece = 1
        dx, dy = draws[0, 0, 0], draws[0, 0, 1]
        for k in range(count):
            progress = minimum_jerk(1.0 - (1.0 - k / (count - 1)) ** skew)
            at = progress * along[-1]
            while piece < len(path) - 1 and along[piece] < at:
                piece += 1
            width = along[piece] - along[piece - 1]
            u = min(max((at - along[piece - 1]) / width, 0.0), 1.0) if width > 0.0 else 1.0
            if k > 0:
                fresh = np.sqrt(1.0 - keep * keep)
                dx = keep * dx + fresh * draws[0, k, 0]
                dy = keep * dy + fresh * draws[0, k, 1]
            off = share * drift * (1.0 - progress)
            x = path[piece - 1, 0] + u * (path[piece, 0] - path[piece - 1, 0]) + off * dx
            y = path[piece - 1, 1] + u * (path[piece, 1] - path[piece - 1, 1]) + off * dy
            x += share * noise * draws[1, k, 0]
            y += share * noise * draws[1, k, 1]
            states[k, 0] = min(max(x, bounds[0]), bounds[2])
            states[k, 1] = min(max(y, bounds[1]), bounds[3])
        if not crosses(boxes, hand, states):
            return
        share = 0.5 * share if attempt < 3 else 0.0
