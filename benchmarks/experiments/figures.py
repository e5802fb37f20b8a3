"""Figures that compare conditions, in kitchens and on tables alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.experiments.conditions import compare_layouts, in_order, slug
from legible_envs.drawing.chart_parts import legend_above, round_upwards
from legible_envs.drawing.charts import COLOURS, SOFT, Chart, ChartSize, save_figure, styled
from predictors.evaluation.figures import accuracy_figure, learning_curve_figure

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from predictors.evaluation.comparison import Comparison

__all__ = ["accuracy_by_condition", "bars_by_condition", "learning_by_condition", "save_accuracy", "save_learning"]


def accuracy_by_condition(
    comparison: Comparison,
    conditions: Sequence[str],
    chance: float,
    title: str,
    subtitle: str,
    note: str = "",
    *,
    size: ChartSize = "report",
) -> Chart:
    """Accuracy against fraction observed, a line per condition in the order given, bands of Tukey's half-width."""
    means = in_order(comparison.means, condition=conditions)
    table = means.rename(columns={"condition": "predictor", "mean": "accuracy"}).assign(chance=chance)
    table[["low", "high"]] = table[["low", "high"]].clip(0, 1)
    if note:
        table.attrs["evaluation"] = note
    return accuracy_figure(table, title=title, subtitle=subtitle, size=size)


def save_accuracy(
    rows: pd.DataFrame, predictor: str, conditions: Sequence[str], path: Path, *, title: str, note: str = ""
) -> Path:
    """Write the accuracy of one predictor against fraction observed, compared over layouts.

    Args:
        rows: ``predictor, condition, layout, participant, fraction, correct, chance``.
        predictor: Whose.
        conditions: In order.
        path: The file.
        title: Heading.
        note: At the foot.
    """
    each, _ = compare_layouts(rows, predictor)
    chance = float(rows[rows["predictor"] == predictor]["chance"].mean())
    subtitle = f"mean over {int(each.means['n'].min())} layouts per condition; bands: Tukey's half-width over layouts"
    return save_figure(path, accuracy_by_condition(each, conditions, chance, title, subtitle, note))


def save_learning(curves: pd.DataFrame, conditions: Sequence[str], folder: Path) -> list[Path]:
    """Write the figure of :func:`learning_by_condition` for every predictor that has curves."""
    return [
        save_figure(folder / f"{slug('learning', name)}.svg", learning_by_condition(curves, name, conditions))
        for name in dict.fromkeys(curves["predictor"] if len(curves) else ())
    ]


def learning_by_condition(
    curves: pd.DataFrame, predictor: str, conditions: Sequence[str], *, size: ChartSize = "report"
) -> Chart:
    """Accuracy against how much was learned from, a line per condition, bands of one deviation between layouts.

    Args:
        curves: ``predictor, condition, layout, share, size, accuracy``.
        predictor: Whose.
        conditions: In order.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
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
        title=f"What more trajectories buy: {predictor}",
        subtitle="mean over fractions observed; bands: one standard deviation between layouts",
        size=size,
    )


def bars_by_condition(
    table: pd.DataFrame,
    series: Mapping[str, str],
    title: str,
    subtitle: str,
    note: str,
    places: str = ".2f",
    *,
    size: ChartSize = "report",
) -> Chart:
    """A group of bars for each condition, a bar for each series; heights from 0 to a round value, or 1 for shares.

    Args:
        table: ``condition``, and a column for each series.
        series: Names by column; the first is drawn in grey, as what the others are compared with.
        title: Heading.
        subtitle: Below it.
        note: At the foot.
        places: Format of the numbers on the bars.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
    """
    values = table[list(series)].to_numpy(dtype=np.float64)
    colours = [SOFT, *COLOURS][: len(series)]
    wide = 0.84 / len(series)
    with styled(size):
        chart = Chart(
            title, subtitle, note, description=f"{title}: {', '.join(series.values())}.", size=size, height=2.7
        )
        axes = chart.subplots()
        most = float(np.nanmax(values))
        round_upwards(axes, 0.0, 1.0 if 0.3 < most <= 1.0 else most)
        for j, (name, colour) in enumerate(zip(series.values(), colours, strict=True)):
            for i in np.flatnonzero(np.isfinite(values[:, j])):
                middle, value = i + wide * (j - (len(series) - 1) / 2), values[i, j]
                (bar,) = axes.bar(middle, value, 0.92 * wide, color=colour, label=name)
                chart.tip(bar, [f"{table['condition'].iloc[i]}, {name}: {value:.4g}"])
                number = f"{value:{places}}".removeprefix("0")
                axes.annotate(number, (middle, value), (0, 2), textcoords="offset points", ha="center", size="small")
        axes.set_xlim(-0.5, len(table) - 0.5)
        axes.set_xticks(range(len(table)), [str(name) for name in table["condition"]], color="k", weight="bold")
        axes.tick_params(axis="x", length=0)
        legend_above(chart, list(series.values()), colours)
        return chart
