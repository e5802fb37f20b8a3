"""Kernels: from excess costs of observed points to the value of a reach in all stages at once (Eq. 1 and 2)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["add_weighted", "exponentials", "settle_ties", "sum_candidates"]

Floats = npt.NDArray[np.float64]


@kernel
def exponentials(beta: float, excess: Floats, evidence: Floats) -> None:
    """``evidence = exp(-beta * excess)`` to an absolute error of 1e-14, without calls, so that it is vectorised.

    The Taylor series of degree 8 at a sixty-fourth of the exponent, squared six times; exponents beyond 40 (4e-18) are
    cut off there.
    """
    for p in range(len(excess)):
        x = beta * excess[p]
        x = x if x > 0.0 else 0.0
        x = (x if x < 40.0 else 40.0) * (-1.0 / 64.0)
        y = 1.0 + x * (1.0 / 8.0)
        y = 1.0 + x * y * (1.0 / 7.0)
        y = 1.0 + x * y * (1.0 / 6.0)
        y = 1.0 + x * y * (1.0 / 5.0)
        y = 1.0 + x * y * (1.0 / 4.0)
        y = 1.0 + x * y * (1.0 / 3.0)
        y = 1.0 + x * y * (1.0 / 2.0)
        y = 1.0 + x * y
        y *= y
        y *= y
        y *= y
        y *= y
        y *= y
        evidence[p] = y * y


@kernel
def keep_margin(value: Floats, evidence: Floats, result: Floats) -> None:
    """``result = min(value, 1 - evidence)`` (a call of its own, like the next, so that it is vectorised)."""
    for p in range(len(evidence)):
        margin = 1.0 - evidence[p]
        result[p] = margin if margin < value[p] else value[p]


@kernel
def add_rows(a: Floats, b: Floats, result: Floats) -> None:
    """``result = a + b``."""
    for p in range(len(b)):
        result[p] = a[p] + b[p]


@kernel
def sum_candidates(num_goals: int, num_points: int, evidence: Floats, value: Floats, total: Floats) -> None:
    """Eq. 2 as ``value / total`` of every point for every set of candidates, as if no goals tied.

    Args:
        num_goals: Goals of the group.
        num_points: Points of all its reaches.
        evidence: ``[G, P]`` weights in Eq. 1; 0 for the true goal of a point, which is always a candidate of weight 1.
        value: ``[2^G * P]`` out; row ``mask`` holds the points for the candidates in ``mask``.
        total: ``[2^G * P]`` out.
    """
    n = num_points
    value[:n] = 1.0
    total[:n] = 1.0
    for g in range(num_goals):
        row = evidence[g, :n]
        for rest in range(1 << g):
            old, new = rest * n, (rest | 1 << g) * n
            keep_margin(value[old : old + n], row, value[new : new + n])
            add_rows(total[old : old + n], row, total[new : new + n])


@kernel
def settle_ties(
    num_goals: int,
    num_points: int,
    per_goal: int,
    excess: Floats,
    tie_tolerance: float,
    observed: Floats,
    penalty: float,
    strict: bool,
    value: Floats,
    total: Floats,
) -> None:
    """Overwrite ``value / total`` where goals tie with the true one: to guess among them costs what was observed."""
    for p in range(num_points):
        goal = p // per_goal
        tied = 0
        for g in range(num_goals):
            if g != goal and excess[g, p] <= tie_tolerance:
                tied |= 1 << g
        if tied == 0:
            continue
        for mask in range(1 << num_goals):
            both = mask & tied
            if both and mask >> goal & 1:
                others = 0.0
                while both:
                    both &= both - 1
                    others += 1.0
                e = mask * num_points + p
                value[e] = -penalty * observed[p] * (1.0 if strict else others)
                total[e] = 1.0 if strict else others + 1.0


@kernel
def add_weighted(weights: Floats, value: Floats, total: Floats, sums: Floats) -> None:
    """``sums += weights * value / total``, element by element."""
    for e in range(len(weights)):
        sums[e] += weights[e] * (value[e] / total[e])
