"""Prefixes of trajectories as feature vectors, and the base of the baselines that learn from them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Self

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from predictors.grid.base import GridPredictor, check_complete, check_trajectory, remaining_steps
from predictors.grid.priors import GoalPrior

__all__ = ["PrefixEncoder", "PrefixPredictor", "distinct_prefixes"]

Floats = npt.NDArray[np.float64]
Steps = tuple[tuple[int, int], ...]


class PrefixEncoder:
    """Turns observed floor cells into feature vectors.

    Features, in this order: which start station, first cell, cell now, cell before (one-hot over those seen), start
    station and cell now together, the share of the prefix spent on each cell, the number of cells so far, and for each
    goal how much nearer it has come per step taken (1: straight toward it, -1: straight away).

    Args:
        trajectories: Complete trajectories; their stations and cells define the one-hot features, others are zero.
        classes: ``(K,)`` names of goals.
    """

    def __init__(self, trajectories: Sequence[Trajectory], classes: npt.NDArray[np.str_]) -> None:
        self._classes = tuple(classes.tolist())
        self._places: dict[OvercookedLayout, int] = {}
        self._index: dict[tuple[object, ...], int] = {}
        for trajectory in trajectories:
            place = self._places.setdefault(_layout_of(trajectory), len(self._places))
            cells = tuple(map(tuple, trajectory.states[:-1].tolist()))
            for end in range(1, len(cells) + 1):
                for key, _ in _one_hot(place, trajectory.start, cells[:end]):
                    self._index.setdefault(key, len(self._index))
        self.width = len(self._index) + 1 + len(self._classes)

    def encode(self, trajectory: Trajectory, cells: Steps) -> Floats:
        """``(width,)`` features of the first cells of a trajectory, at least one."""
        layout, row = _layout_of(trajectory), np.zeros(self.width)
        for key, value in _one_hot(self._places.get(layout, -1), trajectory.start, cells):
            column = self._index.get(key)
            if column is not None:
                row[column] += value
        row[len(self._index)] = min(len(cells), 20) / 10.0
        stations = layout.stations
        known = [column for column, name in enumerate(self._classes) if name in stations]
        steps = remaining_steps(layout, tuple(self._classes[column] for column in known))
        for column, first, now in zip(known, steps[cells[0]].tolist(), steps[cells[-1]].tolist(), strict=True):
            if first < np.inf and now < np.inf:
                row[len(self._index) + 1 + column] = (first - now) / max(len(cells) - 1, 1)
        return row


def _layout_of(trajectory: Trajectory) -> OvercookedLayout:
    assert isinstance(trajectory.layout, OvercookedLayout)
    return trajectory.layout


def _one_hot(place: int, start: str, cells: Steps) -> list[tuple[tuple[object, ...], float]]:
    """Names and values of the features that are not zero; ``place`` is the number of the kitchen."""
    values: list[tuple[tuple[object, ...], float]] = [
        (("start", place, start), 1.0),
        (("first", place, cells[0]), 1.0),
        (("now", place, cells[-1]), 1.0),
        (("both", place, start, cells[-1]), 1.0),
        *((("visited", place, cell), 1.0 / len(cells)) for cell in cells),
    ]
    if len(cells) > 1:
        values.append((("before", place, cells[-2]), 1.0))
    return values


class PrefixPredictor(GridPredictor):
    """Learns from all prefixes of complete trajectories; subclasses define ``_learn`` and ``_weigh``.

    With nothing observed the belief is the prior: as often as each goal was chosen. A person inside a candidate station
    has reached it.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
    """

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn from complete trajectories.

        Raises:
            ValueError: No trajectories, prefixes, trajectories that do not fit their layout (naming the cell), or bad
                parameters.
        """
        super().fit(X, y)
        trajectories = list(X)
        for number, trajectory in enumerate(trajectories):
            check_complete(trajectory, number)
        self._prior = GoalPrior("empirical", trajectories, self.classes_)
        self._prior_weights = self._prior.of(self.classes_.tolist())
        self._learn(trajectories)
        return self

    @abstractmethod
    def _learn(self, trajectories: Sequence[Trajectory]) -> None:
        """Learn from checked trajectories; ``_prior_weights`` is the ``(K,)`` prior of all goals."""

    @abstractmethod
    def _weigh(self, trajectory: Trajectory, cells: Steps) -> Floats:
        """``(K,)`` weights of all goals >= 0 in the order of ``classes_``, given at least one floor cell."""

    def candidate_probabilities(self, trajectory: Trajectory) -> Floats:
        """``(len(trajectory.candidates),)`` probabilities in the order of the candidates.

        Raises:
            ValueError: A trajectory that does not fit its layout.
        """
        layout = check_trajectory(trajectory)
        missing = [name for name in trajectory.candidates if name not in layout.stations]
        if missing:
            raise ValueError(
                f"the candidates {missing} are no stations of the layout, which has {list(layout.stations)}"
            )
        prior = self._prior.of(trajectory.candidates)
        cells: Steps = tuple(map(tuple, trajectory.states.tolist()))
        if not cells:
            return prior
        reached = layout.station_at(cells[-1])
        if reached is not None:
            return np.array([float(name == reached) for name in trajectory.candidates])
        weights = self._weigh(trajectory, cells)[self.candidate_columns(trajectory)]
        total = weights.sum()
        return weights / total if total > 0 else prior


def distinct_prefixes(
    trajectories: Sequence[Trajectory], encoder: PrefixEncoder, classes: npt.NDArray[np.str_]
) -> tuple[Floats, Floats]:
    """All prefixes of trajectories, equal ones once.

    Args:
        trajectories: Complete trajectories.
        encoder: Of their prefixes.
        classes: ``(K,)`` names of goals.

    Returns:
        ``(U, width)`` features, and ``(U, K)`` weights: how many trajectories to each goal have this prefix. Each
        counts by the share of it that one cell is: at fractions observed, cells of short ones are met more often.
    """
    column = {name: number for number, name in enumerate(classes.tolist())}
    rows: dict[tuple[object, ...], int] = {}
    places: dict[OvercookedLayout, int] = {}
    features: list[Floats] = []
    weights: list[Floats] = []
    for trajectory in trajectories:
        cells: Steps = tuple(map(tuple, trajectory.states[:-1].tolist()))
        place = places.setdefault(_layout_of(trajectory), len(places))
        for end in range(1, len(cells) + 1):
            key = (place, trajectory.start, cells[:end])
            row = rows.get(key)
            if row is None:
                row = rows[key] = len(features)
                features.append(encoder.encode(trajectory, cells[:end]))
                weights.append(np.zeros(len(column)))
            weights[row][column[trajectory.goal or ""]] += 1.0 / len(cells)
    return np.array(features), np.array(weights)
