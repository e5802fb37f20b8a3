"""How rationally people walk: the local softmax walker, fitted to trajectories by maximum likelihood."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid_kernels import costs_to, neighbour
from legible_envs.overcooked.humans.kernels import GoalField, is_option
from legible_envs.overcooked.layout import FLOOR, OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import real, shown

__all__ = ["RationalityFit", "RationalitySpread", "fit_rationality", "goal_field", "rationality_spread", "walked_paths"]

Floats = npt.NDArray[np.float64]

_GREATEST = 50.0
"""Rationality at which a detour of two steps has odds of 1e-43: nothing is learned from looking further."""


@dataclass(frozen=True)
class RationalityFit:
    """Maximum likelihood estimate of the rationality of a local softmax walker.

    Attributes:
        rationality: Per unit of path cost; 0 where steps were no better than random ones, ``inf`` where every step
            was a best one.
        interval: Profile likelihood interval: all values that a likelihood ratio test does not reject. It takes steps
            as independent.
        standard_error: From the observed information, steps independent; NaN at 0 and ``inf``.
        clustered_error: The same, robust to the likeness of steps of one participant; NaN for a single participant.
        confidence: Of the interval.
        log_likelihood: At the estimate.
        num_steps: Steps taken, the one into the station included.
        num_trajectories: Trajectories.
        num_participants: Different participants.
    """

    rationality: float
    interval: tuple[float, float]
    standard_error: float
    clustered_error: float
    confidence: float
    log_likelihood: float
    num_steps: int
    num_trajectories: int
    num_participants: int


@dataclass(frozen=True)
class RationalitySpread:
    """How much participants differ in rationality.

    Attributes:
        median: Median participant, ``exp(mean of log rationality)``.
        sd: Standard deviation of log rationality between participants, the error of each estimate taken out.
        raw_sd: The same with these errors left in.
        fits: Fit of each participant.
    """

    median: float
    sd: float
    raw_sd: float
    fits: dict[str, RationalityFit]


@dataclass(frozen=True)
class _Steps:
    """``excess [m, 4]``: cost of each option over the best one, inf where there is none; ``taken [m]``; ``who [m]``."""

    excess: Floats
    taken: Floats
    who: npt.NDArray[np.intp]

    def log_likelihood(self, rationality: float) -> float:
        with np.errstate(invalid="ignore"):
            scaled = np.where(np.isfinite(self.excess), rationality * self.excess, np.inf)
        return float(-(rationality * self.taken).sum() - np.log(np.exp(-scaled).sum(axis=1)).sum())

    def scores(self, rationality: float) -> tuple[Floats, Floats]:
        """``(m,)`` derivative of each step's log-likelihood, and ``(m,)`` its negative second derivative."""
        finite = np.where(np.isfinite(self.excess), self.excess, 0.0)
        odds = np.where(np.isfinite(self.excess), np.exp(-rationality * finite), 0.0)
        odds /= odds.sum(axis=1, keepdims=True)
        mean = (odds * finite).sum(axis=1)
        return mean - self.taken, (odds * finite**2).sum(axis=1) - mean**2


def fit_rationality(
    trajectories: Iterable[Trajectory],
    *,
    confidence: float = 0.95,
    cell_costs: npt.ArrayLike | None = None,
) -> RationalityFit:
    r"""Fit the rationality of :class:`~legible_envs.overcooked.humans.BoltzmannWalker`.

    Every step counts, from floor cell to floor cell and into the goal station; where participants stand first, and how
    long, does not. The log-likelihood is concave, so the estimate is the only one.

    Args:
        trajectories: With a layout and a goal, consecutive repeats dropped.
        confidence: Of the interval, in (0, 1).
        cell_costs: ``(H, W)`` cost of stepping on each cell, 1 if None; with costs, all kitchens must be of one shape.

    Raises:
        ValueError: No step with a choice; a trajectory without layout or goal, that does not fit its layout, or
            that jumps.

    Example:
        >>> from legible_envs.overcooked import OvercookedLayout
        >>> kitchen = OvercookedLayout.from_ascii("XOXXX\nX   X\nXXXSX")
        >>> there_and_back = [(1, 3), (1, 2), (1, 3), (1, 2), (1, 1), (0, 1)]
        >>> trajectory = Trajectory(there_and_back, goal="onion", candidates=("onion",), layout=kitchen)
        >>> round(fit_rationality([trajectory]).rationality, 3)
        0.347
    """
    listed = list(trajectories)
    for number, trajectory in enumerate(listed):
        if not isinstance(trajectory, Trajectory):
            raise ValueError(f"expected trajectories, got {shown(trajectory)} at index {number}")
    confidence = real("confidence", confidence, 0, 1, closed="neither")
    names = sorted({trajectory.participant for trajectory in listed})
    steps = _collect(listed, names, cell_costs)
    return _fit(steps, confidence, len(listed), len(names))


