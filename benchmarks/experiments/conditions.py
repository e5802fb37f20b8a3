"""Conditions compared over their layouts and participants: tables, tests, and the figures that show them."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from predictors.evaluation.figures import COLOURS, Drawing, accuracy_figure, footnote, heading, learning_curve_figure

if TYPE_CHECKING:
    import pandas as pd

    from predictors.evaluation.comparison import Comparison

__all__ = [
    "Agreement",
    "Comparisons",
    "accuracy_by_condition",
    "agreements",
    "bars_by_condition",
    "beside_published",
    "compare_layouts",
    "compare_participants",
    "figures_of_merit",
    "in_order",
    "learning_by_condition",
    "round_up",
    "slug",
    "stacked",
    "variance_rows",
]

_SOFT, _RULE = "#5d6670", "#e3e6ea"


def slug(*words: str) -> str:
    """A name of a file."""
    text = "".join(c if c.isalnum() else "_" for c in "_".join(words).lower())
    while "__" in text:
        text = text.replace("__", "_")
    return text.strip("_")


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


# -- figures ----------------------------------------------------------------------------------------------------------


def accuracy_by_condition(
    comparison: Comparison, conditions: Sequence[str], chance: float, title: str, subtitle: str, note: str = ""
) -> str:
    """Accuracy against fraction observed, a line per condition in the order given, bands of Tukey's half-width."""
    means = in_order(comparison.means, condition=conditions)
    table = means.rename(columns={"condition": "predictor", "mean": "accuracy"}).assign(chance=chance)
    table[["low", "high"]] = table[["low", "high"]].clip(0, 1)
    if note:
        table.attrs["evaluation"] = note
    return accuracy_figure(table, title=title, subtitle=subtitle)


def learning_by_condition(curves: pd.DataFrame, predictor: str, conditions: Sequence[str], what: str) -> str:
    """Accuracy against how much was learned from, a line per condition, bands of one deviation between layouts.

    Args:
        curves: ``predictor, condition, layout, share, size, accuracy``.
        predictor: Whose.
        conditions: In order.
        what: Plural of what is learned from.
    """
    own = curves[curves["predictor"] == predictor]
    # Training sets may differ by one between layouts: shares are what is equal.
    sizes = own.groupby("share")["size"].mean().round().astype(int)
    each = own.groupby(["condition", "share", "layout"], sort=False, as_index=False)["accuracy"].mean()
    grouped = each.groupby(["condition", "share"], sort=False)["accuracy"]
    table = in_order(grouped.agg(accuracy="mean", sd="std").reset_index(), condition=conditions)
    table = table.assign(
        predictor=table["condition"],
        size=table["share"].map(sizes),
        low=(table["accuracy"] - table["sd"]).clip(0, 1),
        high=(table["accuracy"] + table["sd"]).clip(0, 1),
    )
    return learning_curve_figure(
        table,
        title=f"What more {what} buy: {predictor}",
        subtitle="mean over fractions observed; bands: one standard deviation between layouts",
    )


@dataclasses.dataclass(frozen=True)
class _Bars:
    left: float = 70.0
    right: float = 20.0
    top: float = 84.0
    bottom: float = 300.0
    width: float = 720.0
    height: float = 360.0


def bars_by_condition(
    table: pd.DataFrame, series: Mapping[str, str], title: str, subtitle: str, note: str, places: str = ".2f"
) -> str:
    """A group of bars for each condition, a bar for each series; heights from 0 to the largest, or 1 for shares.

    Args:
        table: ``condition``, and a column for each series.
        series: Names by column; the first is drawn in grey, as what the others are compared with.
        title: Heading.
        subtitle: Below it.
        note: At the foot.
        places: Format of the numbers on the bars.
    """
    box = _Bars()
    drawing = Drawing(box.width, box.height, title, f"{title}: {', '.join(series.values())}.")
    heading(drawing, title, subtitle)
    most = float(np.nanmax(table[list(series)].to_numpy(dtype=np.float64)))
    top = 1.0 if 0.3 < most <= 1.0 else round_up(most)
    for value in np.linspace(0, top, 6):
        y = box.bottom - value / top * (box.bottom - box.top)
        drawing.line([(box.left, y), (box.width - box.right, y)], _RULE if value else _SOFT)
        drawing.text(box.left - 9, y + 4, f"{value:.3g}", "end", fill=_SOFT)
    step = (box.width - box.right - box.left) / len(table)
    for i, row in enumerate(table.to_dict("records")):
        _group_of_bars(
            drawing, box, box.left + step * i, step, {str(k): v for k, v in row.items()}, series, top, places
        )
    x = box.left
    for j, name in enumerate(series.values()):
        drawing.box(x, 58, 12, 12, _SOFT if not j else COLOURS[j - 1])
        drawing.text(x + 18, 68, name)
        x += 40 + 7 * len(name)
    footnote(drawing, note)
    return drawing.render()


def _group_of_bars(
    drawing: Drawing,
    box: _Bars,
    x: float,
    step: float,
    row: Mapping[str, Any],
    series: Mapping[str, str],
    top: float,
    places: str,
) -> None:
    bar = 0.8 * step / len(series)
    for j, (column, name) in enumerate(series.items()):
        value = float(row[column])
        if not np.isfinite(value):
            continue
        left, y = x + 0.1 * step + bar * j, box.bottom - value / top * (box.bottom - box.top)
        colour = _SOFT if not j else COLOURS[j - 1]
        drawing.box(left, y, bar - 3, box.bottom - y, colour, f"{row['condition']}, {name}: {value:.4g}")
        drawing.text(left + (bar - 3) / 2, y - 5, f"{value:{places}}".removeprefix("0"), "middle", font_size=11)
    drawing.text(x + step / 2, box.bottom + 20, str(row["condition"]), "middle", font_weight="600")


def round_up(value: float) -> float:
    """The next of 1, 2, 2.5, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(power * step for step in (1, 2, 2.5, 5, 10) if power * step >= value * (1 - 1e-9)))
