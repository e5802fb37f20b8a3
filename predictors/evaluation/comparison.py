"""Whether conditions or predictors differ: tables of values in, tables of tests out.

Tests compare *units* that are independent of one another. Folds of one cross-validation share their data: with
4 folds x 3 repeats as units, a true null hypothesis is rejected about every second time. The default unit is therefore
the participant, whose values are averaged first. The tests themselves are in :mod:`predictors.evaluation.statistics`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from legible_envs.support.validation import choice, real
from predictors.evaluation.statistics import (
    effect_sizes,
    holm,
    one_way_anova,
    repeated_measures_anova,
    tukey_half_width,
    tukey_pair,
)

if TYPE_CHECKING:
    import pandas as pd

    from predictors.evaluation.results import Evaluation

__all__ = ["Comparison", "compare_conditions"]

Unit = Literal["participant", "trajectory", "fold"]
Design = Literal["auto", "between", "within"]


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
        definition: Of the values, if the evaluation gave one.
        omitted: Sentences about predictors that are not compared because they could not be evaluated.
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
    omitted: tuple[str, ...] = ()


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
    """Test whether goals are predicted better in some conditions, or by some predictors, than in others.

    Args:
        results: An evaluation, its ``table``, or several by the name of their condition (which then is the factor).
        factor: The column to compare: ``"condition"``, ``"layout"`` or ``"predictor"``.
        unit: What is independent: values are averaged within each before anything is tested, so that a participant
            counts once, however many trajectories are recorded; means differ from those over trajectories. ``"fold"``
            is the practice of treating folds as samples; it is warned about.
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
    alpha = real("alpha", alpha, 0, 1, closed="neither")
    choice("at", at, ("each", "mean"))
    choice("correct_fractions", correct_fractions, ("holm", None))
    if isinstance(results, Mapping):
        factor = "condition" if factor == "layout" else factor
    table = _one_table(results)
    omitted = _about_omitted(table, None if factor == "predictor" else predictor)
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
        only = f"nothing to compare: the only {factor} is {levels[0]!r}" if levels else "no rows to compare"
        raise ValueError("; ".join((only, *omitted)))
    chosen, table, dropped = _designed(table, factor, unit, levels, design)
    tables = _tests(table, factor, levels, value, chosen, at, alpha)
    if correct_fractions == "holm":
        _correct(tables)
    anova, means, pairs = tables
    definition = str(table.attrs.get("evaluation", table.attrs.get("definition", "")))
    return Comparison(anova, means, pairs, factor, unit, chosen, alpha, dropped, definition, omitted)


def _about_omitted(table: pd.DataFrame, predictor: str | None) -> tuple[str, ...]:
    """Sentences about predictors without values; only about one if it is named."""
    notes = [str(note) for note in table.attrs.get("omitted", ())]
    return tuple(note for note in notes if predictor is None or note.startswith(f"{predictor} was not evaluated"))


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
    # Trajectories are numbered within each evaluation; participants keep their names.
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
    whole.attrs["omitted"] = [
        f"{note} (in {name!r})" for name, part in parts.items() for note in part.attrs.get("omitted", ())
    ]
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
            why = "".join(f"; {note}" for note in _about_omitted(table, predictor))
            raise ValueError(f"no values of predictor {predictor!r}; the table has {names}{why}")
        if predictor is not None:
            table = table[table["predictor"] == predictor]
    if not np.isfinite(table[value].to_numpy(dtype=np.float64)).all():
        raise ValueError(f"column {value!r} holds missing values; leave these rows out")
    return table


def _with_units(table: pd.DataFrame, factor: str, unit: str) -> pd.DataFrame:
    """The table with a column ``_unit``: the same text, the same independent unit."""
    needed = {"participant": ["participant"], "trajectory": ["trajectory"], "fold": ["repeat", "fold"]}
    choice("unit", unit, needed)
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
    choice("design", design, ("auto", "between", "within"))
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
        result = repeated_measures_anova(np.column_stack(samples)) if design == "within" else one_way_anova(samples)
        anova.append({"fraction": fraction, **result.row})
        for level, sample in zip(levels, samples, strict=True):
            half = tukey_half_width(result.error, len(sample), len(levels), result.freedom, alpha)
            row = {"fraction": fraction, factor: level, "n": len(sample), "mean": sample.mean()}
            row |= {"sd": sample.std(ddof=1), "half_width": half}
            means.append(row | {"low": sample.mean() - half, "high": sample.mean() + half})
        for i, j in combinations(range(len(levels)), 2):
            row = {"fraction": fraction, "a": levels[i], "b": levels[j]}
            row |= tukey_pair(samples[i], samples[j], result.error, result.freedom, len(levels), alpha)
            pairs.append(row | effect_sizes(samples[i], samples[j]))
    return pd.DataFrame(anova), pd.DataFrame(means), pd.DataFrame(pairs)


def _correct(tables: tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]) -> None:
    anova, _, pairs = tables
    anova["p_holm"] = holm(anova["p_corrected"] if "p_corrected" in anova else anova["p"])
    pairs["p_holm"] = np.nan
    for _, part in pairs.groupby(["a", "b"], sort=False):
        pairs.loc[part.index, "p_holm"] = holm(part["p"])
