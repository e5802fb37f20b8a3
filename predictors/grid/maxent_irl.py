"""Exact maximum-entropy inverse reinforcement learning of the costs of cells in kitchens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.reach import reach_from
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice, integer, real
from predictors.base import check_trajectories
from predictors.grid.base import GridPredictor, check_complete, goal_posterior
from predictors.grid.graphs import soft_costs
from predictors.grid.priors import PRIORS, GoalPrior, Prior
from predictors.grid.walk_likelihood import (
    Evidence,
    FeatureMap,
    Floats,
    best_uniform_cost,
    collect_evidence,
    minimise,
)

if TYPE_CHECKING:
    from legible_envs.drawing.canvas import Image

__all__ = ["MaxEntIRL"]

Features = Literal["position"] | npt.NDArray[np.float64] | FeatureMap


class MaxEntIRL(GridPredictor):
    r"""Learns the costs of cells from trajectories, and predicts goals with them.

    The model (Ziebart et al., *Maximum entropy inverse reinforcement learning*, AAAI 2008, with goal stations that
    absorb): of all paths from ``S`` into ``G``, a path is taken with probability ``exp(-cost) / Z[S, G]``, its cost the
    sum over the cells it enters. ``Z = (I - W)^-1 B`` sums over *all* paths, of every length, so the likelihood and
    its gradient are exact, and the fit is convex. It is defined while the sum is finite, that is while the spectral
    radius of ``W`` is below 1: loitering must cost something.

    Costs are ``u + features @ coef``, the weights found by maximum likelihood with the penalty ``l2 / 2 |coef|^2``.
    With a weight per position ``u`` is the best uniform cost per step for all trajectories together, and the cost in
    kitchens without any; with other features it is found along with their weights. The penalty is needed: costs raised
    on the black and lowered on the white cells of a checkerboard give (almost) the same likelihood.

    The belief is ``P(G | S->Q) ∝ P(G) Z[Q, G] / Z[S, G]``, the exact posterior of this model; it is what
    ``BayesianGoalPredictor(costs="soft", cell_costs="learned")`` computes.

    Args:
        features: ``"position"``: a weight for each cell of each kitchen. Or ``(H*W, k)`` features of the cells in
            reading order, for kitchens of that shape, or a function that returns them for a layout; the ``k`` weights
            are shared by all kitchens.
        l2: Strength of the pull toward the uniform cost, above 0. On some hundred recorded trajectories per kitchen
            less pull (1) makes unseen trajectories a little more likely, by .01 to .03 nats each; goals are then
            predicted better in some kitchens and worse in others.
        prior: ``"uniform"`` over candidates, or ``"empirical"``: as often as each was chosen in ``fit``.
        max_iter: Most iterations of L-BFGS.
        tol: Largest component of the gradient, per trajectory, at which the fit is done.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
        uniform_cost_: Best uniform cost per step, the participants' rationality in nats per step.
        costs_: Learned cost of entering each cell, ``{layout: (H, W)}``, NaN off the floor.
        cost_: That of the only kitchen; absent where there are several.
        reward_: ``-cost_``.
        intercept_: The level ``u``.
        coef_: Learned weights: ``(k,)``, or ``{layout: (n,)}`` of the cells in reach for ``"position"``.
        log_likelihood_: Of the trajectories in ``fit``, in nats per trajectory, given start and goal of each.
        n_iter_: Iterations used.
        converged_: Whether they sufficed.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> from legible_envs.rollouts import Trajectory
        >>> kitchen = OvercookedLayout.from_ascii("XOXXXTX\nX     X\nXXXSXXX")
        >>> cells = [(1, 3), (1, 2), (1, 1), (0, 1)]
        >>> trajectory = Trajectory(cells, goal="onion", candidates=("onion", "tomato"), layout=kitchen)
        >>> irl = MaxEntIRL().fit([trajectory] * 20)
        >>> irl.cost_.shape, irl.converged_
        ((3, 7), True)
        >>> bool(irl.predict_proba([trajectory.first(2)])[0, 0] > 0.9)
        True
    """

    uniform_cost_: float
    intercept_: float
    costs_: dict[OvercookedLayout, Floats]
    cost_: Floats
    reward_: Floats
    coef_: Any
    log_likelihood_: float
    n_iter_: int
    converged_: bool
    _tables: dict[tuple[OvercookedLayout, tuple[str, ...], Cell | None], Floats]

    def __init__(
        self,
        features: Features = "position",
        l2: float = 15.0,
        *,
        prior: Prior = "uniform",
        max_iter: int = 500,
        tol: float = 1e-5,
    ) -> None:
        self.features = features
        self.l2 = l2
        self.prior = prior
        self.max_iter = max_iter
        self.tol = tol

    # -- learning -----------------------------------------------------------------------------------------------------

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn costs from complete trajectories.

        Args:
            X: Complete trajectories with known goals.
            y: Ignored; goals are part of the trajectories.

        Raises:
            ValueError: No trajectories, prefixes, trajectories that do not fit their layout (naming the cell), or bad
                parameters.
        """
        super().fit(X, y)
        trajectories = list(X)
        for number, trajectory in enumerate(trajectories):
            check_complete(trajectory, number)
        self._prior = GoalPrior(self.prior, trajectories, self.classes_)
        evidence = collect_evidence(trajectories)
        self.uniform_cost_ = best_uniform_cost(evidence)
        self.costs_, self._tables, value = {}, {}, 0.0
        self.n_iter_, self.converged_ = 0, True
        if isinstance(self.features, str):
            self.coef_ = {}
            for layout, part in evidence.items():
                self.coef_[layout], loss = self._learn({layout: part}, None)
                value += loss
        else:
            self.coef_, value = self._learn(evidence, self._feature_map())
        self.log_likelihood_ = -value / len(trajectories)
        for name in ("cost_", "reward_"):
            self.__dict__.pop(name, None)
        if len(self.costs_) == 1:
            (self.cost_,) = self.costs_.values()
            self.reward_ = -self.cost_
        return self

    def _learn(self, evidence: dict[OvercookedLayout, Evidence], features: FeatureMap | None) -> tuple[Floats, float]:
        """Weights shared by some kitchens, and the negative log-likelihood there; sets their costs."""
        found = minimise(evidence, features, self.uniform_cost_, self.l2, self.max_iter, self.tol)
        self.n_iter_ = max(self.n_iter_, found.iterations)
        self.converged_ = self.converged_ and found.converged
        self.intercept_ = found.level
        for layout, costs in found.costs.items():  # rooms without trajectories are left out there
            merged = np.where(np.isnan(costs), self._expected_costs(layout, found.weights), costs)
            merged.flags.writeable = False
            self.costs_[layout] = merged
        return found.weights, found.loss

    def _check_parameters(self) -> None:
        if isinstance(self.features, str) and self.features != "position":
            raise ValueError(f"`features` must be 'position', an array or a function, got {self.features!r}")
        for name in ("l2", "tol"):
            real(name, getattr(self, name), 0.0, closed="neither")
        integer("max_iter", self.max_iter, 1)
        choice("prior", self.prior, PRIORS)

    def _feature_map(self) -> FeatureMap:
        if callable(self.features):
            return self.features
        matrix = np.asarray(self.features, dtype=np.float64)
        return lambda layout: matrix

    # -- predicting ---------------------------------------------------------------------------------------------------

    def cost_map(self, layout: OvercookedLayout) -> Floats:
        """``(H, W)`` cost of entering each cell of a kitchen, also of one that ``fit`` did not see.

        NaN off the floor. A kitchen that ``fit`` did not see has the uniform cost, or that of its features.
        """
        return self.costs_[layout] if layout in self.costs_ else self._expected_costs(layout, self.coef_)

    def _expected_costs(self, layout: OvercookedLayout, weights: Any) -> Floats:
        """``(H, W)`` costs where there were no trajectories."""
        costs = np.where(layout.cells == 0, self.intercept_, np.nan)
        if not isinstance(self.features, str):
            costs += (np.asarray(self._feature_map()(layout)) @ weights).reshape(layout.shape)
        return costs

    def goal_costs(self, layout: OvercookedLayout, goals: tuple[str, ...], cell: Cell | None = None) -> Floats:
        """``(H, W, K)`` ``-log Z`` from each cell into each goal.

        Args:
            layout: The kitchen.
            goals: ``K`` names of stations.
            cell: Where the person is; costs are then those of the floor in their reach. None for all floor.

        Raises:
            LayoutError: A goal is not a station of this kitchen.
            ValueError: A kitchen that ``fit`` did not see, in which the sum over paths diverges at the learned costs.
        """
        region = None if cell is None else reach_from(layout, cell).region
        table = self._tables.get((layout, goals, region))
        if table is None:
            if len(self._tables) >= 256:
                self._tables.clear()
            within = None if region is None else (region,)
            table = self._tables[layout, goals, region] = soft_costs(layout, goals, self.cost_map(layout), within)
        return table

    def candidate_probabilities(self, trajectory: Trajectory) -> Floats:
        """``(len(trajectory.candidates),)`` probabilities in the order of the candidates.

        Raises:
            ValueError: A trajectory that does not fit its layout, or a candidate that cannot be reached from its start.
        """
        return goal_posterior(trajectory, self._prior.of(trajectory.candidates), self.goal_costs)

    def log_likelihoods(self, X: Sequence[Trajectory]) -> Floats:
        """``(n,)`` log-probability of each complete trajectory given its start and goal, in nats.

        Raises:
            ValueError: Prefixes, or trajectories that do not fit their layout.
        """
        trajectories = check_trajectories(X)
        result = np.empty(len(trajectories))
        for number, trajectory in enumerate(trajectories):
            layout = check_complete(trajectory, number)
            self.candidate_columns(trajectory)
            goal = trajectory.goal or ""
            cells = trajectory.states[:-1]
            table = self.goal_costs(layout, (goal,), (int(cells[0, 0]), int(cells[0, 1])))
            result[number] = table[(*cells[0], 0)] - self.cost_map(layout)[cells[1:, 0], cells[1:, 1]].sum()
        return result

    def draw_reward(
        self, layout: OvercookedLayout | None = None, *, tile: int = 48, values: bool = False, title: str | None = None
    ) -> Image:
        """Draw the learned reward (negative cost) of each cell over the kitchen.

        Args:
            layout: Which kitchen; may be left out if there is only one.
            tile: Pixels of a cell's side, 8 to 256.
            values: Whether to write each cell's place between least and most, in hundredths.
            title: A line above the drawing.

        Returns:
            ``(h, W * tile, 3)`` uint8.

        Raises:
            ValueError: No layout given where there are several.
        """
        from legible_envs.overcooked.rendering import draw_ambiguity

        if layout is None:
            if len(self.costs_) != 1:
                raise ValueError(f"give `layout`, one of the {len(self.costs_)} kitchens in `costs_`")
            (layout,) = self.costs_
        reward = -self.cost_map(layout)
        low, high = float(np.nanmin(reward)), float(np.nanmax(reward))
        heat = (reward - low) / (high - low) if high - low > 1e-12 else np.where(np.isnan(reward), np.nan, 0.5)
        legend = (f"reward {low:.2f}", f"{high:.2f}")
        return draw_ambiguity(layout, np.clip(heat, 0, 1), tile=tile, values=values, legend=legend, title=title)

    def __getstate__(self) -> dict[str, Any]:
        """Without the tables, which are computed again on demand."""
        state = dict(super().__getstate__())
        if "_tables" in state:
            state["_tables"] = {}
        return state
