"""The settings of the experiment, as data, and the trials they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.experiments.predictor_settings import PredictorSetting

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "CONDITIONS",
    "FITTED",
    "FITTED_SOURCE",
    "FULL",
    "PREFERENCE",
    "PUBLISHED",
    "QUICK",
    "WALKERS",
    "Settings",
    "accuracy_trials",
    "curve_trials",
    "fit_trials",
    "layout_trials",
    "people_of",
]

CONDITIONS: Final = ("Random", "Efficient", "Legible-Efficient", "Legible")
"""In the order of the paper's table."""
OBJECTIVES: Final = {"Efficient": "efficiency", "Legible-Efficient": "legible-efficient", "Legible": "legibility"}
WALKERS: Final = ("boltzmann", "planner")

PUBLISHED: Final[Mapping[str, Mapping[str, float]]] = {
    "Random": {"f1": 0.477, "precision": 0.564, "recall": 0.482},
    "Efficient": {"f1": 0.512, "precision": 0.648, "recall": 0.554},
    "Legible-Efficient": {"f1": 0.744, "precision": 0.792, "recall": 0.751},
    "Legible": {"f1": 0.799, "precision": 0.824, "recall": 0.812},
}
"""Tung et al. (HRI 2024), participants in the Overcooked study: weighted means over goals."""

PREFERENCE: Final = 0.2
"""Spread of the log cost that each cell has for each person. An assumption: recorded trajectories are too few to fit
it."""

FITTED: Final[Mapping[str, Any]] = {
    "boltzmann": {"rationality": 1.236, "spread": 0.138},
    "planner": {
        "depth": 2,
        "recency": 3.0,
        "fade": 0.7,
        "people": [
            [0.0, 0.191], [2.0, 0.113], [0.0, 0.172], [2.0, 0.164], [0.25, 0.072], [2.0, 0.196], [2.0, 0.112],
            [0.75, 0.251], [1.0, 0.108], [0.5, 0.254], [1.0, 0.131], [1.5, 0.194], [2.0, 0.177], [1.0, 0.16],
            [1.0, 0.149], [2.0, 0.15], [0.25, 0.138], [0.25, 0.161], [2.0, 0.14], [0.25, 0.153], [0.25, 0.096],
            [0.25, 0.193], [1.5, 0.173], [2.0, 0.193], [2.0, 0.171], [2.0, 0.128], [1.0, 0.12], [2.0, 0.112],
            [2.0, 0.11], [0.0, 0.131], [0.5, 0.198], [2.0, 0.157], [2.0, 0.176], [0.25, 0.186],
        ],
    },
}  # fmt: skip
"""Participants for where the recordings are absent; what :mod:`.planner_fitting` fitted to them."""
FITTED_SOURCE: Final = (
    "2,406 trajectories of 34 participants in four kitchens, "
    "Overcooked-AI's published games of 2019 (Carroll et al., NeurIPS 2019)"
)

PREDICTORS: Final = (
    PredictorSetting("Eq. 1 (IRL costs)", "bayesian", {"cell_costs": "learned"}),
    PredictorSetting("shortest distance", "shortest-distance", learns=False),
    PredictorSetting("logistic", "grid-logistic"),
    PredictorSetting("k-NN", "grid-knn"),
)
"""The paper's two first."""
NEURAL: Final = PredictorSetting(
    "GRU", "recurrent", {"members": 2, "max_epochs": 40, "patience": 6, "device": "cpu"}, max_repeats=1
)


@dataclass(frozen=True)
class Settings:
    """How much is done.

    Attributes:
        layouts: Layouts per condition, each searched with a seed of its own.
        participants: Simulated participants per layout and kind of walker; each cooks the task's three soups.
        initial: Random layouts: what a search begins with, and what the median is taken of.
        improvements: Climbs of a search.
        predictors: Which predictors to compare.
        folds: Of the cross-validation.
        repeats: Of the cross-validation.
        shares: Of the trajectories not held out, learned from in learning curves.
        curve_repeats: Splits of the learning curves.
        shape: Rows and columns of the kitchens.
        seed: Of the participants and splits.
        team_participants: Simulated participants per layout and kind of walker who cook with each robot. 0: none,
            as in quick runs.
    """

    layouts: int = 5
    participants: int = 20
    initial: int = 1000
    improvements: int = 1000
    predictors: tuple[PredictorSetting, ...] = (*PREDICTORS, NEURAL)
    folds: int = 4
    repeats: int = 3
    shares: tuple[float, ...] = (0.2, 0.4, 0.7, 1.0)
    curve_repeats: int = 4
    shape: tuple[int, int] = (7, 7)
    seed: int = 0
    team_participants: int = 8


