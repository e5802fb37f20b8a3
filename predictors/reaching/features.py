"""A reach as numbers: positions and velocities since its first sample, and resampling in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["Reach", "check_dimension", "check_reaches", "resample"]

_Array = npt.NDArray[np.float64]


class Reach:
    """A trajectory relative to where and when it began.

    Velocities look backwards only, so that those of a prefix are a prefix of the velocities: the first sample's is 0,
    and two samples at the same moment share one.

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
            velocities[i + 1] = moved / gaps[i] if gaps[i] > 0 else velocities[i]
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
            speed = (here - self._last[0]) / gap if gap > 0 else self._last[2]
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
        ValueError: An unknown goal, a prefix, fewer than two states, no duration, or mixed dimensions.
    """
    for number, trajectory in enumerate(trajectories):
        if trajectory.goal is None:
            raise ValueError(f"reach {number} has no known goal to learn from")
        if not trajectory.complete:
            raise ValueError(f"reach {number} is a prefix; `fit` learns from complete reaches")
        if trajectory.num_states < 2 or not trajectory.times[-1] > trajectory.times[0]:
            raise ValueError(
                f"reach {number} has {trajectory.num_states} states and no duration; it needs at least 2 and some"
            )
        if trajectory.states.shape[1] != trajectories[0].states.shape[1]:
            raise ValueError(
                f"all reaches must have one dimension; reach 0 has {trajectories[0].states.shape[1]}, reach {number} "
                f"has {trajectory.states.shape[1]}"
            )
    return int(trajectories[0].states.shape[1])


def check_dimension(trajectory: Trajectory, dimension: int) -> None:
    """Refuse states of another dimension than those learned from."""
    if trajectory.num_states and trajectory.states.shape[1] != dimension:
        raise ValueError(f"expected states of dimension {dimension} as in `fit`, got {trajectory.states.shape[1]}")
