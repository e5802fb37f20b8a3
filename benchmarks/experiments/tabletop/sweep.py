"""The settings of the experiment, as data, and the trials they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.experiments.predictor_settings import PredictorSetting

__all__ = [
    "ALONE",
    "CONDITIONS",
    "DESIGNS",
    "FULL",
    "HAVE_OBSTACLES",
    "NO_PREDICTION",
    "PUBLISHED",
    "PUBLISHED_SPREAD",
    "QUICK",
    "ROBOTS",
    "RobotSetting",
    "Settings",
    "accuracy_trials",
    "curve_trials",
    "layout_trials",
    "spread_trials",
    "team_trials",
]

CONDITIONS: Final = ("Random", "Baseline", "Placement", "Virtual Obstacle", "Both")
"""The paper's four in the order of its table, after a reference of ours."""
DESIGNS: Final = {"Placement": "placement", "Virtual Obstacle": "obstacles", "Both": "both"}
"""What is searched, as conditions of :class:`~legible_envs.tabletop.TabletopWorkspace`."""
HAVE_OBSTACLES: Final = ("Virtual Obstacle", "Both")

PUBLISHED: Final[Mapping[str, Mapping[str, float]]] = {
    "Baseline": {"f1": 0.704, "precision": 0.751, "recall": 0.689},
    "Placement": {"f1": 0.753, "precision": 0.770, "recall": 0.761},
    "Virtual Obstacle": {"f1": 0.796, "precision": 0.803, "recall": 0.800},
    "Both": {"f1": 0.936, "precision": 0.941, "recall": 0.937},
}
"""Tung et al. (HRI 2024), 12 participants at the table: weighted means over goals."""
PUBLISHED_SPREAD: Final[Mapping[str, Mapping[str, float]]] = {
    "Baseline": {"determinant": 9.36e-6, "trace": 7.12e-3},
    "Placement": {"determinant": 8.50e-6, "trace": 5.90e-3},
    "Virtual Obstacle": {"determinant": 6.14e-6, "trace": 3.90e-3},
    "Both": {"determinant": 1.09e-6, "trace": 2.77e-3},
}
"""Tung et al. (HRI 2024): covariances of reaches to one goal, m^4 and m^2."""

PREDICTORS: Final = (
    PredictorSetting("Gaussian (paper's index)", "reach-gaussian", {"online": "fraction", "alignment": "mean"}),
    PredictorSetting("nearest cube", "shortest-distance", {"metric": "euclidean"}, learns=False),
    PredictorSetting("Gaussian", "reach-gaussian"),
    PredictorSetting("Eq. 1", "reach-bayesian", learns=False),
    PredictorSetting("logistic", "reach-logistic"),
    PredictorSetting("k-NN", "reach-knn"),
)
"""The paper's two first. Its Gaussian is indexed by the share of the whole duration, which is unknown during a
reach; the one named plainly "Gaussian" aligns what was seen so far."""
NEURAL: Final = PredictorSetting(
    "GRU", "recurrent", {"members": 2, "max_epochs": 40, "patience": 6, "device": "cpu"}, max_repeats=1
)

ALONE: Final = "alone"
"""Name, in tables, of work without a robot."""
NO_PREDICTION: Final = "no prediction"
"""Name, in tables, of a robot that holds all goals for equally likely."""


@dataclass(frozen=True)
class RobotSetting:
    """How a robot predicts the goals of the participant it works with.

    Attributes:
        label: What tables call it.
        predictor: As :class:`~legible_envs.tabletop.env.TabletopEnv` takes it; empty: there is no robot.
    """

    label: str
    predictor: str


ROBOTS: Final = (
    RobotSetting("Eq. 1", "bayesian"),
    RobotSetting("Gaussian", "predictors.reaching.gaussian:TimeSeriesGaussian"),
    RobotSetting(NO_PREDICTION, "predictors.uniform:UniformPredictor"),
    RobotSetting(ALONE, ""),
)
"""The Gaussian has learned from simulated participants at the same table. A robot without prediction acts when the
participant holds an object, or has one goal only."""


