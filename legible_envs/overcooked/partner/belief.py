"""Bayesian goal inference along a walk, with shortest paths among counters and obstacles as costs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import NEIGHBOURS
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.support.validation import real

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["BayesianIntent", "GoalBelief"]


class GoalBelief:
    r"""The probability of each goal of one reach, updated as the person walks (Bayesian goal inference).

    ``P(G | S->Q) ∝ exp(-beta (C(S->Q) + C*(Q->G) - C*(S->G)))``, Eq. 1 of Tung et al. (HRI 2024) after Dragan and
    Srinivasa (2013), with ``C*`` the fewest steps. The cost so far cancels: only where the reach began and where the
    person is now matter. At the first cell the belief is uniform. A person who crosses a virtual obstacle counts as
    one step from the floor beside it; where no path leads on from a cell at all, the belief stays as it was.

    Args:
        layout: The kitchen.
        beta: Rationality per step, >= 0.
        goals: Names of stations the person may go for.

    Raises:
        ValueError: No goals, or a ``beta`` out of range.
        LayoutError: A goal that is no station of the kitchen.
    """

    def __init__(self, layout: OvercookedLayout, beta: float, goals: Sequence[str]) -> None:
        self._beta = real("beta", beta, 0)
        self.goals = tuple(goals)
        if not self.goals:
            raise ValueError("`goals` must name at least one station, got none")
        self._steps = np.stack([_steps_to(layout, goal) for goal in self.goals], axis=-1)
        self._optimal: npt.NDArray[np.float64] | None = None
        self._row = np.full(len(self.goals), 1.0 / len(self.goals))

    @property
    def belief(self) -> dict[str, float]:
        """``{goal: probability}`` now."""
        return dict(zip(self.goals, self._row.tolist(), strict=True))

    def update(self, point: npt.ArrayLike, time: float | None = None) -> dict[str, float]:
        """Move the person and return the belief.

        Args:
            point: Row and column of the cell where the person is now.
            time: Ignored: this belief does not depend on speed.
        """
        row, col = np.asarray(point).astype(np.int64).tolist()
        remaining = self._steps[row, col]
        if self._optimal is None:
            self._optimal = remaining
            return self.belief
        excess = self._beta * (remaining - self._optimal)
        least = float(excess.min())
        if math.isfinite(least):
            weights = np.exp(least - excess)  # 0 where no path leads to the goal any more
            self._row = weights / weights.sum()
        return self.belief


class BayesianIntent:
    """Bayesian goal inference in the form of a predictor: it opens a :class:`GoalBelief` for each reach.

    In a kitchen it is known to partners by the name ``"bayesian"``, and gives the probabilities of
    ``predictors.BayesianGoalPredictor(beta=1)``. It has no parameters to learn.

    Args:
        beta: Rationality per step.
    """

    def __init__(self, beta: float = 1.0) -> None:
        self.beta = beta

    def __repr__(self) -> str:
        return f"BayesianIntent(beta={self.beta!r})"

    def stream(self, context: Trajectory) -> GoalBelief:
        """Follow one reach.

        Args:
            context: A trajectory with a ``layout`` of a kitchen and ``candidates``. Its states do not matter: the reach
                begins at the first point of ``update``.
        """
        layout: OvercookedLayout = context.layout  # type: ignore[assignment]
        return GoalBelief(layout, self.beta, context.candidates)


@lru_cache(maxsize=512)
def _steps_to(layout: OvercookedLayout, goal: str) -> npt.NDArray[np.float64]:
    """``(H, W)`` fewest steps into a station from each cell, infinite where no path leads."""
    away = layout.distances_from(layout.access(goal))
    steps = np.where(away >= 0, away + 1.0, np.inf)
    beside = np.full(layout.shape, np.inf)
    padded = np.pad(steps, 1, constant_values=np.inf)
    for rows, cols in NEIGHBOURS:
        inner = padded[1 + rows : 1 + rows + layout.shape[0], 1 + cols : 1 + cols + layout.shape[1]]
        beside = np.minimum(beside, inner + 1.0)
    steps = np.where(np.isfinite(steps), steps, beside)
    steps.flags.writeable = False
    return steps
