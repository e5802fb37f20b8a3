"""Eq. 1 of Tung et al. (HRI 2024): goals explain the way so far as nearly optimal, or do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts import Trajectory
from predictors.grid.distances import GridPredictor, check_walk, remaining_steps

__all__ = ["BayesianGoalPredictor"]


class BayesianGoalPredictor(GridPredictor):
    r"""The posterior over goals of a person who walks nearly optimally.

    ``P(G | S->Q) ∝ exp(-beta (C(S->Q) + C*(Q->G) - C*(S->G)))`` (Eq. 1 of Tung et al., HRI 2024, after Dragan and
    Srinivasa, 2013), with a uniform prior, every step costing 1 and ``C*`` the cost of the cheapest way. The cost so
    far, ``C(S->Q)``, is the same for every goal and cancels: the belief depends on where the person began and where he
    is now. ``S`` is the first floor cell of the walk. With nothing or one cell observed the belief is the prior.

    Args:
        beta: Rationality, per step: 0 learns nothing from the way, larger values judge detours more sharply. Which goal
            is on top does not depend on it.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> from legible_envs.rollouts import Trajectory
        >>> kitchen = OvercookedLayout.from_ascii("XOXXXTX\nX     X\nXXXSXXX")
        >>> walk = Trajectory([(1, 3), (1, 2)], goal="onion", candidates=("onion", "tomato"), layout=kitchen)
        >>> BayesianGoalPredictor().fit([walk]).predict_proba([walk.first(1), walk]).round(3).tolist()
        [[0.5, 0.5], [0.881, 0.119]]
    """

    def __init__(self, beta: float = 1.0) -> None:
        self.beta = beta

    def fit(self, X: Any, y: object = None) -> BayesianGoalPredictor:  # type: ignore[override]
        """Learn the names of the goals; see :meth:`GoalPredictor.fit`."""
        self._check_beta()
        return super().fit(X, y)

    def _check_beta(self) -> None:
        if isinstance(self.beta, bool) or not isinstance(self.beta, int | float) or not 0 <= self.beta < np.inf:
            raise ValueError(f"`beta` must be a finite number >= 0, got {self.beta!r}")

    def candidate_probabilities(self, walk: Trajectory) -> npt.NDArray[np.float64]:
        """``(len(walk.candidates),)`` probabilities in the order of the walk's candidates.

        Raises:
            ValueError: A walk that does not fit its layout, or a candidate that cannot be reached from its start.
        """
        self._check_beta()
        layout = check_walk(walk)
        count = len(walk.candidates)
        if walk.num_states == 0:
            return np.full(count, 1.0 / count)
        steps = remaining_steps(layout, walk.candidates)
        (first_row, first_col), (row, col) = walk.states[0].tolist(), walk.states[-1].tolist()
        optimal = steps[first_row, first_col]
        if np.isinf(optimal).any():
            goal = walk.candidates[int(np.isinf(optimal).argmax())]
            raise ValueError(f"the candidate {goal!r} cannot be reached from row {first_row}, column {first_col}")
        excess = steps[row, col] - optimal
        possible = np.isfinite(excess)  # nobody inside a station walks on to another
        weights = np.zeros(count)
        weights[possible] = np.exp(-self.beta * (excess[possible] - excess.min()))
        return weights / weights.sum()
