"""The settings of the experiment, as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from benchmarks.experiments.predictor_settings import PredictorSetting
from legible_envs.rollouts.trajectory import Cut
from predictors.base import FRACTIONS

__all__ = [
    "LAYOUTS",
    "NEURAL",
    "POINTING_NEURAL",
    "POINTING_PREDICTORS",
    "POINTING_REFERENCE",
    "PREDICTORS",
    "REFERENCE",
    "UNTRAINED",
    "Experiment",
]


LAYOUTS: Final = ("asymmetric_advantages", "coordination_ring", "cramped_room", "random3")
"""Recorded kitchens in which players walk to dispensers; in ``random0`` they hand ingredients across a counter."""

UNTRAINED: Final = (
    PredictorSetting("shortest distance", "shortest-distance", {"metric": "manhattan"}),
    PredictorSetting("Eq. 1", "bayesian", {"beta": 1.0}),
)
"""Predictors that learn nothing from trajectories."""

PREDICTORS: Final = (
    *UNTRAINED,
    PredictorSetting("Eq. 1 (soft costs)", "bayesian", {"beta": 1.0, "costs": "soft"}),
    PredictorSetting("Eq. 1 (soft costs, prior)", "bayesian", {"beta": 1.0, "costs": "soft", "prior": "empirical"}),
    PredictorSetting("MaxEnt IRL", "maxent-irl"),
    PredictorSetting("MaxEnt IRL with prior", "maxent-irl", {"prior": "empirical"}),
    PredictorSetting("behaviour cloning", "behaviour-cloning"),
    PredictorSetting("behaviour cloning with prior", "behaviour-cloning", {"prior": "empirical", "trust": "fit"}),
    PredictorSetting("n-gram", "grid-ngram"),
    PredictorSetting("k-NN", "grid-knn"),
    PredictorSetting("logistic", "grid-logistic"),
)
"""All of them; "with prior" means that goals are expected as often as they were chosen in training trajectories."""

NEURAL: Final = (PredictorSetting("GRU", "recurrent"), PredictorSetting("Transformer", "transformer", max_repeats=1))
"""Learned networks, whose fitting needs torch."""

REFERENCE: Final[Mapping[str, tuple[float, float, float, float]]] = {
    "shortest distance": (0.605, 0.293, 0.350, 0.448),
    "Eq. 1": (0.712, 0.337, 0.471, 0.378),
    "Eq. 1 (soft costs)": (0.754, 0.323, 0.444, 0.453),
    "MaxEnt IRL": (0.754, 0.323, 0.444, 0.454),
    "MaxEnt IRL with prior": (0.941, 0.413, 0.666, 0.449),
    "k-NN": (0.930, 0.422, 0.676, 0.454),
    "logistic": (0.937, 0.420, 0.680, 0.493),
    "GRU": (0.935, 0.439, 0.676, 0.488),
}
"""Mean accuracy over 10..90 % in each of ``LAYOUTS``, measured before with other implementations of the same ideas."""

POINTING_PREDICTORS: Final = (
    PredictorSetting("nearest target", "shortest-distance", {"metric": "euclidean"}),
    PredictorSetting("Eq. 1, straight lines", "reach-bayesian"),
    PredictorSetting("Gaussian, open-end", "reach-gaussian"),
    PredictorSetting("Gaussian, index", "reach-gaussian", {"online": "index"}),
    PredictorSetting("Gaussian with velocity, open-end", "reach-gaussian", {"velocity": True}),
    PredictorSetting("Gaussian with velocity, index", "reach-gaussian", {"velocity": True, "online": "index"}),
    PredictorSetting("Gaussian with velocity, newest sample", "reach-gaussian", {"velocity": True, "half_life": 0.0}),
    PredictorSetting("logistic", "reach-logistic"),
    PredictorSetting("logistic, degree 2", "reach-logistic", {"degree": 2}),
    PredictorSetting("k-NN", "reach-knn"),
)
"""Predictors to compare on real pointing."""

POINTING_NEURAL: Final = (PredictorSetting("GRU", "recurrent"), PredictorSetting("Transformer", "transformer"))

POINTING_REFERENCE: Final[Mapping[str, float]] = {
    "nearest target": 0.754,
    "Eq. 1, straight lines": 0.759,
    "Gaussian, open-end": 0.711,
    "Gaussian, index": 0.723,
    "Gaussian with velocity, index": 0.757,
    "logistic": 0.776,
    "GRU": 0.798,
}
"""Mean accuracy over 10..90 % on 1,258 movements of 53 participants, measured before with other implementations."""


@dataclass(frozen=True)
class Experiment:
    """What is evaluated on recorded play, and how.

    Attributes:
        predictors: Which predictors to compare.
        layouts: Kitchens, by the names they have in the recordings.
        fractions: Fractions observed.
        cut: Fraction of what; see :data:`legible_envs.rollouts.CUTS`.
        candidate_set: Which goals count as possible; see
            :func:`legible_envs.datasets.overcooked_2019.recorded_trajectories`.
        folds: How many parts the trajectories are split into.
        repeats: How often, with other splits.
        seed: Of the splits.
    """

    predictors: Sequence[PredictorSetting] = PREDICTORS
    layouts: Sequence[str] = LAYOUTS
    fractions: Sequence[float] = FRACTIONS
    cut: Cut = "cells"
    candidate_set: Literal["game", "all"] = "all"
    folds: int = 4
    repeats: int = 3
    seed: int = 0
