"""Kernels on kitchen genomes: what is valid, random ones, and small changes.

A genome is ``[slot of each station …, obstacle bit of each inner cell …]``. Slots number the border cells clockwise
from the top-left, corners left out; inner cells are numbered row by row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.compiled import kernel
from legible_envs.overcooked.legibility import BLOCKED, FREE, ScoreTables, make_scratch, score_cells

__all__ = ["Geometry", "perturb_genomes", "sample_genomes", "score_genomes", "valid_genomes"]

MAX_TRIES = 1000
TRIES_PER_KIND = 50


class Geometry(NamedTuple):
    """Where things may stand; ``N`` stations, ``M`` slots, ``I`` inner cells, flat cell indices.

    Attributes:
        stride: Columns of the grid.
        num_cells: Cells of the grid.
        slot_access: ``[M]`` cell from which a station in the slot is used.
        allowed: ``[N, M]`` whether the station may stand in the slot.
        compatible: ``[M, M]`` whether two stations may stand in these slots together.
        inner: ``[I]`` cell of each obstacle bit.
        may_block: ``[I]`` whether an obstacle may lie there.
    """

    stride: int
    num_cells: int
    slot_access: npt.NDArray[np.int64]
    allowed: npt.NDArray[np.bool_]
    compatible: npt.NDArray[np.bool_]
    inner: npt.NDArray[np.int64]
    may_block: npt.NDArray[np.bool_]


Genomes = npt.NDArray[np.int8]


@kernel
def place_stations(genome: Genomes, geometry: Geometry, access: npt.NDArray[np.int64]) -> bool:
    """Write each station's access cell to ``access [N]``; False where stations stand where they may not."""
    num_stations, num_slots = geometry.allowed.shape
    for i in range(num_stations):
        slot = genome[i]
        if slot < 0 or slot >= num_slots or not geometry.allowed[i, slot]:
            return False
        for j in range(i):
            if not geometry.compatible[slot, genome[j]]:
                return False
        access[i] = geometry.slot_access[slot]
    return True


@kernel
def place_obstacles(genome: Genomes, geometry: Geometry, floor: npt.NDArray[np.int32]) -> bool:
    """Write free and blocked cells to ``floor [n]`` (border already blocked); False where a bit is not allowed."""
    num_stations = len(geometry.allowed)
    for i in range(len(geometry.inner)):
        bit = genome[num_stations + i]
        if bit == 0:
            floor[geometry.inner[i]] = FREE
        elif bit == 1 and geometry.may_block[i]:
            floor[geometry.inner[i]] = BLOCKED
        else:
            return False
    return True


@kernel
def connected(
    floor: npt.NDArray[np.int32],
    stride: int,
    access: npt.NDArray[np.int64],
    seen: npt.NDArray[np.bool_],
    stack: npt.NDArray[np.int64],
) -> bool:
    """Whether all access cells are free and mutually reachable."""
    for cell in access:
        if floor[cell] != FREE:
            return False
    seen[:] = False
    seen[access[0]] = True
    stack[0] = access[0]
    height = 1
    while height:
        height -= 1
        cell = stack[height]
        for offset in (-stride, stride, 1, -1):
            after = cell + offset
            if floor[after] == FREE and not seen[after]:
                seen[after] = True
                stack[height] = after
                height += 1
    for cell in access:
        if not seen[cell]:
            return False  # a loop, because the kernel compiler takes no generator expressions
    return True


@kernel
def valid_genomes(genomes: Genomes, geometry: Geometry, valid: npt.NDArray[np.bool_]) -> None:
    """Write to ``valid [B]`` which of ``genomes [B, d]`` obey every rule."""
    floor = np.full(geometry.num_cells, BLOCKED, dtype=np.int32)
    access = np.empty(len(geometry.allowed), dtype=np.int64)
    seen = np.empty(geometry.num_cells, dtype=np.bool_)
    stack = np.empty(geometry.num_cells, dtype=np.int64)
    for b in range(len(genomes)):
        valid[b] = (
            place_stations(genomes[b], geometry, access)
            and place_obstacles(genomes[b], geometry, floor)
            and connected(floor, geometry.stride, access, seen, stack)
        )


