"""What partners at the table and in the kitchen have in common, and the predictors that both can ask."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["Floats", "GoalStream", "PrefixPredictor", "ReachSenses", "StreamingPredictor", "TeamCommand", "TeamSenses"]

Floats = npt.NDArray[np.float64]


class TeamSenses(Protocol):
    """The part of a robot's senses that team measures look at."""

    @property
    def time(self) -> float:
        """Seconds since the episode began."""

    @property
    def reach_number(self) -> int:
        """How many reaches have begun; a change tells that the reach is another one."""

    @property
    def goals(self) -> tuple[str, ...]:
        """What the person may validly reach for now."""

    @property
    def person_holding(self) -> str | None:
        """What is in the person's hand."""


class ReachSenses(Protocol):
    """The part of a robot's senses from which a predictor says where a reach leads."""

    @property
    def reach_number(self) -> int:
        """How many reaches have begun; a change tells that the reach is another one."""

    @property
    def goals(self) -> tuple[str, ...]:
        """What the person may validly reach for now."""

    @property
    def reach(self) -> npt.NDArray[np.number]:
        """``(k, 2)`` points since the reach began, oldest first; ``k = 0`` where there is none."""

    @property
    def times(self) -> Floats:
        """``(k,)`` seconds since the episode began, of each of them."""


class TeamCommand(Protocol):
    """The part of a robot's command that team measures look at."""

    @property
    def target(self) -> str | None:
        """What the robot goes for."""

    @property
    def predicted(self) -> str | None:
        """The person's goal that the robot is sure of; None where it is not sure."""

    @property
    def conflict(self) -> bool:
        """Whether the robot gave up its target just now because the person took it."""


class GoalStream(Protocol):
    """The belief about one reach while it happens."""

    def update(self, point: Floats, time: float) -> Mapping[str, float]:
        """Move the person to ``(2,)`` at a time in seconds; ``{goal: probability}``."""
        ...


class StreamingPredictor(Protocol):
    """A predictor that follows a reach point by point."""

    def stream(self, context: Trajectory) -> GoalStream:
        """Open a stream for one reach; ``context`` has its layout, candidates and their places, and no states."""
        ...


class PrefixPredictor(Protocol):
    """A predictor of observed parts of trajectories."""

    classes_: Sequence[str]

    def predict_proba(self, X: Sequence[Trajectory]) -> Floats:
        """``(len(X), len(classes_))`` probabilities."""
        ...
