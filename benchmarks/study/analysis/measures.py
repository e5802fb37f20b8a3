"""Measures of how participants worked and what they answered, compared within participants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.study.analysis.evaluate import compare, whole_units

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.study.analysis.data import StudyData

__all__ = ["MEASURES", "Family", "compare_family", "mean_rows", "per_condition", "scale_values", "trend_rows"]

MEASURES: Final[dict[str, dict[str, str]]] = {
    "overcooked": {
        "seconds": "completion time, s",
        "path_length": "cells walked",
        "steps": "keys pressed",
        "done": "soups delivered",
        "crossings": "obstacles crossed",
        "idle": "idle, share of time",
    },
    "tabletop": {
        "seconds": "completion time, s",
        "path_length": "path of the hand, m",
        "done": "objects placed",
        "crossings": "obstacles crossed",
        "idle": "hand at rest, share of time",
        "conflicts": "conflicts",
        "goals_lost": "goals lost to the robot",
        "human_idle": "human idle, share of time",
        "robot_idle": "robot idle, share of time",
        "concurrent_activity": "both active, share of time",
        "functional_delay": "functional delay, share of time",
        "decision_time": "robot sure after, s",
        "decided_rightly": "robot sure and right, share of reaches",
    },
}
"""Columns of ``rounds.csv`` that are compared, and what they are called."""
_ADDED: Final = ("seconds", "path_length", "steps", "done", "crossings", "conflicts", "goals_lost")
"""Measures of which a condition with a fixed number of reaches has the sum over its rounds; of others the mean."""


@dataclass(frozen=True, eq=False)
class Family:
    """Measures compared over conditions; p-values hold for all of them together (Holm).

    Attributes:
        means: ``measure, condition, participants, mean, sd, low, high`` (95 % interval of the mean, participants as
            units), over the participants with a value in each condition by itself.
        tests: ``measure, participants, F, df1, df2, p, p_corrected`` (Greenhouse and Geisser) ``p_holm, eta_squared``:
            repeated-measures analyses of variance over the participants with values in all conditions.
        pairs: ``measure, a, b, difference, low, high, p`` (Tukey's), ``hedges_g``.
        unsaid: What could not be compared, and why.
    """

    means: pd.DataFrame
    tests: pd.DataFrame
    pairs: pd.DataFrame
    unsaid: list[str] = field(default_factory=list)


def per_condition(data: StudyData, domain: str, *, fixed_reaches: bool, by: Sequence[str] = ()) -> pd.DataFrame:
    """A row per participant and condition (and what ``by`` names) of the rounds that count.

    Args:
        data: An export.
        domain: Of the study.
        fixed_reaches: Whether a condition ends after a number of reaches, so that rounds are parts of it.
        by: Further columns of ``rounds.csv``: ``sitting``, ``round`` or ``position``.
    """
    rounds = data.of_analysed("rounds")
    rounds = rounds[rounds["counts"] == 1]
    names = [name for name in MEASURES[domain] if name in rounds]
    values = rounds[names].astype(float)
    keyed = rounds[["participant", "condition", *by]].assign(**{name: values[name] for name in names})
    how: dict[str, Any] = {
        name: (lambda column: column.sum(min_count=1)) if fixed_reaches and name in _ADDED else "mean" for name in names
    }
    grouped = keyed.groupby(["participant", "condition", *by], sort=False)
    return grouped.agg(how).reset_index() if len(keyed) else keyed


def scale_values(data: StudyData) -> pd.DataFrame:
    """``participant, condition, sitting, measure, value``: scales that were asked in conditions."""
    scales = data.of_analysed("scales")
    own = scales[(scales["condition"] != "") & scales["value"].notna()]
    return own.assign(measure=own["questionnaire"] + ": " + own["scale"], value=own["value"].astype(float))[
        ["participant", "condition", "sitting", "measure", "value"]
    ].reset_index(drop=True)


def long_form(table: pd.DataFrame, names: Mapping[str, str]) -> pd.DataFrame:
    """A row per participant, condition and measure; measures that nobody has, or that never vary from 0, left out."""
    import pandas as pd

    parts = [
        table[["participant", "condition"]].assign(measure=label, value=table[name].astype(float))
        for name, label in names.items()
        if name in table and table[name].notna().any() and (table[name].fillna(0) != 0).any()
    ]
    return pd.concat(parts, ignore_index=True).dropna(subset=["value"]) if parts else _empty()


def _empty() -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(columns=["participant", "condition", "measure", "value"])


def compare_family(table: pd.DataFrame, conditions: Sequence[str], *, alpha: float = 0.05) -> Family:
    """Compare every measure of a family over conditions.

    Args:
        table: ``participant, condition, measure, value``; several values of a participant are averaged.
        conditions: In their order.
        alpha: Level of tests and intervals.
    """
    import pandas as pd

    from predictors.evaluation.statistics import holm

    means, tests, pairs, unsaid = [], [], [], []
    for measure, part in table.groupby("measure", sort=False):
        own = part.groupby(["participant", "condition"], sort=False)["value"].mean().reset_index()
        own = own.iloc[np.argsort([list(conditions).index(name) for name in own["condition"]], kind="stable")]
        means += [{"measure": measure, **row} for row in mean_rows(own, "condition", "value", alpha)]
        if own["participant"].nunique() > 1 and np.ptp(own["value"].to_numpy(dtype=np.float64)) == 0:
            continue  # the same for everybody everywhere: there is nothing to test
        try:
            found = compare(own, "value", alpha=alpha).overall
        except ValueError as error:
            unsaid.append(f"{measure}: conditions cannot be compared: {error}.")
            continue
        row = found.anova.drop(columns="fraction").iloc[0].to_dict()
        people = whole_units(own, "condition", "value")["participant"].nunique()
        tests.append({"measure": measure, "participants": people, **row})
        pairs.append(found.pairs.drop(columns=["fraction", "cohens_d"]).assign(measure=measure))
    tested = pd.DataFrame(tests)
    if len(tested):
        tested["p_holm"] = holm(tested["p_corrected"])
        columns = ["measure", "participants", "F", "df1", "df2", "p", "p_corrected", "p_holm", "eta_squared"]
        tested = tested[columns]
    table_of_pairs = pd.concat(pairs, ignore_index=True) if pairs else pd.DataFrame()
    if len(table_of_pairs):
        table_of_pairs = table_of_pairs[["measure", *(c for c in table_of_pairs if c != "measure")]]
    return Family(pd.DataFrame(means), tested, table_of_pairs, unsaid)


def mean_rows(table: pd.DataFrame, factor: str, value: str, alpha: float = 0.05) -> list[dict[str, Any]]:
    """Means over participants and intervals of them (Student's t), a row per level of a factor."""
    from scipy import stats

    rows = []
    for level, part in table.groupby(factor, sort=False):
        values = part.groupby("participant")[value].mean().dropna().to_numpy(dtype=np.float64)
        count, mean = len(values), float(values.mean()) if len(values) else float("nan")
        sd = float(values.std(ddof=1)) if count > 1 else float("nan")
        reach = float(stats.t.ppf(1 - alpha / 2, count - 1)) * sd / count**0.5 if count > 1 else float("nan")
        row = {factor: level, "participants": count, "mean": mean, "sd": sd}
        rows.append(row | {"low": mean - reach, "high": mean + reach})
    return rows


def trend_rows(
    table: pd.DataFrame, over: str, names: Mapping[str, str], *, alpha: float = 0.05
) -> list[dict[str, Any]]:
    """How measures change with practice: a slope per participant, and whether its mean is 0 (Student's t).

    Args:
        table: ``participant, condition``, the column ``over`` and measures.
        over: ``"position"`` of a condition in the participant's order, or ``"round"`` in a condition.
        names: Measures and what they are called.
        alpha: Level of the intervals.

    Returns:
        ``measure, over, participants, slope`` (per position or round), ``low, high, p``, of measures that two
        participants or more have at two places or more.
    """
    from scipy import stats

    rows = []
    for name, label in names.items():
        if name not in table:
            continue
        slopes = []
        for _, part in table.dropna(subset=[name, over]).groupby("participant", sort=False):
            at, value = part[over].to_numpy(dtype=float), part[name].to_numpy(dtype=float)
            if len(set(at)) > 1:
                slopes.append(float(np.polyfit(at, value, 1)[0]))
        values = np.array(slopes)
        if len(values) < 2 or np.ptp(values) < 1e-12:
            continue
        spread = float(values.std(ddof=1)) / len(values) ** 0.5
        mean, t = float(values.mean()), float(stats.t.ppf(1 - alpha / 2, len(values) - 1))
        p = float(2 * stats.t.sf(abs(mean) / spread, len(values) - 1))
        row = {"measure": label, "over": over, "participants": len(values), "slope": mean}
        rows.append(row | {"low": mean - t * spread, "high": mean + t * spread, "p": p})
    return rows
