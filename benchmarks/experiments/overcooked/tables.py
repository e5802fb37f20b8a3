"""Tables of the experiment, from its result files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.experiments import conditions
from benchmarks.experiments.conditions import figures_of_merit, stacked, variance_rows
from benchmarks.experiments.hypotheses import Hypotheses, assess_hypotheses
from benchmarks.experiments.overcooked.sweep import CONDITIONS, PUBLISHED
from benchmarks.experiments.trial_rows import by_table, confusion_matrix, logged_rows

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "Results",
    "accuracy_rows",
    "anova_table",
    "beside_published",
    "best_layouts",
    "confusion_of",
    "hypotheses_of",
    "load_results",
    "metrics_table",
]


@dataclass(frozen=True, eq=False)
class Results:
    """The logged rows of a run.

    Attributes:
        layouts: A row per layout.
        elites: A row per cell of the archive of each search.
        fits: What was fitted to recorded participants; empty without recordings.
        readings: ``accuracy``, ``metrics``, ``confusion`` and ``cost`` rows.
        curves: Learning curves.
    """

    layouts: pd.DataFrame
    elites: pd.DataFrame
    fits: pd.DataFrame
    readings: dict[str, pd.DataFrame]
    curves: pd.DataFrame

    @property
    def predictors(self) -> list[str]:
        """In the order of the sweep."""
        return list(dict.fromkeys(self.readings["accuracy"]["predictor"]))

    @property
    def walkers(self) -> list[str]:
        """In the order of the sweep."""
        return list(dict.fromkeys(self.readings["accuracy"]["walker"]))


def load_results(folder: Path) -> Results:
    """Read what :func:`benchmarks.experiments.overcooked.run.reproduce` logged.

    Raises:
        FileNotFoundError: There is nothing; the message says how to run the experiment.
    """
    found = by_table(logged_rows(folder, "layouts", "overcooked"))
    readings, fits, curves = (logged_rows(folder, name, "overcooked") for name in ("readings", "people", "curves"))
    return Results(found["layout"], found["elite"], fits, by_table(readings), curves)


def best_layouts(results: Results) -> pd.DataFrame:
    """One layout per condition to be shown: the best by the condition's own measure, a middle one for Random."""
    import pandas as pd

    chosen = []
    for condition in CONDITIONS:
        part = results.layouts[results.layouts["condition"] == condition]
        if condition == "Efficient":
            place = part["distance"].idxmin()
        elif condition == "Random":
            place = part["score"].sort_values(kind="stable").index[len(part) // 2]
        elif condition == "Legible":
            place = part["score"].idxmax()
        else:
            own = results.elites[results.elites["condition"] == condition]
            best = own.groupby("layout")["objective"].max().idxmax()
            place = part.index[part["layout"] == best][0]
        chosen.append(part[part.index == place])
    return pd.concat(chosen, ignore_index=True)


# -- how well goals are predicted -------------------------------------------------------------------------------------


def accuracy_rows(results: Results, walker: str) -> pd.DataFrame:
    """Per-participant rows of one kind of participant, as :func:`.assess_hypotheses` takes them."""
    rows = results.readings["accuracy"]
    columns = ["predictor", "condition", "layout", "participant", "fraction", "correct", "chance"]
    return rows[rows["walker"] == walker][columns].reset_index(drop=True)


def metrics_table(results: Results) -> pd.DataFrame:
    """Figures of merit per walker, predictor and condition: means over fractions and layouts, and their spread."""
    orders = {"walker": results.walkers, "predictor": results.predictors, "condition": CONDITIONS}
    return figures_of_merit(results.readings["metrics"], orders)


def beside_published(metrics: pd.DataFrame, predictor: str) -> pd.DataFrame:
    """F1, precision and recall of the paper and ours, a row per condition."""
    own = metrics[metrics["predictor"] == predictor]
    return conditions.beside_published(PUBLISHED, {str(who): rows for who, rows in own.groupby("walker", sort=False)})


def anova_table(results: Results, best: pd.DataFrame) -> pd.DataFrame:
    """The rows of :func:`benchmarks.experiments.conditions.variance_rows`, for each kind of participant."""
    of = {walker: variance_rows(accuracy_rows(results, walker), results.predictors, best) for walker in results.walkers}
    return stacked(of, "walker")


def hypotheses_of(results: Results) -> dict[str, Hypotheses]:
    """H1 to H3 for legible layouts against random and efficient ones, for each kind of participant."""
    found = {}
    for walker in results.walkers:
        own = results.curves[results.curves["walker"] == walker] if len(results.curves) else None
        found[walker] = assess_hypotheses(
            accuracy_rows(results, walker),
            treatment="Legible",
            controls=["Random", "Efficient"],
            curves=own if own is not None and len(own) else None,
            unit="layout",
        )
    return found


def confusion_of(results: Results, walker: str, predictor: str, condition: str, layout: int) -> pd.DataFrame:
    """A square table of trajectories: true goals as rows, predicted ones as columns."""
    keys = {"walker": walker, "predictor": predictor, "condition": condition, "layout": layout}
    return confusion_matrix(results.readings["confusion"], **keys) / results.readings["accuracy"]["fraction"].nunique()
