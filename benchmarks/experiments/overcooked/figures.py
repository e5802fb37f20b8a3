"""Figures of the experiment: charts for curves and maps, pictures for kitchens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.patches import Rectangle

from benchmarks.experiments.conditions import slug
from benchmarks.experiments.figures import bars_by_condition, save_accuracy, save_learning
from benchmarks.experiments.overcooked import tables
from benchmarks.experiments.overcooked.sweep import CONDITIONS
from benchmarks.presenters.overcooked import DOUBT
from legible_envs.drawing.chart_parts import number_squares
from legible_envs.drawing.charts import SOFT, Chart, ChartSize, save_figure, styled
from predictors.evaluation.figures import confusion_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from legible_envs.tasks import TaskGraph

__all__ = ["behaviour_map", "boards", "draw_all", "rewards", "task_figure"]

_PANEL: Final = "#f4f7fa"
TILE: Final = 44
LEGIBLE_FIRST: Final = tuple(reversed(CONDITIONS))
"""The legible condition is the one to look for."""
_NOTE: Final = (
    "Simulated participants; cross-validated; only trajectories with two valid goals or more. Two bands that do not "
    "overlap are a difference by Tukey's test at that point."
)


# -- maps and graphs --------------------------------------------------------------------------------------------------


def behaviour_map(elites: pd.DataFrame, *, size: ChartSize = "report") -> Chart:
    """The best layouts of every kind found: number of obstacles against order of ingredients, all searches together.

    Args:
        elites: ``obstacles, order, objective``.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
    """
    best = elites.groupby(["obstacles", "order"])["objective"].max()
    orders = sorted({str(order) for _, order in best.index})
    rows = range(int(elites["obstacles"].max()), -1, -1)
    values = np.array([[best.get((float(number), order), np.nan) for order in orders] for number in rows])
    high = float(best.max())
    low = float(np.percentile(best, 5))  # a few poor cells must not make all others look alike
    shares = np.clip((values - low) / (high - low), 0, 1) if high > low else np.where(np.isnan(values), np.nan, 0.5)
    found = np.isfinite(values)
    with styled(size) as own:
        cell = max(1.9 * own.text / 72, (own.width - 0.9) / len(orders))
        chart = Chart(
            "Behaviour map: the best layout of every kind",
            "legibility (Eq. 3) of the best layout found",
            f"T tomato, O onion, C cabbage, F fish; white: no layout found. Values rounded; darkest {high:.1f}.",
            description="The best legibility for each number of obstacles and order.",
            size=size,
            height=(2.0 * own.text / 72 * len(rows) + 0.9) / own.scale,
            width=max(own.width, cell * len(orders) + 0.9),
        )
        axes = chart.subplots()
        texts = [f"{round(float(value)):d}".replace("-", "\u2212") if value == value else "" for value in values.flat]
        squares = number_squares(axes, 0.06 + 0.94 * shares, texts, dark=0.53, text="x-small")
        chart.tip(
            squares,
            [
                f"{number} obstacles, {order}: " + (f"{values[i, j]:.2f}" if found[i, j] else "no layout found")
                for i, number in enumerate(rows)
                for j, order in enumerate(orders)
            ],
        )
        axes.set_xticks(range(len(orders)), orders, rotation=90, rotation_mode="anchor", ha="right", va="center")
        axes.set_yticks(range(len(rows)), [str(number) for number in rows])
        axes.tick_params(labelsize="small")
        axes.set_xlabel("ingredients and where they come, read row by row")
        axes.set_ylabel("virtual obstacles")
        return chart


def task_figure(task: TaskGraph) -> Chart:
    """The precedence graph: subtasks as boxes, an arrow from what must be done before."""
    groups = {name: [s for s in task.subtasks if s.name.startswith(f"{name}:")] for name in task.groups}
    with styled():
        chart = Chart(
            "The task: three soups, in any order",
            f"{task.num_sequences:,} valid sequences, {len(task.stages())} stages; arrows: must be done before",
            "Fetches are what an observer predicts; the legs after an arrow to pot and serving are not.",
            description="The precedence graph of the task.",
            height=0.78 * len(groups) + 0.24,
        )
        axes = chart.subplots()
        axes.set_xlim(0, 5.76)
        axes.set_ylim(0.78 * len(groups), 0)
        axes.set_axis_off()
        for i, (name, group) in enumerate(groups.items()):
            top = 0.78 * i
            axes.add_patch(Rectangle((0, top), 5.76, 0.68, color=_PANEL))
            axes.text(0.12, top + 0.34, name, weight="bold", va="center_baseline")
            *fetches, serve = group
            serving = _task_box(axes, 4.65, top + 0.34, f"{serve.goals[0]} → pot → serving")
            for k, fetch in enumerate(fetches):
                middle = top + 0.68 * (k + 1) / (len(fetches) + 1)
                box = _task_box(axes, 1.8, middle, f"{fetch.count} × {fetch.goals[0]} → pot")
                ends = (serving.get_x() - 0.02, top + 0.34), (box.get_x() + box.get_width(), middle)
                axes.annotate("", *ends, arrowprops={"arrowstyle": "-|>", "color": SOFT, "shrinkA": 0, "shrinkB": 0})
        return chart


def _task_box(axes: Axes, middle: float, height: float, text: str) -> Rectangle:
    box = Rectangle((middle - 0.85, height - 0.11), 1.7, 0.22, facecolor="white", edgecolor=SOFT)
    axes.add_patch(box)
    axes.text(middle, height, text, ha="center", va="center_baseline", size="small")
    return box


# -- kitchens ---------------------------------------------------------------------------------------------------------


def boards(best: pd.DataFrame) -> Any:
    """The layouts shown, each with the cells where the goal is ambiguous."""
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.rendering import draw_ambiguity, draw_side_by_side
    from legible_envs.overcooked.scoring.explanation import ambiguity

    kitchens = [OvercookedLayout.from_ascii(drawing) for drawing in best["drawing"]]
    return draw_side_by_side(
        [draw_ambiguity(kitchen, ambiguity(kitchen), tile=TILE, legend=DOUBT) for kitchen in kitchens],
        list(best["condition"]),
        [
            f"legibility {score:.1f}\ndistance {distance:.0f} steps".replace("-", "\u2212")
            for score, distance in zip(best["score"], best["distance"], strict=True)
        ],
        columns=2,
    )


def rewards(best: pd.DataFrame, costs: pd.DataFrame) -> Any:
    """What each cell is worth to the participants in the layouts shown, as inverse reinforcement learning sees it."""
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.rendering import draw_ambiguity, draw_side_by_side

    pictures = []
    for place in best.to_dict("records"):
        kitchen = OvercookedLayout.from_ascii(place["drawing"])
        own = costs[(costs["condition"] == place["condition"]) & (costs["layout"] == place["layout"])]
        reward = np.full(kitchen.shape, np.nan)
        reward[own["row"].astype(int), own["column"].astype(int)] = -own["cost"]
        low, high = float(np.nanmin(reward)), float(np.nanmax(reward))
        heat = (reward - low) / (high - low) if high - low > 1e-12 else np.where(np.isnan(reward), np.nan, 0.5)
        ends = f"reward {low:.2f}".replace("-", "\u2212"), f"{high:.2f}".replace("-", "\u2212")
        pictures.append(draw_ambiguity(kitchen, np.clip(heat, 0, 1), tile=TILE, legend=ends))
    return draw_side_by_side(pictures, list(best["condition"]), None, columns=2)


# -- all of them ------------------------------------------------------------------------------------------------------


def draw_all(results: tables.Results, folder: Path) -> dict[str, list[Path]]:
    """Write every figure; returns their files by the section of the report they belong to."""
    from legible_envs.overcooked.recipes import soup_task
    from legible_envs.overcooked.rendering import save_png

    best = tables.best_layouts(results)
    first = results.predictors[0]
    folder.mkdir(parents=True, exist_ok=True)
    published = bars_by_condition(
        tables.beside_published(tables.metrics_table(results), first),
        {
            "f1, paper": "participants of the paper",
            **{f"f1, {name}": f"{name} (simulated)" for name in results.walkers},
        },
        "F1 by condition, the paper's participants and ours",
        f"ours: {first}, mean over 10 to 90 % observed",
        "The paper's figures are of human participants and one layout per condition; see the text.",
    )
    found = {
        "layouts": [
            save_png(folder / "layouts.png", boards(best)),
            save_figure(folder / "task.svg", task_figure(soup_task())),
            save_figure(
                folder / "behaviour_map.svg", behaviour_map(results.elites[results.elites["condition"] == "Legible"])
            ),
        ],
        "published": [save_figure(folder / "published.svg", published)],
        "accuracy": _accuracy_figures(results, folder),
        "confusion": _confusion_figures(results, best, folder),
        "curves": save_learning(results.curves, LEGIBLE_FIRST, folder),
    }
    costs = results.readings.get("cost")
    if costs is not None:
        own = costs[costs["walker"] == results.walkers[0]]
        found["confusion"].append(save_png(folder / "rewards.png", rewards(best, own)))
    return found


def _accuracy_figures(results: tables.Results, folder: Path) -> list[Path]:
    files = []
    for walker in results.walkers:
        rows = tables.accuracy_rows(results, walker)
        for predictor in results.predictors:
            path, title = folder / f"{slug('accuracy', walker, predictor)}.svg", f"{predictor}, {walker} participants"
            files.append(save_accuracy(rows, predictor, LEGIBLE_FIRST, path, title=title, note=_NOTE))
    return files


def _confusion_figures(results: tables.Results, best: pd.DataFrame, folder: Path) -> list[Path]:
    files = []
    walker, predictor = results.walkers[0], results.predictors[0]
    for place in best.to_dict("records"):
        matrix = tables.confusion_of(results, walker, predictor, place["condition"], place["layout"])
        figure = confusion_figure(matrix, title=f"{place['condition']}: predictions of {predictor}")
        files.append(save_figure(folder / f"{slug('confusion', place['condition'])}.svg", figure))
    return files
