"""Figures of merit from rows of predictions; ties at the top are shared out, as in accuracy."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from predictors.base import TIE_TOLERANCE, TieCredit

__all__ = ["CALIBRATION_BINS", "calibration_error", "clustered_interval", "log_loss", "tied_shares", "weighted_scores"]

CALIBRATION_BINS: Final = 10
"""Equal-width bins of confidence that the calibration error looks at."""


def tied_shares(probabilities: npt.NDArray[np.float64], ties: TieCredit = "fractional") -> npt.NDArray[np.float64]:
    """How much of a prediction goes to each goal: 1 to the top one, 1/k to each of ``k`` tied ones.

    Args:
        probabilities: ``(..., K)``.
        ties: With ``"strict"``, a prediction tied between goals goes to none of them.

    Returns:
        ``(..., K)``; rows sum to one, or to zero for strict ties.
    """
    top = probabilities >= probabilities.max(axis=-1, keepdims=True) - TIE_TOLERANCE
    count = top.sum(axis=-1, keepdims=True)
    return np.where(top, 1.0 / count, 0.0) if ties == "fractional" else np.where(top & (count == 1), 1.0, 0.0)


def weighted_scores(
    confusion: npt.NDArray[np.float64], support: npt.NDArray[np.float64] | None = None
) -> dict[str, float]:
    """Precision, recall and F1, averaged over goals by their number of examples.

    Without ties these are scikit-learn's ``average="weighted", zero_division=0``; with ties, those of samples split
    into fractions.

    Args:
        confusion: ``(K, K)`` examples of the row's goal predicted as the column's.
        support: ``(K,)`` examples of each goal; row sums by default (strict ties fall out of these).
    """
    counts = confusion.sum(axis=1) if support is None else support
    hits, named = np.diag(confusion), confusion.sum(axis=0)
    precision = np.divide(hits, named, out=np.zeros(len(hits)), where=named > 0)
    recall = np.divide(hits, counts, out=np.zeros(len(hits)), where=counts > 0)
    both = precision + recall
    f1 = np.divide(2 * precision * recall, both, out=np.zeros(len(hits)), where=both > 0)
    weights = counts / counts.sum()
    return {"precision": float(weights @ precision), "recall": float(weights @ recall), "f1": float(weights @ f1)}


def log_loss(probability: npt.NDArray[np.float64]) -> float:
    """Mean of ``-log p`` of the true goals; ``p`` is kept off 0 by the machine epsilon, as scikit-learn does."""
    return float(-np.log(np.clip(probability, np.finfo(np.float64).eps, 1.0)).mean())


def calibration_error(
    confidence: npt.NDArray[np.float64], correct: npt.NDArray[np.float64], bins: int = CALIBRATION_BINS
) -> float:
    """Expected calibration error: |accuracy - confidence| per bin of confidence, weighted by the bins' shares.

    Guo, Pleiss, Sun and Weinberger, *On Calibration of Modern Neural Networks* (ICML 2017), Eq. 3.

    Args:
        confidence: ``(n,)`` probability of the top goal.
        correct: ``(n,)`` 0 to 1.
        bins: Number of bins of equal width over [0, 1].
    """
    place = np.clip(np.ceil(confidence * bins - 1e-9).astype(np.intp) - 1, 0, bins - 1)
    gaps = np.bincount(place, weights=correct - confidence, minlength=bins)
    return float(np.abs(gaps).sum() / len(confidence))


def clustered_interval(
    values: npt.NDArray[np.float64], units: npt.NDArray[np.integer], level: float = 0.95
) -> tuple[float, float, float]:
    """A mean and its confidence interval where values of one unit (a participant) depend on each other.

    The mean is over values; its variance sums the units' total deviations (cluster-robust, with factor
    ``m/(m-1)`` for ``m`` units) and the quantile is Student's with ``m - 1`` degrees of freedom. With one value per
    unit this is the ordinary t interval. A single unit has no interval (NaN).

    Returns:
        ``(mean, low, high)``; the ends are kept inside [0, 1].
    """
    from scipy import stats

    mean = float(values.mean())
    totals = np.bincount(units, weights=values - mean)
    number = len(totals)
    if number < 2:
        return mean, float("nan"), float("nan")
    error = float(np.sqrt(number / (number - 1) * (totals**2).sum()) / len(values))
    reach = float(stats.t.ppf(0.5 + level / 2, number - 1)) * error
    return mean, max(mean - reach, 0.0), min(mean + reach, 1.0)
