"""What every predictor's answer must be: a probability for each candidate, and nothing for other goals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["SUM_TOLERANCE", "probability_fault"]

SUM_TOLERANCE: Final = 1e-6
"""Probabilities of one trajectory may sum to one give or take this much."""


def probability_fault(
    answer: object, trajectories: Sequence[Trajectory], classes: npt.NDArray[np.str_], extra: tuple[int, ...] = ()
) -> str | None:
    """What is wrong with the probabilities that a predictor gave, in words; None if nothing.

    Args:
        answer: What it returned: should be ``(n, *extra, K)`` numbers.
        trajectories: ``n`` trajectories that it was asked about.
        classes: ``(K,)`` its ``classes_``.
        extra: Axes between trajectories and classes, such as ``(F,)`` fractions.
    """
    shape = (len(trajectories), *extra, len(classes))
    if not isinstance(answer, np.ndarray) or answer.shape != shape:
        return f"expected an array of shape {shape}, got {getattr(answer, 'shape', type(answer).__name__)}"
    if not np.issubdtype(answer.dtype, np.floating):
        return f"probabilities must be floats, got dtype {answer.dtype}"
    if (place := _first(~np.isfinite(answer) | (answer < 0))) is not None:
        return f"probabilities must be finite and >= 0, got {answer[place]} for {_asked(place, trajectories, classes)}"
    sums = answer.sum(axis=-1)
    if (place := _first(np.abs(sums - 1.0) > SUM_TOLERANCE)) is not None:
        return f"the probabilities of a trajectory must sum to 1, got {sums[place]:.6g} for trajectory {place[0]}"
    others = {each: ~np.isin(classes, each) for each in {trajectory.candidates for trajectory in trajectories}}
    forbidden = np.array([others[trajectory.candidates] for trajectory in trajectories], dtype=bool)
    outside = (answer > 0) & forbidden.reshape(len(answer), *(1,) * len(extra), len(classes))
    if (place := _first(outside)) is not None:
        return (
            f"{_asked(place, trajectories, classes)} got probability {answer[place]:.6g} without being one of its "
            f"candidates {trajectories[place[0]].candidates}"
        )
    return None


def _first(wrong: npt.NDArray[np.bool_]) -> tuple[int, ...] | None:
    """Where the first true value is, None if there is none."""
    return tuple(int(i) for i in np.argwhere(wrong)[0]) if wrong.any() else None


def _asked(place: tuple[int, ...], trajectories: Sequence[Trajectory], classes: Any) -> str:
    return f"goal {str(classes[place[-1]])!r} of trajectory {place[0]}"
