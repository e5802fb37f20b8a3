"""Figures of the experiment: SVG for curves and bars, PNG for tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.experiments.conditions import (
    accuracy_by_condition,
    bars_by_condition,
    compare_layouts,
    learning_by_condition,
    round_up,
    slug,
)
from benchmarks.experiments.tabletop import tables
from benchmarks.experiments.tabletop.sweep import CONDITIONS
from predictors.evaluation.figures import COLOURS, Drawing, confusion_figure, footnote, heading, save_figure

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pandas as pd

__all__ = ["boards", "draw_all", "spreads_over_tables", "team_figure"]

_SOFT, _RULE = "#5d6670", "#e3e6ea"
_RGB: Final = tuple(tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5)) for colour in COLOURS)
BEST_FIRST: Final = tuple(reversed(CONDITIONS))
DEVIATIONS: Final = 2.0
_EVERY: Final = 7


# -- tables -----------------------------------------------------------------------------------------------------------


def boards(best: pd.DataFrame) -> Any:
    """The layouts shown, with what is built and where the goal of a reach is in doubt."""
    from legible_envs.tabletop import TabletopLayout
    from legible_envs.tabletop.rendering import draw_panels
    from legible_envs.tabletop.settings import read_task

    layouts = {row["condition"]: TabletopLayout.from_json(row["json"]) for row in best.to_dict("records")}
    return draw_panels(
        {str(name): layout for name, layout in layouts.items()}, read_task("columns"), width=480, columns=4
    )


def spreads_over_tables(best: pd.DataFrame, spreads: pd.DataFrame, width: int = 560) -> Any:
    """Mean reaches to every cube and ellipses of their covariances, on the layouts shown; nothing is warped."""
    from legible_envs.drawing.sheets import draw_side_by_side
    from legible_envs.tabletop import TabletopLayout
    from legible_envs.tabletop.settings import read_task

    images, captions = [], []
    sizes = tables.sizes_of_covariances(spreads[spreads["alignment"] == "none"])
    for row in best.to_dict("records"):
        own = sizes[(sizes["condition"] == row["condition"]) & (sizes["layout"] == row["layout"])]
        layout = TabletopLayout.from_json(row["json"])
        images.append(_draw_spread(layout, read_task("columns"), own, width))
        captions.append(f"trace {own['trace'].mean():.2e} m^2\ndeterminant {own['determinant'].mean():.2e} m^4")
    return draw_side_by_side(images, list(best["condition"]), captions, columns=3, text=max(13, round(width * 0.047)))


def _draw_spread(layout: Any, task: Any, own: pd.DataFrame, width: int) -> npt.NDArray[np.uint8]:
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


# -- people at work ---------------------------------------------------------------------------------------------------

_PANELS: Final = {
    "completion_time": "completion time, s",
    "decision_time": "robot sure after, s",
    "conflicts": "conflicts per task",
    "human_idle": "human idle, share of time",
    "robot_idle": "robot idle, share of time",
    "concurrent_activity": "both active, share of time",
}


def team_figure(teams: pd.DataFrame) -> str:
    """Means and 95 % intervals of measures by condition, a colour for each way the robot reads people."""
    readers = list(dict.fromkeys(teams["reader"]))
    drawing = Drawing(760, 640, "People and robots at work", f"Measures of teams by condition, {', '.join(readers)}.")
    heading(drawing, "People and robots at work", "means over people and 95 % confidence intervals")
    x = 16.0
    for j, reader in enumerate(readers):
        drawing.box(x, 58, 12, 12, COLOURS[j])
        drawing.text(x + 18, 68, reader)
        x += 40 + 7 * len(reader)
    for i, (measure, title) in enumerate(_PANELS.items()):
        own = teams[teams["measure"] == measure]
        if len(own):
            _panel(drawing, 16 + 248 * (i % 3), 96 + 254 * (i // 3), own, title, readers)
    footnote(drawing, "Alone: the same people without a robot; they are never idle for want of an object to take.")
    return drawing.render()


def _panel(drawing: Drawing, left: float, top: float, own: pd.DataFrame, title: str, readers: Sequence[str]) -> None:
    width, height = 232.0, 150.0
    is_time = own["measure"].iloc[0] == "completion_time"
    least = float(own["low"].min()) if is_time else min(0.0, float(own["low"].min()))
    gap = round_up((float(own["high"].max()) - least) / 5 or 0.2)
    ticks = np.arange(np.floor(least / gap + 1e-9), np.ceil(float(own["high"].max()) / gap - 1e-9) + 1) * gap
    low, high = ticks[0], ticks[-1]
    drawing.text(left + 34, top + 4, title, font_weight="600")

    def y(value: float) -> float:
        return top + 16 + (high - value) / (high - low) * height

    for value in ticks:
        drawing.line([(left + 34, y(value)), (left + width, y(value))], _RULE if value else _SOFT)
        drawing.text(left + 29, y(value) + 4, f"{value:.3g}", "end", fill=_SOFT, font_size=10)
    step = (width - 34) / len(CONDITIONS)
    for i, condition in enumerate(CONDITIONS):
        middle = left + 34 + step * (i + 0.5)
        for j, reader in enumerate(readers):
            _interval(drawing, own, reader, condition, middle + 7 * (j - (len(readers) - 1) / 2), y, COLOURS[j])
        at = f"rotate(-35 {middle:.1f} {top + height + 30:.1f})"
        drawing.text(middle, top + height + 30, condition, "end", fill=_SOFT, font_size=10, transform=at)


def _interval(
    drawing: Drawing,
    own: pd.DataFrame,
    reader: str,
    condition: str,
    x: float,
    y: Callable[[float], float],
    colour: str,
) -> None:
    for row in own[(own["reader"] == reader) & (own["condition"] == condition)].to_dict("records"):
        drawing.line([(x, y(row["low"])), (x, y(row["high"]))], colour, 1.6)
        drawing.dot(x, y(row["mean"]), colour, f"{condition}, {reader}: {row['mean']:.3g}")


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
        {"f1, paper": "people of the paper", **{f"f1, {name}": f"{name} (ours)" for name in paper}},
        "F1 by condition, the paper's people and ours",
        "ours: simulated people, mean over 10 to 90 % observed",
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
        "curves": [
            save_figure(
                folder / f"{slug('learning', name)}.svg",
                learning_by_condition(results.curves, name, BEST_FIRST, "reaches"),
            )
            for name in dict.fromkeys(results.curves["predictor"])
        ],
        "teams": [save_figure(folder / "teams.svg", team_figure(tables.team_table(results)))],
    }


def _accuracy_figures(results: tables.Results, folder: Path) -> list[Path]:
    files, rows = [], tables.accuracy_rows(results)
    for predictor in results.predictors:
        each, _ = compare_layouts(rows, predictor)
        svg = accuracy_by_condition(
            each,
            BEST_FIRST,
            float(rows[rows["predictor"] == predictor]["chance"].mean()),
            f"Goals read correctly: {predictor}",
            f"mean over {int(each.means['n'].min())} layouts per condition; bands: Tukey's half-width over layouts",
        )
        files.append(save_figure(folder / f"{slug('accuracy', predictor)}.svg", svg))
    return files


def _confusion_figures(results: tables.Results, best: pd.DataFrame, folder: Path) -> list[Path]:
    files, predictor = [], results.predictors[0]
    for place in best.to_dict("records"):
        matrix = tables.confusion_of(results, predictor, place["condition"], place["layout"])
        svg = confusion_figure(matrix, title=f"{place['condition']}: what the {predictor} takes for what")
        files.append(save_figure(folder / f"{slug('confusion', place['condition'])}.svg", svg))
    return files