def rationality_spread(
    trajectories: Iterable[Trajectory], *, confidence: float = 0.95, min_trajectories: int = 10
) -> RationalitySpread:
    """How much participants differ in rationality.

    Args:
        trajectories: As for :func:`fit_rationality`; of one kitchen, or of kitchens that every participant walked in.
        confidence: Of each interval.
        min_trajectories: Participants with fewer trajectories are left out.

    Raises:
        ValueError: Fewer than two participants with enough trajectories and an estimate that is neither 0 nor infinite.
    """
    by_name: dict[str, list[Trajectory]] = {}
    for trajectory in trajectories:
        by_name.setdefault(trajectory.participant, []).append(trajectory)
    fits = {
        name: fit_rationality(own, confidence=confidence)
        for name, own in sorted(by_name.items())
        if len(own) >= min_trajectories
    }
    usable = [fit for fit in fits.values() if 0 < fit.rationality < math.inf]
    if len(usable) < 2:
        raise ValueError(
            f"a spread needs two participants with {min_trajectories} trajectories each; got {len(usable)}"
        )
    logs = np.log([fit.rationality for fit in usable])
    errors = np.array([fit.standard_error / fit.rationality for fit in usable])
    variance = float(logs.var(ddof=1))
    between = max(0.0, variance - float((errors**2).mean()))
    return RationalitySpread(float(np.exp(logs.mean())), math.sqrt(between), math.sqrt(variance), fits)


def _collect(trajectories: Sequence[Trajectory], names: Sequence[str], cell_costs: npt.ArrayLike | None) -> _Steps:
    excess, taken, who = [], [], []
    paths = walked_paths(trajectories, cell_costs)
    for trajectory, (cells, field) in zip(trajectories, paths, strict=True):
        for before, after in itertools.pairwise(cells):
            options = [neighbour(before, direction, field.height, field.width) for direction in range(4)]
            costs = np.array([_cost(option, field) for option in options])
            excess.append(costs - costs.min())
            taken.append(_cost(after, field) - costs.min())
            who.append(names.index(trajectory.participant))
    table = np.array(excess).reshape(-1, 4)
    if not len(table) or not (np.isfinite(table).sum(axis=1) > 1).any():
        raise ValueError(f"{len(trajectories)} trajectories have no step at which there was a choice")
    return _Steps(table, np.array(taken), np.array(who, dtype=np.intp))


def walked_paths(
    trajectories: Sequence[Trajectory], cell_costs: npt.ArrayLike | None = None
) -> list[tuple[list[int], GoalField]]:
    """The cells of each trajectory, numbered row by row, and the costs to go to its goal.

    Raises:
        ValueError: A trajectory without layout or goal, that leaves its layout, or that jumps (naming the state).
    """
    fields: dict[tuple[object, str], GoalField] = {}
    paths = []
    for number, trajectory in enumerate(trajectories):
        layout, goal = trajectory.layout, trajectory.goal
        if not isinstance(layout, OvercookedLayout) or goal is None or not trajectory.is_grid:
            raise ValueError(f"trajectory {number} has no kitchen, no goal, or positions instead of cells")
        if goal not in layout.stations:
            raise ValueError(f"trajectory {number}: no station {goal!r}; this kitchen has {list(layout.stations)}")
        if (layout, goal) not in fields:
            fields[layout, goal] = goal_field(layout, layout.stations[goal], cell_costs)
        paths.append((_walked_cells(trajectory, number, fields[layout, goal]), fields[layout, goal]))
    return paths


