"""Kernels that draw random kitchen genomes and change them a little.

See :mod:`legible_envs.overcooked.scoring.genome_kernels` for the parts of a genome.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.scoring.exact_kernels import BLOCKED
from legible_envs.overcooked.scoring.genome_kernels import Genomes, Geometry, connected, place_obstacles
from legible_envs.support.compiled import kernel
from legible_envs.support.random_kernels import Bits, below, random

__all__ = ["perturb_genomes", "sample_genomes"]

MAX_TRIES = 1000
TRIES_PER_KIND = 50


@kernel
def draw_stations(bits: Bits, genome: Genomes, geometry: Geometry, access: npt.NDArray[np.int64]) -> bool:
    """Draw a slot for every station, any slot equally likely; False as soon as two draws break a rule."""
    num_stations, num_slots = geometry.allowed.shape
    for i in range(num_stations):
        slot = below(bits, num_slots)
        if not geometry.allowed[i, slot]:
            return False
        for j in range(i):
            if not geometry.compatible[slot, genome[j]]:
                return False
        genome[i] = slot
        access[i] = geometry.slot_access[slot]
    return True


@kernel
def sample_genomes(bits: Bits, genomes: Genomes, geometry: Geometry, obstacle_rate: float, max_tries: int) -> int:
    """Fill ``genomes [B, d]`` with random valid ones by rejecting whole layouts.

    Every station draws any slot and every inner cell is blocked with probability ``obstacle_rate``, independently; the
    first draw that obeys all rules is kept, so the result is that distribution conditioned on being valid.

    Returns:
        How many were found; fewer than asked only if ``max_tries`` draws in a row failed.
    """
    num_stations = len(geometry.allowed)
    floor = np.full(geometry.num_cells, BLOCKED, dtype=np.int32)
    access = np.empty(num_stations, dtype=np.int64)
    seen = np.empty(geometry.num_cells, dtype=np.bool_)
    stack = np.empty(geometry.num_cells, dtype=np.int64)
    for b in range(len(genomes)):
        genome = genomes[b]
        found = False
        for _ in range(max_tries):
            if not draw_stations(bits, genome, geometry, access):
                continue
            for i in range(len(geometry.inner)):
                genome[num_stations + i] = 1 if random(bits) < obstacle_rate else 0
            if place_obstacles(genome, geometry, floor) and connected(floor, geometry.stride, access, seen, stack):
                found = True
                break
        if not found:
            return b
    return len(genomes)


@kernel
def change(bits: Bits, genome: Genomes, kind: int, geometry: Geometry) -> int:
    """Try one random small change in place.

    Args:
        bits: Source of randomness.
        genome: ``[d]`` a valid genome.
        kind: 0 move a station to a free counter, 1 swap two stations, 2 add an obstacle, 3 remove one.
        geometry: Where stations and obstacles may stand.

    Returns:
        0: nothing was changed (the draw did not apply). 1: changed, and still connected if it was. 2: changed, and
        connections have to be checked.
    """
    num_stations, num_slots = geometry.allowed.shape
    if kind == 0:
        i = below(bits, num_stations)
        slot = below(bits, num_slots)
        if slot == genome[i] or not geometry.allowed[i, slot]:
            return 0
        for j in range(num_stations):
            if j != i and not geometry.compatible[slot, genome[j]]:
                return 0
        genome[i] = slot
        return 2
    if kind == 1:
        i = below(bits, num_stations)
        other = below(bits, num_stations)
        if i == other or not (geometry.allowed[i, genome[other]] and geometry.allowed[other, genome[i]]):
            return 0
        genome[i], genome[other] = genome[other], genome[i]
        return 1
    i = below(bits, len(geometry.inner))
    bit = num_stations + i
    if kind == 2 and genome[bit] == 0 and geometry.may_block[i]:
        genome[bit] = 1
        return 2
    if kind == 3 and genome[bit] == 1:
        genome[bit] = 0
        return 1
    return 0


@kernel
def perturb_genomes(bits: Bits, parents: Genomes, k: int, geometry: Geometry, children: Genomes) -> None:
    """Write ``k`` valid children of each of ``parents [B, d]`` to ``children [B * k, d]``, grouped by parent.

    Each child differs by one change: a station moved to a free counter, two stations swapped, an obstacle added, or
    one removed. The kind is drawn first, all equally likely, then its place until the kitchen is valid; a kind that
    finds no place in 50 draws is drawn anew. A parent of which no valid child is found repeats itself.
    """
    num_stations = len(geometry.allowed)
    floor = np.full(geometry.num_cells, BLOCKED, dtype=np.int32)
    access = np.empty(num_stations, dtype=np.int64)
    seen = np.empty(geometry.num_cells, dtype=np.bool_)
    stack = np.empty(geometry.num_cells, dtype=np.int64)
    for b in range(len(parents)):
        for n in range(b * k, (b + 1) * k):
            child = children[n]
            kind = 0
            for attempt in range(MAX_TRIES):
                if attempt % TRIES_PER_KIND == 0:
                    kind = below(bits, 4)
                child[:] = parents[b]
                outcome = change(bits, child, kind, geometry)
                if outcome == 0:
                    continue
                if outcome == 1:
                    break
                for i in range(num_stations):
                    access[i] = geometry.slot_access[child[i]]
                place_obstacles(child, geometry, floor)
                if connected(floor, geometry.stride, access, seen, stack):
                    break
                child[:] = parents[b]
