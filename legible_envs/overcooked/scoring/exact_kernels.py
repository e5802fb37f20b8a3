"""Kernels of the exact legibility score of kitchens whose stations each have one access cell.

:mod:`legible_envs.legibility` defines the score; here the computation is arranged to be fast. Grids are flat arrays
with their counter border, so that a neighbour is an offset. One flood per station gives distances and the number of
shortest paths to every cell. A cell on a shortest path then knows the *excess cost* of every goal (how much longer the
path through the cell is than the shortest), and one sum over the subsets of goals that are not tied serves all stages
at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["ScoreTables", "Scratch", "flood", "make_scratch", "score_cells"]

FREE = -1
BLOCKED = -2


class ScoreTables(NamedTuple):
    """Task and parameters as the score needs them; ``S`` starts, ``K`` goals, ``N`` stations.

    Attributes:
        starts: ``[S]`` station index of each place where a person may stand when choosing the next goal.
        goals: ``[K]`` station index of each goal.
        stage_weights: ``[S, 2**K]`` expected visits of the stage (start, set of valid goals).
        tie_penalties: ``[S, K, 2**K]`` by start, true goal and set of tied goals: expected visits of the stages in
            which these goals tie, times the probability to predict a wrong one.
        discounts: ``[D]`` ``exp(-beta * excess)`` for whole numbers of steps.
        prefix_weights: ``[L, L]`` weight of the prefix of ``t`` steps of a trajectory of ``l`` steps, at ``[l, t]``.
        legs: ``[N, N]`` expected number of legs from station to station in one task execution.
        c: Cost per step observed while the prediction is wrong.
        beta: Rationality per unit of cost.
        tie_tolerance: Goals tie up to this excess cost.
    """

    starts: npt.NDArray[np.int64]
    goals: npt.NDArray[np.int64]
    stage_weights: npt.NDArray[np.float64]
    tie_penalties: npt.NDArray[np.float64]
    discounts: npt.NDArray[np.float64]
    prefix_weights: npt.NDArray[np.float64]
    legs: npt.NDArray[np.float64]
    c: float
    beta: float
    tie_tolerance: float


class Scratch(NamedTuple):
    """Working memory of :func:`score_cells`; ``N`` stations, ``n`` cells, ``K`` goals.

    Attributes:
        distance: ``[N, n]`` moves from each station's access cell.
        paths: ``[N, n]`` number of shortest paths from there.
        queue: ``[n]`` cells in the order of a flood.
        excess: ``[K]`` excess cost of each goal at one cell, in steps.
        discounts: ``[K]`` ``exp(-beta * excess)`` of each goal that does not tie.
        shares: ``[K]`` weighted share of the trajectories to each goal that pass the cell.
        free: ``[K]`` the goals that do not tie.
        masks: ``[2**K]``, like the next three: see :func:`clean_margins`.
        sums: Sums of discounts.
        highest: Greatest discounts.
        margins: Margins of the true goal.
    """

    distance: npt.NDArray[np.int32]
    paths: npt.NDArray[np.float64]
    queue: npt.NDArray[np.int64]
    excess: npt.NDArray[np.int64]
    discounts: npt.NDArray[np.float64]
    shares: npt.NDArray[np.float64]
    free: npt.NDArray[np.int64]
    masks: npt.NDArray[np.int64]
    sums: npt.NDArray[np.float64]
    highest: npt.NDArray[np.float64]
    margins: npt.NDArray[np.float64]


@kernel
def flood(
    floor: npt.NDArray[np.int32],
    stride: int,
    source: int,
    distance: npt.NDArray[np.int32],
    paths: npt.NDArray[np.float64],
    queue: npt.NDArray[np.int64],
) -> int:
    """Breadth-first distances and numbers of shortest paths from one floor cell.

    Args:
        floor: ``[n]`` -1 where a person can stand, -2 elsewhere; the border is -2.
        stride: Columns of the grid.
        source: Index of a floor cell.
        distance: ``[n]`` output: moves from the source, -1 where unreachable, -2 where blocked.
        paths: ``[n]`` output: number of shortest paths.
        queue: ``[n]`` output: the cells reached, nearest first.

    Returns:
        Number of cells reached.
    """
    distance[:] = floor
    paths[:] = 0.0
    distance[source] = 0
    paths[source] = 1.0
    queue[0] = source
    head, tail = 0, 1
    while head < tail:
        cell = queue[head]
        head += 1
        following = distance[cell] + 1
        count = paths[cell]
        for offset in (-stride, stride, 1, -1):
            after = cell + offset
            if distance[after] == FREE:
                distance[after] = following
                paths[after] = count
                queue[tail] = after
                tail += 1
            elif distance[after] == following:
                paths[after] += count
    return tail


@kernel
def clean_margins(
    discounts: npt.NDArray[np.float64],
    free: npt.NDArray[np.int64],
    num_free: int,
    masks: npt.NDArray[np.int64],
    sums: npt.NDArray[np.float64],
    highest: npt.NDArray[np.float64],
    margins: npt.NDArray[np.float64],
) -> int:
    """Margin ``p(1) - p(2)`` of a goal that leads alone, against every subset of the goals that do not tie.

    Args:
        discounts: ``[K]`` relative posterior ``exp(-beta * excess)`` of each goal.
        free: ``[K]`` the goals that do not tie, in the first ``num_free`` places.
        num_free: How many they are.
        masks: ``[2**K]`` output: the subsets as bit masks over all goals.
        sums: ``[2**K]`` scratch.
        highest: ``[2**K]`` scratch.
        margins: ``[2**K]`` output.

    Returns:
        Number of subsets, ``2**num_free``.
    """
    masks[0] = 0
    sums[0] = 1.0
    highest[0] = 0.0
    margins[0] = 1.0
    count = 1
    for j in range(num_free):
        goal = free[j]
        value = discounts[goal]
        bit = 1 << goal
        for u in range(count):
            masks[count + u] = masks[u] | bit
            sums[count + u] = sums[u] + value
            highest[count + u] = max(highest[u], value)
        for u in range(count, 2 * count):
            margins[u] = (1.0 - highest[u]) / sums[u]
        count *= 2
    return count


@kernel
def make_scratch(num_cells: int, num_stations: int, num_goals: int) -> Scratch:
    """Allocate what :func:`score_cells` needs, once per batch."""
    subsets = 1 << num_goals
    return Scratch(
        distance=np.empty((num_stations, num_cells), dtype=np.int32),
        paths=np.empty((num_stations, num_cells), dtype=np.float64),
        queue=np.empty(num_cells, dtype=np.int64),
        excess=np.empty(num_goals, dtype=np.int64),
        discounts=np.empty(num_goals, dtype=np.float64),
        shares=np.empty(num_goals, dtype=np.float64),
        free=np.empty(num_goals, dtype=np.int64),
        masks=np.empty(subsets, dtype=np.int64),
        sums=np.empty(subsets, dtype=np.float64),
        highest=np.empty(subsets, dtype=np.float64),
        margins=np.empty(subsets, dtype=np.float64),
    )


@kernel
def score_cells(
    floor: npt.NDArray[np.int32],
    stride: int,
    access: npt.NDArray[np.int64],
    tables: ScoreTables,
    scratch: Scratch,
) -> tuple[float, float]:
    """Legibility per task execution (Eq. 3) and expected floor moves of one kitchen.

    Args:
        floor: ``[n]`` -1 where a person can stand, -2 elsewhere.
        stride: Columns of the grid.
        access: ``[N]`` index of the floor cell from which each station is used.
        tables: Task and parameters.
        scratch: Room to work in, see :func:`make_scratch`.

    Returns:
        ``(legibility, distance)``; both NaN where two stations are not connected.
    """
    distance, paths, queue = scratch.distance, scratch.paths, scratch.queue
    excess, discounts, shares, free = scratch.excess, scratch.discounts, scratch.shares, scratch.free
    masks, sums, highest, margins = scratch.masks, scratch.sums, scratch.highest, scratch.margins
    moves = 0.0
    reached = 0
    for a in range(len(access)):
        reached = flood(floor, stride, access[a], distance[a], paths[a], queue)
        for b in range(len(access)):
            if distance[a, access[b]] < 0:
                return np.nan, np.nan
            moves += tables.legs[a, b] * distance[a, access[b]]

    num_goals = len(tables.goals)
    total = 0.0
    for s in range(len(tables.starts)):
        start = tables.starts[s]
        weights = tables.stage_weights[s]
        # All stations are connected, so any flood's queue holds the cells that every flood reaches.
        for cell in queue[:reached]:
            here = distance[start, cell]
            tied, num_free, on_path = 0, 0, 0
            for g in range(num_goals):
                station = tables.goals[g]
                excess[g] = here + distance[station, cell] - distance[start, access[station]]
                if excess[g] <= tables.tie_tolerance:
                    tied |= 1 << g
                else:
                    discounts[g] = tables.discounts[excess[g]]
                    free[num_free] = g
                    num_free += 1
                if excess[g] == 0:
                    on_path |= 1 << g
            if on_path == 0:
                continue
            step = here + 1
            wrong = 0.0
            for g in range(num_goals):
                if on_path & (1 << g):
                    station = tables.goals[g]
                    goal_cell = access[station]
                    share = paths[start, cell] * paths[station, cell] / paths[start, goal_cell]
                    shares[g] = share * tables.prefix_weights[distance[start, goal_cell] + 2, step]
                    wrong += shares[g] * tables.tie_penalties[s, g, tied]
            total -= tables.c * step * wrong
            for u in range(clean_margins(discounts, free, num_free, masks, sums, highest, margins)):
                visits = 0.0
                for g in range(num_goals):
                    if on_path & (1 << g):
                        visits += shares[g] * weights[masks[u] | (1 << g)]
                total += margins[u] * visits
    return total, moves
