"""Tables of the experiment, from its result files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.conditions import in_order, stacked, variance_rows
from benchmarks.hypotheses import Hypotheses, assess_hypotheses
from benchmarks.overcooked_conditions.sweep import CONDITIONS, PUBLISHED

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "METRICS",
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

METRICS: Final = ("f1", "precision", "recall")


@dataclass(frozen=True, eq=False)
class Results:
    """The logged rows of a run.

    Attributes:
        layouts: A row per layout.
        elites: A row per cell of the archive of each search.
        fits: What was fitted to recorded people; empty where there were none.
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
    """Read what :func:`benchmarks.overcooked_conditions.run.reproduce` logged.

    Raises:
        FileNotFoundError: There is nothing; the message says how to run the experiment.
    """
    import pandas as pd

    def read(name: str) -> pd.DataFrame:
        path = folder / f"{name}.csv"
        try:
            return pd.read_csv(path, keep_default_na=False, na_values=[""], low_memory=False)
        except pd.errors.EmptyDataError:
            return pd.DataFrame()
        except FileNotFoundError as error:
            raise FileNotFoundError(f"{path} is missing; run `legible reproduce overcooked` first") from error

    found, readings = read("layouts"), read("readings")
    parts = {
        str(name): part.dropna(axis=1, how="all").reset_index(drop=True)
        for name, part in readings.groupby("table", sort=False)
    }
    layouts, elites = (
        found[found["table"] == name].dropna(axis=1, how="all").reset_index(drop=True) for name in ("layout", "elite")
    )
    return Results(layouts, elites, read("people"), parts, read("curves"))


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


# -- how well people are read -----------------------------------------------------------------------------------------


def accuracy_rows(results: Results, walker: str) -> pd.DataFrame:
    """Per-participant rows of one kind of people, as :func:`benchmarks.hypotheses.assess_hypotheses` takes them."""
    rows = results.readings["accuracy"]
    columns = ["predictor", "condition", "layout", "participant", "fraction", "correct", "chance"]
    return rows[rows["walker"] == walker][columns].reset_index(drop=True)


def metrics_table(results: Results) -> pd.DataFrame:
    """Figures of merit per people, predictor and condition: means over fractions and layouts, and their spread."""
    keys = ["walker", "predictor", "condition"]
    names = ["accuracy", *METRICS, "log_loss", "calibration_error"]
    per_layout = results.readings["metrics"].groupby([*keys, "layout"], sort=False)[names].mean()
    grouped = per_layout.reset_index().groupby(keys, sort=False)
    table = grouped[names].mean()
    table.insert(1, "accuracy_sd", grouped["accuracy"].std())
    return in_order(table.reset_index(), walker=results.walkers, predictor=results.predictors, condition=CONDITIONS)


def beside_published(metrics: pd.DataFrame, predictor: str) -> pd.DataFrame:
    """F1, precision and recall of the paper and ours, a row per condition."""
    import pandas as pd

    rows = []
    for condition in CONDITIONS:
        row: dict[str, object] = {"condition": condition}
        for name in METRICS:
            row[f"{name}, paper"] = PUBLISHED[condition][name]
            for walker in dict.fromkeys(metrics["walker"]):
                own = metrics[(metrics["walker"] == walker) & (metrics["predictor"] == predictor)]
                row[f"{name}, {walker}"] = float(own.set_index("condition")[name][condition])
        rows.append(row)
    return pd.DataFrame(rows)


def anova_table(results: Results, best: pd.DataFrame) -> pd.DataFrame:
    """Analyses of variance of each kind of people; see :func:`benchmarks.conditions.variance_rows`."""
    of = {walker: variance_rows(accuracy_rows(results, walker), results.predictors, best) for walker in results.walkers}
    return stacked(of, "walker")


def hypotheses_of(results: Results) -> dict[str, Hypotheses]:
    """H1 to H3 for legible layouts against random and efficient ones, for each kind of people."""
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
    """A square table of walks: true goals as rows, predicted ones as columns."""
    rows = results.readings["confusion"]
    keys = {"walker": walker, "predictor": predictor, "condition": condition, "layout": layout}
    for name, value in keys.items():
        rows = rows[rows[name] == value]
    goals = sorted({*rows["goal"], *rows["predicted"]})
    fractions = results.readings["accuracy"]["fraction"].nunique()
    wide = rows.pivot_table(index="goal", columns="predicted", values="count", aggfunc="sum", fill_value=0.0)
    return wide.reindex(index=goals, columns=goals, fill_value=0.0) / fractions
