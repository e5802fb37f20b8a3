"""Kernels on genomes of tables: random ones, and small changes.

A genome is ``[x, y of each movable object …, (active, x, y, angle) of each place for an obstacle …]``. Obstacles fill
the places from the first on; unused places are zeros.
"""

from __future__ import annotations

import numpy as np

from legible_envs.support.compiled import kernel
from legible_envs.support.random_kernels import Bits, below, normal, random, uniform
from legible_envs.tabletop.design.validity_kernels import Room, Rules, make_room, obeys
from legible_envs.tabletop.geometry.visibility_kernels import Floats

__all__ = ["OBJECTS", "OBSTACLES", "TURN_SD", "perturb_genomes", "sample_objects", "sample_obstacles"]

OBJECTS = 0
OBSTACLES = 1
TURN_SD = np.pi / 6
SWAP_SHARE = 0.2
MORE_SHARE = 0.35
MAX_TRIES = 1000
TRIES_PER_KIND = 50


@kernel
def sample_objects(bits: Bits, genomes: Floats, rules: Rules, max_tries: int) -> int:
    """Fill ``genomes [B, d]`` with random valid arrangements without obstacles, by rejecting whole arrangements.

    Every movable object draws its centre uniformly from the region; the first draw that obeys all rules is kept, so the
    result is that distribution conditioned on being valid.

    Returns:
        How many were found; fewer than asked only if ``max_tries`` draws in a row failed.
    """
    room = make_room(rules)
    for b in range(len(genomes)):
        genome = genomes[b]
        genome[:] = 0.0
        found = False
        for _ in range(max_tries):
            for i in range(2 * len(rules.movable)):
                genome[i] = uniform(bits, rules.lower[i], rules.upper[i])
            if obeys(genome, rules, room):
                found = True
                break
        if not found:
            return b
    return len(genomes)


@kernel
def sample_obstacles(bits: Bits, genomes: Floats, rules: Rules, max_tries: int) -> None:
    """Lay random obstacles on ``genomes [B, d]`` that have none: 0 to all places, each number equally likely.

    Each is proposed as by :func:`add_obstacle` until the table is valid; a table that has no room for one more after
    ``max_tries`` proposals stays as it is.
    """
    room = make_room(rules)
    places = (genomes.shape[1] - 2 * len(rules.movable)) // 4
    before = np.empty(genomes.shape[1])
    for b in range(len(genomes)):
        for _ in range(below(bits, places + 1)):
            before[:] = genomes[b]
            for _ in range(max_tries):
                add_obstacle(bits, genomes[b], rules, room)
                if obeys(genomes[b], rules, room):
                    break
                genomes[b] = before


@kernel
def count_obstacles(genome: Floats, first: int) -> int:
    """Number of obstacles of a genome whose places begin at gene ``first``."""
    count = 0
    for i in range(first, len(genome), 4):
        count += genome[i] > 0.5
    return count


@kernel
def pack_obstacles(genome: Floats, first: int) -> None:
    """Move obstacles to the first places, keeping their order, and clear the rest."""
    to = first
    for i in range(first, len(genome), 4):
        if genome[i] > 0.5:
            genome[to] = 1.0
            genome[to + 1 : to + 4] = genome[i + 1 : i + 4]
            to += 4
    genome[to:] = 0.0


@kernel
def half_turn(angle: float) -> float:
    """The same direction of an obstacle, in [-pi/2, pi/2]."""
    return min(max(angle - np.pi * np.round(angle / np.pi), -0.5 * np.pi), 0.5 * np.pi)


@kernel
def change_objects(bits: Bits, genome: Floats, rules: Rules, step_sd: float) -> bool:
    """Swap two objects, or move one or a few by a Gaussian step; False where the draw does not apply."""
    n = len(rules.movable)
    if random(bits) < SWAP_SHARE:
        i, j = below(bits, n), below(bits, n)
        for axis in range(2):
            a, b = 2 * i + axis, 2 * j + axis
            genome[a], genome[b] = genome[b], genome[a]
        return i != j
    while True:
        i = 2 * below(bits, n)
        genome[i] += normal(bits, 0.0, step_sd)
        genome[i + 1] += normal(bits, 0.0, step_sd)
        if random(bits) >= MORE_SHARE:
            return True


@kernel
def add_obstacle(bits: Bits, genome: Floats, rules: Rules, room: Room) -> bool:
    """Lay one more obstacle across the line between two random objects; False where there is no place for it."""
    n = len(rules.shapes)
    i, j = below(bits, n), below(bits, n)
    first = 2 * len(rules.movable)
    at = first + 4 * count_obstacles(genome, first)
    if i == j or at >= len(genome):
        return False
    points = room.points
    for k in range(len(rules.movable)):
        points[rules.movable[k], 0] = genome[2 * k]
        points[rules.movable[k], 1] = genome[2 * k + 1]
    share = random(bits)
    dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
    genome[at] = 1.0
    genome[at + 1] = points[i, 0] + share * dx
    genome[at + 2] = points[i, 1] + share * dy
    genome[at + 3] = half_turn(np.arctan2(dx, -dy))
    return True


@kernel
def change_obstacles(bits: Bits, genome: Floats, kind: int, rules: Rules, room: Room, step_sd: float) -> bool:
    """Add (``kind`` 0), remove (1), nudge (2) or turn (3) an obstacle; False where the draw does not apply."""
    if kind == 0:
        return add_obstacle(bits, genome, rules, room)
    first = 2 * len(rules.movable)
    count = count_obstacles(genome, first)
    if count == 0:
        return False
    at = first + 4 * below(bits, count)
    if kind == 1:
        genome[at] = 0.0
        pack_obstacles(genome, first)
    elif kind == 2:
        genome[at + 1] += normal(bits, 0.0, step_sd)
        genome[at + 2] += normal(bits, 0.0, step_sd)
    else:
        genome[at + 3] = half_turn(genome[at + 3] + normal(bits, 0.0, TURN_SD))
    return True


@kernel
def perturb_genomes(
    bits: Bits, parents: Floats, k: int, what: int, rules: Rules, step_sd: float, children: Floats
) -> None:
    """Write ``k`` valid children of each of ``parents [B, d]`` to ``children [B * k, d]``, grouped by parent.

    Args:
        bits: Source of randomness.
        parents: Valid genomes.
        k: Children of each.
        what: ``OBJECTS``: two swap places (one child in five), or one or a few move: one, then with probability .35
            one more, and so on, each by a Gaussian step of ``step_sd`` along either axis. ``OBSTACLES``: one is added,
            removed, nudged by such a step, or turned by a Gaussian angle of 30 degrees; the kind is drawn first, all
            equally likely, then its place until the table is valid.
        rules: What is valid.
        step_sd: Standard deviation of a step in metres.
        children: Out. A kind that finds no valid change in 50 draws is drawn anew; a parent of which no valid child is
            found in 1,000 draws repeats itself.
    """
    room = make_room(rules)
    first = 2 * len(rules.movable)
    for b in range(len(parents)):
        for n in range(b * k, (b + 1) * k):
            child = children[n]
            kind = 0
            for attempt in range(MAX_TRIES):
                if attempt % TRIES_PER_KIND == 0:
                    kind = below(bits, 4)
                child[:] = parents[b]
                pack_obstacles(child, first)
                if what == OBJECTS:
                    is_changed = change_objects(bits, child, rules, step_sd)
                else:
                    is_changed = change_obstacles(bits, child, kind, rules, room, step_sd)
                if is_changed and obeys(child, rules, room):
                    break
                child[:] = parents[b]
