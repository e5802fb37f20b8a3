"""The heuristic that people go for the nearest goal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Self, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice
from predictors.base import TIE_TOLERANCE, GoalStream
from predictors.grid.base import GridPredictor, check_trajectory, remaining_steps
from predictors.reaching.base import goal_places, learn_places, straight_lines
from predictors.reaching.features import check_positions

__all__ = ["ShortestDistance"]

Metric = Literal["manhattan", "geodesic", "euclidean"]


class ShortestDistance(GridPredictor):
    r"""Predicts the candidate nearest to where the person is now; equally near ones share the probability.

    The baseline of Tung et al. (HRI 2024). It uses neither the start nor the path so far. With nothing observed yet
    all candidates are equally probable.

    Args:
        metric: ``"manhattan"``: rows plus columns to the station, through walls. ``"geodesic"``: steps of the shortest
            path into the station. ``"euclidean"``: the straight line, for reaches, to the trajectory's
            ``goal_positions`` or else to where reaches ended in ``fit``.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> from legible_envs.rollouts import Trajectory
        >>> kitchen = OvercookedLayout.from_ascii("XOXXXTX\nX     X\nXXXSXXX")
        >>> trajectory = Trajectory([(1, 3), (1, 2)], goal="onion", candidates=("onion", "tomato"), layout=kitchen)
        >>> ShortestDistance().fit([trajectory]).predict_proba([trajectory.first(1), trajectory]).tolist()
        [[0.5, 0.5], [1.0, 0.0]]
    """

    def __init__(self, metric: Metric = "manhattan") -> None:
        self.metric = metric

    @property
    def learns(self) -> bool:
        """False: only names and places are learned."""
        return False

    def _check_parameters(self) -> None:
        choice("metric", self.metric, get_args(Metric))

    def stream(self, context: Trajectory) -> GoalStream:
        """Predict one person's goal while they move; see :meth:`GoalPredictor.stream`."""
        return GoalStream(self, context, cells=False) if self.metric == "euclidean" else super().stream(context)

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn the goals' names (and places, for the Euclidean metric); see :meth:`GoalPredictor.fit`."""
        super().fit(X, y)
        self.places_ = learn_places(X) if self.metric == "euclidean" else {}
        return self

    def candidate_probabilities(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``(len(trajectory.candidates),)`` probabilities in the order of the candidates.

        Raises:
            ValueError: An unknown metric, or a trajectory that does not fit its layout.
        """
        self._check_parameters()
        if self.metric == "euclidean":
            return self._nearest(self._straight_lines(trajectory))
        layout = check_trajectory(trajectory)
        count = len(trajectory.candidates)
        if not trajectory.num_states:
            return np.full(count, 1.0 / count)
        row, col = trajectory.states[-1].tolist()
        if self.metric == "geodesic":
            distances = remaining_steps(layout, trajectory.candidates)[row, col]
        else:
            missing = [goal for goal in trajectory.candidates if goal not in layout.stations]
            if missing:
                raise ValueError(
                    f"the candidates {missing} are no stations of the layout, which has {list(layout.stations)}"
                )
            stations = np.array([layout.stations[goal] for goal in trajectory.candidates])
            distances = np.abs(stations - (row, col)).sum(axis=1).astype(np.float64)
        if np.isinf(distances).all():
            raise ValueError(f"no candidate of {trajectory.candidates} can be reached from row {row}, column {col}")
        return self._nearest(distances)

    def _straight_lines(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        if not trajectory.num_states:
            return np.zeros(len(trajectory.candidates))
        check_positions(trajectory)
        return straight_lines(trajectory.states[-1], goal_places(trajectory, self.places_))

    @staticmethod
    def _nearest(distances: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        nearest = distances <= distances.min() + TIE_TOLERANCE
        return nearest / nearest.sum()
