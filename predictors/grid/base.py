"""Costs-to-go to the stations of a kitchen, Bayesian goal inference from them, and the base of grid predictors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import FLOOR, OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import CandidatePredictor, GoalStream, check_trajectories
from predictors.grid.candidates import within_reach

__all__ = ["GridPredictor", "check_complete", "check_trajectory", "goal_posterior", "remaining_steps"]

GoalCosts = Callable[[OvercookedLayout, tuple[str, ...], Cell], npt.NDArray[np.float64]]


@lru_cache(maxsize=256)
def remaining_steps(layout: OvercookedLayout, goals: tuple[str, ...]) -> npt.NDArray[np.float64]:
    """Optimal number of steps from every cell into each goal station.

    People walk on floor cells and reach into the station with a last step, so that a cell beside a station is one step
    away from it. A station is a dead end: its own cell is 0 from itself and infinitely far from all others.

    Args:
        layout: The kitchen.
        goals: ``K`` names of stations.

    Returns:
        ``(H, W, K)`` read-only, ``inf`` where there is no path.

    Raises:
        LayoutError: A goal is not a station of this kitchen.
    """
    steps = np.full((*layout.shape, len(goals)), np.inf)
    for column, goal in enumerate(goals):
        away = layout.distances_from(layout.access(goal))
        steps[..., column][away >= 0] = away[away >= 0] + 1
        steps[(*layout.stations[goal], column)] = 0.0
    steps.flags.writeable = False
    return steps


def check_trajectory(trajectory: Trajectory) -> OvercookedLayout:
    """The kitchen of a trajectory, after checking that the states fit it.

    Raises:
        ValueError: No layout, positions instead of cells, or a state outside the floor (named).
    """
    layout = trajectory.layout
    if layout is None:
        raise ValueError("this predictor needs the layout of a trajectory; this one has none")
    if not isinstance(layout, OvercookedLayout):
        raise ValueError(f"this predictor is for trajectories in kitchens; this one has a {type(layout).__name__}")
    if trajectory.num_states and (not trajectory.is_grid or trajectory.states.shape[1] != 2):
        raise ValueError(
            f"expected (row, col) cells, got {trajectory.states.shape[1]}-d {trajectory.states.dtype} states"
        )
    last, floor = trajectory.num_states - 1, _floor_of(layout)
    for index, (row, col) in enumerate(trajectory.states.tolist()):
        if (row, col) not in floor and (index < last or layout.station_at((row, col)) not in trajectory.candidates):
            raise ValueError(
                f"the trajectory does not fit the layout: state {index}, row {row}, column {col} is neither floor nor, "
                "as the last state, a candidate station"
            )
    return layout


@lru_cache(maxsize=256)
def _floor_of(layout: OvercookedLayout) -> frozenset[tuple[int, int]]:
    """``(row, col)`` of all floor cells: asking a set is ten times faster than asking the layout."""
    return frozenset((row, col) for row, col in np.argwhere(layout.cells == FLOOR).tolist())


def check_complete(trajectory: Trajectory, number: int) -> OvercookedLayout:
    """The kitchen of a complete trajectory: a known goal, no jumps, from a floor cell into the goal station.

    Args:
        trajectory: The trajectory.
        number: Its number, for error messages.

    Raises:
        ValueError: Anything else (naming the cell).
    """
    layout = check_trajectory(trajectory)
    if trajectory.goal is None or not trajectory.complete:
        raise ValueError(f"learning needs complete trajectories with known goals; trajectory {number} is not one")
    cells = trajectory.states
    if len(cells) < 2 or layout.station_at(cells[-1]) != trajectory.goal:
        raise ValueError(
            f"a complete trajectory ends with the cell of its goal station after one floor cell or more; trajectory "
            f"{number} to {trajectory.goal!r} has the states {cells.tolist()}"
        )
    jumps = np.flatnonzero(np.abs(np.diff(cells, axis=0)).sum(axis=1) != 1)
    if len(jumps):
        (row, col), (to_row, to_col) = cells[jumps[0]].tolist(), cells[jumps[0] + 1].tolist()
        raise ValueError(
            f"trajectory {number} does not fit its layout: it goes from row {row}, column {col} to row {to_row}, "
            f"column {to_col}, which is not one step"
        )
    return layout


def goal_posterior(
    trajectory: Trajectory, prior: npt.NDArray[np.float64], goal_costs: GoalCosts
) -> npt.NDArray[np.float64]:
    """Bayesian goal inference (Eq. 1): ``P(G) exp(C*(S->G) - C*(Q->G))``, normalised.

    Args:
        trajectory: The observed prefix.
        prior: ``(K,)`` probabilities of its candidates.
        goal_costs: Optimal costs in nats, ``(H, W, K)`` for a layout, names of goals, and a cell where the person is.

    Returns:
        ``(K,)`` probabilities of its candidates; the prior if nothing was observed.

    Raises:
        ValueError: A trajectory that does not fit its layout, or a candidate out of reach from its first cell.
    """
    layout = check_trajectory(trajectory)
    if not trajectory.num_states:
        return prior
    (first_row, first_col), (row, col) = trajectory.states[0].tolist(), trajectory.states[-1].tolist()
    costs = goal_costs(layout, trajectory.candidates, (first_row, first_col))
    optimal = costs[first_row, first_col]
    if np.isinf(optimal).any():
        goal = trajectory.candidates[int(np.isinf(optimal).argmax())]
        raise ValueError(f"the candidate {goal!r} cannot be reached from row {first_row}, column {first_col}")
    excess = costs[row, col] - optimal
    possible = np.isfinite(excess)  # no path leads out of a station
    weights = np.zeros(len(prior))
    weights[possible] = prior[possible] * np.exp(excess[possible].min() - excess[possible])
    return weights / weights.sum()


class GridStream(GoalStream):
    """The belief about one person on a grid; each cell is checked once, by the predictor."""

    def _observed(self) -> Trajectory:
        if not self._points:
            return self._context
        return self._context.observed(np.array(self._points), np.array(self._times))


class GridPredictor(CandidatePredictor):
    """A predictor on grids, one trajectory at a time; subclasses define ``candidate_probabilities``.

    Candidates that the person cannot reach are no goals: they get probability 0, and the others the probabilities that
    they have without them (:func:`~predictors.grid.candidates.within_reach`).
    """

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba`; goals out of the person's reach have probability 0."""
        trajectories = check_trajectories(X)
        columns = [self.candidate_columns(trajectory) for trajectory in trajectories]
        probabilities = np.zeros((len(trajectories), len(self.classes_)))
        for row, trajectory in enumerate(trajectories):
            part = within_reach(trajectory)
            here = columns[row] if part is trajectory else self.candidate_columns(part)
            probabilities[row, here] = self.candidate_probabilities(part)
        return probabilities

    def stream(self, context: Trajectory) -> GridStream:
        """Predict one person's goal while they move; see :meth:`GoalPredictor.stream`."""
        return GridStream(self, context)
