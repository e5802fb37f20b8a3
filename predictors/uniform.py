"""The predictor that every other one must beat: all candidates alike, whatever is observed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import GoalPredictor, check_trajectories

__all__ = ["UniformPredictor"]


class UniformPredictor(GoalPredictor):
    """Gives every candidate the same probability, before and after anything is observed.

    It predicts at chance level in kitchens and on tables. A robot that is given it acts only where its partner has no
    choice or already holds something: ``gym.make("LegibleTabletop-v0", partner="robot",
    predictor="predictors.uniform:UniformPredictor")``.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.

    Example:
        >>> from legible_envs.rollouts import Trajectory
        >>> reach = Trajectory([(0.0, 0.0), (0.1, 0.3)], candidates=("cup", "milk"))
        >>> UniformPredictor().fit([reach]).predict_proba([reach]).tolist()
        [[0.5, 0.5]]
    """

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """``(n, K)``: ``1 / len(candidates)`` for each candidate of a trajectory."""
        trajectories = check_trajectories(X)
        columns = [self.candidate_columns(trajectory) for trajectory in trajectories]
        probabilities = np.zeros((len(trajectories), len(self.classes_)))
        for row, candidates in zip(probabilities, columns, strict=True):
            row[candidates] = 1.0 / len(candidates)
        return probabilities