@dataclass(frozen=True)
class Settings:
    """How much is done.

    Attributes:
        layouts: Layouts per condition, each searched with a seed of its own; of the one Baseline, groups of
            participants.
        participants: Simulated participants per layout; each reaches for the eight cubes once.
        initial: Random tables: what a search begins with, and what the median is taken of.
        evaluations: Of a search, the initial ones included.
        predictors: Which predictors to compare.
        folds: Of the cross-validation.
        repeats: Of the cross-validation.
        shares: Of the reaches not held out, learned from in learning curves.
        curve_repeats: Splits of the learning curves.
        crossing: Probabilities with which participants who do not always comply reach across obstacles.
        samples: Steps of a mean reach, for covariances.
        robots: Which robots participants work with.
        rounds: How often each participant builds the task with each robot.
        threshold: A robot is sure above this probability.
        seed: Of the participants and splits.
    """

    layouts: int = 5
    participants: int = 12
    initial: int = 1000
    evaluations: int = 200_000
    predictors: tuple[PredictorSetting, ...] = (*PREDICTORS, NEURAL)
    folds: int = 4
    repeats: int = 3
    shares: tuple[float, ...] = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
    curve_repeats: int = 10
    crossing: tuple[float, ...] = (0.1, 0.5, 1.0)
    samples: int = 50
    robots: tuple[RobotSetting, ...] = ROBOTS
    rounds: int = 3
    threshold: float = 0.8
    seed: int = 0


FULL: Final = Settings()
QUICK: Final = Settings(
    layouts=3,
    evaluations=30_000,
    predictors=PREDICTORS,
    repeats=1,
    shares=(0.1, 0.3, 0.6, 1.0),
    curve_repeats=3,
    crossing=(0.1, 1.0),
    rounds=1,
)

Place = Mapping[str, Any]


def layout_trials(settings: Settings) -> list[dict[str, Any]]:
    """One search, or one draw of random tables, for each layout."""
    trials = []
    for condition in CONDITIONS:
        for number in range(settings.layouts):
            trial: dict[str, Any] = {"condition": condition, "layout": number}
            if condition != "Baseline":
                trial["initial"] = settings.initial
            if condition in DESIGNS:
                trial["evaluations"] = settings.evaluations
            trials.append(trial)
    return trials


def accuracy_trials(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """Every predictor on participants at every table; with obstacles, also on participants who ignore them.

    Args:
        settings: The settings.
        places: ``condition``, ``layout`` (its number) and ``json``.
    """
    trials = []
    for place in places:
        rates = settings.crossing if place["condition"] in HAVE_OBSTACLES else ()
        for rate in (0.0, *rates):
            for setting in settings.predictors:
                if rate and setting.max_repeats is not None:
                    continue  # the table of compliance does without those that take long
                extra = {"folds": settings.folds, "repeats": setting.repeats(settings.repeats)}
                trials.append(_with_people(settings, place, rate) | _predicted_by(setting) | extra)
    return trials


def curve_trials(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """A learning curve of every predictor that learns."""
    return [
        _with_people(settings, place)
        | _predicted_by(setting)
        | {"shares": list(settings.shares), "repeats": setting.repeats(settings.curve_repeats)}
        for place in places
        for setting in settings.predictors
        if setting.learns
    ]


def spread_trials(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """How much reaches to the same goal differ, at every table."""
    return [_with_people(settings, place) | {"samples": settings.samples} for place in places]


def team_trials(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """The same participants at work, with every robot and alone."""
    return [
        _with_people(settings, place)
        | {"reader": robot.label, "robot": robot.predictor, "rounds": settings.rounds}
        | {"threshold": settings.threshold}
        for place in places
        for robot in settings.robots
    ]


def _predicted_by(setting: PredictorSetting) -> dict[str, Any]:
    return {"predictor": setting.label, "how": setting.how}


def _with_people(settings: Settings, place: Place, crossing: float = 0.0) -> dict[str, Any]:
    """A trial's table and participants: the same ones for every predictor, and whether or not they comply."""
    condition, number = str(place["condition"]), int(place["layout"])
    source = np.random.SeedSequence((settings.seed, CONDITIONS.index(condition), number))
    return {
        "condition": condition,
        "layout": number,
        "crossing": crossing,
        "json": str(place["json"]),
        "participants": settings.participants,
        "seed": int(source.generate_state(1)[0]),
    }
