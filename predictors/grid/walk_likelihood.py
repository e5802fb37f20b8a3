"""The likelihood of trajectories under given costs, summed over kitchens, and the costs that maximise it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.overcooked.reach import reach_from
from legible_envs.rollouts.trajectory import Trajectory
from predictors.grid.graphs import WalkGraph, walk_graph
from predictors.grid.walk_kernels import likelihood

__all__ = ["Evidence", "FeatureMap", "Fit", "best_uniform_cost", "collect_evidence", "minimise"]

Floats = npt.NDArray[np.float64]
FeatureMap = Callable[[OvercookedLayout], npt.NDArray[np.float64]]

MOST_RATIONAL: Final = 10.0
"""Upper bound of uniform costs: for participants who never stray the best ones are infinite."""

_OUTSIDE: Final = 1e10


@dataclass(frozen=True, eq=False)
class Evidence:
    """Sufficient statistics of all trajectories in one kitchen for the likelihood.

    Attributes:
        graph: The floor in reach of the goals and of the people.
        visits: ``(n,)`` how often cells were entered, first cells not counted.
        starts: ``(P,)`` first cell of each group of trajectories that share it and the goal.
        goals: ``(P,)`` column of its goal.
        weights: ``(P,)`` number of its trajectories.
    """

    graph: WalkGraph
    visits: Floats
    starts: npt.NDArray[np.int64]
    goals: npt.NDArray[np.int64]
    weights: Floats

    def loss(self, costs: Floats) -> tuple[float, Floats]:
        """Negative log-likelihood at ``(n,)`` costs and its gradient; ``inf`` where the sum over paths diverges."""
        graph = self.graph
        return likelihood(
            costs, graph.neighbours, graph.band, graph.access, self.visits, self.starts, self.goals, self.weights
        )


@dataclass(frozen=True, eq=False)
class Fit:
    """What :func:`minimise` found.

    Attributes:
        level: Cost of cells whose features are zero.
        weights: ``(k,)`` of the features.
        loss: Negative log-likelihood, without the penalty.
        costs: ``(H, W)`` per kitchen, NaN where no path leads.
        iterations: Iterations used.
        converged: Whether they sufficed.
    """

    level: float
    weights: Floats
    loss: float
    costs: dict[OvercookedLayout, Floats]
    iterations: int
    converged: bool


def collect_evidence(trajectories: Sequence[Trajectory]) -> dict[OvercookedLayout, Evidence]:
    """Sum up complete trajectories, which must fit their layouts, per kitchen."""
    groups: dict[OvercookedLayout, list[Trajectory]] = {}
    for trajectory in trajectories:
        assert isinstance(trajectory.layout, OvercookedLayout)
        groups.setdefault(trajectory.layout, []).append(trajectory)
    return {layout: _sum_up(layout, members) for layout, members in groups.items()}


def _sum_up(layout: OvercookedLayout, trajectories: Sequence[Trajectory]) -> Evidence:
    names = tuple(sorted({trajectory.goal for trajectory in trajectories if trajectory.goal is not None}))
    regions = {reach_from(layout, trajectory.states[0]).region for trajectory in trajectories}
    graph = walk_graph(layout, names, tuple(sorted(region for region in regions if region is not None)))
    visits = np.zeros(len(graph.cells))
    pairs: Counter[tuple[int, int]] = Counter()
    for trajectory in trajectories:
        numbers = graph.index[trajectory.states[:-1, 0], trajectory.states[:-1, 1]]
        np.add.at(visits, numbers[1:], 1.0)
        pairs[int(numbers[0]), names.index(trajectory.goal or "")] += 1
    keys = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
    weights = np.array([pairs[start, goal] for start, goal in keys.tolist()], dtype=np.float64)
    return Evidence(graph, visits, keys[:, 0].copy(), keys[:, 1].copy(), weights)


def best_uniform_cost(evidence: Mapping[OvercookedLayout, Evidence]) -> float:
    """The uniform cost per step that makes the trajectories most likely; at most :data:`MOST_RATIONAL`."""
    from scipy.optimize import brentq

    # As costs fall to where the sum diverges, the expected length of paths grows without bound: the slope is negative
    # there, except within rounding errors where no path can stray at all.
    low = max(part.graph.divergence_cost for part in evidence.values())
    low = max(low, -MOST_RATIONAL) + 1e-6
    high = max(MOST_RATIONAL, low + 1.0)

    def slope(cost: float) -> float:
        return float(sum(part.loss(np.full(len(part.visits), cost))[1].sum() for part in evidence.values()))

    if slope(high) <= 0:
        return high
    return float(brentq(slope, low, high, xtol=1e-10)) if slope(low) < 0 else low


def minimise(
    evidence: Mapping[OvercookedLayout, Evidence],
    features: FeatureMap | None,
    uniform: float,
    l2: float,
    max_iter: int,
    tol: float,
) -> Fit:
    """Weights of features that make the trajectories most likely, ``l2 / 2 |weights|^2`` added to the loss.

    Without features each cell in reach has a weight of its own, and all of them are pulled toward the uniform cost.
    With features the level of the costs is found along with the weights, and not pulled anywhere.

    Outside its domain the loss is a large number, at which L-BFGS backs off.

    Raises:
        ValueError: Features of the wrong shape, or not finite.
    """
    from scipy.optimize import minimize

    parts = [(part, _design(part.graph, features)) for part in evidence.values()]
    width = parts[0][1].shape[1]
    if any(matrix.shape[1] != width for _, matrix in parts):
        raise ValueError(f"kitchens have different numbers of features: {[matrix.shape[1] - 1 for _, matrix in parts]}")
    count = float(sum(part.weights.sum() for part, _ in parts))
    pull = np.full(width, float(l2))
    if features is not None:
        pull[0] = 0.0

    def objective(weights: Floats) -> tuple[float, Floats]:
        value, gradient = 0.5 * float(pull @ weights**2), pull * weights
        for part, matrix in parts:
            loss, slope = part.loss(uniform + matrix @ weights)
            if not np.isfinite(loss):
                return _OUTSIDE, gradient / count
            value += loss
            gradient = gradient + matrix.T @ slope
        return value / count, gradient / count

    options = {"maxiter": int(max_iter), "gtol": tol, "ftol": 1e-14}
    found = minimize(objective, np.zeros(width), jac=True, method="L-BFGS-B", options=options)
    weights = np.asarray(found.x, dtype=np.float64)
    costs = {part.graph.layout: _grid(part.graph, uniform + matrix @ weights) for part, matrix in parts}
    loss = count * float(found.fun) - 0.5 * float(pull @ weights**2)
    level = uniform if features is None else uniform + float(weights[0])
    return Fit(level, weights if features is None else weights[1:], loss, costs, int(found.nit), bool(found.success))


def _design(graph: WalkGraph, features: FeatureMap | None) -> Floats:
    """``(n, k)``: one column per cell, or one of ones and then the features."""
    if features is None:
        return np.eye(len(graph.cells))
    matrix = _features_of(graph, features)
    return np.hstack([np.ones((len(matrix), 1)), matrix])


def _features_of(graph: WalkGraph, features: FeatureMap) -> Floats:
    """``(n, k)`` features of the cells in reach."""
    rows, cols = graph.layout.shape
    matrix = np.asarray(features(graph.layout), dtype=np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != rows * cols:
        raise ValueError(
            f"features must have shape ({rows * cols}, k), one row per cell of the {rows} x {cols} kitchen, "
            f"got {matrix.shape}"
        )
    chosen = matrix[graph.cells[:, 0] * cols + graph.cells[:, 1]]
    if not np.isfinite(chosen).all():
        row, col = graph.cells[int(np.argwhere(~np.isfinite(chosen))[0][0])]
        raise ValueError(f"features must be finite on the floor; those of row {row}, column {col} are not")
    return chosen


def _grid(graph: WalkGraph, values: Floats) -> Floats:
    grid = np.full(graph.layout.shape, np.nan)
    grid[graph.cells[:, 0], graph.cells[:, 1]] = values
    grid.flags.writeable = False
    return grid
