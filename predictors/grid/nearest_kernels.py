"""Votes of the nearest of many examples, on plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["votes_of_nearest"]

Floats = npt.NDArray[np.float64]

_UNIT = 1e9
"""Squared distances are counted in units of 1e-9, so that equally near ones stay equally near on every machine."""


@kernel
def votes_of_nearest(
    columns: npt.NDArray[np.integer[Any]],
    values: Floats,
    features: Floats,
    squares: Floats,
    weights: Floats,
    sizes: Floats,
    k: float,
) -> Floats:
    """Sum of the weights of all examples that are as near as the ``k``-th.

    Args:
        columns: ``(m,)`` the query's features that are not zero.
        values: ``(m,)`` these.
        features: ``(width, U)`` features of the examples, one row per feature.
        squares: ``(U,)`` squared lengths of the examples.
        weights: ``(U, K)`` their votes.
        sizes: ``(U,)`` how many neighbours each counts as.
        k: Number of neighbours; all examples count if there are fewer.

    Returns:
        ``(K,)``.
    """
    count, width = weights.shape
    distances = squares.copy()
    for m in range(len(columns)):
        row, twice = features[columns[m]], 2.0 * values[m]
        for u in range(count):
            distances[u] -= twice * row[u]
    for u in range(count):
        distances[u] = np.rint(distances[u] * _UNIT)
    limit = _distance_within_which(distances, sizes, k)
    votes = np.zeros(width)
    for u in range(count):
        if distances[u] <= limit:
            for goal in range(width):
                votes[goal] += weights[u, goal]
    return votes


@kernel
def _distance_within_which(distances: Floats, sizes: Floats, wanted: float) -> float:
    """The smallest distance within which sizes add up to what is wanted; the largest if they nowhere do.

    Quickselect: whatever lies on the wrong side of a pivot is not looked at again.
    """
    values, masses = distances.copy(), sizes.copy()
    low, high = 0, len(values)
    missing = wanted - 1e-9  # sizes are fractions that add up to whole numbers but for rounding
    while True:
        pivot = _middle(values[low], values[(low + high) // 2], values[high - 1])
        # [low, a) below the pivot, [a, b) equal to it, [b, high) above.
        a, i, b = low, low, high
        below, equal = 0.0, 0.0
        while i < b:
            value, mass = values[i], masses[i]
            if value < pivot:
                values[i], masses[i], values[a], masses[a] = values[a], masses[a], value, mass
                below += mass
                a += 1
                i += 1
            elif value > pivot:
                b -= 1
                values[i], masses[i], values[b], masses[b] = values[b], masses[b], value, mass
            else:
                equal += mass
                i += 1
        if below >= missing and a > low:
            high = a
        elif below + equal >= missing or b == high:
            return pivot
        else:
            missing -= below + equal
            low = b


@kernel
def _middle(x: float, y: float, z: float) -> float:
    return max(min(x, y), min(max(x, y), z))
