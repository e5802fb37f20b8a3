"""Whether conditions or predictors differ: analysis of variance, Tukey's test, effect sizes.

What is tested are *units* that are independent of one another. Folds of one cross-validation share their data: with
4 folds x 3 repeats as units, a true null hypothesis is rejected about every second time. The default unit is therefore
the participant, whose values are averaged first.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd

    from predictors.evaluation.results import Evaluation

__all__ = ["Comparison", "compare_conditions", "holm", "tukey_half_width"]

Unit = Literal["participant", "trajectory", "fold"]
Design = Literal["auto", "between", "within"]
Values = npt.NDArray[np.float64]

_NO_VARIANCE = 1e-12
"""Mean squares below this are zero: values are accuracies in [0, 1], and what is left is rounding."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What :func:`compare_conditions` found. Tables have a row per fraction (and level, and pair).

    Attributes:
        anova: ``fraction, F, df1, df2, p, eta_squared`` (share of the variance; partial within participants); within
            participants also ``epsilon`` and ``p_corrected`` (Greenhouse-Geisser); with Holm also ``p_holm``.
        means: ``fraction``, the factor, ``n, mean, sd, half_width, low, high``: two bands of
            ``q * sqrt(MSE / n) / 2`` that do not overlap are a difference by Tukey's test.
        pairs: ``fraction, a, b, difference`` (a - b), ``low, high`` (simultaneous interval), ``p`` (Tukey),
            ``cohens_d``, ``hedges_g`` (both by the pooled spread of units); with Holm also ``p_holm``.
        factor: What was compared.
        unit: What counted as independent.
        design: ``"between"`` (other units in each condition) or ``"within"`` (the same ones in all).
        alpha: Level of the bands and intervals.
        dropped: Units that were left out because a condition lacks them.
        definition: What the values are, if the evaluation said so.
    """

    anova: pd.DataFrame = field(repr=False)
    means: pd.DataFrame = field(repr=False)
    pairs: pd.DataFrame = field(repr=False)
    factor: str
    unit: str
    design: str
    alpha: float
    dropped: int = 0
    definition: str = ""


def compare_conditions(
    results: Evaluation | pd.DataFrame | Mapping[str, Evaluation | pd.DataFrame],
    *,
    factor: str = "condition",
    unit: Unit = "participant",
    design: Design = "auto",
    predictor: str | None = None,
    value: str = "correct",
    at: Literal["each", "mean"] = "each",
    correct_fractions: Literal["holm"] | None = None,
    alpha: float = 0.05,
) -> Comparison:
    """Test whether people are read better in some conditions, or by some predictors, than in others.

    Args:
        results: An evaluation, its ``table``, or several by the name of their condition (which then is the factor).
        factor: The column to compare: ``"condition"``, ``"layout"`` or ``"predictor"``.
        unit: What is independent: values are averaged within each before anything is tested, so that a person counts
            once, however many walks are recorded; means differ from those over walks. ``"fold"`` is the practice of
            treating folds as samples; it is warned about.
        design: ``"within"`` is a repeated-measures ANOVA, for the same units in every condition; ``"between"`` the
            one-way ANOVA. ``"auto"`` takes ``"within"`` if all units are in all conditions and ``"between"`` if none is
            in two.
        predictor: Whose values, where there are several and they are not the factor.
        value: The column that holds them.
        at: ``"each"`` fraction observed, or their ``"mean"`` (``fraction`` is then NaN).
        correct_fractions: ``"holm"`` adds p-values that hold over all fractions together (per pair in ``pairs``).
        alpha: Level of Tukey's bands and intervals.

    Returns:
        Tables; see :class:`Comparison`. Where no value varies within conditions, ``F`` is infinite and ``p`` 0 if means
        differ, ``F`` is NaN and ``p`` 1 if all values are equal.

    Raises:
        ValueError: Fewer than two conditions or than two units in one, missing columns or values, several predictors,
            results of different cuts or candidate sets, or units that are in some conditions but not in all.

    Warns:
        UserWarning: Folds as units; units dropped because a condition lacks them.
    """
    if not 0 < alpha < 1:
        raise ValueError(f"`alpha` must be between 0 and 1, got {alpha!r}")
    if at not in ("each", "mean"):
        raise ValueError(f"`at` must be 'each' or 'mean', got {at!r}")
    if correct_fractions not in (None, "holm"):
        raise ValueError(f"`correct_fractions` must be 'holm' or None, got {correct_fractions!r}")
    if isinstance(results, Mapping):
        factor = "condition" if factor == "layout" else factor
    table = _one_table(results)
    table = _chosen(table, factor, predictor, value)
    if unit == "fold":
        warnings.warn(
            "folds share their trajectories and are not independent: with them as units, true null hypotheses are "
            "rejected far more often than alpha; use unit='participant'",
            UserWarning,
            stacklevel=2,
        )
    table = _with_units(table, factor, unit)
    levels = list(dict.fromkeys(table[factor].tolist()))
    if len(levels) < 2:
        raise ValueError(f"nothing to compare: the only {factor} is {levels[0]!r}" if levels else "no rows to compare")
    chosen, table, dropped = _designed(table, factor, unit, levels, design)
    tables = _tests(table, factor, levels, value, chosen, at, alpha)
    if correct_fractions == "holm":
        _correct(tables)
    anova, means, pairs = tables
    definition = str(table.attrs.get("evaluation", table.attrs.get("definition", "")))
    return Comparison(anova, means, pairs, factor, unit, chosen, alpha, dropped, definition)


# -- what is compared -------------------------------------------------------------------------------------------------


def _one_table(results: Any) -> pd.DataFrame:
    import pandas as pd

    if not isinstance(results, Mapping):
        return _rows_of(results)
    parts = {str(name): _rows_of(part) for name, part in results.items()}
    if not parts:
        raise ValueError("no results to compare")
    for key in ("cut", "ties", "candidate_set"):
        found = {part.attrs[key] for part in parts.values() if key in part.attrs}
        if len(found) > 1:
            raise ValueError(f"results of different {key} {sorted(map(str, found))} must not be compared")
    # Trajectories are numbered within each evaluation; people keep their names.
    whole = pd.concat(
        [
            part.assign(condition=name, trajectory=[f"{name}/{number}" for number in part["trajectory"]])
            if "trajectory" in part
            else part.assign(condition=name)
            for name, part in parts.items()
        ],
        ignore_index=True,
    )
    whole.attrs.update(next(iter(parts.values())).attrs)
    return whole


def _rows_of(results: Any) -> pd.DataFrame:
    import pandas as pd

    table = getattr(results, "table", results)
    if not isinstance(table, pd.DataFrame):
        raise ValueError(f"expected an evaluation or a table, got {type(results).__name__}")
    return table


def _chosen(table: pd.DataFrame, factor: str, predictor: str | None, value: str) -> pd.DataFrame:
    missing = [name for name in (factor, value) if name not in table]
    if missing:
        raise ValueError(f"the table has no column {missing[0]!r}; it has {list(table.columns)}")
    if "predictor" in table and factor != "predictor":
        names = list(dict.fromkeys(table["predictor"]))
        if predictor is None and len(names) > 1:
            raise ValueError(f"say whose values to compare with predictor=; the table has {names}")
        if predictor is not None and predictor not in names:
            raise ValueError(f"no values of predictor {predictor!r}; the table has {names}")
        if predictor is not None:
            table = table[table["predictor"] == predictor]
    if not np.isfinite(table[value].to_numpy(dtype=np.float64)).all():
        raise ValueError(f"column {value!r} holds missing values; leave these rows out")
    return table


def _with_units(table: pd.DataFrame, factor: str, unit: str) -> pd.DataFrame:
    """The table with a column ``_unit``: the same text, the same independent unit."""
    needed = {"participant": ["participant"], "trajectory": ["trajectory"], "fold": ["repeat", "fold"]}
    if unit not in needed:
        raise ValueError(f"`unit` must be one of {list(needed)}, got {unit!r}")
    missing = [name for name in needed[unit] if name not in table]
    if missing:
        raise ValueError(f"unit {unit!r} needs the column {missing[0]!r}")
    names = table[needed[unit][0]].astype(str)
    if unit == "participant" and (names == "").any():
        raise ValueError("some rows name no participant; name them, or use unit='trajectory'")
    if unit == "fold":
        names = names + "/" + table["fold"].astype(str)
        if factor != "predictor":  # fold 1 of one condition has nothing to do with fold 1 of another
            names = table[factor].astype(str) + "/" + names
    return table.assign(_unit=names)


def _designed(
    table: pd.DataFrame, factor: str, unit: str, levels: Sequence[Any], design: str
) -> tuple[str, pd.DataFrame, int]:
    """Between or within, and only the units that this design can use."""
    if design not in ("auto", "between", "within"):
        raise ValueError(f"`design` must be 'auto', 'between' or 'within', got {design!r}")
    seen = table.groupby("_unit")[factor].nunique()
    if design == "auto":
        if (seen == len(levels)).all():
            design = "within"
        elif (seen == 1).all():
            design = "between"
        else:
            whole = int((seen == len(levels)).sum())
            raise ValueError(
                f"of {len(seen)} {unit}s, {whole} are in all {len(levels)} conditions and {int((seen == 1).sum())} in "
                "one; say design='within' to keep the former only, or design='between' to take all for independent"
            )
    if design == "between" or (seen == len(levels)).all():
        return design, table, 0
    kept = seen.index[seen == len(levels)]
    dropped = len(seen) - len(kept)
    warnings.warn(
        f"{dropped} of {len(seen)} {unit}s are not in every condition and were left out", UserWarning, stacklevel=3
    )
    return design, table[table["_unit"].isin(kept)], dropped


# -- the tests --------------------------------------------------------------------------------------------------------


def _tests(
    table: pd.DataFrame, factor: str, levels: Sequence[Any], value: str, design: str, at: str, alpha: float
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    import pandas as pd

    slices: list[tuple[float, pd.DataFrame]] = [(float("nan"), table)]
    if at == "each" and "fraction" in table:
        slices = [(float(fraction), part) for fraction, part in table.groupby("fraction", sort=True)]  # type: ignore[arg-type]
    anova, means, pairs = [], [], []
    for fraction, part in slices:
        wide = part.groupby(["_unit", factor], sort=False)[value].mean().unstack(factor)
        wide = wide.reindex(columns=list(levels))
        samples = [wide[level].dropna().to_numpy(dtype=np.float64) for level in levels]
        for level, sample in zip(levels, samples, strict=True):
            if len(sample) < 2:
                raise ValueError(f"{factor} {level!r} has {len(sample)} unit(s) at fraction {fraction}; 2 are needed")
        if design == "within" and len({len(sample) for sample in samples}) > 1:
            raise ValueError(f"some units lack values at fraction {fraction}")
        result, error, freedom = _within(np.column_stack(samples)) if design == "within" else _between(samples)
        anova.append({"fraction": fraction, **result})
        for level, sample in zip(levels, samples, strict=True):
            half = tukey_half_width(error, len(sample), len(levels), freedom, alpha)
            row = {"fraction": fraction, factor: level, "n": len(sample), "mean": sample.mean()}
            row |= {"sd": sample.std(ddof=1), "half_width": half}
            means.append(row | {"low": sample.mean() - half, "high": sample.mean() + half})
        for i, j in combinations(range(len(levels)), 2):
            row = {"fraction": fraction, "a": levels[i], "b": levels[j]}
            row |= _tukey(samples[i], samples[j], error, freedom, len(levels), alpha)
            pairs.append(row | _effect(samples[i], samples[j]))
    return pd.DataFrame(anova), pd.DataFrame(means), pd.DataFrame(pairs)


def _between(samples: Sequence[Values]) -> tuple[dict[str, float], float, int]:
    """One-way ANOVA: its row, the mean square error and its degrees of freedom."""
    total, count = np.concatenate(samples), len(samples)
    grand = total.mean()
    between = sum(len(sample) * (sample.mean() - grand) ** 2 for sample in samples)
    rest = sum(((sample - sample.mean()) ** 2).sum() for sample in samples)
    freedom = len(total) - count
    row = _f_test(float(between), count - 1, float(rest), freedom)
    return row, float(rest) / freedom, freedom


def _within(table: Values) -> tuple[dict[str, float], float, int]:
    """Repeated-measures ANOVA of ``(units, conditions)``, with Greenhouse and Geisser's correction."""
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
    epsilon = 1.0 if square < _NO_VARIANCE**2 else float(np.trace(covariance) ** 2 / ((count - 1) * square))
    epsilon = min(max(epsilon, 1 / (count - 1)), 1.0)
    row["epsilon"] = epsilon
    finite = np.isfinite(row["F"])
    row["p_corrected"] = float(stats.f.sf(row["F"], epsilon * (count - 1), epsilon * freedom)) if finite else row["p"]
    return row, rest / freedom, freedom


