"""Bayesian goal inference (Eq. 1 of Tung et al., HRI 2024): for which goals is the path so far nearly optimal?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal, Self

import numpy as np
import numpy.typing as npt
from sklearn.base import clone

from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.reach import reach_from
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice, real
from predictors.grid.base import GridPredictor, check_complete, goal_posterior, remaining_steps
from predictors.grid.graphs import soft_costs, station_costs, walk_graph
from predictors.grid.maxent_irl import MaxEntIRL
from predictors.grid.priors import PRIORS, GoalPrior, Prior
from predictors.grid.walk_likelihood import best_uniform_cost, collect_evidence

__all__ = ["BayesianGoalPredictor"]

Costs = Literal["hard", "soft"]
CellCosts = Literal["uniform", "learned"] | MaxEntIRL | npt.NDArray[np.float64]

LARGEST_BETA: Final = 1e9
"""A path that costs one step more is then impossible by any standard; beyond it, kernels take costs for infinite."""

_MARGIN: Final = 0.25


class BayesianGoalPredictor(GridPredictor):
    r"""The posterior over goals of a person who walks nearly optimally.

    ``P(G | S->Q) ∝ P(G) exp(-beta (C(S->Q) + C*(Q->G) - C*(S->G)))`` (Eq. 1 of Tung et al., HRI 2024, after Dragan and
    Srinivasa, 2013). The cost so far, ``C(S->Q)``, is the same for every goal and cancels: the belief depends on where
    the person began and where they are now. ``S`` is the first floor cell of the trajectory. With nothing or one cell
    observed the belief is the prior.

    ``C*`` is the cost of the cheapest path (``costs="hard"``), or the soft minimum over all paths, ``-log(Z) / beta``
    with ``Z`` the sum of ``exp(-beta C)`` over all paths of every length (``costs="soft"``). With soft costs Eq. 1 is
    the exact posterior of people who take each path with probability proportional to ``exp(-beta C)``.

    Args:
        beta: Rationality, per unit of cost: 0 learns nothing from the path, larger values penalise detours more.
            With hard costs and a uniform prior, which goal is on top does not depend on it. ``"fit"``: the value that
            makes the trajectories of ``fit`` most likely (uniform costs only). None: 1; but with soft uniform costs,
            in kitchens so open that the sum over paths diverges at 1, .25 more than where it begins to be finite.
        costs: ``"hard"`` or ``"soft"``. Soft costs need a ``beta`` at which the sum over paths is finite: at uniform
            costs above 1.25 in a room of 5 x 5 cells, 1.39 suffices anywhere.
        cell_costs: What entering a cell costs: ``"uniform"``: 1. ``"learned"``: what :class:`MaxEntIRL` learns in
            ``fit``. A ``MaxEntIRL`` with other settings, which is cloned and fitted. Or the ``(H, W)`` costs
            themselves, the same for all kitchens of this shape.
        prior: ``"uniform"`` over candidates, or ``"empirical"``: as often as each was chosen in ``fit``.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        beta_: The rationality used (without the correction of ``beta=None``).
        irl_: The fitted :class:`MaxEntIRL`, with learned costs.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> from legible_envs.rollouts import Trajectory
        >>> kitchen = OvercookedLayout.from_ascii("XOXXXTX\nX     X\nXXXSXXX")
        >>> trajectory = Trajectory([(1, 3), (1, 2)], goal="onion", candidates=("onion", "tomato"), layout=kitchen)
        >>> predictor = BayesianGoalPredictor().fit([trajectory])
        >>> predictor.predict_proba([trajectory.first(1), trajectory]).round(3).tolist()
        [[0.5, 0.5], [0.881, 0.119]]
    """

    beta_: float
    irl_: MaxEntIRL

    def __init__(
        self,
        beta: float | Literal["fit"] | None = None,
        *,
        costs: Costs = "hard",
        cell_costs: CellCosts = "uniform",
        prior: Prior = "uniform",
    ) -> None:
        self.beta = beta
        self.costs = costs
        self.cell_costs = cell_costs
        self.prior = prior

    @property
    def learns(self) -> bool:
        """Whether costs, ``beta`` or the prior are learned in ``fit``."""
        learned_costs = isinstance(self.cell_costs, MaxEntIRL | str) and self.cell_costs != "uniform"
        return self.beta == "fit" or learned_costs or self.prior != "uniform"

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn the names of the goals, and what the parameters leave to learning; see :meth:`GoalPredictor.fit`.

        Raises:
            ValueError: Bad parameters, no trajectories, or incomplete ones where costs or ``beta`` are learned.
        """
        super().fit(X, y)
        trajectories = list(X)
        self._prior = GoalPrior(self.prior, trajectories, self.classes_)
        self._tables: dict[tuple[OvercookedLayout, tuple[str, ...], Cell | None], npt.NDArray[np.float64]] = {}
        if self.beta == "fit":
            for number, trajectory in enumerate(trajectories):
                check_complete(trajectory, number)
            self.beta_ = best_uniform_cost(collect_evidence(trajectories))
        else:
            self.beta_ = 1.0 if self.beta is None else float(self.beta)
        self.__dict__.pop("irl_", None)
        if isinstance(self.cell_costs, MaxEntIRL):
            self.irl_ = clone(self.cell_costs).fit(trajectories)
        elif isinstance(self.cell_costs, str) and self.cell_costs == "learned":
            self.irl_ = MaxEntIRL().fit(trajectories)
        return self

    def _check_parameters(self) -> None:
        beta = self.beta
        if beta == "fit":
            if not isinstance(self.cell_costs, str) or self.cell_costs != "uniform":
                raise ValueError("`beta='fit'` goes with uniform costs; learned costs are in nats: leave `beta` at 1")
        elif beta is not None:
            real("beta", real("beta", beta, 0, also="None, 'fit'"), 0, LARGEST_BETA)
        choice("costs", self.costs, ("hard", "soft"))
        choice("prior", self.prior, PRIORS)
        if isinstance(self.cell_costs, str) and self.cell_costs not in ("uniform", "learned"):
            raise ValueError(
                f"`cell_costs` must be 'uniform', 'learned', a MaxEntIRL or an (H, W) array, got {self.cell_costs!r}"
            )

    def goal_costs(
        self, layout: OvercookedLayout, goals: tuple[str, ...], cell: Cell | None = None
    ) -> npt.NDArray[np.float64]:
        """``(H, W, K)`` optimal costs from each cell into each goal, times ``beta``.

        Args:
            layout: The kitchen.
            goals: ``K`` names of stations.
            cell: Where the person is; soft costs are then those of the floor in their reach. None for all floor.

        Raises:
            LayoutError: A goal is not a station of this kitchen.
            ValueError: Soft costs where the sum over paths diverges, or cell costs of another shape.
        """
        region = reach_from(layout, cell).region if self.costs == "soft" and cell is not None else None
        table = self._tables.get((layout, goals, region))
        if table is None:
            if len(self._tables) >= 256:
                self._tables.clear()
            table = self._tables[layout, goals, region] = self._make_table(layout, goals, region)
        return table

    def _make_table(
        self, layout: OvercookedLayout, goals: tuple[str, ...], region: Cell | None
    ) -> npt.NDArray[np.float64]:
        uniform = isinstance(self.cell_costs, str) and self.cell_costs == "uniform"
        if self.beta_ == 0:  # without a path a goal stays infinitely far
            return np.where(np.isinf(remaining_steps(layout, goals)), np.inf, 0.0)
        if self.costs == "hard" and uniform:
            return self.beta_ * remaining_steps(layout, goals)
        if uniform:
            costs = np.ones(layout.shape)
        else:
            costs = self.irl_.cost_map(layout) if hasattr(self, "irl_") else np.asarray(self.cell_costs, np.float64)
        if self.costs == "hard":
            return self.beta_ * station_costs(layout, goals, costs)
        beta, within = self.beta_, None if region is None else (region,)
        if uniform and self.beta is None:
            beta = max(beta, walk_graph(layout, goals, within).divergence_cost + _MARGIN)
        try:
            return soft_costs(layout, goals, beta * costs, within)
        except ValueError as error:
            raise ValueError(f"{error}; raise `beta` ({self.beta_:.4g}) or give beta='fit'") from error

    def candidate_probabilities(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``(len(trajectory.candidates),)`` probabilities in the order of the candidates.

        Raises:
            ValueError: A trajectory that does not fit its layout, or a candidate that cannot be reached from its start.
        """
        return goal_posterior(trajectory, self._prior.of(trajectory.candidates), self.goal_costs)

    def __getstate__(self) -> dict[str, Any]:
        """Without the tables, which are computed again on demand."""
        state = dict(super().__getstate__())
        if "_tables" in state:
            state["_tables"] = {}
        return state
