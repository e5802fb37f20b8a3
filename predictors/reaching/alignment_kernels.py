"""Dynamic time warping between two whole series, in a band or not, and averages under it. Kernels on plain arrays.

The cost of a warping path is the sum of squared Euclidean distances of matched samples (Sakoe and Chiba, 1978); steps
are (1, 0), (0, 1) and (1, 1). A band of ``radius`` r lets sample ``i`` of the shorter series meet samples ``i - r`` to
``i + r + (difference in length)`` of the longer one, so that both corners always lie inside it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["closed_cost", "closed_path", "dba_step", "match_means", "pairwise_costs"]

_Array = npt.NDArray[np.float64]


@kernel
def closed_cost(x: _Array, y: _Array, radius: int) -> float:
    """Cost of the cheapest warping path between two series.

    Args:
        x: ``(n, d)``, n >= 1.
        y: ``(m, d)``, m >= 1.
        radius: Half-width of the band in samples; negative: no band.

    Returns:
        Sum of squared distances along the path.
    """
    if len(x) > len(y):
        x, y = y, x
    n, m, d = len(x), len(y), x.shape[1]
    # One row of the table, shifted by one so that its first column is the border.
    row = np.full(m + 1, np.inf)
    row[0] = 0.0
    for i in range(n):
        low = 0 if radius < 0 else max(0, i - radius)
        high = m if radius < 0 else min(m, i + m - n + radius + 1)
        diagonal = row[low]
        row[low] = np.inf
        left = np.inf
        for j in range(low, high):
            above = row[j + 1]
            cost = 0.0
            for k in range(d):
                gap = x[i, k] - y[j, k]
                cost += gap * gap
            best = diagonal if diagonal < above else above
            left = cost + (best if best < left else left)
            row[j + 1] = left
            diagonal = above
    return row[m]


@kernel
def _table(x: _Array, y: _Array, radius: int) -> _Array:
    """``(n+1, m+1)`` cheapest costs up to every pair of samples, bordered by inf."""
    n, m, d = len(x), len(y), x.shape[1]
    table = np.full((n + 1, m + 1), np.inf)
    table[0, 0] = 0.0
    for i in range(n):
        low, high = 0, m
        if radius >= 0:
            low = max(0, i - radius - max(0, n - m))
            high = min(m, i + radius + max(0, m - n) + 1)
        for j in range(low, high):
            cost = 0.0
            for k in range(d):
                gap = x[i, k] - y[j, k]
                cost += gap * gap
            table[i + 1, j + 1] = cost + min(table[i, j], table[i, j + 1], table[i + 1, j])
    return table


@kernel
def closed_path(x: _Array, y: _Array, radius: int) -> npt.NDArray[np.int64]:
    """The cheapest warping path; among equally cheap ones the most diagonal.

    Args:
        x: ``(n, d)``, n >= 1.
        y: ``(m, d)``, m >= 1.
        radius: Half-width of the band in samples; negative: no band.

    Returns:
        ``(p, 2)`` matched indices into ``x`` and ``y``, from (0, 0) to (n-1, m-1).
    """
    table = _table(x, y, radius)
    i, j = len(x), len(y)
    path = np.empty((i + j - 1, 2), np.int64)
    at = i + j - 1
    while i > 0 and j > 0:
        at -= 1
        path[at, 0], path[at, 1] = i - 1, j - 1
        best = min(table[i - 1, j - 1], table[i - 1, j], table[i, j - 1])
        if table[i - 1, j - 1] == best:
            i, j = i - 1, j - 1
        elif table[i - 1, j] == best:
            i -= 1
        else:
            j -= 1
    return path[at:]


@kernel
def pairwise_costs(series: _Array, radius: int) -> _Array:
    """``(n, n)`` costs between all pairs of ``(n, K, d)`` series."""
    n = len(series)
    costs = np.zeros((n, n))
    for a in range(n):
        for b in range(a):
            costs[a, b] = costs[b, a] = closed_cost(series[a], series[b], radius)
    return costs


@kernel
def match_means(series: _Array, features: _Array, reference: _Array, radius: int) -> _Array:
    """Every series in the time of a reference: per step the mean of what warping matches to it.

    Args:
        series: ``(n, T, d)`` positions that are aligned.
        features: ``(n, T, f)`` what is averaged.
        reference: ``(K, d)``.
        radius: Half-width of the band in samples; negative: no band.

    Returns:
        ``(n, K, f)``.
    """
    count, steps, width = len(series), len(reference), features.shape[2]
    aligned = np.zeros((count, steps, width))
    for a in range(count):
        matches = np.zeros(steps)
        path = closed_path(series[a], reference, radius)
        for p in range(len(path)):
            i, j = path[p, 0], path[p, 1]
            matches[j] += 1.0
            for k in range(width):
                aligned[a, j, k] += features[a, i, k]
        for j in range(steps):
            for k in range(width):
                aligned[a, j, k] /= matches[j]
    return aligned


@kernel
def dba_step(series: _Array, reference: _Array, radius: int) -> _Array:
    """One step of DTW barycentre averaging (Petitjean et al., 2011): the mean of all samples matched to each step.

    Args:
        series: ``(n, T, d)``.
        reference: ``(K, d)`` average so far.
        radius: Half-width of the band in samples; negative: no band.

    Returns:
        ``(K, d)``.
    """
    steps, d = reference.shape
    total = np.zeros((steps, d))
    matches = np.zeros(steps)
    for a in range(len(series)):
        path = closed_path(series[a], reference, radius)
        for p in range(len(path)):
            i, j = path[p, 0], path[p, 1]
            matches[j] += 1.0
            for k in range(d):
                total[j, k] += series[a, i, k]
    for j in range(steps):
        for k in range(d):
            total[j, k] /= matches[j]
    return total