@kernel
def score_genomes(
    genomes: Genomes,
    geometry: Geometry,
    tables: ScoreTables,
    legibility: npt.NDArray[np.float64],
    distance: npt.NDArray[np.float64],
) -> None:
    """Score ``genomes [B, d]`` into ``legibility [B]`` and ``distance [B]``; NaN where a rule is broken."""
    floor = np.full(geometry.num_cells, BLOCKED, dtype=np.int32)
    access = np.empty(len(geometry.allowed), dtype=np.int64)
    scratch = make_scratch(geometry.num_cells, len(geometry.allowed), len(tables.goals))
    for b in range(len(genomes)):
        legibility[b] = np.nan
        distance[b] = np.nan
        if place_stations(genomes[b], geometry, access) and place_obstacles(genomes[b], geometry, floor):
            is_free = True
            for cell in access:
                is_free = is_free and floor[cell] == FREE
            if is_free:
                legibility[b], distance[b] = score_cells(floor, geometry.stride, access, tables, scratch)


@kernel
def draw_stations(genome: Genomes, geometry: Geometry, access: npt.NDArray[np.int64], rng: np.random.Generator) -> bool:
    """Draw a slot for every station, any slot equally likely; False as soon as two draws break a rule."""
    num_stations, num_slots = geometry.allowed.shape
    for i in range(num_stations):
        slot = rng.integers(0, num_slots)
        if not geometry.allowed[i, slot]:
            return False
        for j in range(i):
            if not geometry.compatible[slot, genome[j]]:
                return False
        genome[i] = slot
        access[i] = geometry.slot_access[slot]
    return True


@kernel
def sample_genomes(
    genomes: Genomes, geometry: Geometry, obstacle_rate: float, max_tries: int, rng: np.random.Generator
) -> int:
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
            if not draw_stations(genome, geometry, access, rng):
                continue
            for i in range(len(geometry.inner)):
                genome[num_stations + i] = 1 if rng.random() < obstacle_rate else 0
            if place_obstacles(genome, geometry, floor) and connected(floor, geometry.stride, access, seen, stack):
                found = True
                break
        if not found:
            return b
    return len(genomes)


@kernel
def change(genome: Genomes, kind: int, geometry: Geometry, rng: np.random.Generator) -> int:
    """Try one random small change in place.

    Args:
        genome: ``[d]`` a valid genome.
        kind: 0 move a station to a free counter, 1 swap two stations, 2 add an obstacle, 3 remove one.
        geometry: Where things may stand.
        rng: Source of randomness.

    Returns:
        0: nothing was changed (the draw did not apply). 1: changed, and still connected if it was. 2: changed, and
        connections have to be checked.
    """
    num_stations, num_slots = geometry.allowed.shape
    if kind == 0:
        i = rng.integers(0, num_stations)
        slot = rng.integers(0, num_slots)
        if slot == genome[i] or not geometry.allowed[i, slot]:
            return 0
        for j in range(num_stations):
            if j != i and not geometry.compatible[slot, genome[j]]:
                return 0
        genome[i] = slot
        return 2
    if kind == 1:
        i = rng.integers(0, num_stations)
        other = rng.integers(0, num_stations)
        if i == other or not (geometry.allowed[i, genome[other]] and geometry.allowed[other, genome[i]]):
            return 0
        genome[i], genome[other] = genome[other], genome[i]
        return 1
    i = rng.integers(0, len(geometry.inner))
    bit = num_stations + i
    if kind == 2 and genome[bit] == 0 and geometry.may_block[i]:
        genome[bit] = 1
        return 2
    if kind == 3 and genome[bit] == 1:
        genome[bit] = 0
        return 1
    return 0


@kernel
def perturb_genomes(parents: Genomes, k: int, geometry: Geometry, rng: np.random.Generator, children: Genomes) -> None:
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
                    kind = int(rng.integers(0, 4))
                child[:] = parents[b]
                outcome = change(child, kind, geometry, rng)
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