def _walked_cells(trajectory: Trajectory, number: int, field: GoalField) -> list[int]:
    states = trajectory.states
    if len(states) and states.shape[1] != 2:
        raise ValueError(f"trajectory {number}: expected (row, col) cells, got states of shape {states.shape}")
    for i, (row, col) in enumerate(states.tolist()):
        if not (0 <= row < field.height and 0 <= col < field.width):
            raise ValueError(
                f"trajectory {number}: state {i}, row {row}, column {col}, lies outside its "
                f"{field.height}x{field.width} kitchen"
            )
    cells = [row * field.width + col for row, col in states.tolist()]
    for i, (before, after) in enumerate(itertools.pairwise(cells)):
        options = [neighbour(before, direction, field.height, field.width) for direction in range(4)]
        if not field.floor[before] or after not in options or not is_option(after, field):
            (a, b), (c, d) = divmod(before, field.width), divmod(after, field.width)
            raise ValueError(
                f"trajectory {number}: the step after state {i}, from row {a}, column {b} to row {c}, column {d}, "
                f"is not to a neighbouring floor cell or into {trajectory.goal!r}"
            )
    return cells


def _cost(cell: int, field: GoalField) -> float:
    if not is_option(cell, field):
        return math.inf
    return 1.0 if cell == field.station else float(field.costs[cell] + field.cost_to_go[cell])


def goal_field(layout: OvercookedLayout, station: Sequence[int], cell_costs: npt.ArrayLike | None = None) -> GoalField:
    """The costs to go to a station of a layout, for the kernels.

    Args:
        layout: The kitchen.
        station: ``(row, col)`` of the station.
        cell_costs: ``(H, W)`` cost of stepping on each cell; 1 if None.

    Raises:
        ValueError: Costs of another shape, or costs of floor cells that are not positive and finite.
    """
    height, width = layout.shape
    floor = (layout.cells == FLOOR).ravel()
    costs = np.ones(layout.shape) if cell_costs is None else np.array(cell_costs, dtype=np.float64)
    if costs.shape != layout.shape:
        raise ValueError(f"cell costs must have the kitchen's shape {layout.shape}, got {costs.shape}")
    if not np.isfinite(costs.ravel()[floor]).all() or (costs.ravel()[floor] <= 0).any():
        raise ValueError("cell costs of floor cells must be finite and greater than 0")
    cost_to_go = np.empty(height * width)
    target = int(station[0]) * width + int(station[1])
    costs_to(target, floor, costs.ravel(), height, width, cost_to_go)
    return GoalField(height, width, floor, costs.ravel(), target, cost_to_go)


def _fit(steps: _Steps, confidence: float, num_trajectories: int, num_participants: int) -> RationalityFit:
    from scipy.optimize import brentq
    from scipy.stats import chi2

    def slope(rationality: float) -> float:
        return float(steps.scores(rationality)[0].sum())

    if (steps.taken <= 1e-12).all():
        best = math.inf
    elif slope(0.0) <= 0:
        best = 0.0
    else:
        best = float(brentq(slope, 0.0, _GREATEST, xtol=1e-10))
    # At infinity only the ties between best steps are left to chance.
    greatest = steps.log_likelihood(min(best, _GREATEST))
    threshold = greatest - float(chi2.ppf(confidence, 1)) / 2

    def above(rationality: float) -> float:
        return steps.log_likelihood(rationality) - threshold

    low = 0.0 if best == 0.0 or above(0.0) >= 0 else float(brentq(above, 0.0, min(best, _GREATEST)))
    high = math.inf if best == math.inf or above(_GREATEST) >= 0 else float(brentq(above, best, _GREATEST))
    error = clustered = math.nan
    if 0 < best < math.inf:
        scores, information = steps.scores(best)
        error = 1 / math.sqrt(information.sum())
        if num_participants > 1:
            by_person = np.bincount(steps.who, scores, minlength=num_participants)
            correction = num_participants / (num_participants - 1)
            clustered = math.sqrt(correction * float((by_person**2).sum())) / float(information.sum())
    return RationalityFit(
        best, (low, high), error, clustered, confidence, greatest, len(steps.taken), num_trajectories, num_participants
    )
