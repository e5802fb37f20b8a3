"""Kernels that make any genome of a table valid, changing it as little as they find a way to."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.design.genome_kernels import half_turn
from legible_envs.tabletop.design.validity_kernels import (
    EDGE,
    Room,
    Rules,
    make_room,
    obstacle_allowed,
    on_table,
    place,
    too_close,
    ways_allowed,
)
from legible_envs.tabletop.geometry.visibility_kernels import Floats, norm

__all__ = ["settle_tables"]


@kernel
def has_room(rules: Rules, points: Floats, i: int, placed: npt.NDArray[np.bool_]) -> bool:
    """Whether object ``i`` lies on the table and apart from those of ``placed [n]``."""
    if not on_table(points[i, 0], points[i, 1], rules.shapes[i], rules.size):
        return False
    for j in range(len(rules.shapes)):
        if placed[j] and not (rules.fixed[i] and rules.fixed[j]) and too_close(rules, points, i, j):
            return False
    return True


@kernel
def least_move(rules: Rules, points: Floats, i: int, placed: npt.NDArray[np.bool_]) -> float:
    """A length that object ``i`` must move at least to be ``object_spacing`` away from those of ``placed [n]``."""
    least = 0.0
    for j in range(len(rules.shapes)):
        if placed[j] and not (rules.fixed[i] and rules.fixed[j]):
            distance = norm(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1])
            least = max(least, rules.object_spacing - distance - 2.0 * EDGE)
    return least


@kernel
def settle_objects(
    genome: Floats, rules: Rules, room: Room, moves: Floats, anchor: Floats, placed: npt.NDArray[np.bool_]
) -> None:
    """Move objects of a genome, in their order, to the nearest place with room for them.

    Args:
        genome: ``[d]``, changed in place.
        rules: What is valid.
        room: Scratch.
        moves: ``[K, 3]`` steps along x and y from where an object should lie, and their lengths, the shortest first;
            the first is no step at all.
        anchor: ``[d]`` a valid genome: its objects all stay where one finds no room.
        placed: ``[n]`` scratch.
    """
    points, lower, upper = room.points, rules.lower, rules.upper
    points[:] = rules.template
    placed[:] = True
    for k in range(len(rules.movable)):
        placed[rules.movable[k]] = False
    for k in range(len(rules.movable)):
        i, x, y = rules.movable[k], genome[2 * k], genome[2 * k + 1]
        points[i, 0], points[i, 1] = x, y
        found = has_room(rules, points, i, placed)
        if not found:
            for m in range(np.searchsorted(moves[:, 2], least_move(rules, points, i, placed)), len(moves)):
                points[i, 0], points[i, 1] = x + moves[m, 0], y + moves[m, 1]
                inside_x = lower[2 * k] <= points[i, 0] <= upper[2 * k]
                inside_y = lower[2 * k + 1] <= points[i, 1] <= upper[2 * k + 1]
                if inside_x and inside_y:
                    found = has_room(rules, points, i, placed)
                    if found:
                        break
        if not found:
            genome[: 2 * len(rules.movable)] = anchor[: 2 * len(rules.movable)]
            return
        genome[2 * k], genome[2 * k + 1] = points[i, 0], points[i, 1]
        placed[i] = True


@kernel
def settle_obstacles(genome: Floats, wanted: Floats, rules: Rules, room: Room, shifts: Floats) -> None:
    """Lay the wanted obstacles on a valid genome without any, each at the nearest pose that keeps it valid.

    Args:
        genome: ``[d]``, valid and without obstacles; changed in place.
        wanted: ``[d]`` the genome whose obstacles are wanted.
        rules: What is valid.
        room: Scratch.
        shifts: ``[K, 3]`` steps and turns from a wanted pose, the smallest first; the first changes nothing. An
            obstacle with none that is valid is left out.
    """
    first = 2 * len(rules.movable)
    to = first
    for at in range(first, len(genome), 4):
        if wanted[at] <= 0.5:
            continue
        for m in range(len(shifts)):
            genome[to] = 1.0
            genome[to + 1] = wanted[at + 1] + shifts[m, 0]
            genome[to + 2] = wanted[at + 2] + shifts[m, 1]
            genome[to + 3] = wanted[at + 3]
            if shifts[m, 2] != 0.0:
                genome[to + 3] = half_turn(wanted[at + 3] + shifts[m, 2])
            inside_x = rules.lower[to + 1] <= genome[to + 1] <= rules.upper[to + 1]
            inside_y = rules.lower[to + 2] <= genome[to + 2] <= rules.upper[to + 2]
            if not (inside_x and inside_y):
                continue
            # objects and the obstacles before are valid already; the cheap half of the rules comes first
            count = place(genome, rules, room)
            if obstacle_allowed(rules, room.points, room.boxes, count - 1) and ways_allowed(rules, room, count):
                to += 4
                break
        genome[to : to + 4] = 0.0


@kernel
def settle_tables(wanted: Floats, rules: Rules, moves: Floats, shifts: Floats, anchor: Floats, genomes: Floats) -> None:
    """Write a valid genome near each of ``wanted [B, d]``, which lie within their bounds, to ``genomes [B, d]``.

    Objects come first (:func:`settle_objects`), then obstacles (:func:`settle_obstacles`), packed into the first places
    with ``active`` 1 and zeros after them. A wanted genome that is valid stays as it is but for that.
    """
    room = make_room(rules)
    placed = np.empty(len(rules.shapes), dtype=np.bool_)
    first = 2 * len(rules.movable)
    for b in range(len(wanted)):
        genome = genomes[b]
        genome[:first] = wanted[b, :first]
        genome[first:] = 0.0
        settle_objects(genome, rules, room, moves, anchor, placed)
        settle_obstacles(genome, wanted[b], rules, room, shifts)
