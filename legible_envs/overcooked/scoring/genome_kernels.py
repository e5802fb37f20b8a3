"""Kernels that check and score kitchen genomes.

A genome is ``[slot of each station …, obstacle bit of each inner cell …]``. Slots number the border cells clockwise
from the top-left, corners left out; inner cells are numbered row by row.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.scoring.exact_kernels import BLOCKED, FREE, ScoreTables, make_scratch, score_cells
from legible_envs.support.compiled import kernel

__all__ = ["Genomes", "Geometry", "connected", "place_obstacles", "place_stations", "score_genomes", "valid_genomes"]


class Geometry(NamedTuple):
    """Where stations and obstacles may stand; ``N`` stations, ``M`` slots, ``I`` inner cells, flat cell indices.

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


Genomes = npt.NDArray[np.signedinteger[Any]]


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
