"""The settings of the experiment, as data, and the cells they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.experiments.trial_rows import Judge

__all__ = [
    "CONDITIONS",
    "DESIGNS",
    "FULL",
    "HAVE_OBSTACLES",
    "PUBLISHED",
    "PUBLISHED_SPREAD",
    "QUICK",
    "READERS",
    "Reader",
    "Settings",
    "curve_cells",
    "layout_cells",
    "reading_cells",
    "spread_cells",
    "team_cells",
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
"""Tung et al. (HRI 2024), 12 people at the table: weighted means over goals."""
PUBLISHED_SPREAD: Final[Mapping[str, Mapping[str, float]]] = {
    "Baseline": {"determinant": 9.36e-6, "trace": 7.12e-3},
    "Placement": {"determinant": 8.50e-6, "trace": 5.90e-3},
    "Virtual Obstacle": {"determinant": 6.14e-6, "trace": 3.90e-3},
    "Both": {"determinant": 1.09e-6, "trace": 2.77e-3},
}
"""Tung et al. (HRI 2024): covariances of reaches to one goal, m^4 and m^2."""

PREDICTORS: Final = (
    Judge("Gaussian (paper's index)", "reach-gaussian", {"online": "fraction", "alignment": "mean"}),
    Judge("nearest cube", "shortest-distance", {"metric": "euclidean"}, learns=False),
    Judge("Gaussian", "reach-gaussian"),
    Judge("Eq. 1", "reach-bayesian", learns=False),
    Judge("logistic", "reach-logistic"),
    Judge("k-NN", "reach-knn"),
)
"""The paper's two first. Its Gaussian is indexed by the share of the whole duration, which nobody knows while a reach
is going on; the one called just so aligns what was seen so far."""
NEURAL: Final = Judge("GRU", "recurrent", {"members": 2, "max_epochs": 40, "patience": 6, "device": "cpu"}, repeats=1)


@dataclass(frozen=True)
class Reader:
    """How a robot reads the person it works with.

    Attributes:
        label: What tables call it.
        predictor: As :class:`~legible_envs.tabletop.env.TabletopEnv` takes it; empty: there is no robot.
    """

    label: str
    predictor: str


READERS: Final = (
    Reader("Eq. 1", "bayesian"),
    Reader("Gaussian", "predictors.reaching.gaussian:TimeSeriesGaussian"),
    Reader("reads nothing", "predictors.uniform:UniformPredictor"),
    Reader("alone", ""),
)
"""The Gaussian has learned from simulated people at the very table. Who reads nothing acts when the person holds
something, or has no choice."""


@dataclass(frozen=True)
class Settings:
    """How much is done.

    Attributes:
        layouts: Layouts per condition, each searched with a seed of its own; of the one Baseline, groups of people.
        participants: Simulated people per layout; each reaches for the eight cubes once.
        initial: Random tables: what a search begins with, and what the median is taken of.
        evaluations: Of a search, the initial ones included.
        predictors: Whom to compare.
        folds: Of the cross-validation.
        repeats: Of the cross-validation.
        shares: Of the reaches not held out, learned from in learning curves.
        curve_repeats: Splits of the learning curves.
        crossing: Probabilities with which people who do not always comply reach across obstacles.
        samples: Steps of a mean reach, for covariances.
        readers: Of the robots.
        rounds: How often each person builds the task with each robot.
        threshold: A robot is sure above this probability.
        seed: Of the people and splits.
    """

    layouts: int = 5
    participants: int = 12
    initial: int = 1000
    evaluations: int = 200_000
    predictors: tuple[Judge, ...] = (*PREDICTORS, NEURAL)
    folds: int = 4
    repeats: int = 3
    shares: tuple[float, ...] = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
    curve_repeats: int = 10
    crossing: tuple[float, ...] = (0.1, 0.5, 1.0)
    samples: int = 50
    readers: tuple[Reader, ...] = READERS
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


def layout_cells(settings: Settings) -> list[dict[str, Any]]:
    """One search, or one draw of random tables, for each layout."""
    cells = []
    for condition in CONDITIONS:
        for number in range(settings.layouts):
            cell: dict[str, Any] = {"condition": condition, "layout": number}
            if condition != "Baseline":
                cell["initial"] = settings.initial
            if condition in DESIGNS:
                cell["evaluations"] = settings.evaluations
            cells.append(cell)
    return cells


def reading_cells(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """Every predictor on people at every table; where there are obstacles, also on people who ignore them.

    Args:
        settings: The settings.
        places: ``condition``, ``layout`` (its number) and ``json``.
    """
    cells = []
    for place in places:
        rates = settings.crossing if place["condition"] in HAVE_OBSTACLES else ()
        for rate in (0.0, *rates):
            for judge in settings.predictors:
                if rate and judge.repeats:
                    continue  # the table of compliance does without those that take long
                extra = {"folds": settings.folds, "repeats": judge.repeats or settings.repeats}
                cells.append(_with_people(settings, place, rate) | _judged(judge) | extra)
    return cells


def curve_cells(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """A learning curve of every predictor that learns."""
    return [
        _with_people(settings, place)
        | _judged(judge)
        | {"shares": list(settings.shares), "repeats": min(judge.repeats or 99, settings.curve_repeats)}
        for place in places
        for judge in settings.predictors
        if judge.learns
    ]


def spread_cells(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """How much reaches to one goal differ, at every table."""
    return [_with_people(settings, place) | {"samples": settings.samples} for place in places]


def team_cells(settings: Settings, places: Sequence[Place]) -> list[dict[str, Any]]:
    """The same people at work, with every robot and alone."""
    return [
        _with_people(settings, place)
        | {"reader": reader.label, "robot": reader.predictor, "rounds": settings.rounds}
        | {"threshold": settings.threshold}
        for place in places
        for reader in settings.readers
    ]


def _judged(judge: Judge) -> dict[str, Any]:
    return {"predictor": judge.label, "how": judge.how}


def _with_people(settings: Settings, place: Place, crossing: float = 0.0) -> dict[str, Any]:
    """A cell's table and people: the same people whoever reads them, and whether or not they comply."""
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
