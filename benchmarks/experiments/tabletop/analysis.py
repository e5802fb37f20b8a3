"""Tables, figures and prose from logged results alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.csv_tables import write_tables
from benchmarks.experiments.conditions import stacked, variance_rows
from benchmarks.experiments.tabletop import figures, narrative, tables
from benchmarks.reports.experiment_report import Section
from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.experiments.hypotheses import Hypotheses

__all__ = ["sections"]

_CAPTIONS: Final = {
    "layouts": "The best table of each condition, and what is built. Ribbons are the shortest reaches: the darker, the "
    "less an observer who has seen the hand come so far believes in its true goal.",
    "reaches": "Reaches from the assembly zone to every object: their mean as a line, and ellipses of two standard "
    "deviations, on the same tables; a colour for each object.",
}
"""What the pictures show."""


def sections(folder: str | Path) -> list[Section]:
    """Write ``tables/*.csv`` and ``figures/*``, and return the pieces of the report.

    Args:
        folder: Where :func:`benchmarks.experiments.tabletop.run.reproduce` left its results.

    Raises:
        FileNotFoundError: There are no results.
    """
    folder = Path(folder)
    results = tables.load_results(folder)
    found = _tables(results)
    hypotheses = tables.hypotheses_of(results)
    found["verdicts"] = stacked({name: one.verdicts() for name, one in hypotheses.items()}, "design")
    tests = {name: one.tests.drop(columns="treatment") for name, one in hypotheses.items()}
    found["hypotheses"] = stacked(tests, "design")
    found["hypotheses_by_fraction"] = stacked({name: one.points for name, one in hypotheses.items()}, "design")
    write_tables(folder / "tables", found.items())
    drawn = figures.draw_all(results, folder / "figures")
    return [
        *_accuracy_sections(results, found, drawn),
        *_claim_sections(found, hypotheses, drawn),
        Section(
            "With a robot",
            narrative.about_teams(results, found["teams"], found["team_differences"]),
            {
                f"Against the Baseline, the robot predicts by {_first_robot(results)} "
                "(Tukey's intervals, participants as units)": found["team_differences"],
                "All measures, means over participants and 95 % intervals": found["teams"],
            },
            drawn["teams"],
        ),
        Section(
            "Confusions",
            narrate("tabletop/confusion", predictor=results.predictors[0]),
            {},
            drawn["confusion"],
        ),
    ]


def _tables(results: tables.Results) -> dict[str, pd.DataFrame]:
    """Everything that is written to ``tables``, by name, but for the hypotheses."""
    best, metrics = tables.best_layouts(results), tables.metrics_table(results)
    spread = tables.spread_table(results)
    return {
        "layouts": _layout_table(results.layouts),
        "metrics": metrics,
        "starts": tables.start_table(results),
        "published": tables.beside_published(metrics, results.predictors[:2]),
        "spread": spread,
        "published_spread": tables.spread_beside_published(spread),
        "anova": variance_rows(tables.accuracy_rows(results), results.predictors, best),
        "compliance": tables.compliance_table(results),
        "teams": tables.team_table(results),
        "team_differences": tables.team_differences(results, _first_robot(results)),
    }


def _accuracy_sections(
    results: tables.Results, found: dict[str, pd.DataFrame], drawn: dict[str, list[Path]]
) -> list[Section]:
    return [
        Section(
            "Tables",
            narrative.about_layouts(results),
            {"Tables by condition": found["layouts"]},
            drawn["layouts"],
            _CAPTIONS,
        ),
        Section("Participants", narrative.about_participants()),
        Section(
            "How well goals are predicted",
            narrative.about_accuracy(results, found["metrics"], found["anova"]),
            {
                "Figures of merit, mean over 10 to 90 % observed": found["metrics"],
                "Over all fractions: one-way analyses of variance": _overall(found["anova"]),
                "Accuracy by where reaches begin": found["starts"],
            },
            drawn["accuracy"],
        ),
        Section(
            "Beside the paper",
            narrative.about_agreement(found["published"], found["metrics"], results.predictors),
            {"Weighted F1, precision and recall": found["published"]},
            drawn["published"],
        ),
        Section(
            "How much reaches differ",
            narrative.about_spread(found["spread"], found["published_spread"]),
            {
                "Determinant (m⁴) and trace (m²) beside the paper": found["published_spread"],
                "By alignment": found["spread"],
            },
            drawn["spread"],
            _CAPTIONS,
        ),
    ]


def _claim_sections(
    found: dict[str, pd.DataFrame], hypotheses: dict[str, Hypotheses], drawn: dict[str, list[Path]]
) -> list[Section]:
    return [
        Section(
            "Hypotheses",
            narrative.about_hypotheses(hypotheses),
            {"Verdicts": found["verdicts"], "Every test": found["hypotheses"]},
            drawn["curves"],
        ),
        Section(
            "Participants who ignore virtual obstacles",
            narrative.about_compliance(found["compliance"]),
            {"Accuracy by how often participants reach across obstacles": found["compliance"]},
        ),
    ]


def _first_robot(results: tables.Results) -> str:
    return str(results.teams["reader"].iloc[0])


def _layout_table(layouts: pd.DataFrame) -> pd.DataFrame:
    names = {"score": "legibility", "num_obstacles": "obstacles", "found_after": "evaluations"}
    keep = ["condition", "layout", "score", "normalised", "distance", "mean_detour", "max_detour", "num_obstacles"]
    return layouts[[*keep, "found_after"]].rename(columns=names)


def _overall(anova: pd.DataFrame) -> pd.DataFrame:
    own = anova[anova["fraction"].isna()]
    return own[["predictor", "unit", "F", "df1", "df2", "p", "eta_squared"]].reset_index(drop=True)
