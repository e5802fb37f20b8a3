"""What predictors are asked about: trajectories by number, and fractions of them."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import Any, Final, Literal

import numpy as np

from legible_envs.rollouts.trajectory import CUTS, Cut, Trajectory
from legible_envs.support.validation import entries, real, shown

__all__ = ["TrajectoryError", "check_fractions", "check_trajectories", "prefix_lengths"]

_SAME_FRACTION: Final = 1e-9


class TrajectoryError(ValueError):
    """A trajectory that does not suit a predictor, or its evaluation.

    Attributes:
        number: Its number among those given.
        reason: What is wrong, without the number.
    """

    def __init__(self, number: int, participant: str, reason: str) -> None:
        who = f" (participant {participant!r})" if participant else ""
        super().__init__(f"trajectory {number}{who}: {reason}")
        self.number = number
        self.participant = participant
        self.reason = reason

    def __reduce__(self) -> tuple[Any, ...]:
        return TrajectoryError, (self.number, self.participant, self.reason)

    @classmethod
    def of(cls, number: int, trajectory: Trajectory, error: ValueError) -> TrajectoryError:
        """The error about a trajectory, with its number among others."""
        return cls(number, trajectory.participant, error.reason if isinstance(error, cls) else str(error))


def check_trajectories(X: Sequence[Trajectory]) -> list[Trajectory]:
    """The samples as a list.

    Raises:
        TypeError: A single trajectory, or samples that are not trajectories.
    """
    if isinstance(X, Trajectory):
        raise TypeError("expected a list of trajectories, got a single one; put it in a list")
    trajectories = list(X)
    for number, trajectory in enumerate(trajectories):
        if not isinstance(trajectory, Trajectory):
            raise TypeError(f"expected trajectories, got {type(trajectory).__name__} at index {number}")
    return trajectories


def check_fractions(fractions: Sequence[float], cut: Cut, *, distinct: bool = False) -> tuple[float, ...]:
    """Fractions observed, as given.

    Args:
        fractions: Numbers in (0, 1]; 0 too for ``"cells"``, ``"time"`` and ``"arc"``.
        cut: What they are a share of, a key of :data:`legible_envs.rollouts.CUTS`.
        distinct: Whether there must be at least one, each once.

    Raises:
        ValueError: Anything else.
    """
    if cut not in CUTS:
        raise ValueError(f"unknown cut {shown(cut)}; expected one of {list(CUTS)}")
    listed = entries(fractions)
    if isinstance(fractions, Set) or (not listed and not _is_empty(fractions)):
        raise ValueError(f"`fractions` must be a list of numbers, got {shown(fractions)}")
    closed: Literal["right", "both"] = "right" if cut == "steps" else "both"
    found = tuple(real("each of `fractions`", fraction, 0, 1, closed=closed) for fraction in listed)
    if distinct and (not found or min(np.diff(sorted(found)), default=1.0) < _SAME_FRACTION):
        raise ValueError(f"`fractions` must be at least one, each once, got {shown(fractions)}")
    return found


def _is_empty(values: object) -> bool:
    return isinstance(values, Sequence | np.ndarray) and not isinstance(values, str) and np.size(values) == 0


def prefix_lengths(trajectories: Sequence[Trajectory], fractions: Sequence[float], cut: Cut) -> list[list[int]]:
    """How many states are observed: a row per trajectory, a number per fraction.

    Raises:
        TrajectoryError: A prefix, or a trajectory of fewer than two states, with its number.
    """
    rows = []
    for number, trajectory in enumerate(trajectories):
        try:
            rows.append([trajectory.prefix_length(fraction, cut) for fraction in fractions])
        except ValueError as error:
            raise TrajectoryError.of(number, trajectory, error) from error
    return rows
