"""Kernels: from excess costs of observed points to the value of a reach in all stages at once (Eq. 1 and 2)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.compiled import kernel

__all__ = ["add_weighted", "exponentials", "value_in_all_stages"]

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
def value_in_all_stages(
    goal: int,
    p: int,
    num_goals: int,
    excess: Floats,
    evidence: Floats,
    tie_tolerance: float,
    doubt: float,
    strict: bool,
    value: Floats,
    total: Floats,
) -> None:
    """Eq. 2 of one observed point, as ``value / total``, for every set of goals the true one may be valid with.

    Args:
        goal: The true goal; on its own shortest path its excess is 0 and its evidence 1.
        p: The point.
        num_goals: Goals of the group.
        excess: ``[G, P]`` excess cost of each goal at each point.
        evidence: ``[G, P]`` their weights in Eq. 1.
        tie_tolerance: Excess costs up to this tie with the true goal.
        doubt: Eq. 2 of a wrong guess here (negative).
        strict: Whether a tie counts as wrong rather than as a fair guess.
        value: ``[2^(G-1)]`` out; bit ``j`` of the index stands for the ``j``-th goal but the true one.
        total: ``[2^(G-1)]`` out.
    """
    value[0] = 1.0
    total[0] = 1.0
    width = 1
    is_tied = False
    for g in range(num_goals):
        if g != goal:
            weight = evidence[g, p]
            margin = 1.0 - weight
            is_tied |= excess[g, p] <= tie_tolerance
            for others in range(width):
                total[width + others] = total[others] + weight
                value[width + others] = margin if margin < value[others] else value[others]
            width *= 2
    if not is_tied:
        return
    for others in range(1, width):
        tied, j = 1.0, 0
        for g in range(num_goals):
            if g != goal:
                if others >> j & 1 and excess[g, p] <= tie_tolerance:
                    tied += 1.0
                j += 1
        if tied > 1.0:
            value[others] = doubt if strict else doubt * (tied - 1.0)
            total[others] = 1.0 if strict else tied


@kernel
def add_weighted(weights: Floats, value: Floats, total: Floats, sums: Floats) -> None:
    """``sums += weights * value / total``, element by element."""
    for e in range(len(weights)):
        sums[e] += weights[e] * (value[e] / total[e])
