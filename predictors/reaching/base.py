"""Where the goals of reaches are: given by the trajectory, or learned from where earlier reaches ended."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Self

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import CandidatePredictor, GoalStream
from predictors.reaching.features import check_positions

__all__ = ["PlacePredictor", "goal_places", "learn_places", "straight_lines"]

Places = Mapping[str, npt.NDArray[np.float64]]


def learn_places(X: Sequence[Trajectory]) -> dict[str, npt.NDArray[np.float64]]:
    """``(d,)`` mean last position of the complete reaches to each goal.

    Raises:
        ValueError: Reaches of different dimensions.
    """
    ends: dict[str, list[npt.NDArray[np.float64]]] = {}
    for trajectory in X:
        if trajectory.complete and trajectory.num_states and trajectory.goal is not None:
            ends.setdefault(trajectory.goal, []).append(trajectory.states[-1].astype(np.float64))
    dimensions = sorted({len(end) for found in ends.values() for end in found})
    if len(dimensions) > 1:
        raise ValueError(f"all reaches must have one dimension, got {dimensions}")
    return {goal: np.mean(found, axis=0) for goal, found in ends.items()}


def goal_places(trajectory: Trajectory, learned: Places) -> npt.NDArray[np.float64]:
    """``(len(trajectory.candidates), d)`` where the candidates are.

    Args:
        trajectory: Its ``goal_positions`` count where it has them.
        learned: What :func:`learn_places` found, for the others.

    Raises:
        ValueError: A candidate without a place (no ``goal_positions``, and no reach in ``fit`` ended there), or places
            of another dimension than the states.
    """
    if trajectory.goal_positions is not None:
        return _of_dimension(np.array(trajectory.goal_positions), trajectory, "of the goal positions")
    missing = [goal for goal in trajectory.candidates if goal not in learned]
    if missing:
        raise ValueError(
            f"unknown places of {missing}: the trajectory has no `goal_positions`, and no reach in `fit` ended there"
        )
    return _of_dimension(np.array([learned[goal] for goal in trajectory.candidates]), trajectory, "as in `fit`")


def _of_dimension(places: npt.NDArray[np.float64], trajectory: Trajectory, whose: str) -> npt.NDArray[np.float64]:
    if trajectory.num_states and places.shape[1] != trajectory.states.shape[1]:
        raise ValueError(f"expected states of dimension {places.shape[1]} {whose}, got {trajectory.states.shape[1]}")
    return places


def straight_lines(point: npt.NDArray[np.floating], places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """``(n,)`` Euclidean distances from a point ``(d,)`` to places ``(n, d)``."""
    return np.sqrt(((places - point) ** 2).sum(axis=1))


class PlacePredictor(CandidatePredictor):
    """A predictor that knows where goals are and looks at one reach at a time.

    Subclasses define ``weigh``.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        places_: ``(d,)`` place of each goal that reaches ended at in ``fit``.
    """

    @property
    def learns(self) -> bool:
        """Whether a subclass learns more in ``fit`` than names and places."""
        return type(self).fit is not PlacePredictor.fit

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn the goals' names and where reaches to them end; see :meth:`GoalPredictor.fit`."""
        super().fit(X, y)
        self.places_ = learn_places(X)
        return self

    @abstractmethod
    def weigh(self, states: npt.NDArray[np.floating], places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """``(n,)`` weights >= 0, not all 0, of goals at ``(n, d)`` places after ``(T, d)`` states, T >= 1."""

    def weigh_trajectory(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``(n,)`` weights of the candidates after at least one state, for subclasses that use more than the states."""
        return self.weigh(trajectory.states, goal_places(trajectory, self.places_))

    def candidate_probabilities(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """See :meth:`CandidatePredictor.candidate_probabilities`; all alike before the first state."""
        check_positions(trajectory)
        weights = self.weigh_trajectory(trajectory) if trajectory.num_states else np.ones(len(trajectory.candidates))
        return weights / weights.sum()

    def stream(self, context: Trajectory) -> GoalStream:
        """Predict one person's goal while they move; see :meth:`GoalPredictor.stream`."""
        return GoalStream(self, context, cells=False)
