"""Sums over all walks between the cells of a kitchen: paths that may enter a cell more than once. On plain arrays.

A kitchen's floor is ``n`` cells in reading order, ``neighbours`` their ``(n, 4)`` indices (-1: none) and ``band`` the
largest distance of two of them. A walk weighs ``exp(-costs of the cells it enters)``; entering the station, its last
step, is free. With ``W[u, v] = exp(-cost[v])`` for neighbours, the walks from ``u`` into a station weigh
``Z = (I - W)^-1 B`` in all, where ``B`` marks the cells beside the station.

``I - W`` is banded, and an M-matrix exactly while the sum is finite (spectral radius of ``W`` below 1). So it can be
factorised without pivoting, and the first pivot that is not positive says that the sum diverges.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["cheapest_costs", "factorise", "likelihood", "solve", "solve_transposed", "walk_costs"]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.integer[Any]]

SMALLEST_PIVOT = 1e-12


@kernel
def factorise(neighbours: Integers, steps: Floats, band: int) -> tuple[Floats, bool]:
    """LU factors of ``I - W``.

    Args:
        neighbours: ``(n, 4)``.
        steps: ``(n, 4)`` weight ``W`` of each step.
        band: Largest ``|u - v|`` of neighbours.

    Returns:
        ``(n, 2 band + 1)`` diagonals of both factors, and whether the sum over walks is finite.
    """
    n = len(neighbours)
    factors = np.zeros((n, 2 * band + 1))
    for u in range(n):
        factors[u, band] = 1.0
        for move in range(4):
            v = neighbours[u, move]
            if v >= 0:
                factors[u, band + v - u] = -steps[u, move]
    for k in range(n):
        pivot = factors[k, band]
        if not pivot > SMALLEST_PIVOT:
            return factors, False
        last = min(n, k + band + 1)
        for i in range(k + 1, last):
            if factors[i, band + k - i] != 0.0:
                share = factors[i, band + k - i] / pivot
                factors[i, band + k - i] = share
                for j in range(k + 1, last):
                    factors[i, band + j - i] -= share * factors[k, band + j - k]
    return factors, True


@kernel
def solve(factors: Floats, right: Floats) -> Floats:
    """``(I - W)^-1 right`` for ``(n, K)`` right-hand sides."""
    (n, count), band = right.shape, factors.shape[1] // 2
    x = right.copy()
    # Loops instead of rows: the kernel compiler would make room for each row's product.
    for i in range(n):
        for j in range(max(0, i - band), i):
            share = factors[i, band + j - i]
            if share != 0.0:
                for column in range(count):
                    x[i, column] -= share * x[j, column]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, min(n, i + band + 1)):
            share = factors[i, band + j - i]
            if share != 0.0:
                for column in range(count):
                    x[i, column] -= share * x[j, column]
        for column in range(count):
            x[i, column] /= factors[i, band]
    return x


@kernel
def solve_transposed(factors: Floats, right: Floats) -> Floats:
    """``(I - W)^-T right`` for ``(n, K)`` right-hand sides."""
    (n, count), band = right.shape, factors.shape[1] // 2
    x = right.copy()
    for i in range(n):
        for j in range(max(0, i - band), i):
            share = factors[j, band + i - j]
            if share != 0.0:
                for column in range(count):
                    x[i, column] -= share * x[j, column]
        for column in range(count):
            x[i, column] /= factors[i, band]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, min(n, i + band + 1)):
            share = factors[j, band + i - j]
            if share != 0.0:
                for column in range(count):
                    x[i, column] -= share * x[j, column]
    return x


@kernel
def likelihood(
    costs: Floats,
    neighbours: Integers,
    band: int,
    access: Floats,
    visits: Floats,
    starts: Integers,
    goals: Integers,
    weights: Floats,
) -> tuple[float, Floats]:
    """Negative log-likelihood of walks, given where each starts and ends, and its gradient.

    Args:
        costs: ``(n,)`` of entering each cell.
        neighbours: ``(n, 4)``.
        band: Largest ``|u - v|`` of neighbours.
        access: ``(n, K)``, 1 beside each station.
        visits: ``(n,)`` how often all walks together entered each cell, their first cells not counted.
        starts: ``(P,)`` first cell of each group of walks that share it and the goal.
        goals: ``(P,)`` column of its goal.
        weights: ``(P,)`` number of its walks.

    Returns:
        The value and its ``(n,)`` gradient: expected visits are subtracted from those counted. The value is ``inf``
        where the sum over walks diverges or underflows.
    """
    n = len(costs)
    steps = np.empty((n, 4))
    value = 0.0
    for u in range(n):
        value += costs[u] * visits[u]
        for move in range(4):
            v = neighbours[u, move]
            steps[u, move] = np.exp(-costs[v]) if v >= 0 else 0.0
    factors, finite = factorise(neighbours, steps, band)
    gradient = visits.copy()
    if not finite:
        return np.inf, gradient
    sums = solve(factors, access)
    shares = np.zeros_like(access)
    for p in range(len(starts)):
        total = sums[starts[p], goals[p]]
        if not total > 0.0 or not total < np.inf:
            return np.inf, gradient
        value += weights[p] * np.log(total)
        shares[starts[p], goals[p]] += weights[p] / total
    flow = solve_transposed(factors, shares)
    for u in range(n):
        for goal in range(access.shape[1]):
            gradient[u] -= (flow[u, goal] - shares[u, goal]) * sums[u, goal]
    return value, gradient


@kernel
def cheapest_costs(costs: Floats, neighbours: Integers, access: Floats) -> Floats:
    """Cost of the cheapest walk from each cell into each station (Bellman and Ford).

    Costs may be below zero as long as no cycle has a negative cost, which a finite sum over walks guarantees; after as
    many rounds as there are cells the search stops in any case.

    Returns:
        ``(n, K)``, ``inf`` where there is no path.
    """
    n, count = access.shape
    best = np.where(access > 0.0, 0.0, np.inf)
    for _ in range(n):
        changed = False
        for u in range(n):
            for move in range(4):
                v = neighbours[u, move]
                if v >= 0:
                    for goal in range(count):
                        value = costs[v] + best[v, goal]
                        if value < best[u, goal]:
                            best[u, goal] = value
                            changed = True
        if not changed:
            break
    return best


@kernel
def walk_costs(costs: Floats, neighbours: Integers, band: int, access: Floats) -> tuple[Floats, bool]:
    """``-log Z`` from each cell into each station.

    Each station's system is scaled by the cheapest costs first, so that nothing underflows however far it is.

    Returns:
        ``(n, K)``, ``inf`` where there is no path, and whether the sums over walks are finite.
    """
    n, count = access.shape
    cheapest = cheapest_costs(costs, neighbours, access)
    result = np.full((n, count), np.inf)
    steps, right = np.empty((n, 4)), np.empty((n, 1))
    for goal in range(count):
        for u in range(n):
            here = cheapest[u, goal]
            right[u, 0] = np.exp(here) if access[u, goal] > 0.0 else 0.0
            for move in range(4):
                v = neighbours[u, move]
                joined = v >= 0 and here < np.inf
                steps[u, move] = np.exp(here - costs[v] - cheapest[v, goal]) if joined else 0.0
        factors, finite = factorise(neighbours, steps, band)
        if not finite:
            return result, False
        scaled = solve(factors, right)
        for u in range(n):
            if cheapest[u, goal] < np.inf:
                result[u, goal] = cheapest[u, goal] - np.log(scaled[u, 0])
    return result, True
