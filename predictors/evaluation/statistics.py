"""Tests of significance and effect sizes of samples: arrays in, numbers out.

A thin layer over :mod:`scipy.stats`, which gives the distributions; what is added is the analysis of variance with its
error term (for Tukey's bands), repeated measures, and a stated answer where nothing varies. See
``docs/decisions/0002-statistics.md``. For tables of values, see :func:`predictors.evaluation.compare_conditions`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = [
    "Anova",
    "effect_sizes",
    "hedges_g",
    "holm",
    "one_way_anova",
    "repeated_measures_anova",
    "tukey_half_width",
    "tukey_pair",
]

Values = npt.NDArray[np.float64]

NO_VARIANCE: Final = 1e-12
"""Mean squares below this are zero: values are accuracies in [0, 1] or of that order, and what is left is rounding."""


class Anova(NamedTuple):
    """An analysis of variance.

    Attributes:
        row: ``F, df1, df2, p, eta_squared`` and what a design adds. Where no value varies within conditions, ``F`` is
            infinite and ``p`` 0 if means differ, ``F`` is NaN and ``p`` 1 if all values are equal.
        error: Mean square error.
        freedom: Its degrees of freedom.
    """

    row: dict[str, float]
    error: float
    freedom: int


def one_way_anova(samples: Sequence[Values]) -> Anova:
    """One-way analysis of variance of independent samples, two values or more in each."""
    total, count = np.concatenate(samples), len(samples)
    grand = total.mean()
    between = sum(len(sample) * (sample.mean() - grand) ** 2 for sample in samples)
    rest = sum(((sample - sample.mean()) ** 2).sum() for sample in samples)
    freedom = len(total) - count
    row = _f_test(float(between), count - 1, float(rest), freedom)
    return Anova(row, float(rest) / freedom, freedom)


def repeated_measures_anova(table: Values) -> Anova:
    """Repeated-measures analysis of variance of ``(units, conditions)``.

    Its row also has ``epsilon`` and ``p_corrected``, the correction of Greenhouse and Geisser (1959).
    """
    from scipy import stats

    number, count = table.shape
    grand = table.mean()
    between = number * ((table.mean(axis=0) - grand) ** 2).sum()
    residual = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0) + grand
    rest, freedom = float((residual**2).sum()), (number - 1) * (count - 1)
    row = _f_test(float(between), count - 1, rest, freedom)
    centre = np.eye(count) - 1 / count
    covariance = centre @ np.cov(table, rowvar=False) @ centre
    square = float((covariance**2).sum())
    epsilon = 1.0 if square < NO_VARIANCE**2 else float(np.trace(covariance) ** 2 / ((count - 1) * square))
    epsilon = min(max(epsilon, 1 / (count - 1)), 1.0)
    row["epsilon"] = epsilon
    finite = np.isfinite(row["F"])
    row["p_corrected"] = float(stats.f.sf(row["F"], epsilon * (count - 1), epsilon * freedom)) if finite else row["p"]
    return Anova(row, rest / freedom, freedom)


def _f_test(between: float, df1: int, rest: float, df2: int) -> dict[str, float]:
    from scipy import stats

    effect, error = between / df1, rest / df2
    if error < NO_VARIANCE:
        equal = effect < NO_VARIANCE
        value, p, share = (float("nan"), 1.0, 0.0) if equal else (float("inf"), 0.0, 1.0)
    else:
        value, share = effect / error, between / (between + rest)
        p = float(stats.f.sf(value, df1, df2))
    return {"F": value, "df1": df1, "df2": df2, "p": p, "eta_squared": share}


def tukey_half_width(error: float, n: float, count: int, freedom: int, alpha: float = 0.05) -> float:
    """Half the least difference that Tukey's test calls significant: ``q * sqrt(MSE / n) / 2``.

    Two means whose bands of this half-width do not overlap differ significantly (exactly so for equal ``n``).

    Args:
        error: Mean square error of the ANOVA.
        n: Units behind the mean.
        count: Number of means compared.
        freedom: Degrees of freedom of the error.
        alpha: Family-wise level.

    Returns:
        The half-width; 0 where nothing varies.
    """
    return 0.0 if error < NO_VARIANCE else _range_quantile(1 - alpha, count, freedom) * float(np.sqrt(error / n)) / 2


@lru_cache(maxsize=256)  # a quantile takes a tenth of a second, and is the same for every fraction
def _range_quantile(level: float, count: int, freedom: int) -> float:
    from scipy import stats

    if count == 2:  # the range of two is a difference: Student's t
        return float(np.sqrt(2) * stats.t.ppf(0.5 + level / 2, freedom))
    return float(stats.studentized_range.ppf(level, count, freedom))


@lru_cache(maxsize=8192)  # the same comparison is often asked for a table, a figure and a test
def _range_tail(value: float, count: int, freedom: int) -> float:
    from scipy import stats

    if count == 2:
        return float(2 * stats.t.sf(value / np.sqrt(2), freedom))
    return float(np.clip(stats.studentized_range.sf(value, count, freedom), 0.0, 1.0))


def tukey_pair(a: Values, b: Values, error: float, freedom: int, count: int, alpha: float) -> dict[str, float]:
    """Tukey and Kramer's test of one pair of samples out of ``count``: ``difference, low, high, p``.

    Args:
        a: One sample.
        b: The other; differences are a - b.
        error: Mean square error of the ANOVA.
        freedom: Its degrees of freedom.
        count: Number of samples compared.
        alpha: Family-wise level of the interval.
    """
    difference = float(a.mean() - b.mean())
    if error < NO_VARIANCE:
        p = 1.0 if abs(difference) < np.sqrt(NO_VARIANCE) else 0.0
        return {"difference": difference, "low": difference, "high": difference, "p": p}
    scale = float(np.sqrt(error / 2 * (1 / len(a) + 1 / len(b))))
    reach = _range_quantile(1 - alpha, count, freedom) * scale
    p = _range_tail(abs(difference) / scale, count, freedom)
    return {"difference": difference, "low": difference - reach, "high": difference + reach, "p": p}


def effect_sizes(a: Values, b: Values) -> dict[str, float]:
    """``cohens_d`` and ``hedges_g`` of two samples; see :func:`hedges_g` for samples that do not vary."""
    d = _cohens_d(a, b)
    return {"cohens_d": d, "hedges_g": d * _small_sample_factor(a, b)}


def hedges_g(a: Values, b: Values) -> float:
    """Difference of two means in units of their pooled spread, corrected for small samples (Hedges, 1981).

    The correction is the approximate one, 1 - 3 / (4 (n_a + n_b - 2) - 1).

    Args:
        a: ``(n_a,)`` values.
        b: ``(n_b,)`` values.

    Returns:
        (mean of a - mean of b) / pooled standard deviation * correction. NaN where a sample has fewer than two values:
        its spread is unknown. Where nothing varies within either sample (pooled variance below 1e-12), 0 if their
        means are equal (to 1e-6), and infinite with the sign of the difference if they are not.
    """
    if min(len(a), len(b)) < 2:
        return float("nan")
    return _cohens_d(a, b) * _small_sample_factor(a, b)


def _cohens_d(a: Values, b: Values) -> float:
    freedom = len(a) + len(b) - 2
    pooled = float(np.sqrt((((a - a.mean()) ** 2).sum() + ((b - b.mean()) ** 2).sum()) / freedom))
    difference = float(a.mean() - b.mean())
    if pooled**2 < NO_VARIANCE:
        return 0.0 if abs(difference) < np.sqrt(NO_VARIANCE) else float(np.copysign(np.inf, difference))
    return difference / pooled


def _small_sample_factor(a: Values, b: Values) -> float:
    return 1 - 3 / (4 * (len(a) + len(b) - 2) - 1)


def holm(p: npt.ArrayLike) -> Values:
    """Holm's step-down adjustment of p-values; NaN stay NaN and do not count."""
    values = np.asarray(p, dtype=np.float64)
    known = np.flatnonzero(~np.isnan(values))
    order = known[np.argsort(values[known], kind="stable")]
    adjusted = np.full(values.shape, np.nan)
    steps = values[order] * np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0) if len(order) else steps
    return adjusted
