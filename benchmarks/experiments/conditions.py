"""Conditions compared over their layouts and participants: tables and tests."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from legible_envs.support.names import file_name

if TYPE_CHECKING:
    import pandas as pd

    from predictors.evaluation.comparison import Comparison

__all__ = [
    "Agreement",
    "Comparisons",
    "agreements",
    "beside_published",
    "compare_layouts",
    "compare_participants",
    "figures_of_merit",
    "in_order",
    "slug",
    "stacked",
    "variance_rows",
]


def slug(*words: str) -> str:
    """A name of a file."""
    text = "".join(c if c.isalnum() else "_" for c in "_".join(words).lower())
    while "__" in text:
        text = text.replace("__", "_")
    return file_name(text.strip("_"))


def in_order(table: pd.DataFrame, **orders: Sequence[Any]) -> pd.DataFrame:
    """Rows sorted by columns whose values have an order; the first column counts most."""
    ranks = [table[name].map({value: i for i, value in enumerate(order)}).to_numpy() for name, order in orders.items()]
    return table.iloc[np.lexsort(ranks[::-1])].reset_index(drop=True)


def stacked(parts: Mapping[str, pd.DataFrame], name: str) -> pd.DataFrame:
    """Tables below one another, told apart by a first column."""
    import pandas as pd

    table = pd.concat([part.assign(**{name: key}) for key, part in parts.items()], ignore_index=True)
    return table[[name, *(column for column in table if column != name)]]


# -- tables -----------------------------------------------------------------------------------------------------------


def figures_of_merit(rows: pd.DataFrame, orders: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    """Means over fractions and layouts, and ``accuracy_sd``, the spread of accuracy between layouts.

    Args:
        rows: ``metrics`` rows, as of :func:`benchmarks.experiments.trial_rows.accuracy_rows`.
        orders: The columns that there is a row for each combination of, and their values in order.
    """
    keys, names = list(orders), ["accuracy", "f1", "precision", "recall", "log_loss", "calibration_error"]
    grouped = rows.groupby([*keys, "layout"], sort=False)[names].mean().groupby(keys, sort=False)
    table = grouped.mean()
    table.insert(1, "accuracy_sd", grouped["accuracy"].std())
    return in_order(table.reset_index(), **orders)


def beside_published(published: Mapping[str, Mapping[str, float]], ours: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """A row per condition of the paper: each of its figures, named ``"f1, paper"``, and ours, ``"f1, NAME"``.

    Args:
        published: The paper's figures by condition and name.
        ours: By name, tables with ``condition`` (once each) and the same figures.
    """
    import pandas as pd

    rows, own = [], {who: table.set_index("condition") for who, table in ours.items()}
    for condition, known in published.items():
        row: dict[str, object] = {"condition": condition}
        for name, value in known.items():
            row[f"{name}, paper"] = value
            row |= {f"{name}, {who}": float(table[name][condition]) for who, table in own.items()}
        rows.append(row)
    return pd.DataFrame(rows)


@dataclasses.dataclass(frozen=True)
class Agreement:
    """How figures of ours agree with the paper's.

    Attributes:
        ranked: Conditions by our figures, the best first.
        swapped: How many pairs of conditions are in another order than in the paper.
        gain: What a treatment adds to a control.
        published_gain: The same in the paper.
        level: Ours less the paper's, mean over conditions.
        least: The same, least of all conditions.
        most: The same, most of all conditions.
    """

    ranked: list[str]
    swapped: int
    gain: float
    published_gain: float
    level: float
    least: float
    most: float


def agreements(published: pd.DataFrame, treatment: str, control: str) -> dict[str, Agreement]:
    """How our F1 agrees with the paper's.

    Args:
        published: As of :func:`beside_published`.
        treatment: The condition whose gain is compared.
        control: Over which other.

    Returns:
        By the name that ours have in the table.
    """
    table = published.set_index("condition")
    columns = {str(c).removeprefix("f1, "): table[c] for c in table if str(c).startswith("f1, ")}
    paper = columns.pop("paper")
    order, found = sorted(paper.index, key=lambda name: -paper[name]), {}
    for who, ours in columns.items():
        apart = ours - paper
        found[who] = Agreement(
            ranked=sorted(ours.index, key=lambda name: -ours[name]),
            swapped=sum(bool(ours[a] < ours[b]) for a, b in itertools.combinations(order, 2)),
            gain=float(ours[treatment] - ours[control]),
            published_gain=float(paper[treatment] - paper[control]),
            level=float(apart.mean()),
            least=float(apart.min()),
            most=float(apart.max()),
        )
    return found


# -- tests ------------------------------------------------------------------------------------------------------------


class Comparisons(NamedTuple):
    """Conditions compared.

    Attributes:
        each: At each fraction observed.
        overall: Over their mean.
    """

    each: Comparison
    overall: Comparison


def compare_layouts(rows: pd.DataFrame, predictor: str) -> Comparisons:
    """Conditions with layouts as units, at each fraction and over all: the nested analysis of variance.

    Args:
        rows: ``predictor, condition, layout, participant, fraction, correct``.
        predictor: The predictor whose accuracy is compared.
    """
    from predictors.evaluation.comparison import compare_conditions

    own = rows[rows["predictor"] == predictor]
    own = own.assign(participant=own["condition"] + "/" + own["layout"].astype(str))
    units = own.groupby(["condition", "participant", "fraction"], sort=False)["correct"].mean().reset_index()
    return Comparisons(compare_conditions(units, correct_fractions="holm"), compare_conditions(units, at="mean"))


def compare_participants(rows: pd.DataFrame, predictor: str, shown: pd.DataFrame) -> Comparisons:
    """Conditions in one layout each, with participants as units, as in the paper.

    Args:
        rows: As for :func:`compare_layouts`.
        predictor: The predictor whose accuracy is compared.
        shown: ``condition, layout``, one row for each condition.
    """
    from predictors.evaluation.comparison import compare_conditions

    own = shown[["condition", "layout"]].merge(rows[rows["predictor"] == predictor], on=["condition", "layout"])
    return Comparisons(compare_conditions(own, correct_fractions="holm"), compare_conditions(own, at="mean"))


def variance_rows(rows: pd.DataFrame, predictors: Sequence[str], shown: pd.DataFrame) -> pd.DataFrame:
    """One-way analyses of variance over the conditions at each fraction and over all (``fraction`` is NaN).

    Both with layouts as units and, in the layouts shown, with participants as units.
    """
    import pandas as pd

    parts = []
    for predictor in predictors:
        both = {"layout": compare_layouts(rows, predictor), "participant": compare_participants(rows, predictor, shown)}
        for unit, comparisons in both.items():
            parts += [found.anova.assign(predictor=predictor, unit=unit) for found in comparisons]
    table = pd.concat(parts, ignore_index=True)
    front = ["predictor", "unit", "fraction"]
    return table[[*front, *(column for column in table if column not in front)]]
