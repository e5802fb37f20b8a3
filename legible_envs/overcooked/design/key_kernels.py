"""Kernels that decode kitchens from random keys, so that every vector of keys is a valid kitchen."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.scoring.genome_kernels import Genomes, Geometry, connected, place_obstacles
from legible_envs.support.compiled import kernel

__all__ = ["decode_kitchens"]

Keys = npt.NDArray[np.float64]


@kernel
def nearest_slots(key: float, allowed: npt.NDArray[np.bool_], slots: npt.NDArray[np.int64]) -> int:
    """Write the allowed slots to ``slots [M]``, nearest to ``key * M - 0.5`` on the ring first; return how many."""
    num_slots = len(allowed)
    wanted = min(int(key * num_slots), num_slots - 1)
    step = 1 if key * num_slots - wanted >= 0.5 else -1
    count = 0
    for n in range(num_slots):
        away = (n + 1) // 2
        slot = (wanted + (step * away if n % 2 == 1 else -step * away)) % num_slots
        if allowed[slot]:
            slots[count] = slot
            count += 1
    return count


@kernel
def place_by_keys(
    keys: Keys,
    geometry: Geometry,
    order: npt.NDArray[np.int64],
    choices: npt.NDArray[np.int64],
    slots: npt.NDArray[np.int64],
) -> bool:
    """Give every station the slot nearest to its key that leaves room for the others, by depth-first search.

    Args:
        keys: ``[N + I]`` keys; the first ``N`` are used.
        geometry: Where stations and obstacles may stand.
        order: ``[N]`` the order in which stations are placed.
        choices: ``[N, M]`` scratch.
        slots: ``[N]`` output: the slot of each station.

    Returns:
        False if there is no room at all.
    """
    num_stations = len(order)
    counts = np.zeros(num_stations, dtype=np.int64)
    tried = np.zeros(num_stations, dtype=np.int64)
    for depth in range(num_stations):
        station = order[depth]
        counts[depth] = nearest_slots(keys[station], geometry.allowed[station], choices[depth])
    depth = 0
    while 0 <= depth < num_stations:
        placed = False
        while tried[depth] < counts[depth] and not placed:
            slot = choices[depth, tried[depth]]
            tried[depth] += 1
            placed = True
            for other in range(depth):
                if not geometry.compatible[slot, slots[order[other]]]:
                    placed = False
                    break
            if placed:
                slots[order[depth]] = slot
        if placed:
            depth += 1
            if depth < num_stations:
                tried[depth] = 0
        else:
            depth -= 1
    return depth == num_stations


@kernel
def decode_kitchens(keys: Keys, geometry: Geometry, order: npt.NDArray[np.int64], genomes: Genomes) -> bool:
    """Write the kitchens that ``keys [B, N + I]`` stand for to ``genomes [B, N + I]``.

    Stations come first (:func:`place_by_keys`). Then every inner cell whose key is above one half becomes an obstacle,
    the greatest key first, unless that would cut a station off.

    Returns:
        False if the stations find no room.
    """
    num_stations, num_slots = geometry.allowed.shape
    num_inner = len(geometry.inner)
    floor = np.full(geometry.num_cells, -2, dtype=np.int32)
    access = np.empty(num_stations, dtype=np.int64)
    slots = np.empty(num_stations, dtype=np.int64)
    choices = np.empty((num_stations, num_slots), dtype=np.int64)
    seen = np.empty(geometry.num_cells, dtype=np.bool_)
    stack = np.empty(geometry.num_cells, dtype=np.int64)
    for b in range(len(keys)):
        if not place_by_keys(keys[b], geometry, order, choices, slots):
            return False
        genome = genomes[b]
        for i in range(num_stations):
            genome[i] = slots[i]
            access[i] = geometry.slot_access[slots[i]]
        # Most often all obstacles can lie at once; only where they cannot is each tried for itself.
        for i in range(num_inner):
            genome[num_stations + i] = keys[b, num_stations + i] > 0.5 and geometry.may_block[i]
        place_obstacles(genome, geometry, floor)
        if connected(floor, geometry.stride, access, seen, stack):
            continue
        genome[num_stations:] = 0
        place_obstacles(genome, geometry, floor)
        by_key = np.argsort(-keys[b, num_stations:])
        for i in by_key[:num_inner]:
            if keys[b, num_stations + i] <= 0.5:
                break
            if not geometry.may_block[i]:
                continue
            floor[geometry.inner[i]] = -2
            if connected(floor, geometry.stride, access, seen, stack):
                genome[num_stations + i] = 1
            else:
                floor[geometry.inner[i]] = -1
    return True
