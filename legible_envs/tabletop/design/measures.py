"""Measures of an archive of tables: how near objects lie to one another, and their order from left to right."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["greatest_spacing", "least_distances", "mean_x", "order_ranks"]

Floats = npt.NDArray[np.float64]


def least_distances(centres: Floats, fixed: npt.NDArray[np.bool_]) -> Floats:
    """``(B,)`` least distance between two of ``centres (B, n, 2)``, pairs left out where both are ``fixed (n,)``.

    0 where there is no pair.
    """
    i, j = np.triu_indices(centres.shape[1], 1)
    counts = ~(fixed[i] & fixed[j])
    gaps = np.hypot(*np.moveaxis(centres[:, i[counts]] - centres[:, j[counts]], -1, 0))
    return gaps.min(axis=1) if counts.any() else np.zeros(len(centres))


def mean_x(centres: Floats, ranked: Sequence[int]) -> Floats:
    """``(B,)`` mean ``x`` of some of ``centres (B, n, 2)``."""
    return np.asarray(centres[:, ranked, 0].mean(axis=1))


def order_ranks(centres: Floats, ranked: Sequence[int]) -> npt.NDArray[np.int64]:
    """``(B,)`` lexicographic rank of the order from left to right of some of ``centres (B, n, 2)``.

    Ties by ``y``, nearer first, then by position in ``ranked``.
    """
    x, y = centres[:, ranked, 0], centres[:, ranked, 1]
    order = np.lexsort((np.broadcast_to(np.arange(len(ranked)), x.shape), y, x), axis=1)
    rank = np.zeros(len(centres), dtype=np.int64)
    # The Lehmer code of the permutation: how many of the objects further right are named earlier.
    for i in range(len(ranked)):
        rank += (order[:, i + 1 :] < order[:, i : i + 1]).sum(axis=1) * math.factorial(len(ranked) - 1 - i)
    return rank


def greatest_spacing(layout: TabletopLayout, moves: npt.NDArray[np.bool_]) -> float:
    """A least distance that no arrangement exceeds, with the objects in ``moves (n,)`` anywhere in the region.

    At most ``2 A / (sqrt(3) d^2) + P / (2 d) + 1`` points lie at distances of at least ``d`` in a convex region of area
    ``A`` and perimeter ``P`` (Oler, 1961); and no point of the region is farther from the objects that stay than the
    farthest point of a grid, by more than half its diagonal.
    """
    x0, y0, x1, y1 = layout.table.region
    width, depth, n = x1 - x0, y1 - y0, int(moves.sum())
    bounds = [math.hypot(width, depth)]
    if n > 1:
        a, b = 2 * width * depth / math.sqrt(3), width + depth
        bounds.append((b + math.sqrt(b * b + 4 * (n - 1) * a)) / (2 * (n - 1)))
    if n and not moves.all():
        cells = 64
        grid = np.stack(
            np.meshgrid(*(np.linspace(lo, hi, cells + 1) for lo, hi in ((x0, x1), (y0, y1)))), axis=-1
        ).reshape(-1, 1, 2)
        farthest = np.hypot(*np.moveaxis(grid - layout.centres[~moves], -1, 0)).min(axis=1).max()
        bounds.append(float(farthest) + math.hypot(width, depth) / (2 * cells))
    return min(bounds)
