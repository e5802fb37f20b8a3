"""Kernels of the exact legibility score of noisily rational walkers; defined in ``boltzmann``.

How a trajectory goes on does not depend on where it began. So the expected weight of a prefix at a cell is computed
once for each goal, and the forward pass of each start uses it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.scoring.exact_kernels import BLOCKED, ScoreTables
from legible_envs.overcooked.scoring.genome_kernels import Genomes, Geometry, connected, place_obstacles, place_stations
from legible_envs.overcooked.scoring.weighted_kernels import costs_to
from legible_envs.support.compiled import kernel

__all__ = ["score_genomes_boltzmann"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@kernel
def find_steps(stride: int, costs: Floats, best: Floats, cells: Ints, rationality: float, steps: Floats) -> None:
    """Write to ``steps [n, 5]`` the probability to step north, south, east, west, or into the goal station.

    ``best [n]`` and ``cells`` (the cells reached, the station's access cell first) are those of ``costs_to``.
    """
    for cell in cells:
        least = 1.0 if cell == cells[0] else np.inf
        for offset in (-stride, stride, 1, -1):
            if best[cell + offset] < np.inf:
                least = min(least, costs[cell + offset] + best[cell + offset])
        total = 0.0
        for i, offset in enumerate((-stride, stride, 1, -1)):
            steps[cell, i] = 0.0
            if best[cell + offset] < np.inf:
                steps[cell, i] = np.exp(-rationality * (costs[cell + offset] + best[cell + offset] - least))
            total += steps[cell, i]
        steps[cell, 4] = np.exp(-rationality * (1.0 - least)) if cell == cells[0] else 0.0
        total += steps[cell, 4]
        for i in range(5):
            steps[cell, i] /= total


@kernel
def find_arrivals(stride: int, steps: Floats, cells: Ints, arrives: Floats) -> None:
    """Write to ``arrives [H + 1, n]`` the probability to enter the goal with exactly ``r`` more steps."""
    arrives[:] = 0.0
    arrives[1, cells[0]] = steps[cells[0], 4]
    for r in range(1, len(arrives) - 1):
        for cell in cells:
            total = 0.0
            for i, offset in enumerate((-stride, stride, 1, -1)):
                total += steps[cell, i] * arrives[r, cell + offset]
            arrives[r + 1, cell] += total


@kernel
def weigh_prefixes(prefix_weights: Floats, arrives: Floats, future: Floats) -> None:
    """Write to ``future [H + 1, n]`` the expected weight of a prefix of ``t`` steps at each cell.

    It is the sum over the steps still to come, ``r``, of the probability to arrive with them times the weight
    ``prefix_weights[t + r, t]``; trajectories longer than ``H`` weigh nothing.
    """
    horizon = len(arrives) - 1
    future[:] = 0.0
    for t in range(1, horizon):
        for r in range(1, horizon + 1 - t):
            weight = prefix_weights[t + r, t]
            if weight != 0.0:
                for cell in range(arrives.shape[1]):
                    future[t, cell] += weight * arrives[r, cell]


@kernel
def walk_forwards(
    stride: int, start: int, steps: Floats, cells: Ints, future: Floats, here: Floats, presence: Floats, waiting: Floats
) -> None:
    """Sum over all prefixes at each cell: their weight into ``presence [n]``, weight times steps into ``waiting [n]``.

    ``here [2, n]`` is scratch; the first step enters ``start``.
    """
    presence[:] = 0.0
    waiting[:] = 0.0
    here[:] = 0.0
    here[1, start] = 1.0
    for t in range(1, len(future) - 1):
        now, then = here[t % 2], here[(t + 1) % 2]
        then[:] = 0.0
        for cell in cells:
            if now[cell] != 0.0:
                share = now[cell] * future[t, cell]
                presence[cell] += share
                waiting[cell] += t * share
                for i, offset in enumerate((-stride, stride, 1, -1)):
                    then[cell + offset] += now[cell] * steps[cell, i]


@kernel
def add_stages(
    excess: Floats, goal: int, weights: Floats, tables: ScoreTables, strict: bool, relative: Floats
) -> tuple[float, float]:
    """Eq. 2 at one cell, summed over the stages in which ``goal`` is valid, each as often as it happens.

    Args:
        excess: ``[K]`` optimal cost from the cell to each goal, less that from the start.
        goal: The true goal.
        weights: ``[2**K]`` expected visits of the stage with each set of valid goals.
        tables: Task and parameters.
        strict: Whether any tie counts as wrong.
        relative: ``[K]`` scratch.

    Returns:
        ``(margin, wrong)``: expected margin, and expected number of wrong predictions.
    """
    margin, wrong = 0.0, 0.0
    for g in range(len(excess)):
        relative[g] = np.exp(-tables.beta * max(0.0, excess[g] - excess[goal]))
    for goals in range(len(weights)):
        if weights[goals] == 0.0 or not goals & (1 << goal):
            continue
        least = excess[goal]
        for g in range(len(excess)):
            if goals & (1 << g):
                least = min(least, excess[g])
        tied = 0
        total, second = 0.0, 0.0
        for g in range(len(excess)):
            if goals & (1 << g):
                tied += excess[g] - least <= tables.tie_tolerance
                total += relative[g]
                if g != goal:
                    second = max(second, relative[g])
        if excess[goal] - least > tables.tie_tolerance:
            wrong += weights[goals]
        elif tied > 1:
            wrong += weights[goals] * (1.0 if strict else (tied - 1.0) / tied)
        else:
            margin += weights[goals] * (1.0 - second) / total
    return margin, wrong


@kernel
def score_cells_boltzmann(
    floor: npt.NDArray[np.int32],
    stride: int,
    access: Ints,
    costs: Floats,
    tables: ScoreTables,
    strict: bool,
    rationality: float,
    horizon: int,
) -> float:
    """Legibility per task execution of one connected kitchen; see :func:`score_genomes_boltzmann`."""
    n, num_goals = len(floor), len(tables.goals)
    best = np.empty((num_goals, n))
    order = np.empty((num_goals, n), dtype=np.int64)
    reached = 0
    done = np.empty(n, dtype=np.bool_)
    steps, here = np.zeros((n, 5)), np.empty((2, n))
    arrives, future = np.empty((horizon + 1, n)), np.empty((horizon + 1, n))
    presence, waiting = np.empty(n), np.empty(n)
    excess, relative = np.empty(num_goals), np.empty(num_goals)
    for g in range(num_goals):
        # All stations are connected, so every goal is reached from the same cells.
        reached = costs_to(floor, stride, costs, access[tables.goals[g]], best[g], order[g], done)
    total = 0.0
    for goal in range(num_goals):
        cells = order[goal, :reached]
        find_steps(stride, costs, best[goal], cells, rationality, steps)
        find_arrivals(stride, steps, cells, arrives)
        weigh_prefixes(tables.prefix_weights, arrives, future)
        for s in range(len(tables.starts)):
            start = access[tables.starts[s]]
            walk_forwards(stride, start, steps, cells, future, here, presence, waiting)
            # The first step enters the start's access cell, so one less is left from there.
            arrived = arrives[1:horizon, start].sum()
            for cell in cells:
                if presence[cell] != 0.0:
                    for g in range(num_goals):
                        excess[g] = best[g, cell] - best[g, start]
                    margin, wrong = add_stages(excess, goal, tables.stage_weights[s], tables, strict, relative)
                    total += (margin * presence[cell] - tables.c * wrong * waiting[cell]) / arrived
    return total


@kernel
def score_genomes_boltzmann(
    genomes: Genomes,
    geometry: Geometry,
    tables: ScoreTables,
    costs: Floats,
    strict: bool,
    rationality: float,
    horizon: int,
    legibility: Floats,
) -> None:
    """Score ``genomes [B, d]`` into ``legibility [B]``; NaN if invalid.

    Args:
        genomes: ``[B, d]``.
        geometry: Where stations and obstacles may stand.
        tables: Task and parameters; ``prefix_weights`` reaches as far as ``horizon``.
        costs: ``[n]`` cost of stepping on each cell.
        strict: Whether any tie counts as wrong.
        rationality: Of the walker, per unit of cost.
        horizon: Length of the longest trajectory, in steps.
        legibility: ``[B]`` output.
    """
    floor = np.full(geometry.num_cells, BLOCKED, dtype=np.int32)
    access = np.empty(len(geometry.allowed), dtype=np.int64)
    seen = np.empty(geometry.num_cells, dtype=np.bool_)
    stack = np.empty(geometry.num_cells, dtype=np.int64)
    for b in range(len(genomes)):
        legibility[b] = np.nan
        if (
            place_stations(genomes[b], geometry, access)
            and place_obstacles(genomes[b], geometry, floor)
            and connected(floor, geometry.stride, access, seen, stack)
        ):
            legibility[b] = score_cells_boltzmann(
                floor, geometry.stride, access, costs, tables, strict, rationality, horizon
            )
