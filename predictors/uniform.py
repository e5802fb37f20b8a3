"""The predictor that every other one must beat: all candidates alike, whatever is observed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import CandidatePredictor

__all__ = ["UniformPredictor"]


class UniformPredictor(CandidatePredictor):
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

    def candidate_probabilities(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``1 / len(candidates)`` for each candidate of the trajectory."""
        return np.full(len(trajectory.candidates), 1.0 / len(trajectory.candidates))
