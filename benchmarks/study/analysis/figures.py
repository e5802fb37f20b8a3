"""Figures of a study: the experiments' own, with participants as units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.experiments.conditions import Comparisons, in_order, slug
from benchmarks.experiments.figures import accuracy_by_condition, bars_by_condition
from benchmarks.study.design.study import Study
from legible_envs.drawing.chart_parts import round_upwards
from legible_envs.drawing.charts import COLOURS, Chart, save_figure, styled
from predictors.evaluation.figures import confusion_figure, learning_curve_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

__all__ = [
    "draw_accuracy",
    "draw_confusions",
    "draw_layouts",
    "draw_learning",
    "draw_published",
    "draw_spread",
    "interval_panels",
]

NOTE = (
    "Participants of the study; cross-validated; only trajectories with two valid goals or more. Two bands that do not "
    "overlap are a difference by Tukey's test at that point, within participants."
)


def draw_accuracy(
    comparisons: Mapping[str, Comparisons],
    chances: Mapping[str, float],
    conditions: Sequence[str],
    folder: Path,
    title: str = "Goals predicted correctly",
) -> list[Path]:
    """Accuracy against fraction observed, a figure for each predictor."""
    files = []
    for predictor, found in comparisons.items():
        people = int(found.each.means["n"].min())
        figure = accuracy_by_condition(
            found.each,
            conditions,
            chances[predictor],
            f"{title}: {predictor}",
            f"mean over {people} participants; bands: Tukey's half-width within participants",
            NOTE,
        )
        files.append(save_figure(folder / f"{slug('accuracy', predictor)}.svg", figure))
    return files


def draw_learning(curves: pd.DataFrame, conditions: Sequence[str], folder: Path) -> list[Path]:
    """Accuracy against how much was learned from, a figure for each predictor; bands of a deviation between splits."""
    files = []
    for predictor in dict.fromkeys(curves["predictor"] if len(curves) else ()):
        own = curves[curves["predictor"] == predictor]
        sizes = own.groupby("share")["size"].mean().round().astype(int)
        each = own.groupby(["condition", "share", "split"], sort=False, as_index=False)["accuracy"].mean()
        grouped = each.groupby(["condition", "share"], sort=False)["accuracy"]
        table = in_order(grouped.agg(accuracy="mean", sd="std").reset_index(), condition=list(conditions))
        table = table.assign(
            predictor=table["condition"],
            size=table["share"].map(sizes),
            low=(table["accuracy"] - table["sd"].fillna(0)).clip(0, 1),
            high=(table["accuracy"] + table["sd"].fillna(0)).clip(0, 1),
        )
        bands = "bands: one standard deviation between splits" if table["sd"].notna().any() else "of one split"
        figure = learning_curve_figure(
            table,
            title=f"What more trajectories buy: {predictor}",
            subtitle=f"mean over fractions observed and participants; {bands}",
        )
        files.append(save_figure(folder / f"{slug('learning', predictor)}.svg", figure))
    return files


def draw_confusions(matrices: Mapping[str, pd.DataFrame], predictor: str, folder: Path) -> list[Path]:
    """Confusion matrices by condition."""
    return [
        save_figure(
            folder / f"{slug('confusion', condition)}.svg",
            confusion_figure(matrix, title=f"{condition}: predictions of {predictor}"),
        )
        for condition, matrix in matrices.items()
    ]


def draw_published(table: pd.DataFrame, predictors: Sequence[str], folder: Path) -> list[Path]:
    """F1 by condition, the paper's participants and those of the study."""
    figure = bars_by_condition(
        table,
        {"f1, paper": "participants of the paper", **{f"f1, {name}": f"{name} (here)" for name in predictors}},
        "F1 by condition, the paper's participants and ours",
        "ours: mean over 10 to 90 % observed",
        "Layouts of one name may differ between the paper and this study.",
    )
    return [save_figure(folder / "published.svg", figure)]


def draw_spread(table: pd.DataFrame, series: Mapping[str, str], folder: Path) -> list[Path]:
    """Trace of the covariances of reaches by condition."""
    figure = bars_by_condition(
        table,
        series,
        "How much reaches to one goal differ",
        "trace of the covariance in square metres, mean over goals and steps",
        "Reaches from the assembly zone; goals that were reached for twice or more.",
        ".4f",
    )
    return [save_figure(folder / "spread.svg", figure)]


