"""Kernels of the exact legibility score where cells differ in cost, such as costs learned from recorded trajectories.

Optimal trajectories may then differ in their number of steps, so they are counted by steps taken and steps left.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.scoring.exact_kernels import BLOCKED, FREE, ScoreTables
from legible_envs.overcooked.scoring.genome_kernels import Genomes, Geometry, connected, place_obstacles, place_stations
from legible_envs.support.compiled import kernel

__all__ = ["score_genomes_weighted"]

Floats = npt.NDArray[np.float64]


@kernel
def costs_to(
    floor: npt.NDArray[np.int32],
    stride: int,
    costs: Floats,
    target: int,
    best: Floats,
    order: npt.NDArray[np.int64],
    done: npt.NDArray[np.bool_],
) -> int:
    """Cost-to-go from every cell to one floor cell and on into its station (Dijkstra).

    Grids are small, so the next cell is found by looking through all of them.

    Args:
        floor: ``[n]`` -1 where a person can stand.
        stride: Columns of the grid.
        costs: ``[n]`` cost of stepping on each cell.
        target: Index of the station's access cell.
        best: ``[n]`` output, ``inf`` where there is no path; the last step into the station costs 1.
        order: ``[n]`` output: the cells reached, nearest first.
        done: ``[n]`` scratch.

    Returns:
        Number of cells reached.
    """
    best[:] = np.inf
    done[:] = False
    best[target] = 1.0
    reached = 0
    while True:
        cell = -1
        for i in range(len(best)):
            if not done[i] and best[i] < np.inf and (cell < 0 or best[i] < best[cell]):
                cell = i
        if cell < 0:
            return reached
        done[cell] = True
        order[reached] = cell
        reached += 1
        for offset in (-stride, stride, 1, -1):
            before = cell + offset
            if floor[before] == FREE and not done[before]:
                best[before] = min(best[before], costs[cell] + best[cell])


@kernel
def count_trajectories(
    stride: int,
    costs: Floats,
    start: int,
    best: Floats,
    order: npt.NDArray[np.int64],
    reached: int,
    tolerance: float,
    departing: Floats,
    arriving: Floats,
) -> None:
    """Count optimal trajectories from ``start``, by steps, to and from every cell.

    ``best``, ``order`` and ``reached`` are those of :func:`costs_to`; ``departing [n, T]`` and ``arriving [n, T]``
    receive the number of trajectories ``start -> cell`` of ``t`` steps (the first step enters ``start``) and
    ``cell -> station`` of ``r`` steps.
    """
    longest = departing.shape[1]
    departing[:] = 0.0
    arriving[:] = 0.0
    arriving[order[0], 1] = 1.0
    for i in range(reached):
        cell = order[i]
        for offset in (-stride, stride, 1, -1):
            after = cell + offset
            if best[after] < np.inf and abs(costs[after] + best[after] - best[cell]) <= tolerance:
                for r in range(1, longest - 1):
                    arriving[cell, r + 1] += arriving[after, r]
    departing[start, 1] = 1.0
    for i in range(reached - 1, -1, -1):
        cell = order[i]
        for offset in (-stride, stride, 1, -1):
            after = cell + offset
            if best[after] < np.inf and abs(costs[after] + best[after] - best[cell]) <= tolerance:
                for t in range(1, longest - 1):
                    departing[after, t + 1] += departing[cell, t]


@kernel
def stage_value(excess: Floats, goal: int, goals: int, step: int, tables: ScoreTables, strict: bool) -> float:
    """Eq. 2 of one prefix for the bit set of valid ``goals``; ``excess [K]`` is relative to the true goal."""
    tied = 0
    total = 0.0
    second = 0.0
    for g in range(len(excess)):
        if goals & (1 << g):
            p = np.exp(-tables.beta * excess[g])
            total += p
            tied += excess[g] <= tables.tie_tolerance
            if g != goal:
                second = max(second, p)
    if tied > 1:
        return -tables.c * step * (1.0 if strict else (tied - 1.0) / tied)
    return (1.0 - second) / total


@kernel
def score_cells_weighted(
    floor: npt.NDArray[np.int32],
    stride: int,
    access: npt.NDArray[np.int64],
    costs: Floats,
    tables: ScoreTables,
    strict: bool,
    longest: int,
) -> float:
    """Legibility per task execution of one connected kitchen; see :func:`score_genomes_weighted`."""
    n, num_goals = len(floor), len(tables.goals)
    best = np.empty((num_goals, n))
    order = np.empty((num_goals, n), dtype=np.int64)
    reached = np.empty(num_goals, dtype=np.int64)
    done = np.empty(n, dtype=np.bool_)
    departing = np.empty((n, longest))
    arriving = np.empty((n, longest))
    excess = np.empty(num_goals)
    for g in range(num_goals):
        reached[g] = costs_to(floor, stride, costs, access[tables.goals[g]], best[g], order[g], done)
    total = 0.0
    for s in range(len(tables.starts)):
        start = access[tables.starts[s]]
        for goal in range(num_goals):
            count_trajectories(
                stride, costs, start, best[goal], order[goal], reached[goal], tables.tie_tolerance, departing, arriving
            )
            count = arriving[start].sum()
            for i in range(reached[goal]):
                cell = order[goal, i]
                for g in range(num_goals):
                    excess[g] = best[g, cell] - best[g, start] - (best[goal, cell] - best[goal, start])
                for t in range(1, longest):
                    if departing[cell, t] == 0.0:
                        continue
                    share = 0.0
                    for r in range(1, longest - t):
                        share += departing[cell, t] * arriving[cell, r] / count * tables.prefix_weights[t + r, t]
                    if share == 0.0:
                        continue
                    for goals in range(tables.stage_weights.shape[1]):
                        weight = tables.stage_weights[s, goals]
                        if weight > 0.0 and goals & (1 << goal):
                            total += weight * share * stage_value(excess, goal, goals, t, tables, strict)
    return total


@kernel
def score_genomes_weighted(
    genomes: Genomes,
    geometry: Geometry,
    tables: ScoreTables,
    costs: Floats,
    strict: bool,
    legibility: Floats,
) -> None:
    """Score ``genomes [B, d]`` into ``legibility [B]`` with ``costs [n]`` to step on each cell; NaN if invalid."""
    floor = np.full(geometry.num_cells, BLOCKED, dtype=np.int32)
    access = np.empty(len(geometry.allowed), dtype=np.int64)
    seen = np.empty(geometry.num_cells, dtype=np.bool_)
    stack = np.empty(geometry.num_cells, dtype=np.int64)
    longest = len(tables.prefix_weights)
    for b in range(len(genomes)):
        legibility[b] = np.nan
        if (
            place_stations(genomes[b], geometry, access)
            and place_obstacles(genomes[b], geometry, floor)
            and connected(floor, geometry.stride, access, seen, stack)
        ):
            legibility[b] = score_cells_weighted(floor, geometry.stride, access, costs, tables, strict, longest)
