"""The figures behind the sentences of ``templates/experiments/learning``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["about_curves", "about_places", "about_results"]


def about_curves(curves: pd.DataFrame) -> str:
    """What the curves are of."""
    return narrate("learning/curves", seeds=int(curves["seeds"].max()) if len(curves) else 0)


def about_results(results: pd.DataFrame, enough: float, at_most: float) -> str:
    """Which tasks are learned, by the policy itself or by its most probable actions."""
    return narrate("learning/results", rows=results.to_dict("records"), enough=enough, at_most=at_most)


def about_places(places: pd.DataFrame) -> str:
    """How far policies get where they were not trained."""
    own = places[places["player"] == "policy"]
    return narrate("learning/places", rows=own.to_dict("records"))
