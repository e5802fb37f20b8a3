"""The figures behind the sentences of ``templates/experiments/optimizers``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.experiments.optimizers.sweep import LEARNED, OPTIMUM_5X5, OURS
from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "about_differences",
    "about_learned",
    "about_local_search",
    "about_optimum",
    "about_published",
    "about_searches",
]


def about_searches(board: pd.DataFrame) -> str:
    """What budgets mean, and which one the leaderboard shows."""
    return narrate("optimizers/searches", budget=None if board.empty else int(board["budget"].iloc[0]))


def about_differences(ours: pd.DataFrame) -> str:
    """How our emitter does against the paper's, and what the tests are."""
    counts = ours["verdict"].value_counts()
    verdicts = [(name, counts[name]) for name in ("better", "worse", "no difference shown") if name in counts]
    return narrate("optimizers/differences", ours=OURS, verdicts=verdicts, count=len(ours))


def about_optimum(gap: pd.DataFrame) -> str:
    """Which methods reach the proven optimum in every search."""
    budgets = []
    for budget, part in gap.groupby("budget", sort=False):
        methods = part.loc[part["reached"] == 1.0, "method"].tolist()
        budgets.append({"budget": str(budget), "methods": methods, "all": len(methods) == len(part)})
    return narrate("optimizers/optimum", optimum=OPTIMUM_5X5, budgets=budgets)


def about_learned(learned: pd.DataFrame) -> str:
    """What a designer that learns is, and where it stands."""
    places = [(name, place) for place, name in enumerate(learned["method"], 1) if name in LEARNED]
    return narrate("optimizers/learned", budget=int(learned["budget"].iloc[0]), places=places, count=len(learned))


def about_local_search() -> str:
    """How a plain local search works."""
    return narrate("optimizers/local_search")


def about_published(published: pd.DataFrame) -> str:
    """On how many grids the paper's methods rank as published."""
    budgets = []
    for budget, part in published.groupby("budget", sort=False):
        same = (part["rank"] == part["published_rank"]).groupby(part["grid"]).all().sum()
        budgets.append({"budget": str(budget), "same": int(same), "grids": part["grid"].nunique()})
    return narrate("optimizers/published", budgets=budgets)
