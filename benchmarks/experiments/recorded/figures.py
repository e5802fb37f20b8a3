"""Figures of the experiment: legibility against accuracy, and correlations with their intervals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from legible_envs.drawing.chart_parts import shares_upwards
from legible_envs.drawing.charts import COLOURS, INK, RULE, SOFT, Chart, ChartSize, save_figure, styled

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["correlation_figure", "draw_all", "scatter_figure"]

_GOALS: Final = {"all": "all in reach"}
_OF_USE: Final = "of use in the game"


def scatter_figure(places: pd.DataFrame, title: str, subtitle: str, *, size: ChartSize = "report") -> Chart:
    """Accuracy of one predictor against legibility, a dot per stage; kitchens by colour.

    Args:
        places: ``kitchen, start, goals, walks, score, accuracy``, a row per stage.
        title: Heading.
        subtitle: Below it.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
    """
    with styled(size):
        chart = Chart(title, subtitle, description="Accuracy against the legibility of stages.", size=size, height=3.1)
        axes = chart.subplots()
        for number, (kitchen, part) in enumerate(places.groupby("kitchen", sort=False)):
            name = str(kitchen).replace("_", " ")
            style: dict[str, Any] = {
                "s": 34,
                "color": COLOURS[number % len(COLOURS)],
                "edgecolor": "white",
                "linewidth": 0.8,
            }
            dots = axes.scatter(part["score"], part["accuracy"], clip_on=False, zorder=3, label=name, **style)
            chart.tip(
                dots,
                [
                    f"{name}, from {row['start']} to {row['goals']}: {row['walks']} trajectories"
                    for row in part.to_dict("records")
                ],
            )
        shares_upwards(axes)
        axes.set_ylabel("accuracy")
        axes.set_xlabel("legibility of the stage (Eq. 2, mean)")
        axes.legend(loc="upper left", bbox_to_anchor=(1.03, 1.0), labelcolor="markerfacecolor", prop={"weight": "bold"})
        return chart


def correlation_figure(correlations: pd.DataFrame, title: str, *, size: ChartSize = "report") -> Chart:
    """Rank correlations with their intervals over places, a row per predictor and candidate set.

    Args:
        correlations: ``predictor, candidate_set, places, rho, people_low, people_high, places_low, places_high``.
        title: Heading.
        size: See :data:`legible_envs.drawing.charts.SIZES`.
    """
    rows = correlations.to_dict("records")
    sets = list(dict.fromkeys(correlations["candidate_set"]))
    numbers = " and ".join(
        f"{int(part['places'].iloc[0])} ({_GOALS.get(str(name), _OF_USE)})"
        for name, part in correlations.groupby("candidate_set", sort=False)
    )
    with styled(size) as own:
        chart = Chart(
            title,
            "dot: rank correlation; thick: 95 % over participants; thin: 95 % over places",
            f"Recorded participants. Places: {numbers}. Possible goals: all in reach, or those of use in the game.",
            description="Rank correlations with intervals.",
            size=size,
            height=0.26 * len(rows) + 0.5,
        )
        axes = chart.subplots()
        for i, row in enumerate(rows):
            colour = COLOURS[sets.index(row["candidate_set"])]
            thin, thick = 0.12 * own.text, 0.5 * own.text
            axes.plot([row["places_low"], row["places_high"]], [i, i], color=colour, linewidth=thin, label="places")
            axes.plot(
                [row["people_low"], row["people_high"]], [i, i], color=colour, linewidth=thick, label="participants"
            )
            (dot,) = axes.plot(row["rho"], i, "o", color=INK, label="rho", zorder=3)
            chart.tip(dot, [f"{row['predictor']}: {row['rho']:.2f}"])
        axes.axvline(0, color=SOFT, linewidth=1, zorder=1)
        axes.grid(visible=False)
        axes.grid(visible=True, axis="x", color=RULE)
        axes.spines[:].set_visible(False)
        axes.set_xlim(-1, 1)
        axes.set_xticks([-1, -0.5, 0, 0.5, 1], ["\u22121", "\u22120.5", "0", "+0.5", "+1"])
        axes.tick_params(length=0)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        names = [f"{row['predictor']}, {_GOALS.get(row['candidate_set'], _OF_USE)}" for row in rows]
        for label, row in zip(axes.set_yticks(range(len(rows)), names), rows, strict=True):
            label.label1.set_color(COLOURS[sets.index(row["candidate_set"])])
        return chart


def draw_all(stages: pd.DataFrame, correlations: pd.DataFrame, folder: Path) -> list[Path]:
    """Write every figure."""
    files = []
    for level, part in correlations.groupby("level", sort=False):
        said = "stages" if level == "stage" else "stages and goals"
        figure = correlation_figure(part, f"Legibility and accuracy of predictions: {said}")
        files.append(save_figure(folder / f"correlations_{level}.svg", figure))
    shown = [name for name in ("Eq. 1", "MaxEnt IRL") if name in set(stages["predictor"])]
    for candidate_set in dict.fromkeys(stages["candidate_set"]):
        goals = "every dispenser in reach" if candidate_set == "all" else "goals of use in the running game"
        for predictor in shown:
            own = stages[(stages["candidate_set"] == candidate_set) & (stages["predictor"] == predictor)]
            if len(own) > 1:
                title = f"{predictor}: legible stages and recorded participants"
                figure = scatter_figure(own, title, f"a dot per stage; {goals}")
                name = predictor.lower().replace(". ", "_").replace(" ", "_")
                files.append(save_figure(folder / f"stages_{candidate_set}_{name}.svg", figure))
    return files
