"""Figures of the experiment: legibility against accuracy, and correlations with their intervals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from predictors.evaluation.figures import COLOURS, Drawing, footnote, heading, round_ticks, save_figure

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["correlation_figure", "draw_all", "scatter_figure"]

_SOFT, _RULE = "#5d6670", "#e3e6ea"


def scatter_figure(places: pd.DataFrame, title: str, subtitle: str) -> str:
    """Accuracy of one predictor against legibility, a dot per stage; kitchens by colour."""
    width, height, left, top, right, bottom = 720.0, 430.0, 70.0, 66.0, 500.0, 350.0
    drawing = Drawing(width, height, title, "Accuracy against the legibility of stages.")
    heading(drawing, title, subtitle)
    low, high = float(places["score"].min()), float(places["score"].max())
    low, high = low - 0.06 * (high - low) - 1e-9, high + 0.06 * (high - low) + 1e-9
    for value in np.linspace(0, 1, 6):
        y = bottom - value * (bottom - top)
        drawing.line([(left, y), (right, y)], _RULE if value else _SOFT)
        drawing.text(left - 9, y + 4, f"{100 * value:.0f} %", "end", fill=_SOFT)
    for value in round_ticks(low, high):
        x = left + (value - low) / (high - low) * (right - left)
        drawing.line([(x, bottom), (x, bottom + 5)], _SOFT)
        drawing.text(x, bottom + 20, f"{value:g}".replace("-", "\u2212"), "middle", fill=_SOFT)
    drawing.text((left + right) / 2, bottom + 42, "legibility of the stage (Eq. 2, mean)", "middle")
    middle = (top + bottom) / 2
    drawing.text(16, middle, "accuracy", "middle", transform=f"rotate(-90 16 {middle:.1f})")
    for number, (kitchen, part) in enumerate(places.groupby("kitchen", sort=False)):
        colour = COLOURS[number % len(COLOURS)]
        name = str(kitchen).replace("_", " ")
        for row in part.to_dict("records"):
            x = left + (row["score"] - low) / (high - low) * (right - left)
            y = bottom - row["accuracy"] * (bottom - top)
            drawing.dot(x, y, colour, f"{name}, from {row['start']} to {row['goals']}: {row['walks']} walks")
        drawing.dot(right + 22, top + 12 + 22 * number, colour, name)
        drawing.text(right + 34, top + 16 + 22 * number, name, fill=colour, font_weight="600")
    return drawing.render()


def correlation_figure(correlations: pd.DataFrame, title: str) -> str:
    """Rank correlations with their intervals over places, a row per predictor and candidate set."""
    rows = correlations.to_dict("records")
    width, left, top, right, step = 720.0, 250.0, 76.0, 690.0, 26.0
    height = top + step * len(rows) + 84
    drawing = Drawing(width, height, title, "Rank correlations with intervals.")
    heading(drawing, title, "dot: rank correlation; thick: 95 % over people; thin: 95 % over places")
    bottom = top + step * len(rows)

    def at(value: float) -> float:
        return left + (value + 1) / 2 * (right - left)

    for value in (-1, -0.5, 0, 0.5, 1):
        drawing.line([(at(value), top - 8), (at(value), bottom)], _SOFT if value == 0 else _RULE)
        drawing.text(
            at(value), bottom + 18, f"{value:+g}".replace("-", "\u2212") if value else "0", "middle", fill=_SOFT
        )
    sets = list(dict.fromkeys(row["candidate_set"] for row in rows))
    for i, row in enumerate(rows):
        y, colour = top + step * (i + 0.5), COLOURS[sets.index(row["candidate_set"])]
        goals = "all in reach" if row["candidate_set"] == "all" else "of use in the game"
        drawing.text(left - 12, y + 4, f"{row['predictor']}, {goals}", "end", fill=colour)
        drawing.line([(at(row["places_low"]), y), (at(row["places_high"]), y)], colour, 1.4)
        drawing.line([(at(row["people_low"]), y), (at(row["people_high"]), y)], colour, 5)
        drawing.dot(at(row["rho"]), y, "#24292f", f"{row['predictor']}: {row['rho']:.2f}")
    numbers = " and ".join(
        f"{int(part['places'].iloc[0])} ({'all in reach' if name == 'all' else 'of use in the game'})"
        for name, part in correlations.groupby("candidate_set", sort=False)
    )
    footnote(drawing, f"Places: {numbers}. Goals that count as possible: all in reach, or those of use in the game.")
    return drawing.render()


def draw_all(stages: pd.DataFrame, correlations: pd.DataFrame, folder: Path) -> list[Path]:
    """Write every figure."""
    files = []
    for level, part in correlations.groupby("level", sort=False):
        said = "stages" if level == "stage" else "reaches (stage and goal)"
        svg = correlation_figure(part, f"Legibility and how well recorded people are read: {said}")
        files.append(save_figure(folder / f"correlations_{level}.svg", svg))
    shown = [name for name in ("Eq. 1", "MaxEnt IRL") if name in set(stages["predictor"])]
    for candidate_set in dict.fromkeys(stages["candidate_set"]):
        goals = "every dispenser in reach" if candidate_set == "all" else "goals of use in the running game"
        for predictor in shown:
            own = stages[(stages["candidate_set"] == candidate_set) & (stages["predictor"] == predictor)]
            if len(own) > 1:
                svg = scatter_figure(own, f"{predictor}: legible stages and real people", f"a dot per stage; {goals}")
                name = predictor.lower().replace(". ", "_").replace(" ", "_")
                files.append(save_figure(folder / f"stages_{candidate_set}_{name}.svg", svg))
    return files
