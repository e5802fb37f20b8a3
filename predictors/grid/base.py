"""Costs-to-go to the stations of a kitchen, Bayesian goal inference from them, and the base of grid predictors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Final, cast

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import FLOOR, OvercookedLayout
from legible_envs.rollouts.trajectory import Cut, Trajectory
from predictors.base import FRACTIONS, CandidatePredictor, GoalStream, TrajectoryError, check_trajectories
from predictors.grid.candidates import within_reach

__all__ = [
    "GridPredictor",
    "check_complete",
    "check_recorded",
    "check_trajectory",
    "check_whole",
    "goal_posterior",
    "remaining_steps",
]

_FOUND_RIGHT: Final = "_is_whole_way"
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


def check_whole(trajectory: Trajectory, number: int) -> OvercookedLayout:
    """The kitchen of a complete trajectory, of which fractions have the meaning that results print.

    It begins on a cell beside its start, if that is a station of the kitchen, goes step by step over floor cells, and
    its last state is the goal station (a candidate, where the goal is not known).

    Args:
        trajectory: The trajectory.
        number: Its number, for error messages.

    Raises:
        TrajectoryError: Anything else (naming the cell).
    """
    # Every predictor of every fold asks again: what was found right is noted on the trajectory, which cannot change.
    # Its prefixes share the note, and are told from it by not being complete.
    if trajectory.complete and _FOUND_RIGHT in trajectory.__dict__:
        return cast(OvercookedLayout, trajectory.layout)
    try:
        layout = check_trajectory(trajectory)
        _check_way(trajectory, layout)
    except ValueError as error:
        raise TrajectoryError.of(number, trajectory, error) from error
    trajectory.__dict__[_FOUND_RIGHT] = True
    return layout


def _check_way(trajectory: Trajectory, layout: OvercookedLayout) -> None:
    if not trajectory.complete:
        raise ValueError("a complete trajectory is expected, and this is a prefix")
    cells = trajectory.states.tolist()
    last = layout.station_at(cells[-1]) if cells else None
    if len(cells) < 2 or last is None or last != (trajectory.goal or last):
        raise ValueError(
            f"a complete trajectory ends with the cell of its goal station after one floor cell or more; this one to "
            f"{trajectory.goal!r} has the states {_shortened(cells)}"
        )
    for (row, col), (to_row, to_col) in pairwise(cells):
        if abs(to_row - row) + abs(to_col - col) != 1:
            raise ValueError(
                f"the trajectory does not fit its layout: it goes from row {row}, column {col} to row {to_row}, "
                f"column {to_col}, which is not one step"
            )
    row, col = cells[0]
    if trajectory.start in layout.stations and (row, col) not in layout.access(trajectory.start):
        raise ValueError(
            f"a trajectory begins on a cell beside the station that it starts from; row {row}, column {col} is not "
            f"beside {trajectory.start!r}"
        )


def _shortened(cells: list[list[int]]) -> str:
    return str(cells) if len(cells) <= 8 else f"[{str(cells[:4])[1:-1]}, …, {str(cells[-3:])[1:-1]}]"


def check_complete(trajectory: Trajectory, number: int) -> OvercookedLayout:
    """The kitchen of a trajectory that can be learned from: its goal is known, and it is whole.

    Args:
        trajectory: The trajectory.
        number: Its number, for error messages.

    Raises:
        TrajectoryError: No known goal, or what :func:`check_whole` refuses.
    """
    if trajectory.goal is None or not trajectory.complete:
        raise TrajectoryError(
            number, trajectory.participant, "learning needs complete trajectories with known goals, and this is not one"
        )
    return check_whole(trajectory, number)


def check_recorded(trajectories: Sequence[Trajectory]) -> None:
    """Check complete trajectories in kitchens, before fractions of them are taken; others pass.

    Raises:
        TrajectoryError: What :func:`check_whole` refuses.
    """
    for number, trajectory in enumerate(trajectories):
        if isinstance(trajectory.layout, OvercookedLayout) and trajectory.is_grid and trajectory.complete:
            check_whole(trajectory, number)


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

    def __init__(self, predictor: GridPredictor, context: Trajectory) -> None:
        super().__init__(predictor, context, cells=True)

    def _observed(self) -> Trajectory:
        if not self._points:
            return self._context
        return self._context.observed(np.array(self._points), np.array(self._times))


class GridPredictor(CandidatePredictor):
    """A predictor on grids, one trajectory at a time; subclasses define ``candidate_probabilities``.

    Candidates that the person cannot reach are no goals: they get probability 0, and the others the probabilities that
    they have without them (:func:`~predictors.grid.candidates.within_reach`).
    """

    def with_possible_goals(self, trajectory: Trajectory) -> Trajectory:
        """The trajectory without candidates out of the person's reach."""
        return within_reach(trajectory)

    def predict_proba_at(
        self, X: Sequence[Trajectory], fractions: Sequence[float] = FRACTIONS, cut: Cut = "steps"
    ) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba_at`.

        Raises:
            TrajectoryError: Also a trajectory that jumps, does not begin beside its start, or does not end in its goal.
        """
        trajectories = check_trajectories(X)
        check_recorded(trajectories)
        return super().predict_proba_at(trajectories, fractions, cut)

    def stream(self, context: Trajectory) -> GoalStream:
        """Predict one person's goal while they move; see :meth:`GoalPredictor.stream`."""
        return GridStream(self, context)
