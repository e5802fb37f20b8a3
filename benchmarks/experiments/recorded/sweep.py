"""The settings of the experiment, as data, and the trials they make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from benchmarks.experiments.prediction.sweep import LAYOUTS, PREDICTORS
from legible_envs.rollouts.trajectory import Cut

__all__ = ["BOOTSTRAPS", "FULL", "MIN_TRAJECTORIES", "QUICK", "Settings", "accuracy_trials", "score_trials"]

MIN_TRAJECTORIES: Final = 10
"""Stages and goals with fewer recorded trajectories are left out: their accuracy is mostly chance."""
BOOTSTRAPS: Final = 2000
"""Resamples behind an interval."""

_LABELS: Final = ("shortest distance", "Eq. 1", "Eq. 1 (soft costs)", "MaxEnt IRL", "k-NN", "logistic")


@dataclass(frozen=True)
class Settings:
    """How much is done.

    Attributes:
        predictors: Labels of :data:`benchmarks.experiments.prediction.sweep.PREDICTORS`.
        layouts: Recorded kitchens.
        candidate_sets: Which goals count as possible; see
            :func:`legible_envs.datasets.overcooked_2019.recorded_trajectories`.
        cut: Fraction of what is observed; see :data:`legible_envs.rollouts.CUTS`.
        folds: Of the cross-validation.
        repeats: Of the cross-validation.
        seed: Of the splits.
    """

    predictors: tuple[str, ...] = _LABELS
    layouts: tuple[str, ...] = LAYOUTS
    candidate_sets: tuple[str, ...] = ("all", "game")
    cut: Cut = "cells"
    folds: int = 4
    repeats: int = 3
    seed: int = 0


FULL: Final = Settings()
QUICK: Final = Settings(predictors=("shortest distance", "Eq. 1", "MaxEnt IRL", "logistic"), repeats=1)


def score_trials(settings: Settings, recorded: int) -> list[dict[str, Any]]:
    """One trial per kitchen and candidate set, for the legibility of its stages.

    Args:
        settings: The settings.
        recorded: How many trajectories are recorded, so that other recordings make other trials.
    """
    return [
        {"candidate_set": candidate_set, "kitchen": layout, "recorded_walks": recorded}
        for candidate_set in settings.candidate_sets
        for layout in settings.layouts
    ]


def accuracy_trials(settings: Settings, recorded: int) -> list[dict[str, Any]]:
    """One trial per kitchen, candidate set and predictor.

    Args:
        settings: The settings.
        recorded: How many trajectories are recorded, so that other recordings make other trials.

    Raises:
        ValueError: A label that no predictor of the benchmark on recorded play has.
    """
    known = {setting.label: setting for setting in PREDICTORS}
    unknown = [label for label in settings.predictors if label not in known]
    if unknown:
        raise ValueError(f"no predictor is called {unknown[0]!r}; there are {list(known)}")
    return [
        place
        | {
            "predictor": label,
            "how": known[label].how,
            "cut": settings.cut,
            "folds": settings.folds,
            "repeats": settings.repeats,
            "seed": settings.seed,
        }
        for place in score_trials(settings, recorded)
        for label in settings.predictors
    ]
