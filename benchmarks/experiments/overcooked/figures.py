"""Figures of the experiment: SVG for curves and maps, PNG for kitchens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.experiments.conditions import (
    accuracy_by_condition,
    bars_by_condition,
    compare_layouts,
    learning_by_condition,
    slug,
)
from benchmarks.experiments.overcooked import tables
from benchmarks.experiments.overcooked.sweep import CONDITIONS
from predictors.evaluation.figures import Drawing, confusion_figure, footnote, heading, save_figure, shade

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.tasks import TaskGraph

__all__ = ["behaviour_map", "boards", "draw_all", "rewards", "task_figure"]

_INK, _SOFT = "#24292f", "#5d6670"
TILE: Final = 44
LEGIBLE_FIRST: Final = tuple(reversed(CONDITIONS))
"""The legible condition is the one to look for."""
_READ: Final = (
    "Simulated people; cross-validated; only walks with two valid goals or more. Two bands that do not overlap are "
    "a difference by Tukey's test at that point."
)


# -- maps and graphs --------------------------------------------------------------------------------------------------


def behaviour_map(elites: pd.DataFrame) -> str:
    """The best layouts of every kind found: number of obstacles against order of ingredients, all searches together."""
    best = elites.groupby(["obstacles", "order"])["objective"].max()
    orders = sorted({str(order) for _, order in best.index})
    rows = range(int(elites["obstacles"].max()), -1, -1)
    high = float(best.max())
    low = float(np.percentile(best, 5))  # a few poor cells must not make all others look alike
    cell, left, top = 26.0, 80.0, 74.0
    width, height = left + cell * len(orders) + 24, top + cell * len(rows) + 110
    drawing = Drawing(width, height, "Behaviour map", "The best legibility for each number of obstacles and order.")
    heading(drawing, "Behaviour map: the best layout of every kind", "legibility (Eq. 3) of the best layout found")
    for j, order in enumerate(orders):
        x = left + cell * (j + 0.5) + 4
        y = top + cell * len(rows) + 12
        drawing.text(x, y, order, "end", font_size=10, fill=_SOFT, transform=f"rotate(-90 {x:.1f} {y:.1f})")
    for i, obstacles in enumerate(rows):
        y = top + cell * i
        drawing.text(left - 8, y + cell / 2 + 4, f"{obstacles}", "end", fill=_SOFT)
        for j, order in enumerate(orders):
            x = left + cell * j
            value = best.get((float(obstacles), order))
            if value is None:
                drawing.box(x + 1, y + 1, cell - 2, cell - 2, "#f6f7f8")
                continue
            share = max(0.0, (float(value) - low) / (high - low)) if high > low else 0.5
            tip = f"{obstacles} obstacles, {order}: {float(value):.2f}"
            drawing.box(x + 1, y + 1, cell - 2, cell - 2, shade(0.06 + 0.94 * share), tip)
            ink = "#fff" if share > 0.5 else _INK
            drawing.text(
                x + cell / 2,
                y + cell / 2 + 3,
                f"{round(float(value)):d}".replace("-", "\u2212"),
                "middle",
                font_size=9,
                fill=ink,
            )
    drawing.text(
        left + cell * len(orders) / 2, height - 46, "ingredients and where they come, read row by row", "middle"
    )
    middle = top + cell * len(rows) / 2
    drawing.text(28, middle, "virtual obstacles", "middle", transform=f"rotate(-90 28 {middle:.1f})")
    footnote(
        drawing, f"T tomato, O onion, C cabbage, F fish; white: no layout found. Values rounded; darkest {high:.1f}."
    )
    return drawing.render()


def task_figure(task: TaskGraph) -> str:
    """The precedence graph: subtasks as boxes, an arrow from what must be done before."""
    groups = [[s for s in task.subtasks if s.name.startswith(f"{name}:")] for name in task.groups]
    tall = 96.0
    drawing = Drawing(720, 92 + tall * len(groups) + 34, "Task", "The precedence graph of the task.")
    heading(
        drawing,
        "The task: three soups, in any order",
        f"{task.num_sequences:,} valid sequences, {len(task.stages())} stages; arrows: must be done before",
    )
    for i, group in enumerate(groups):
        y = 74 + tall * i
        drawing.box(16, y, 688, tall - 12, "#f4f7fa")
        drawing.text(30, y + 22, list(task.groups)[i], font_weight="600")
        fetches, serve = group[:-1], group[-1]
        for k, fetch in enumerate(fetches):
            middle = y + (tall - 12) * (k + 1) / (len(fetches) + 1)
            _task_box(drawing, 130, middle, f"{fetch.count} × {fetch.goals[0]} → pot")
            drawing.line([(330, middle), (440, y + (tall - 12) / 2)], _SOFT, 1.4)
        _arrow_head(drawing, 440, y + (tall - 12) / 2)
        _task_box(drawing, 446, y + (tall - 12) / 2, f"{serve.goals[0]} → pot → serving")
    footnote(drawing, "Fetches are what an observer predicts; the legs after an arrow to pot and serving are not.")
    return drawing.render()


def _task_box(drawing: Drawing, x: float, middle: float, text: str) -> None:
    drawing.box(x, middle - 12, 200, 24, "#ffffff")
    corners = [(x, middle - 12), (x + 200, middle - 12), (x + 200, middle + 12), (x, middle + 12), (x, middle - 12)]
    drawing.line(corners, _SOFT, 1.2)
    drawing.text(x + 100, middle + 4, text, "middle")


def _arrow_head(drawing: Drawing, x: float, y: float) -> None:
    drawing.area([(x + 6, y), (x - 3, y - 5), (x - 3, y + 5)], _SOFT, 1)


# -- kitchens ---------------------------------------------------------------------------------------------------------


def boards(best: pd.DataFrame) -> Any:
    """The layouts shown, each with the cells where the goal is in doubt."""
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.rendering import draw_ambiguity, draw_side_by_side
    from legible_envs.overcooked.scoring.explanation import ambiguity

    kitchens = [OvercookedLayout.from_ascii(drawing) for drawing in best["drawing"]]
    return draw_side_by_side(
        [draw_ambiguity(kitchen, ambiguity(kitchen), tile=TILE) for kitchen in kitchens],
        list(best["condition"]),
        [
            f"legibility {score:.1f}\ndistance {distance:.0f} steps"
            for score, distance in zip(best["score"], best["distance"], strict=True)
        ],
    )


def rewards(best: pd.DataFrame, costs: pd.DataFrame, predictor: str) -> Any:
    """What each cell is worth to the people in the layouts shown, as inverse reinforcement learning sees it."""
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
    return draw_side_by_side(pictures, list(best["condition"]), None)


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
            "f1, paper": "people of the paper",
            **{f"f1, {name}": f"{name} people (simulated)" for name in results.walkers},
        },
        "F1 by condition, the paper's people and ours",
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
        "curves": [
            save_figure(
                folder / f"{slug('learning', name)}.svg",
                learning_by_condition(results.curves, name, LEGIBLE_FIRST, "walks"),
            )
            for name in dict.fromkeys(results.curves["predictor"] if len(results.curves) else ())
        ],
    }
    costs = results.readings.get("cost")
    if costs is not None:
        own = costs[costs["walker"] == results.walkers[0]]
        found["confusion"].append(save_png(folder / "rewards.png", rewards(best, own, first)))
    return found


def _accuracy_figures(results: tables.Results, folder: Path) -> list[Path]:
    files = []
    for walker in results.walkers:
        rows = tables.accuracy_rows(results, walker)
        for predictor in results.predictors:
            each, _ = compare_layouts(rows, predictor)
            svg = accuracy_by_condition(
                each,
                LEGIBLE_FIRST,
                float(rows[rows["predictor"] == predictor]["chance"].mean()),
                f"{predictor}, {walker} people",
                f"mean over {int(each.means['n'].min())} layouts per condition; bands: Tukey's half-width over layouts",
                _READ,
            )
            files.append(save_figure(folder / f"{slug('accuracy', walker, predictor)}.svg", svg))
    return files


def _confusion_figures(results: tables.Results, best: pd.DataFrame, folder: Path) -> list[Path]:
    files = []
    walker, predictor = results.walkers[0], results.predictors[0]
    for place in best.to_dict("records"):
        matrix = tables.confusion_of(results, walker, predictor, place["condition"], place["layout"])
        svg = confusion_figure(matrix, title=f"{place['condition']}: what {predictor} takes for what")
        files.append(save_figure(folder / f"{slug('confusion', place['condition'])}.svg", svg))
    return files
