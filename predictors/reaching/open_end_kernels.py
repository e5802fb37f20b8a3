"""Likelihoods of a reach seen so far, by goal: open-end alignment and Gaussian densities. Kernels on plain arrays.

Open-end warping (Tormene et al., 2009) matches all samples so far to some beginning of the reference. It is computed
row by row, so that a new sample costs O(K) whatever came before.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["advance", "log_densities", "observe"]

_Array = npt.NDArray[np.float64]


@kernel
def advance(
    point: _Array,
    density: _Array,
    reference: _Array,
    low: int,
    high: int,
    decay: float,
    cost: _Array,
    total: _Array,
    weight: _Array,
    first: bool,
) -> int:
    """Take one more sample into an alignment that is open at the end of the reference.

    Row by row, ``cost[k]`` is the least cost of matching all samples so far to steps ``0..k``; ``total`` and ``weight``
    add up a quantity (the log-density) along that match, older samples counting less by ``decay`` per sample. All three
    are updated in place. The first sample is the origin of the reach, the same for every goal, and adds nothing.

    Args:
        point: ``(d,)`` the sample.
        density: ``(K,)`` the quantity for this sample and each step.
        reference: ``(K, d)`` or wider; the first ``d`` columns are aligned to.
        low: First step allowed for this sample.
        high: One past the last.
        decay: Factor of earlier samples' weight.
        cost: ``(K,)`` in and out.
        total: ``(K,)`` in and out.
        weight: ``(K,)`` in and out.
        first: Whether this is the first sample, which begins at step 0.

    Returns:
        The step where the cheapest alignment ends now; the latest among equally cheap ones.
    """
    steps, d = len(reference), len(point)
    gain = 0.0 if first else 1.0
    # What lies to the upper left, before it is overwritten.
    diagonal_cost, diagonal_total, diagonal_weight = np.inf, 0.0, 0.0
    end, least = low, np.inf
    for k in range(steps):
        above_cost, above_total, above_weight = cost[k], total[k], weight[k]
        if k < low or k >= high:
            cost[k] = np.inf
        else:
            here = 0.0
            for c in range(d):
                gap = point[c] - reference[k, c]
                here += gap * gap
            if first and k == 0:
                cost[k], total[k], weight[k] = here, 0.0, 0.0
            else:
                best, sum_, count = np.inf, 0.0, 0.0
                if not first:
                    best, sum_, count = diagonal_cost, decay * diagonal_total, decay * diagonal_weight
                    if above_cost < best:
                        best, sum_, count = above_cost, decay * above_total, decay * above_weight
                if k > 0 and cost[k - 1] < best:
                    best, sum_, count = cost[k - 1], total[k - 1], weight[k - 1]
                cost[k], total[k], weight[k] = here + best, sum_ + gain * density[k], count + gain
            if cost[k] <= least:
                end, least = k, cost[k]
        diagonal_cost, diagonal_total, diagonal_weight = above_cost, above_total, above_weight
    return end


@kernel
def log_densities(feature: _Array, means: _Array, precisions: _Array, log_norms: _Array, out: _Array) -> None:
    """Gaussian log-density of one sample under every step of a goal.

    Args:
        feature: ``(f,)``.
        means: ``(K, f)``.
        precisions: ``(K, f, f)`` inverse covariances.
        log_norms: ``(K,)`` log of the normalising constants.
        out: ``(K,)`` filled.
    """
    width = len(feature)
    gap = np.empty(width)
    for k in range(len(means)):
        for a in range(width):
            gap[a] = feature[a] - means[k, a]
        form = 0.0
        for a in range(width):
            inner = 0.0
            for b in range(width):
                inner += precisions[k, a, b] * gap[b]
            form += gap[a] * inner
        out[k] = log_norms[k] - 0.5 * form


@kernel
def observe(
    points: _Array,
    features: _Array,
    lows: npt.NDArray[np.int64],
    highs: npt.NDArray[np.int64],
    decays: _Array,
    means: _Array,
    precisions: _Array,
    log_norms: _Array,
    state: _Array,
    begun: bool,
) -> _Array:
    """Take in samples one by one; a window of one step follows an index instead of aligning.

    Args:
        points: ``(T, d)`` positions from the start.
        features: ``(T, f)`` what the densities are about; begins with the positions.
        lows: ``(T, G)`` first step allowed for each sample and goal, never decreasing in T.
        highs: ``(T, G)`` one past the last.
        decays: ``(T,)`` what the weight of earlier samples is multiplied by.
        means: ``(G, K, f)``.
        precisions: ``(G, K, f, f)``.
        log_norms: ``(G, K)``.
        state: ``(3, G, K)`` of all samples before: cost, total and weight, see :func:`advance`; updated in place.
        begun: Whether samples were taken in before.

    Returns:
        ``(T, G)`` weighted mean log-density after each sample; 0 while nothing but the origin was seen.
    """
    goals, steps = log_norms.shape
    cost, total, weight = state[0], state[1], state[2]
    scores = np.zeros((len(points), goals))
    density = np.empty(steps)
    for g in range(goals):
        for t in range(len(points)):
            low, high = lows[t, g], highs[t, g]
            first = t == 0 and not begun
            log_densities(
                features[t], means[g, low:high], precisions[g, low:high], log_norms[g, low:high], density[low:high]
            )
            if high - low == 1:
                end = 0
                if not first:
                    total[g, 0] = decays[t] * total[g, 0] + density[low]
                    weight[g, 0] = decays[t] * weight[g, 0] + 1.0
            else:
                end = advance(points[t], density, means[g], low, high, decays[t], cost[g], total[g], weight[g], first)
            if weight[g, end] > 0.0:
                scores[t, g] = total[g, end] / weight[g, end]
    return scores
