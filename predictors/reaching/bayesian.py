"""Bayesian goal inference (Eq. 1 of Tung et al., HRI 2024) for a hand that moves freely."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import flag, real
from legible_envs.tabletop.layout import TabletopLayout
from predictors.reaching.base import PlacePredictor, straight_lines

__all__ = ["StraightLineBayesian"]


class StraightLineBayesian(PlacePredictor):
    r"""The posterior over goals of a hand that moves nearly straight.

    ``P(G | S->Q) ∝ exp(-beta (C(S->Q) + C*(Q->G) - C*(S->G)))`` (Eq. 1 of Tung et al., HRI 2024, after Dragan and
    Srinivasa, 2013) with a uniform prior; the cost of a path is its length. The length so far is the same for every
    goal and cancels. With nothing or one position observed the belief is the prior, exactly.

    The shortest path, of length ``C*``, is the straight line to a goal's place: the trajectory's ``goal_positions``, or
    else where reaches ended in ``fit``. Over a :class:`~legible_envs.tabletop.TabletopLayout` it leads round the
    obstacles to the object of that name: a hand inside an obstacle counts as being at the nearest free point, and
    where there is no path the straight line counts, so that every cost is finite. This is the belief of
    :class:`~legible_envs.tabletop.partner.belief.GoalBelief`.

    Args:
        beta: Rationality, per metre. Which goal is on top does not depend on it.
        obstacles: Whether a table's obstacles count; straight lines everywhere if False.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        places_: ``(d,)`` place of each goal that reaches ended at in ``fit``.

    Example:
        >>> from legible_envs.rollouts import Trajectory
        >>> cups = {"candidates": ("left", "right"), "goal_positions": ((-0.2, 0.3), (0.2, 0.3))}
        >>> reach = Trajectory([(0.0, 0.0), (0.05, 0.1)], goal="right", **cups)
        >>> StraightLineBayesian().fit([reach]).predict_proba([reach.first(1), reach]).round(3).tolist()
        [[0.5, 0.5], [0.197, 0.803]]
    """

    def __init__(self, beta: float = 20.0, obstacles: bool = True) -> None:
        self.beta = beta
        self.obstacles = obstacles

    def _check_parameters(self) -> None:
        real("beta", self.beta, 0)
        flag("obstacles", self.obstacles)

    def weigh_trajectory(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """See :meth:`PlacePredictor.weigh_trajectory`.

        Raises:
            ValueError: A candidate is no object of the trajectory's table.
        """
        if not self.obstacles or not isinstance(trajectory.layout, TabletopLayout):
            return super().weigh_trajectory(trajectory)
        from legible_envs.tabletop.partner.belief import GoalBelief

        self._check_parameters()
        if trajectory.states.shape[1] != 2:
            raise ValueError(
                f"expected positions (x, y) on a table, got {trajectory.states.shape[1]}-d {trajectory.states.dtype}"
            )
        belief = GoalBelief(
            trajectory.layout,
            self.beta,
            start=trajectory.states[0],
            goals=trajectory.candidates,
            positions=trajectory.goal_positions,
        )
        return np.array(list(belief.update(trajectory.states[-1]).values()))

    def weigh(self, states: npt.NDArray[np.floating], places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """See :meth:`PlacePredictor.weigh`."""
        self._check_parameters()
        excess = straight_lines(states[-1], places) - straight_lines(states[0], places)
        with np.errstate(over="ignore"):  # beyond every number is 0 after exp
            return np.exp(-self.beta * (excess - excess.min()))
