"""Tables, figures and prose from logged results alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.csv_tables import write_tables
from benchmarks.experiments.conditions import stacked
from benchmarks.experiments.overcooked import figures, narrative, tables
from benchmarks.experiments.overcooked.sweep import FITTED
from benchmarks.experiments.overcooked.teams import about_teams, load_teams, team_table, wide_table
from benchmarks.reports.experiment_report import Section
from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["sections"]

_CAPTIONS: Final = {
    "layouts": "The best kitchen of each condition, and a middle one of the random ones. The darker a floor cell, the "
    "more often an observer who sees the person there predicts a wrong goal; cells without colour are on no path.",
    "rewards": "What stepping on each cell is worth to the participants, as inverse reinforcement learning infers it "
    "from their trajectories: the darker, the more. The same kitchens.",
}
"""What the pictures show."""


def sections(folder: str | Path) -> list[Section]:
    """Write ``tables/*.csv`` and ``figures/*``, and return the pieces of the report.

    Args:
        folder: Where :func:`benchmarks.experiments.overcooked.run.reproduce` left its results.

    Raises:
        FileNotFoundError: There are no results.
    """
    folder = Path(folder)
    results = tables.load_results(folder)
    best = tables.best_layouts(results)
    metrics = tables.metrics_table(results)
    anova = tables.anova_table(results, best)
    hypotheses = tables.hypotheses_of(results)
    tests = stacked({walker: found.tests for walker, found in hypotheses.items()}, "people")
    verdicts = stacked({walker: found.verdicts() for walker, found in hypotheses.items()}, "people")
    points = stacked({walker: found.points for walker, found in hypotheses.items()}, "people")
    published = tables.beside_published(metrics, results.predictors[0])
    fitted = _people_table(results.fits)
    layouts = _layout_table(results.layouts)
    written = {
        "layouts": layouts,
        "people": fitted,
        "metrics": metrics,
        "published": published,
        "anova": anova,
        "hypotheses": tests,
        "hypotheses_by_fraction": points,
        "verdicts": verdicts,
    }
    teams = load_teams(folder)
    if teams is not None:
        written["teams"] = team_table(teams)
    write_tables(folder / "tables", written.items())
    drawn = figures.draw_all(results, folder / "figures")
    return [
        Section(
            "Layouts", narrative.about_layouts(layouts), {"Layouts by condition": layouts}, drawn["layouts"], _CAPTIONS
        ),
        Section("Participants", narrative.about_participants(results), {"Fitted to recorded play": fitted}),
        Section(
            "How well goals are predicted",
            narrative.about_accuracy(metrics, anova, results),
            {"Figures of merit, mean over 10 to 90 % observed": metrics, "Over all fractions": _overall(anova)},
            drawn["accuracy"],
        ),
        Section(
            "Beside the paper",
            narrative.about_agreement(published),
            {f"Weighted F1, precision and recall: {results.predictors[0]}": published},
            drawn["published"],
        ),
        Section(
            "Hypotheses",
            narrative.about_hypotheses(hypotheses),
            {"Verdicts": verdicts, "Every test": tests},
            drawn["curves"],
        ),
        Section(
            "Confusions, and the costs that are learned",
            narrate("overcooked/confusion", walker=results.walkers[0]),
            {},
            drawn["confusion"],
            _CAPTIONS,
        ),
        *([] if teams is None else [_about_teams(teams)]),
    ]


def _about_teams(teams: pd.DataFrame) -> Section:
    table = team_table(teams)
    found = {"Means over kitchens": wide_table(table), "With 95 % intervals": table}
    return Section("With a robot", about_teams(teams, table), found)


# -- tables for the page ----------------------------------------------------------------------------------------------


def _layout_table(layouts: pd.DataFrame) -> pd.DataFrame:
    names = {"score": "legibility", "num_obstacles": "obstacles"}
    keep = ["condition", "layout", "score", "normalised", "distance", "num_obstacles", "evaluations"]
    return layouts[keep].rename(columns=names)


def _people_table(fits: pd.DataFrame) -> pd.DataFrame:
    """What was fitted: a row per kind of walker."""
    import pandas as pd

    if not len(fits):
        planner = pd.DataFrame(FITTED["planner"]["people"], columns=["turn_cost", "slip"])
        numbers = {key: FITTED["planner"][key] for key in ("depth", "recency", "fade")} | planner.median().to_dict()
        return pd.DataFrame([{"walker": "boltzmann", **FITTED["boltzmann"]}, {"walker": "planner", **numbers}])
    whole = fits[fits["participant"].isna() | (fits["participant"] == "")]
    columns = ["walker", "rationality", "spread", "depth", "turn_cost", "recency", "fade", "slip", "log_likelihood"]
    return whole[[c for c in [*columns, "steps", "walks", "people"] if c in whole]].reset_index(drop=True)


def _overall(anova: pd.DataFrame) -> pd.DataFrame:
    own = anova[anova["fraction"].isna()]
    return own[["walker", "predictor", "unit", "F", "df1", "df2", "p", "eta_squared"]].reset_index(drop=True)
