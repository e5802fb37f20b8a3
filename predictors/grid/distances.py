"""Optimal costs between cells and stations of a kitchen, and the base of the predictors that use them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors.base import GoalPredictor

__all__ = ["GridPredictor", "check_walk", "remaining_steps"]


@lru_cache(maxsize=256)
def remaining_steps(layout: OvercookedLayout, goals: tuple[str, ...]) -> npt.NDArray[np.float64]:
    """Optimal number of steps from every cell into each goal station.

    People walk on floor cells and reach into the station with a last step, so that a cell beside a station is one step
    away from it. A station that has been entered is left for no other: its own cell is 0 from itself.

    Args:
        layout: The kitchen.
        goals: ``K`` names of stations.

    Returns:
        ``(H, W, K)`` read-only, ``inf`` where there is no way.

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


def check_walk(walk: Trajectory) -> OvercookedLayout:
    """The kitchen of a walk whose cells it fits.

    Raises:
        ValueError: No layout, positions instead of cells, or a cell where nobody can be (named).
    """
    layout = walk.layout
    if layout is None:
        raise ValueError("this predictor needs the layout of a trajectory; this one has none")
    if walk.num_states and (not walk.is_grid or walk.states.shape[1] != 2):
        raise ValueError(f"expected (row, col) cells, got {walk.states.shape[1]}-d {walk.states.dtype} states")
    last = walk.num_states - 1
    for index, (row, col) in enumerate(walk.states.tolist()):
        if not layout.is_floor((row, col)) and (index < last or layout.station_at((row, col)) not in walk.candidates):
            raise ValueError(
                f"the walk does not fit the layout: state {index}, row {row}, column {col} is neither floor nor, as "
                "the last state, a candidate station"
            )
    return layout


class GridPredictor(GoalPredictor):
    """A predictor that looks at one walk at a time; subclasses define ``candidate_probabilities``."""

    @abstractmethod
    def candidate_probabilities(self, walk: Trajectory) -> npt.NDArray[np.float64]:
        """``(len(walk.candidates),)`` probabilities in the order of the walk's candidates."""

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba`."""
        walks = self._check_trajectories(X)
        columns = [self._columns(walk) for walk in walks]
        probabilities = np.zeros((len(walks), len(self.classes_)))
        for row, walk in enumerate(walks):
            probabilities[row, columns[row]] = self.candidate_probabilities(walk)
        return probabilities
