"""The probabilities of goals before anything is observed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice
from predictors.grid.candidates import within_reach

__all__ = ["PRIORS", "GoalPrior", "Prior"]

Prior = Literal["uniform", "empirical"]

PRIORS: Final = ("uniform", "empirical")


class GoalPrior:
    """Probabilities of goals before anything is observed.

    ``"uniform"``: all candidates alike. ``"empirical"``: as often as each was chosen when it was a candidate, with one
    more choice of each goal added (Laplace), so that a goal that was never chosen stays possible.

    Args:
        kind: ``"uniform"`` or ``"empirical"``.
        trajectories: Trajectories to count goals in; those without a known goal are skipped.
        classes: ``(K,)`` names of all goals.

    Raises:
        ValueError: Another kind.
    """

    def __init__(self, kind: Prior, trajectories: Sequence[Trajectory], classes: npt.NDArray[np.str_]) -> None:
        choice("prior", kind, PRIORS)
        self._rates: dict[str, float] = {}
        if kind == "empirical":
            known = [trajectory for trajectory in trajectories if trajectory.goal is not None]
            chosen = Counter(trajectory.goal for trajectory in known)
            offered = Counter(name for trajectory in known for name in within_reach(trajectory).candidates)
            names = classes.tolist()
            self._rates = {name: (chosen[name] + 1.0) / (offered[name] + len(names)) for name in names}

    def of(self, candidates: Sequence[str]) -> npt.NDArray[np.float64]:
        """``(len(candidates),)`` probabilities in their order."""
        count = len(candidates)
        if not self._rates:
            return np.full(count, 1.0 / count)
        rates = np.array([self._rates[name] for name in candidates])
        return rates / rates.sum()
