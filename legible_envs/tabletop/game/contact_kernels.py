"""Kernels: objects on a table that must neither overlap nor leave it, and the hand among them.

A solver of impulses lets fast bodies sink into one another. These kernels look at the poses that it found, move objects
apart that overlap, and put back to where they were a moment ago those for which there is no room.

Objects are rectangles: ``positions [n, 2]``, ``angles [n]``, ``halves [n, 2]`` (half length, half width) and
``kinds [n]``: :data:`AWAY`, :data:`LOOSE` or :data:`FIXED`. The hand is a circle of ``radius`` at ``hand``, up and out
of the way where ``radius`` is negative.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["AWAY", "FIXED", "LIFTED", "LOOSE", "MOVED", "TOLERANCE", "TOUCH", "UP", "find_room", "keep_apart"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

AWAY, LOOSE, FIXED = 0, 1, 2

TOLERANCE = 2e-4
"""Metres that two things may overlap: twice what the solver needs to know that they touch."""
TOUCH = 1e-4
"""Metres that two things overlap which were moved apart."""
ROUNDS = 40
UP = -1.0

MOVED, LIFTED = 1, 2

RING = 0.01
DIRECTIONS = 24


# -- overlaps ----------------------------------------------------------------------------------------------------------


@kernel
def box_overlap(positions: Floats, angles: Floats, halves: Floats, i: int, j: int) -> tuple[float, float, float]:
    """How deep two rectangles overlap (negative: how far apart at least), and the direction that frees ``i`` soonest.

    Returns:
        Metres, and the unit vector ``(x, y)`` along which ``i`` leaves ``j`` (separating axes).
    """
    dx, dy = positions[i, 0] - positions[j, 0], positions[i, 1] - positions[j, 1]
    turn = angles[i] - angles[j]
    cos, sin = abs(np.cos(turn)), abs(np.sin(turn))
    best, best_x, best_y = np.inf, 1.0, 0.0
    for one, other in ((i, j), (j, i)):
        axis_x, axis_y = np.cos(angles[one]), np.sin(angles[one])
        for side in range(2):
            if side == 1:
                axis_x, axis_y = -axis_y, axis_x
            a, b = halves[other, side], halves[other, 1 - side]
            along = dx * axis_x + dy * axis_y
            depth = halves[one, side] + a * cos + b * sin - abs(along)
            if depth < best:
                sign = -1.0 if along < 0.0 else 1.0
                best, best_x, best_y = depth, sign * axis_x, sign * axis_y
    return best, best_x, best_y


@kernel
def hand_overlap(
    positions: Floats, angles: Floats, halves: Floats, i: int, hand: tuple[float, float], radius: float
) -> tuple[float, float, float]:
    """How deep the hand is in a rectangle, and the unit vector ``(x, y)`` along which the rectangle leaves it."""
    cos, sin = np.cos(angles[i]), np.sin(angles[i])
    rx, ry = hand[0] - positions[i, 0], hand[1] - positions[i, 1]
    u, v = rx * cos + ry * sin, ry * cos - rx * sin
    out_u, out_v = abs(u) - halves[i, 0], abs(v) - halves[i, 1]
    sign_u, sign_v = -1.0 if u < 0.0 else 1.0, -1.0 if v < 0.0 else 1.0
    if out_u <= 0.0 and out_v <= 0.0:
        if out_u > out_v:
            depth, push_u, push_v = radius - out_u, -sign_u, 0.0
        else:
            depth, push_u, push_v = radius - out_v, 0.0, -sign_v
    else:
        out_u, out_v = max(out_u, 0.0), max(out_v, 0.0)
        distance = np.sqrt(out_u * out_u + out_v * out_v)
        depth = radius - distance
        push_u, push_v = -sign_u * out_u / distance, -sign_v * out_v / distance
    return depth, push_u * cos - push_v * sin, push_u * sin + push_v * cos


@kernel
def are_near(positions: Floats, halves: Floats, i: int, j: int) -> bool:
    """Whether the circles round two rectangles meet."""
    dx, dy = positions[i, 0] - positions[j, 0], positions[i, 1] - positions[j, 1]
    reach = np.sqrt(halves[i, 0] ** 2 + halves[i, 1] ** 2) + np.sqrt(halves[j, 0] ** 2 + halves[j, 1] ** 2)
    return dx * dx + dy * dy <= reach * reach


@kernel
def keep_on_table(positions: Floats, angles: Floats, halves: Floats, i: int, size: tuple[float, float]) -> bool:
    """Move a rectangle onto the table by the shortest way; False where it is too long for the table as it is turned."""
    cos, sin = abs(np.cos(angles[i])), abs(np.sin(angles[i]))
    reach_x = halves[i, 0] * cos + halves[i, 1] * sin
    reach_y = halves[i, 0] * sin + halves[i, 1] * cos
    if reach_x > size[0] / 2 or reach_y > size[1] / 2:
        return False
    positions[i, 0] = min(max(positions[i, 0], reach_x), size[0] - reach_x)
    positions[i, 1] = min(max(positions[i, 1], reach_y), size[1] - reach_y)
    return True


@kernel
def has_place(positions: Floats, angles: Floats, halves: Floats, kinds: Ints, i: int) -> bool:
    """Whether an object overlaps no other."""
    for j in range(len(kinds)):
        if j != i and kinds[j] != AWAY and are_near(positions, halves, i, j):
            depth, _, _ = box_overlap(positions, angles, halves, i, j)
            if depth > TOLERANCE:
                return False
    return True


# -- moving apart ------------------------------------------------------------------------------------------------------


@kernel
def deepest(
    positions: Floats, angles: Floats, halves: Floats, kinds: Ints, hand: tuple[float, float], radius: float
) -> float:
    """The deepest overlap of a loose object with another, or of the hand with any; 0 if there is none."""
    worst = 0.0
    for i in range(len(kinds)):
        if kinds[i] == AWAY:
            continue
        if radius >= 0.0:
            depth, _, _ = hand_overlap(positions, angles, halves, i, hand, radius)
            worst = max(worst, depth)
        for j in range(i):
            if kinds[j] + kinds[i] < 2 * FIXED and kinds[j] != AWAY and are_near(positions, halves, i, j):
                depth, _, _ = box_overlap(positions, angles, halves, i, j)
                worst = max(worst, depth)
    return worst


@kernel
def push_apart(
    positions: Floats,
    angles: Floats,
    halves: Floats,
    kinds: Ints,
    size: tuple[float, float],
    hand: tuple[float, float],
    radius: float,
) -> None:
    """Move every overlapping pair apart once, the lighter further, and everything onto the table."""
    for i in range(len(kinds)):
        if kinds[i] == AWAY:
            continue
        if radius >= 0.0 and kinds[i] == LOOSE:
            depth, x, y = hand_overlap(positions, angles, halves, i, hand, radius)
            if depth > TOUCH:
                positions[i, 0] += x * (depth - TOUCH)
                positions[i, 1] += y * (depth - TOUCH)
        for j in range(i):
            if kinds[j] == AWAY or kinds[i] + kinds[j] == 2 * FIXED or not are_near(positions, halves, i, j):
                continue
            depth, x, y = box_overlap(positions, angles, halves, i, j)
            if depth > TOUCH:
                area, other = halves[i, 0] * halves[i, 1], halves[j, 0] * halves[j, 1]
                share = other / (area + other)
                if kinds[i] == FIXED:
                    share = 0.0
                elif kinds[j] == FIXED:
                    share = 1.0
                depth -= TOUCH
                positions[i, 0] += x * depth * share
                positions[i, 1] += y * depth * share
                positions[j, 0] -= x * depth * (1.0 - share)
                positions[j, 1] -= y * depth * (1.0 - share)
    for i in range(len(kinds)):
        if kinds[i] == LOOSE:
            keep_on_table(positions, angles, halves, i, size)


@kernel
def separate(
    positions: Floats,
    angles: Floats,
    halves: Floats,
    kinds: Ints,
    size: tuple[float, float],
    hand: tuple[float, float],
    radius: float,
) -> bool:
    """Move loose objects until nothing overlaps by more than :data:`TOLERANCE`; False where they stay jammed."""
    for _ in range(ROUNDS):
        if deepest(positions, angles, halves, kinds, hand, radius) <= TOLERANCE:
            return True
        push_apart(positions, angles, halves, kinds, size, hand, radius)
    return deepest(positions, angles, halves, kinds, hand, radius) <= TOLERANCE


@kernel
def put_back(
    positions: Floats, angles: Floats, halves: Floats, kinds: Ints, old: Floats, old_angles: Floats, stuck: Bools
) -> None:
    """Put loose objects that overlap back to old poses without overlaps, and those too that then overlap with them.

    Args:
        positions: Changed in place.
        angles: Likewise.
        halves: See the module.
        kinds: Likewise.
        old: ``[n, 2]`` positions without overlaps.
        old_angles: ``[n]``.
        stuck: ``[n]`` output: the objects that were put back are set.
    """
    found = True
    while found:
        found = False
        for i in range(len(kinds)):
            if kinds[i] == LOOSE and not stuck[i] and not has_place(positions, angles, halves, kinds, i):
                positions[i], angles[i], stuck[i], found = old[i], old_angles[i], True, True


@kernel
def keep_apart(
    positions: Floats,
    angles: Floats,
    halves: Floats,
    kinds: Ints,
    size: tuple[float, float],
    hand: tuple[float, float],
    radius: float,
    old: Floats,
    old_angles: Floats,
    furthest: float,
    stuck: Bools,
) -> int:
    """Correct what a solver found: no loose object overlaps with another by more than :data:`TOLERANCE`, none leaves.

    An object that moved further than ``furthest``, or is too long for the table as it is turned, is put back. Then
    objects are moved apart with the hand among them; where that fails the hand rises, and they are moved apart without
    it; where that fails too, those that overlap are put back.

    Args:
        positions: Changed in place.
        angles: Likewise.
        halves: See the module.
        kinds: Likewise.
        size: Of the table.
        hand: Its centre.
        radius: Of the hand; negative: it is up.
        old: ``[n, 2]`` positions a moment ago, as this function left them.
        old_angles: ``[n]``.
        furthest: Metres.
        stuck: ``[n]`` output: which were put back, and have no speed any more.

    Returns:
        The sum of :data:`MOVED`: poses were changed, and :data:`LIFTED`: the hand rises.
    """
    result = 0
    for i in range(len(kinds)):
        stuck[i] = False
        if kinds[i] != LOOSE:
            continue
        x, y, turn = positions[i, 0], positions[i, 1], abs(angles[i] - old_angles[i])
        dx, dy = x - old[i, 0], y - old[i, 1]
        moved = np.sqrt(dx * dx + dy * dy) + turn * np.sqrt(halves[i, 0] ** 2 + halves[i, 1] ** 2)
        # Not `moved > furthest`: that is False for NaN.
        if not moved <= furthest or not keep_on_table(positions, angles, halves, i, size):
            positions[i], angles[i], stuck[i] = old[i], old_angles[i], True
        if positions[i, 0] != x or positions[i, 1] != y or stuck[i]:
            result = MOVED
    if deepest(positions, angles, halves, kinds, hand, radius) <= TOLERANCE:
        return result
    result = MOVED
    there = positions.copy()
    if separate(positions, angles, halves, kinds, size, hand, radius):
        return result
    if radius >= 0.0:
        result += LIFTED
        positions[:] = there
        if separate(positions, angles, halves, kinds, size, hand, UP):
            return result
    positions[:] = there
    put_back(positions, angles, halves, kinds, old, old_angles, stuck)
    return result


# -- room to put something ---------------------------------------------------------------------------------------------


@kernel
def move_to_room(
    positions: Floats, angles: Floats, halves: Floats, kinds: Ints, size: tuple[float, float], i: int
) -> bool:
    """Move an object to a near point where it overlaps nothing, of those on rings round where it is; False if none."""
    x, y = positions[i, 0], positions[i, 1]
    for ring in range(1, int((size[0] + size[1]) / RING) + 1):
        for step in range(DIRECTIONS):
            angle = 2.0 * np.pi * step / DIRECTIONS
            positions[i, 0], positions[i, 1] = x + ring * RING * np.cos(angle), y + ring * RING * np.sin(angle)
            is_there = keep_on_table(positions, angles, halves, i, size)
            if is_there and has_place(positions, angles, halves, kinds, i):
                return True
    return False


@kernel
def find_room(
    positions: Floats, angles: Floats, halves: Floats, kinds: Ints, size: tuple[float, float], i: int
) -> bool:
    """Make room for an object that is put down: loose objects, it too if it is loose, are pushed aside.

    Where pushing does not help, an object that is in the way is moved to the nearest place with room.

    Args:
        positions: Changed in place.
        angles: See the module.
        halves: Likewise.
        kinds: Likewise.
        size: Of the table.
        i: The object put down.

    Returns:
        Whether nothing overlaps now; where False, positions are of no use.
    """
    nowhere = (0.0, 0.0)
    if kinds[i] == LOOSE and not keep_on_table(positions, angles, halves, i, size):
        return False
    there = positions.copy()
    if separate(positions, angles, halves, kinds, size, nowhere, UP):
        return True
    positions[:] = there
    if kinds[i] == LOOSE:
        return move_to_room(positions, angles, halves, kinds, size, i)
    for j in range(len(kinds)):
        is_in_the_way = kinds[j] == LOOSE and not has_place(positions, angles, halves, kinds, j)
        if is_in_the_way and not move_to_room(positions, angles, halves, kinds, size, j):
            return False
    return True
