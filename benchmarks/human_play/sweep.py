"""The settings of the experiment, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from legible_envs.rollouts import Cut
from predictors.base import FRACTIONS

__all__ = [
    "CUT",
    "FOLDS",
    "FRACTIONS_OBSERVED",
    "LAYOUTS",
    "PREDICTORS",
    "REFERENCE",
    "REPEATS",
    "UNTRAINED",
    "Setting",
]


@dataclass(frozen=True)
class Setting:
    """One predictor of the comparison.

    Attributes:
        label: What tables call it.
        predictor: Its name, or ``"module:Class"``.
        parameters: Its parameters.
    """

    label: str
    predictor: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


LAYOUTS: Final = ("asymmetric_advantages", "coordination_ring", "cramped_room", "random3")
"""Recorded kitchens in which people walk to dispensers; in ``random0`` these are handed across a counter."""

UNTRAINED: Final = (
    Setting("shortest distance", "shortest-distance", {"metric": "manhattan"}),
    Setting("Eq. 1", "bayesian", {"beta": 1.0}),
)
"""Predictors that learn nothing from walks."""

PREDICTORS: Final = (
    *UNTRAINED,
    Setting("Eq. 1, soft costs", "bayesian", {"beta": 1.0, "costs": "soft"}),
    Setting("Eq. 1, soft costs and prior", "bayesian", {"beta": 1.0, "costs": "soft", "prior": "empirical"}),
    Setting("MaxEnt IRL", "maxent-irl"),
    Setting("MaxEnt IRL with prior", "maxent-irl", {"prior": "empirical"}),
    Setting("n-gram", "grid-ngram"),
    Setting("k-NN", "grid-knn"),
    Setting("logistic", "grid-logistic"),
)
"""Everyone; "with prior" means that goals are expected as often as they were chosen in training walks."""

FOLDS: Final = 4

REPEATS: Final = 3

REFERENCE: Final[Mapping[str, tuple[float, float, float, float]]] = {
    "shortest distance": (0.605, 0.293, 0.350, 0.448),
    "Eq. 1": (0.712, 0.337, 0.471, 0.378),
    "Eq. 1, soft costs": (0.754, 0.323, 0.444, 0.453),
    "MaxEnt IRL": (0.754, 0.323, 0.444, 0.454),
    "MaxEnt IRL with prior": (0.941, 0.413, 0.666, 0.449),
    "k-NN": (0.930, 0.422, 0.676, 0.454),
    "logistic": (0.937, 0.420, 0.680, 0.493),
}
"""Mean accuracy over 10..90 % in each of ``LAYOUTS``, measured before with other implementations of the same ideas."""

FRACTIONS_OBSERVED: Final = FRACTIONS

CUT: Final[Cut] = "cells"
"""Which prefix "fraction observed" means; see :data:`legible_envs.rollouts.CUTS`."""
