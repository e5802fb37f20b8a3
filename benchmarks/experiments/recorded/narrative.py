"""What the tables say: the figures behind the sentences of ``templates/experiments/recorded``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.experiments.recorded.sweep import MIN_TRAJECTORIES
from benchmarks.reports.narrative import narrate

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["about_correlations"]


def about_correlations(correlations: pd.DataFrame) -> str:
    """Whether participants are easier to predict where the score is higher.

    Args:
        correlations: As of :func:`benchmarks.experiments.recorded.analysis.correlate`, with ``level``.
    """
    verdicts = [
        {"candidate_set": candidate_set, "level": level, **_verdict(part)}
        for candidate_set, own in correlations.groupby("candidate_set", sort=False)
        for level, part in own.groupby("level", sort=False)
    ]
    return narrate("recorded/correlations", min_trajectories=MIN_TRAJECTORIES, verdicts=verdicts)


def _verdict(part: pd.DataFrame) -> dict[str, Any]:
    found = part[(part["places_low"] > 0) & (part["people_low"] > 0)]
    return {
        "found": found["predictor"].tolist(),
        "against": part[part["places_high"] < 0]["predictor"].tolist(),
        "above": part[part["skill_low"] > 0]["predictor"].tolist(),
        "predictors": part[["predictor", "rho", "places_low", "places_high"]].to_dict("records"),
        "within": {"low": part["rho_within"].min(), "high": part["rho_within"].max()},
        "places": int(part["places"].min()),
        "detectable": part["detectable"].max(),
    }
