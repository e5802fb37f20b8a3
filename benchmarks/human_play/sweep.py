"""The settings of the experiment, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from legible_envs.rollouts import Cut
from predictors.base import FRACTIONS

__all__ = ["CUT", "FRACTIONS_OBSERVED", "LAYOUTS", "PREDICTORS", "Setting"]


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

PREDICTORS: Final = (
    Setting("shortest distance", "shortest-distance", {"metric": "manhattan"}),
    Setting("Eq. 1", "bayesian", {"beta": 1.0}),
)

FRACTIONS_OBSERVED: Final = FRACTIONS

CUT: Final[Cut] = "cells"
"""Which prefix "fraction observed" means; see :data:`legible_envs.rollouts.CUTS`."""
