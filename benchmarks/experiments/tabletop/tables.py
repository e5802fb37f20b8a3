"""Tables of the experiment, from its result files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.experiments import conditions
from benchmarks.experiments.conditions import figures_of_merit, in_order
from benchmarks.experiments.hypotheses import Hypotheses, assess_hypotheses
from benchmarks.experiments.tabletop.sweep import CONDITIONS, HAVE_OBSTACLES, NO_PREDICTION, PUBLISHED, PUBLISHED_SPREAD
from benchmarks.experiments.trial_rows import by_table, confusion_matrix, logged_rows

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "MEASURES",
    "Results",
    "accuracy_rows",
    "beside_published",
    "best_layouts",
    "compliance_table",
    "confusion_of",
    "hypotheses_of",
    "load_results",
    "metrics_table",
    "spread_beside_published",
    "spread_summary",
    "spread_table",
    "start_table",
    "team_differences",
    "team_table",
]

MEASURES: Final = (
    "completion_time",
    "conflicts",
    "goals_lost",
    "human_idle",
    "robot_idle",
    "concurrent_activity",
    "functional_delay",
    "decision_time",
    "decision_fraction",
    "decided_rightly",
)
"""What is told of teams, as :meth:`~legible_envs.partner.fluency.TeamMetrics.summary` names it."""
TESTS: Final = {"Placement": ["Baseline"], "Virtual Obstacle": ["Baseline"], "Both": list(CONDITIONS[1:-1])}
"""Designs, and the conditions than which their goals should be predicted better."""
SHARE: Final = 0.3
"""Of the data, in the test whether less of it is enough."""


@dataclass(frozen=True, eq=False)
class Results:
    """The logged rows of a run.

    Attributes:
        layouts: A row per layout.
        readings: ``accuracy``, ``start``, ``metrics`` and ``confusion`` rows.
        curves: Learning curves.
        spreads: Means and covariances of reaches.
        teams: Measures of participants at work.
    """

    layouts: pd.DataFrame
    readings: dict[str, pd.DataFrame]
    curves: pd.DataFrame
    spreads: pd.DataFrame
    teams: pd.DataFrame

    @property
    def predictors(self) -> list[str]:
        """In the order of the sweep."""
        return list(dict.fromkeys(self.readings["accuracy"]["predictor"]))

    def complying(self, table: str) -> pd.DataFrame:
        """Rows of participants who go round obstacles."""
        rows = self.readings[table]
        return rows[rows["crossing"] == 0].reset_index(drop=True)


def load_results(folder: Path) -> Results:
    """Read what :func:`benchmarks.experiments.tabletop.run.reproduce` logged.

    Raises:
        FileNotFoundError: There is nothing; the message says how to run the experiment.
    """
    names = ("layouts", "readings", "curves", "spreads", "teams")
    layouts, readings, curves, spreads, teams = (logged_rows(folder, name, "tabletop") for name in names)
    # Earlier results call a robot without prediction so.
    teams = teams.replace({"reader": {"reads nothing": NO_PREDICTION}})
    return Results(layouts, by_table(readings), curves, spreads, teams)


def best_layouts(results: Results) -> pd.DataFrame:
    """One layout per condition to be shown: the best by what was searched for, a middle one of the random."""
    import pandas as pd

    chosen = []
    for condition in CONDITIONS:
        part = results.layouts[results.layouts["condition"] == condition]
        if condition == "Random":
            place = part["score"].sort_values(kind="stable").index[len(part) // 2]
        else:
            place = part["objective"].idxmax()
        chosen.append(part.loc[place])
    return pd.DataFrame(chosen).reset_index(drop=True)


# -- how well goals are predicted -------------------------------------------------------------------------------------


def accuracy_rows(results: Results) -> pd.DataFrame:
    """Per-participant rows, as :func:`benchmarks.experiments.hypotheses.assess_hypotheses` takes them."""
    columns = ["predictor", "condition", "layout", "participant", "fraction", "correct", "chance"]
    return results.complying("accuracy")[columns]


def metrics_table(results: Results) -> pd.DataFrame:
    """Figures of merit per predictor and condition: means over fractions and layouts, and the spread of layouts."""
    return figures_of_merit(results.complying("metrics"), {"predictor": results.predictors, "condition": CONDITIONS})


def start_table(results: Results) -> pd.DataFrame:
    """Accuracy, mean over fractions and layouts, by where reaches began."""
    keys = ["predictor", "start", "condition"]
    means = results.complying("start").groupby([*keys, "layout"], sort=False)["correct"].mean()
    wide = means.groupby(keys, sort=False).mean().unstack("condition")[list(CONDITIONS)].reset_index()
    return in_order(wide, predictor=results.predictors, start=sorted(wide["start"].unique(), reverse=True))


def beside_published(metrics: pd.DataFrame, predictors: list[str]) -> pd.DataFrame:
    """F1, precision and recall of the paper and of two of our predictors, a row per condition of the paper."""
    ours = {predictor: metrics[metrics["predictor"] == predictor] for predictor in predictors}
    return conditions.beside_published(PUBLISHED, ours)


def compliance_table(results: Results) -> pd.DataFrame:
    """Accuracy, mean over fractions and layouts, by how often participants reach across obstacles.

    A row per predictor and rate; beside the conditions with obstacles, Placement, which has none to ignore.
    """
    keys = ["predictor", "crossing", "condition"]
    rows = results.readings["metrics"]
    means = rows.groupby([*keys, "layout"], sort=False)["accuracy"].mean().groupby(keys, sort=False).mean()
    wide = means.unstack("condition")
    without = wide.xs(0.0, level="crossing")["Placement"]
    wide = wide[list(HAVE_OBSTACLES)].dropna().reset_index()
    wide["Placement"] = wide["predictor"].map(without)
    tried = [name for name in results.predictors if (wide["predictor"] == name).sum() > 1]
    wide = wide[wide["predictor"].isin(tried)]
    return in_order(wide, predictor=tried, crossing=sorted(wide["crossing"].unique()))


def hypotheses_of(results: Results) -> dict[str, Hypotheses]:
    """H1 to H3 for each design of tables, against the sorted one; for Both also against either alone."""
    rows, curves = accuracy_rows(results), results.curves
    return {
        treatment: assess_hypotheses(
            rows,
            treatment=treatment,
            controls=controls,
            curves=curves if len(curves) else None,
            unit="layout",
            share=SHARE,
        )
        for treatment, controls in TESTS.items()
    }


def confusion_of(results: Results, predictor: str, condition: str, layout: int) -> pd.DataFrame:
    """A square table of reaches: true goals as rows, predicted ones as columns."""
    keys = {"predictor": predictor, "condition": condition, "layout": layout}
    return confusion_matrix(results.complying("confusion"), **keys)


# -- how much reaches differ ------------------------------------------------------------------------------------------


def sizes_of_covariances(spreads: pd.DataFrame) -> pd.DataFrame:
    """The rows with ``determinant`` (m^4) and ``trace`` (m^2) of each covariance."""
    determinant = spreads["xx"] * spreads["yy"] - spreads["xy"] ** 2
    return spreads.assign(determinant=determinant, trace=spreads["xx"] + spreads["yy"])


def spread_table(results: Results) -> pd.DataFrame:
    """The rows of :func:`spread_summary` for all conditions."""
    return spread_summary(results.spreads, CONDITIONS)


def spread_summary(spreads: pd.DataFrame, order: Sequence[str]) -> pd.DataFrame:
    """Determinant and trace of covariances by alignment and condition: means over steps, goals and layouts.

    ``apart`` is how far mean reaches to two goals are from each other (metres, mean over pairs and steps): what spread
    has to be compared with.

    Args:
        spreads: Rows of :func:`benchmarks.experiments.tabletop.run.covariance_rows`, with ``condition, layout``.
        order: Conditions in their order.
    """
    import pandas as pd

    rows = []
    for (alignment, condition), part in sizes_of_covariances(spreads).groupby(["alignment", "condition"]):
        each = part.groupby("layout")[["determinant", "trace"]].mean()
        apart = [_apart(own) for _, own in part.groupby("layout")]
        row = {"alignment": alignment, "condition": condition, **each.mean().to_dict()}
        rows.append(row | {"trace_sd": each["trace"].std(), "apart": float(np.mean(apart))})
    return in_order(pd.DataFrame(rows), alignment=["none", "mean"], condition=order)


def _apart(part: pd.DataFrame) -> float:
    x, y = (part.pivot(index="step", columns="goal", values=name).to_numpy() for name in ("x", "y"))
    distances = np.hypot(x[:, :, None] - x[:, None], y[:, :, None] - y[:, None])
    return float(distances[:, *np.triu_indices(x.shape[1], 1)].mean())


def spread_beside_published(spread: pd.DataFrame) -> pd.DataFrame:
    """Determinant and trace of the paper and ours, a row per condition of the paper."""
    names = {"none": "ours", "mean": "ours, warped"}
    ours = {name: spread[spread["alignment"] == key] for key, name in names.items()}
    return conditions.beside_published(PUBLISHED_SPREAD, ours)


# -- teams ------------------------------------------------------------------------------------------------------------


def team_people(results: Results) -> pd.DataFrame:
    """A row per robot and participant: means over rounds."""
    names = [name for name in MEASURES if name in results.teams]
    keys = ["reader", "condition", "layout", "participant"]
    return results.teams.groupby(keys, sort=False)[[*names, "path_length"]].mean().reset_index()


def team_table(results: Results) -> pd.DataFrame:
    """Mean and 95 % interval of each measure, participants as units: a row per robot, measure and condition."""
    import pandas as pd
    from scipy import stats

    people, rows = team_people(results), []
    for (reader, condition), part in people.groupby(["reader", "condition"], sort=False):
        for measure in MEASURES:
            values = part[measure].dropna().to_numpy()
            if len(values) < 2:
                continue
            reach = float(stats.t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
            mean = float(values.mean())
            row = {"reader": reader, "measure": measure, "condition": condition, "people": len(values), "mean": mean}
            rows.append(row | {"low": mean - reach, "high": mean + reach})
    readers = list(dict.fromkeys(people["reader"]))
    return in_order(pd.DataFrame(rows), reader=readers, measure=MEASURES, condition=CONDITIONS)


def team_differences(results: Results, robot: str) -> pd.DataFrame:
    """Each measure in each condition against the Baseline: Tukey's interval and p, participants as units."""
    import pandas as pd

    from predictors.evaluation.comparison import compare_conditions

    people, parts = team_people(results), []
    own = people[people["reader"] == robot]
    for measure in MEASURES:
        known = own.dropna(subset=[measure])
        # The order decides the sign of differences: others less the Baseline.
        order = [*CONDITIONS[2:], CONDITIONS[0], "Baseline"]
        known = in_order(known, condition=order)
        if known.groupby("condition").size().reindex(order, fill_value=0).min() < 2:
            continue
        pairs = compare_conditions(known, value=measure, at="mean", design="between").pairs
        pairs = pairs[pairs["b"] == "Baseline"].rename(columns={"a": "condition"})
        parts.append(pairs.assign(measure=measure)[["measure", "condition", "difference", "low", "high", "p"]])
    return in_order(pd.concat(parts, ignore_index=True), measure=MEASURES, condition=CONDITIONS)
