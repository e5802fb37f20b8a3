"""Figures of the experiment: charts for curves and bars, pictures for tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.experiments.conditions import slug
from benchmarks.experiments.figures import bars_by_condition, save_accuracy, save_learning
from benchmarks.experiments.tabletop import tables
from benchmarks.experiments.tabletop.sweep import CONDITIONS
from legible_envs.drawing.chart_parts import legend_above, round_upwards
from legible_envs.drawing.charts import COLOURS, SIZES, Chart, ChartSize, save_figure, styled
from predictors.evaluation.figures import confusion_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd
    from matplotlib.axes import Axes

    from legible_envs.tabletop import TabletopLayout, TabletopTask

__all__ = ["boards", "draw_all", "spreads_over_tables", "team_figure"]

_RGB: Final = tuple(tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5)) for colour in COLOURS)
BEST_FIRST: Final = tuple(reversed(CONDITIONS))
DEVIATIONS: Final = 2.0
_EVERY: Final = 7


# -- tables -----------------------------------------------------------------------------------------------------------


def boards(best: pd.DataFrame) -> Any:
    """The layouts shown, with what is built and where the goal of a reach is ambiguous."""
    from legible_envs.tabletop import TabletopLayout
    from legible_envs.tabletop.rendering import draw_panels
    from legible_envs.tabletop.task import read_task

    layouts = {row["condition"]: TabletopLayout.from_json(row["json"]) for row in best.to_dict("records")}
    return draw_panels(
        {str(name): layout for name, layout in layouts.items()}, read_task("columns"), width=480, columns=2
    )


def spreads_over_tables(best: pd.DataFrame, spreads: pd.DataFrame, width: int = 560) -> Any:
    """Mean reaches to every cube and ellipses of their covariances, on the layouts shown; nothing is warped."""
    from legible_envs.drawing.sheets import draw_side_by_side
    from legible_envs.tabletop import TabletopLayout
    from legible_envs.tabletop.task import read_task

    images, captions = [], []
    sizes = tables.sizes_of_covariances(spreads[spreads["alignment"] == "none"])
    for row in best.to_dict("records"):
        own = sizes[(sizes["condition"] == row["condition"]) & (sizes["layout"] == row["layout"])]
        layout = TabletopLayout.from_json(row["json"])
        images.append(_draw_spread(layout, read_task("columns"), own, width))
        captions.append(f"trace {own['trace'].mean():.2e} m^2\ndeterminant {own['determinant'].mean():.2e} m^4")
    return draw_side_by_side(images, list(best["condition"]), captions, columns=2, text=max(13, round(width * 0.047)))


def _draw_spread(layout: TabletopLayout, task: TabletopTask, own: pd.DataFrame, width: int) -> npt.NDArray[np.uint8]:
    from PIL import Image, ImageDraw

    from legible_envs.tabletop.rendering import draw_table
    from legible_envs.tabletop.rendering.frame import Frame

    frame, start = Frame.of(layout.table, width), np.array(layout.place("assembly"))
    image = Image.fromarray(draw_table(layout, task=task, width=width, scale=False))
    pen = ImageDraw.Draw(image, "RGBA")
    turn = np.linspace(0.0, 2 * np.pi, 49)
    circle = DEVIATIONS * np.stack([np.cos(turn), np.sin(turn)])
    for number, (_, part) in enumerate(own.groupby("goal", sort=False)):
        colour, rows = _RGB[number % len(_RGB)], part.sort_values("step").to_dict("records")
        middle = [(start[0] + row["x"], start[1] + row["y"]) for row in rows]
        for row, at in list(zip(rows, middle, strict=True))[_EVERY // 2 :: _EVERY]:
            values, axes = np.linalg.eigh([[row["xx"], row["xy"]], [row["xy"], row["yy"]]])
            ring = np.array(at)[:, None] + axes @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
            pen.polygon([frame.pixel(*p) for p in ring.T.tolist()], fill=(*colour, 34), outline=(*colour, 150))
        pen.line([frame.pixel(*p) for p in middle], fill=(*colour, 255), width=3)
    return np.asarray(image)


# -- participants at work ---------------------------------------------------------------------------------------------

_PANELS: Final = {
    "completion_time": "completion time, s",
    "decision_time": "robot sure after, s",
    "conflicts": "conflicts per task",
    "human_idle": "human idle, share of time",
    "robot_idle": "robot idle, share of time",
    "concurrent_activity": "both active, share of time",
}


def team_figure(teams: pd.DataFrame, *, size: ChartSize = "report") -> Chart:
    """Means and 95 % intervals of measures by condition, a colour for each robot.

    Args:
        teams: ``reader, measure, condition, mean, low, high``.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
    """
    predictors = [str(name) for name in dict.fromkeys(teams["reader"])]
    with styled(size):
        chart = Chart(
            "Participants and robots at work",
            "means over participants and 95 % confidence intervals",
            "Alone: the same participants without a robot; they always have an object to take, and are never idle.",
            description=f"Measures of teams by condition, {', '.join(predictors)}.",
            size=size,
            height=5.9,
        )
        panels = chart.subplots(3, 2, sharex=True).flat
        for axes, (measure, title) in zip(panels, _PANELS.items(), strict=True):
            own = teams[teams["measure"] == measure]
            if len(own):
                _panel(chart, axes, own, title, predictors)
            else:
                axes.set_axis_off()
        legend_above(chart, predictors, COLOURS[: len(predictors)])
        return chart


def _panel(chart: Chart, axes: Axes, own: pd.DataFrame, title: str, predictors: Sequence[str]) -> None:
    is_time = own["measure"].iloc[0] == "completion_time"
    low, high = float(own["low"].min()), float(own["high"].max())
    round_upwards(axes, low if is_time else min(0.0, low), high)
    axes.set_title(title, size="small" if chart.get_size_inches()[0] < SIZES["report"].width else "medium")
    for j, predictor in enumerate(predictors):
        part = own[own["reader"] == predictor]
        at = part["condition"].map(CONDITIONS.index) + 0.16 * (j - (len(predictors) - 1) / 2)
        axes.vlines(at, part["low"], part["high"], color=COLOURS[j], linewidth=1.2)
        (dots,) = axes.plot(at, part["mean"], "o", color=COLOURS[j], label=predictor)
        means = part[["condition", "mean"]].itertuples(index=False)
        chart.tip(dots, [f"{condition}, {predictor}: {mean:.3g}" for condition, mean in means])
    axes.set_xlim(-0.5, len(CONDITIONS) - 0.5)
    axes.set_xticks(range(len(CONDITIONS)), CONDITIONS, rotation=30, rotation_mode="anchor", ha="right")
    axes.tick_params(axis="x", length=0)
    axes.tick_params(labelsize="small")


# -- all of them ------------------------------------------------------------------------------------------------------


def draw_all(results: tables.Results, folder: Path) -> dict[str, list[Path]]:
    """Write every figure; returns their files by the section of the report they belong to."""
    from legible_envs.drawing.sheets import save_png

    best, metrics = tables.best_layouts(results), tables.metrics_table(results)
    spread = tables.spread_beside_published(tables.spread_table(results))
    folder.mkdir(parents=True, exist_ok=True)
    paper = results.predictors[:2]
    published = bars_by_condition(
        tables.beside_published(metrics, paper),
        {"f1, paper": "participants of the paper", **{f"f1, {name}": f"{name} (ours)" for name in paper}},
        "F1 by condition, the paper's participants and ours",
        "ours: simulated participants, mean over 10 to 90 % observed",
        "The paper's figures are of human participants and one layout per condition; see the text.",
    )
    traces = bars_by_condition(
        spread,
        {f"trace, {name}": name for name in ("paper", "ours", "ours, warped")},
        "How much reaches to one goal differ",
        "trace of the covariance in square metres, mean over goals and steps",
        "Ours: covariances of as many reaches, steps and the same band in every condition, from the assembly zone.",
        ".4f",
    )
    return {
        "layouts": [save_png(folder / "layouts.png", boards(best))],
        "published": [save_figure(folder / "published.svg", published)],
        "spread": [
            save_figure(folder / "spread.svg", traces),
            save_png(folder / "reaches.png", spreads_over_tables(best, results.spreads)),
        ],
        "accuracy": _accuracy_figures(results, folder),
        "confusion": _confusion_figures(results, best, folder),
        "curves": save_learning(results.curves, BEST_FIRST, folder),
        "teams": [save_figure(folder / "teams.svg", team_figure(tables.team_table(results)))],
    }


def _accuracy_figures(results: tables.Results, folder: Path) -> list[Path]:
    files, rows = [], tables.accuracy_rows(results)
    for predictor in results.predictors:
        path, title = folder / f"{slug('accuracy', predictor)}.svg", f"Goals predicted correctly: {predictor}"
        files.append(save_accuracy(rows, predictor, BEST_FIRST, path, title=title))
    return files


def _confusion_figures(results: tables.Results, best: pd.DataFrame, folder: Path) -> list[Path]:
    files, predictor = [], results.predictors[0]
    for place in best.to_dict("records"):
        matrix = tables.confusion_of(results, predictor, place["condition"], place["layout"])
        figure = confusion_figure(matrix, title=f"{place['condition']}: predictions of the {predictor}")
        files.append(save_figure(folder / f"{slug('confusion', place['condition'])}.svg", figure))
    return files
