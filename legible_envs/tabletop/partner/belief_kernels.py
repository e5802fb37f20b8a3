"""Kernels: Bayesian goal inference (Eq. 1) for one hand among grown obstacles."""

from __future__ import annotations

import numpy as np

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.geometry.visibility_kernels import Floats, first_corner, nearest_free, norm

__all__ = ["reach_lengths", "reach_posterior"]


@kernel
def reach_lengths(
    boxes: Floats,
    size: tuple[float, float],
    corners: Floats,
    goals: Floats,
    tables: Floats,
    x: float,
    y: float,
    lengths: Floats,
) -> None:
    """Write to ``lengths [n]`` the length of the shortest path from a point to each goal: always finite.

    A point inside a grown obstacle counts as the free point nearest to it. Where there is no path the straight line
    counts, as for a person who ignores the obstacles.

    Args:
        boxes: ``[m, 6]`` grown obstacles.
        size: Of the table.
        corners: ``[k, 2]`` corners a path may bend at.
        goals: ``[n, 2]``.
        tables: ``[n, k]`` shortest path from each corner to each goal.
        x: Of the point.
        y: Of the point.
        lengths: Out.
    """
    free_x, free_y = nearest_free(boxes, size, x, y)
    if np.isnan(free_x):  # obstacles cover the whole table
        free_x, free_y = x, y
    for g in range(len(goals)):
        length = first_corner(boxes, corners, len(corners), tables[g], free_x, free_y, goals[g, 0], goals[g, 1])[0]
        lengths[g] = length if length < np.inf else norm(goals[g, 0] - x, goals[g, 1] - y)


@kernel
def reach_posterior(
    boxes: Floats,
    size: tuple[float, float],
    corners: Floats,
    goals: Floats,
    tables: Floats,
    optimal: Floats,
    prior: Floats,
    beta: float,
    x: float,
    y: float,
    belief: Floats,
) -> None:
    """Write to ``belief [n]`` the probability of each goal with the hand at a point.

    Args:
        boxes: ``[m, 6]`` grown obstacles.
        size: Of the table.
        corners: ``[k, 2]`` corners a path may bend at.
        goals: ``[n, 2]``.
        tables: ``[n, k]`` shortest path from each corner to each goal.
        optimal: ``[n]`` shortest path from the start to each goal.
        prior: ``[n]``.
        beta: Rationality per metre.
        x: Of the hand.
        y: Of the hand.
        belief: Out.
    """
    reach_lengths(boxes, size, corners, goals, tables, x, y, belief)
    # least over goals that are possible at all, so that not all weights can vanish
    least = np.inf
    for g in range(len(goals)):
        belief[g] -= optimal[g]
        if prior[g] > 0.0:
            least = min(least, belief[g])
    total = 0.0
    for g in range(len(goals)):
        belief[g] = prior[g] * np.exp(-beta * (belief[g] - least)) if prior[g] > 0.0 else 0.0
        total += belief[g]
    for g in range(len(goals)):
        belief[g] /= total
