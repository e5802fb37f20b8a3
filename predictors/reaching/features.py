"""A reach as numbers: positions and velocities since its first sample, and resampling in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import TrajectoryError

__all__ = ["SAME_MOMENT", "SHORTEST", "Reach", "check_positions", "check_reach", "check_reaches", "resample"]

_Array = npt.NDArray[np.float64]

SAME_MOMENT: Final = 1e-9
"""Seconds within which two samples count as of one moment: speeds between them would have no meaning."""

SHORTEST: Final = 1e-6
"""Seconds that a reach to learn from must last."""


class Reach:
    """A trajectory relative to where and when it began.

    Velocities look backwards only, so that those of a prefix are a prefix of the velocities: the first sample's is 0,
    and two samples at the same moment (within :data:`SAME_MOMENT`) share one.

    Attributes:
        points: ``(T, d)`` positions from the first.
        times: ``(T,)`` seconds since the first sample.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        states = trajectory.states.astype(np.float64)
        self.points: _Array = states - states[:1]
        self.times: _Array = trajectory.times - trajectory.times[:1]
        self._origin: tuple[_Array, float] | None = None
        self._last: tuple[_Array, float, _Array] | None = None

    @classmethod
    def empty(cls, dimension: int) -> Self:
        """A reach of which nothing was seen yet, to which samples are appended."""
        return cls(Trajectory(np.zeros((0, dimension)), candidates=("any",)))

    @property
    def duration(self) -> float:
        """Seconds from the first to the last sample."""
        return float(self.times[-1])

    def features(self, velocity: bool) -> _Array:
        """``(T, d)`` positions, or ``(T, 2 d)`` positions and velocities."""
        if not velocity:
            return self.points
        velocities = np.zeros_like(self.points)
        gaps = np.diff(self.times)
        for i in np.flatnonzero(gaps >= 0):
            moved = self.points[i + 1] - self.points[i]
            velocities[i + 1] = moved / gaps[i] if gaps[i] > SAME_MOMENT else velocities[i]
        return np.concatenate([self.points, velocities], axis=1)

    def append(self, point: tuple[float, ...], time: float, velocity: bool) -> tuple[_Array, float, float]:
        """Features of one more sample, without keeping those before.

        Returns:
            ``(1, f)`` features, seconds since the first sample and since the last.
        """
        state = np.array(point, dtype=np.float64)
        if self._origin is None:
            self._origin = state, time
        here, when = state - self._origin[0], time - self._origin[1]
        gap, speed = 0.0, np.zeros_like(here)
        if self._last is not None:
            gap = when - self._last[1]
            speed = (here - self._last[0]) / gap if gap > SAME_MOMENT else self._last[2]
        self._last = here, when, speed
        return (np.concatenate([here, speed]) if velocity else here)[None], when, gap


def resample(features: _Array, times: _Array, count: int) -> _Array:
    """Linear interpolation at equal distances in time.

    Args:
        features: ``(T, f)``.
        times: ``(T,)`` seconds, never decreasing, of some duration.
        count: ``K`` samples, the first and last included.

    Returns:
        ``(K, f)``.
    """
    at = np.linspace(times[0], times[-1], count)
    return np.stack([np.interp(at, times, column) for column in features.T], axis=1)


def check_reaches(trajectories: Sequence[Trajectory]) -> int:
    """The dimension of reaches that can be learned from.

    Raises:
        TrajectoryError: An unknown goal, a prefix, cells, fewer than two states, no duration, or another dimension.
    """
    dimension = int(trajectories[0].states.shape[1])
    for number, trajectory in enumerate(trajectories):
        try:
            if trajectory.goal is None:
                raise ValueError("it has no known goal to learn from")
            if not trajectory.complete:
                raise ValueError("it is a prefix; `fit` learns from complete reaches")
            check_positions(trajectory)
            duration = float(trajectory.times[-1] - trajectory.times[0]) if trajectory.num_states else 0.0
            if trajectory.num_states < 2 or duration < SHORTEST:
                count = f"{trajectory.num_states} state{'s' * (trajectory.num_states != 1)}"
                lasts = f"lasts {duration:.3g} s" if duration else "no duration"
                raise ValueError(f"the reach has {count} and {lasts}; it needs at least 2 and {SHORTEST:g} s")
            if trajectory.states.shape[1] != dimension:
                raise ValueError(
                    f"all reaches must have one dimension; the first has {dimension}, this one "
                    f"{trajectory.states.shape[1]}"
                )
        except ValueError as error:
            raise TrajectoryError.of(number, trajectory, error) from error
    return dimension


def check_positions(trajectory: Trajectory) -> None:
    """Refuse cells: on a grid standing still is left out, so that speeds and durations would be others.

    Raises:
        ValueError: States that are integers.
    """
    if trajectory.num_states and trajectory.is_grid:
        raise ValueError(
            "the states are integers, which are cells of a grid; give positions in metres or pixels as floats"
        )


def check_reach(trajectory: Trajectory, number: int, dimension: int) -> None:
    """Refuse states that are no positions of the dimension learned from.

    Raises:
        TrajectoryError: Cells, or another dimension.
    """
    try:
        check_positions(trajectory)
        if trajectory.num_states and trajectory.states.shape[1] != dimension:
            raise ValueError(f"expected states of dimension {dimension} as in `fit`, got {trajectory.states.shape[1]}")
    except ValueError as error:
        raise TrajectoryError.of(number, trajectory, error) from error
