"""Behaviour cloning as a predictor: for which goals are the steps so far those that people take?"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.overcooked.humans.cloning import (
    FEATURES,
    ClonedWalker,
    Feature,
    PolicyFit,
    check_features,
    fit_policy,
)
from legible_envs.overcooked.humans.fitting import goal_field
from legible_envs.overcooked.humans.policy_kernels import policy_table
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice, real
from predictors.grid.base import GridPredictor, check_complete, check_trajectory
from predictors.grid.candidates import within_reach
from predictors.grid.priors import PRIORS, GoalPrior, Prior

__all__ = ["BehaviourCloning"]

Floats = npt.NDArray[np.float64]

_MOST_TABLES = 1024
_NO_HEADING = 4
_GREATEST_TRUST = 3.0
_TINY = 1e-300
_DIRECTIONS = {step: direction for direction, step in enumerate(NEIGHBOURS)}


class BehaviourCloning(GridPredictor):
    r"""Learns people's policy, the probability of each step toward a goal, and inverts it by Bayes' rule.

    ``P(G | b_1 ... b_t) ∝ P(G) prod_i P(b_i | b_{i-1}, heading, G)`` with the softmax over single steps of
    :class:`~legible_envs.overcooked.humans.ClonedWalker`, whose eight weights are fitted by maximum likelihood: a
    concave problem, and one set of weights for all kitchens. With nothing or one cell observed the belief is the prior.

    How it differs from its neighbours: :class:`~predictors.MaxEntIRL` and Eq. 1 with soft costs give probabilities to
    whole paths, of which all but the first and the last cell cancel, and need the sum over all paths. Here every step
    is a choice of its own, so the belief depends on the path taken; steps may depend on the direction a person is
    heading in; and no sum can diverge. With ``features=("progress",)`` it is the exact posterior of
    :class:`~legible_envs.overcooked.humans.BoltzmannWalker`, whose rationality is learned.

    Args:
        l2: Strength of the pull of all weights toward 0, above 0.
        features: Names of :data:`legible_envs.overcooked.humans.cloning.FEATURES` to use; all by default.
        prior: ``"uniform"`` over candidates, or ``"empirical"``: as often as each was chosen in ``fit``.
        trust: Exponent of the likelihood. 1: Bayes' rule. Smaller: steps of people who are not quite as the policy says
            are not taken for as many independent pieces of evidence (a power posterior). ``"fit"``: what makes the
            goals in ``fit`` most likely, given every prefix there.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        policy_: The :class:`~legible_envs.overcooked.humans.PolicyFit`: weights by feature, their standard errors and
            the log-likelihood.
        trust_: The exponent used.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> from legible_envs.rollouts import Trajectory
        >>> kitchen = OvercookedLayout.from_ascii("XOXXXTX\nX     X\nXXXSXXX")
        >>> cells = [(1, 3), (1, 2), (1, 1), (0, 1)]
        >>> trajectory = Trajectory(cells, goal="onion", candidates=("onion", "tomato"), layout=kitchen)
        >>> predictor = BehaviourCloning().fit([trajectory] * 20)
        >>> bool(predictor.predict_proba([trajectory.first(2)])[0, 0] > 0.9)
        True
    """

    policy_: PolicyFit
    trust_: float

    def __init__(
        self,
        l2: float = 1.0,
        *,
        features: Sequence[Feature] = FEATURES,
        prior: Prior = "uniform",
        trust: float | Literal["fit"] = 1.0,
    ) -> None:
        self.l2 = l2
        self.features = features
        self.prior = prior
        self.trust = trust

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn the weights from complete trajectories.

        Args:
            X: Complete trajectories with known goals.
            y: Ignored; goals are part of the trajectories.

        Raises:
            ValueError: No trajectories, prefixes, trajectories that do not fit their layout (naming the cell), none
                with a choice, or bad parameters.
        """
        super().fit(X, y)
        trajectories = list(X)
        for number, trajectory in enumerate(trajectories):
            check_complete(trajectory, number)
        self._prior = GoalPrior(self.prior, trajectories, self.classes_)
        self._tables: dict[tuple[OvercookedLayout, str], Floats] = {}
        self.policy_ = fit_policy(trajectories, l2=self.l2, features=self.features)
        self.trust_ = self._fit_trust(trajectories) if self.trust == "fit" else float(self.trust)
        return self

    def _check_parameters(self) -> None:
        real("l2", self.l2, 0, closed="neither")
        check_features(self.features)
        choice("prior", self.prior, PRIORS)
        if self.trust != "fit":
            real("trust", self.trust, 0, _GREATEST_TRUST, also="'fit'")

    def _fit_trust(self, trajectories: Sequence[Trajectory]) -> float:
        """The exponent that makes the goals most likely, given all prefixes of two cells or more.

        All prefixes weigh alike: then people who are just as the policy says have an exponent of 1. The loss is convex.
        """
        from scipy.optimize import minimize_scalar

        parts = []
        for trajectory in map(within_reach, trajectories):
            evidence = self._evidence(trajectory.first(trajectory.num_states - 1)).cumsum(axis=1)
            if evidence.size:
                parts.append((np.log(self._prior.of(trajectory.candidates)), evidence, _column(trajectory)))

        def loss(trust: float) -> float:
            total = 0.0
            for logs, evidence, goal in parts:
                beliefs = _normalised(logs[:, None] + trust * evidence)
                total -= float(np.log(np.maximum(beliefs[goal], _TINY)).sum())
            return total

        if not parts:
            return 1.0
        return float(minimize_scalar(loss, bounds=(0.0, _GREATEST_TRUST), method="bounded").x)

    def walker(self, **arguments: Any) -> ClonedWalker:
        """A simulated participant who walks as the people in ``fit`` did.

        Args:
            **arguments: Of every walker: ``preferences``, ``idle``, ``turn``, ``tick``.
        """
        return ClonedWalker(self.policy_.params, **arguments)

    def step_log_probabilities(self, layout: OvercookedLayout, goal: str) -> Floats:
        """``(H * W, 5, 4)`` log-probability of each step, by cell, heading (4 for none) and direction N S E W.

        ``-inf`` for steps that are not possible; 0 at cells from which no path leads to the goal.

        Raises:
            LayoutError: The goal is not a station of this kitchen.
        """
        table = self._tables.get((layout, goal))
        if table is None:
            if len(self._tables) >= _MOST_TABLES:
                self._tables.clear()
            table = np.empty((layout.cells.size, 5, 4))
            policy_table(goal_field(layout, _station(layout, goal)), self.policy_.params, table)
            self._tables[layout, goal] = table
        return table

    def candidate_probabilities(self, trajectory: Trajectory) -> Floats:
        """``(len(trajectory.candidates),)`` probabilities in the order of the candidates.

        Steps that are none, as a prefix may jump, tell nothing.

        Raises:
            ValueError: A trajectory that does not fit its layout, or a candidate that cannot be reached from its start.
        """
        layout = check_trajectory(trajectory)
        prior = self._prior.of(trajectory.candidates)
        places = {name: _station(layout, name) for name in trajectory.candidates}
        if not trajectory.num_states:
            return prior
        cells = [(row, col) for row, col in trajectory.states.tolist()]
        reached = layout.station_at(cells[-1])
        if reached is not None:
            return np.array([float(name == reached) for name in places])
        row, col = cells[0]
        for name in places:
            if not self.step_log_probabilities(layout, name)[row * layout.shape[1] + col, _NO_HEADING].any():
                raise ValueError(f"the candidate {name!r} cannot be reached from row {row}, column {col}")
        return _normalised(np.log(prior) + self.trust_ * self._evidence(trajectory).sum(axis=1))

    def _evidence(self, trajectory: Trajectory) -> Floats:
        """``(K, T - 1)`` log-probability of each step between floor cells, for each candidate."""
        layout = trajectory.layout
        assert isinstance(layout, OvercookedLayout)
        steps = _steps([(row, col) for row, col in trajectory.states.tolist()], layout.shape[1])
        return np.array([self.step_log_probabilities(layout, name)[steps] for name in trajectory.candidates])

    def __getstate__(self) -> dict[str, Any]:
        """Without the tables, which are computed again on demand."""
        state = dict(super().__getstate__())
        if "_tables" in state:
            state["_tables"] = {}
        return state


def _station(layout: OvercookedLayout, name: str) -> Cell:
    if name not in layout.stations:
        raise LayoutError(
            f"the candidate {name!r} is no station of the layout, which has {list(layout.stations)}", rule="station"
        )
    return layout.stations[name]


def _column(trajectory: Trajectory) -> int:
    """Number of the goal among the candidates."""
    return trajectory.candidates.index(trajectory.goal or "")


def _normalised(logs: Floats) -> Floats:
    """Probabilities from logarithms up to a constant, along the first axis."""
    odds = np.exp(logs - logs.max(axis=0))
    return np.asarray(odds / odds.sum(axis=0), dtype=np.float64)


def _steps(cells: Sequence[Cell], width: int) -> tuple[list[int], list[int], list[int]]:
    """The steps between neighbouring cells: from which cell, after which direction (4 for none), in which direction."""
    at, before, taken = [], [], []
    heading = _NO_HEADING
    for (row, col), (to_row, to_col) in pairwise(cells):
        direction = _DIRECTIONS.get((to_row - row, to_col - col))
        if direction is None:
            heading = _NO_HEADING
            continue
        at.append(row * width + col)
        before.append(heading)
        taken.append(direction)
        heading = direction
    return at, before, taken