def _f_test(between: float, df1: int, rest: float, df2: int) -> dict[str, float]:
    from scipy import stats

    effect, error = between / df1, rest / df2
    if error < _NO_VARIANCE:
        equal = effect < _NO_VARIANCE
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
    return 0.0 if error < _NO_VARIANCE else _range_quantile(1 - alpha, count, freedom) * float(np.sqrt(error / n)) / 2


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


def _tukey(a: Values, b: Values, error: float, freedom: int, count: int, alpha: float) -> dict[str, float]:
    """Tukey-Kramer for one pair: difference, simultaneous interval, p."""
    difference = float(a.mean() - b.mean())
    if error < _NO_VARIANCE:
        p = 1.0 if abs(difference) < np.sqrt(_NO_VARIANCE) else 0.0
        return {"difference": difference, "low": difference, "high": difference, "p": p}
    scale = float(np.sqrt(error / 2 * (1 / len(a) + 1 / len(b))))
    reach = _range_quantile(1 - alpha, count, freedom) * scale
    p = _range_tail(abs(difference) / scale, count, freedom)
    return {"difference": difference, "low": difference - reach, "high": difference + reach, "p": p}


def _effect(a: Values, b: Values) -> dict[str, float]:
    """Cohen's d with the pooled standard deviation, and Hedges' g (Hedges 1981, the approximate correction)."""
    freedom = len(a) + len(b) - 2
    pooled = float(np.sqrt((((a - a.mean()) ** 2).sum() + ((b - b.mean()) ** 2).sum()) / freedom))
    difference = float(a.mean() - b.mean())
    if pooled**2 < _NO_VARIANCE:
        d = 0.0 if abs(difference) < np.sqrt(_NO_VARIANCE) else float(np.copysign(np.inf, difference))
    else:
        d = difference / pooled
    return {"cohens_d": d, "hedges_g": d * (1 - 3 / (4 * freedom - 1))}


def holm(p: npt.ArrayLike) -> Values:
    """Holm's step-down adjustment of p-values; NaN stay NaN and do not count."""
    values = np.asarray(p, dtype=np.float64)
    known = np.flatnonzero(~np.isnan(values))
    order = known[np.argsort(values[known], kind="stable")]
    adjusted = np.full(values.shape, np.nan)
    steps = values[order] * np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0) if len(order) else steps
    return adjusted


def _correct(tables: tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]) -> None:
    anova, _, pairs = tables
    anova["p_holm"] = holm(anova["p_corrected"] if "p_corrected" in anova else anova["p"])
    pairs["p_holm"] = np.nan
    for _, part in pairs.groupby(["a", "b"], sort=False):
        pairs.loc[part.index, "p_holm"] = holm(part["p"])