# -- measures ---------------------------------------------------------------------------------------------------------


def interval_panels(means: pd.DataFrame, factor: str, levels: Sequence[str], title: str, path: Path) -> Path:
    """Means over participants and 95 % intervals, a panel for each measure.

    Args:
        means: ``measure``, the factor, ``mean, low, high, participants``.
        factor: Along the axis: ``condition`` or ``setting``.
        levels: Its values in order.
        title: Heading.
        path: The file.
    """
    measures = list(dict.fromkeys(means["measure"]))
    columns = min(2, len(measures))
    rows = math.ceil(len(measures) / columns)
    with styled("report"):
        chart = Chart(
            title,
            "means over participants and 95 % confidence intervals",
            "",
            description=f"{title}: {', '.join(measures)}, by {factor}.",
            size="report",
            height=1.75 * rows + 0.5,
        )
        panels = np.atleast_1d(chart.subplots(rows, columns, sharex=True)).ravel()
        for axes, measure in zip(panels, measures, strict=False):
            _panel(chart, axes, means[means["measure"] == measure], factor, levels, measure)
        for axes in panels[len(measures) :]:
            axes.set_axis_off()
        for axes in panels[max(0, len(measures) - columns) : len(measures)]:
            axes.tick_params(axis="x", labelbottom=True)
        return save_figure(path, chart)


def _panel(chart: Chart, axes: Axes, own: pd.DataFrame, factor: str, levels: Sequence[str], title: str) -> None:
    at = own[factor].map(list(levels).index).to_numpy(dtype=float)
    low, high = own["low"].fillna(own["mean"]), own["high"].fillna(own["mean"])
    round_upwards(axes, float(low.min()), float(high.max()))
    axes.set_title(title, size="medium")
    axes.vlines(at, low, high, color=COLOURS[0], linewidth=1.2)
    (dots,) = axes.plot(at, own["mean"], "o", color=COLOURS[0])
    told = own[[factor, "mean", "participants"]].itertuples(index=False)
    chart.tip(dots, [f"{level}: {mean:.3g} ({people} participants)" for level, mean, people in told])
    axes.set_xlim(-0.5, len(levels) - 0.5)
    axes.set_xticks(range(len(levels)), list(levels), rotation=30, rotation_mode="anchor", ha="right")
    axes.tick_params(axis="x", length=0)
    axes.tick_params(labelsize="small")


# -- layouts ----------------------------------------------------------------------------------------------------------


def draw_layouts(study: Study, path: Path) -> Path:
    """The layouts of all conditions, with where the goal is ambiguous as far as that can be said."""
    from legible_envs.drawing.sheets import save_png

    picture = _kitchens(study) if study.content.domain == "overcooked" else _tables(study)
    return save_png(path, picture)


def _kitchens(study: Study) -> Any:
    from benchmarks.presenters.overcooked import DOUBT
    from legible_envs.drawing.sheets import draw_side_by_side
    from legible_envs.overcooked.layouts import read_layout
    from legible_envs.overcooked.recipes import soup_task
    from legible_envs.overcooked.rendering import draw_ambiguity, draw_layout
    from legible_envs.overcooked.scoring.explanation import ambiguity

    pictures = []
    for condition in study.conditions:
        kitchen = read_layout(study.layout_of(condition))
        try:
            heat = ambiguity(kitchen, soup_task(study.content.kitchen.soups))
            pictures.append(draw_ambiguity(kitchen, heat, tile=44, legend=DOUBT))
        except ValueError:  # some station of the paper's task is not there
            pictures.append(draw_layout(kitchen, tile=44))
    return draw_side_by_side(pictures, study.conditions, None, columns=2)


def _tables(study: Study) -> Any:
    from legible_envs.tabletop import TabletopLayout
    from legible_envs.tabletop.rendering import draw_panels
    from legible_envs.tabletop.task import read_task

    name = study.content.table.task
    task = read_task(str(study.folder / name) if name.endswith((".yaml", ".yml")) else name)
    layouts = {name: TabletopLayout.from_json(study.layout_of(name)) for name in study.conditions}
    return draw_panels(layouts, task, width=480, columns=2)