FULL: Final = Settings()
QUICK: Final = Settings(
    layouts=3,
    participants=10,
    initial=300,
    improvements=100,
    predictors=PREDICTORS,
    repeats=1,
    shares=(0.3, 1.0),
    curve_repeats=2,
    team_participants=0,
)


def layout_trials(settings: Settings) -> list[dict[str, Any]]:
    """One search, or one draw of random layouts, for each layout."""
    return [
        {
            "condition": condition,
            "layout": number,
            "shape": list(settings.shape),
            "initial": settings.initial,
            "improvements": 0 if condition == "Random" else settings.improvements,
        }
        for condition in CONDITIONS
        for number in range(settings.layouts)
    ]


def fit_trials(recorded: int) -> list[dict[str, Any]]:
    """One fit for each kind of walker; other recordings make other trials.

    Args:
        recorded: How many trajectories are recorded; 0 where there are no recordings, and then no trials.
    """
    return [{"walker": walker, "recorded_walks": recorded} for walker in WALKERS] if recorded else []


def people_of(fits: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """Participants as plain data for trials, by kind of walker.

    Args:
        fits: Rows of :func:`fit_trials`; empty where there are no recordings, which gives ``FITTED``.
    """
    found: dict[str, dict[str, Any]] = {}
    for walker in WALKERS:
        numbers: dict[str, Any] = dict(FITTED[walker])
        if len(fits):
            rows = fits[fits["walker"] == walker]
            whole, each = rows[rows["participant"] == ""].iloc[0], rows[rows["participant"] != ""]
            if walker == "boltzmann":
                numbers = {key: round(float(whole[key]), 3) for key in ("rationality", "spread")}
            else:
                numbers = {"depth": int(whole["depth"]), **{k: round(float(whole[k]), 3) for k in ("recency", "fade")}}
                pairs = zip(each["turn_cost"], each["slip"], strict=True)
                numbers["people"] = [[round(float(turn), 3), round(float(slip), 3)] for turn, slip in pairs]
        found[walker] = {"walker": walker, "preference": PREFERENCE, **numbers}
    return found


def accuracy_trials(
    settings: Settings, layouts: Sequence[Mapping[str, Any]], people: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Every predictor on every kind of participant in every layout.

    Args:
        settings: The settings.
        layouts: ``condition``, ``layout`` (its number) and ``drawing``.
        people: As of :func:`people_of`.
    """
    trials = []
    for place in layouts:
        for walker, numbers in people.items():
            for setting in settings.predictors:
                extra = {"folds": settings.folds, "repeats": setting.repeats(settings.repeats)}
                trials.append(_with_people(settings, place, walker, numbers, setting) | extra)
    return trials


def curve_trials(
    settings: Settings, layouts: Sequence[Mapping[str, Any]], people: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """A learning curve of every predictor that learns, on the first kind of participant."""
    walker = WALKERS[0]
    return [
        _with_people(settings, place, walker, people[walker], setting)
        | {"shares": list(settings.shares), "repeats": setting.repeats(settings.curve_repeats)}
        for place in layouts
        for setting in settings.predictors
        if setting.learns
    ]


def _with_people(
    settings: Settings, place: Mapping[str, Any], walker: str, numbers: Mapping[str, Any], setting: PredictorSetting
) -> dict[str, Any]:
    condition, number = str(place["condition"]), int(place["layout"])
    source = np.random.SeedSequence((settings.seed, CONDITIONS.index(condition), number, WALKERS.index(walker)))
    return {
        "condition": condition,
        "layout": number,
        "walker": walker,
        "predictor": setting.label,
        "how": setting.how,
        "drawing": str(place["drawing"]),
        "people": dict(numbers),
        "participants": settings.participants,
        "seed": int(source.generate_state(1)[0]),
    }
