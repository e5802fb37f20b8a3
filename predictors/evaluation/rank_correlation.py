"""Spearman's rank correlation of many pairs of rows at once, and what a number of places can show of it.

Ranks are scipy's. :func:`scipy.stats.spearmanr` takes one pair at a time, too slow for thousands of resamples.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["detectable", "spearman", "spearman_rows"]

Floats = npt.NDArray[np.float64]


def spearman(x: Floats, y: Floats) -> float:
    """Spearman's rank correlation, ties averaged; NaN where one side does not vary or there are fewer than three."""
    return float(spearman_rows(x[None], y[None])[0])


def spearman_rows(x: Floats, y: Floats) -> Floats:
    """``(k,)`` :func:`spearman` of each row of ``x (k, n)`` with that of ``y (k, n)``."""
    from scipy.stats import rankdata

    if x.shape[1] < 3:
        return np.full(len(x), np.nan)
    a, b = (rankdata(values, axis=1) - (x.shape[1] + 1) / 2 for values in (x, y))
    spread = np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1))
    varies = spread > 0
    return np.where(varies, (a * b).sum(axis=1) / np.where(varies, spread, 1.0), np.nan)


def detectable(n: int, power: float = 0.8, alpha: float = 0.05) -> float:
    """The rank correlation that a two-sided test on ``n`` pairs finds with a given power.

    By Fisher's z with the variance 1.06 / (n - 3) of ranks (Fieller, Hartley and Pearson, 1957); NaN for ``n < 5``.
    """
    from scipy.stats import norm

    if n < 5:
        return float("nan")
    return float(np.tanh((norm.ppf(1 - alpha / 2) + norm.ppf(power)) * np.sqrt(1.06 / (n - 3))))
