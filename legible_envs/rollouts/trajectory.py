"""Trajectories: one person's motion from one start to one goal, and how a prefix of it is cut.

A *rollout* is one recorded or simulated episode; a *trajectory* is the part of it from a start to a goal, with what an
observer may know beforehand: where the person started, and which goals are possible.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

__all__ = ["CUTS", "Cut", "Trajectory"]

Cut = Literal["steps", "cells", "time", "arc"]
CandidateSet = Literal["task", "game", "all"]

CUTS: Final[dict[str, str]] = {
    "steps": "states 1..t of T, t = clip(round(f*T), 1, T-1); on a grid T counts the floor cells, repeats dropped, "
    "and the goal station as last node",
    "cells": "states 0..floor(f*(n-1)) of the n = T-1 states before the last (the goal's own node)",
    "time": "states up to time t_0 + f*(t_T - t_0), at least one",
    "arc": "states up to arc length f*(whole length), at least one",
}
"""What "fraction f observed" means under each cut; printed beside every result."""

_SLACK: Final = 1e-9


@dataclass(frozen=True, eq=False, init=False)
class Trajectory:
    """One person's motion from a start to a goal. Immutable, compared by content.

    On a grid ``states`` are the floor cells, consecutive repeats dropped, and the goal's own cell as the last node,
    ``(row, col)`` each. Elsewhere they are positions in metres.

    Attributes:
        states: ``(T, d)`` cells (integers) or positions (floats, finite). May be empty: nothing observed yet.
        times: ``(T,)`` seconds, never decreasing; on a grid the time of arrival. None counts 0, 1, 2, ….
        start: Name of the place the person came from.
        goal: Name of the goal reached; None where it is not known.
        candidates: Goals that were possible, each once; the order does not matter and is kept.
        participant: Name of the person.
        condition: Name of the experimental condition.
        layout: The layout it happened in, if any: a value of a registered kind (:mod:`legible_envs.layout_kinds`).
        layout_name: Name of the layout, if it has one.
        candidate_set: Where ``candidates`` come from: valid by precedence (``"task"``), valid in the running game
            (``"game"``), or all goals of that kind in reach (``"all"``).
        complete: Whether the last state is the goal's own; False for a prefix.
        goal_positions: The position of each of ``candidates``, in their order and the frame of ``states``; None where
            the layout tells it or it is not known.

    Raises:
        ValueError: Wrong shapes, NaN, times that run backwards, no or repeated candidates, a goal that is not one.

    Example:
        >>> trajectory = Trajectory([(1, 1), (1, 2), (0, 2)], goal="pot", candidates=("pot", "onion"))
        >>> trajectory.prefix(0.5).states.tolist()
        [[1, 1], [1, 2]]
    """

    states: npt.NDArray[Any]
    times: npt.NDArray[np.float64]
    start: str
    goal: str | None
    candidates: tuple[str, ...]
    participant: str
    condition: str
    layout: Any
    layout_name: str
    candidate_set: CandidateSet
    complete: bool
    goal_positions: tuple[tuple[float, ...], ...] | None

    def __init__(
        self,
        states: npt.ArrayLike,
        times: npt.ArrayLike | None = None,
        start: str = "",
        goal: str | None = None,
        candidates: Sequence[str] = (),
        participant: str = "",
        condition: str = "",
        layout: Any = None,
        layout_name: str = "",
        candidate_set: CandidateSet = "all",
        complete: bool = True,
        goal_positions: npt.ArrayLike | None = None,
    ) -> None:
        checked = _checked_states(states)
        candidates = (candidates,) if isinstance(candidates, str) else tuple(candidates)
        if not candidates or len(set(candidates)) != len(candidates):
            raise ValueError(f"`candidates` must name at least one goal, each once, got {candidates!r}")
        if not all(isinstance(name, str) and name for name in candidates):
            raise ValueError(f"`candidates` must be non-empty names, got {candidates!r}")
        if goal is not None and goal not in candidates:
            raise ValueError(f"the goal {goal!r} is not among the candidates {candidates}")
        if candidate_set not in ("task", "game", "all"):
            raise ValueError(f"`candidate_set` must be 'task', 'game' or 'all', got {candidate_set!r}")
        self.__dict__.update(
            states=checked,
            times=_checked_times(times, len(checked)),
            start=start,
            goal=goal,
            candidates=candidates,
            participant=participant,
            condition=condition,
            layout=layout,
            layout_name=layout_name,
            candidate_set=candidate_set,
            complete=complete,
            goal_positions=None
            if goal_positions is None
            else _checked_positions(goal_positions, len(candidates), checked),
        )

    # -- the observed part --------------------------------------------------------------------------------------------

    def prefix(self, fraction: float, cut: Cut = "steps") -> Trajectory:
        """The part seen when a fraction is observed.

        Args:
            fraction: In (0, 1]; 0 too for ``"cells"``, ``"time"`` and ``"arc"``, whose prefixes begin with one state.
            cut: Fraction of what; see :data:`CUTS`.

        Raises:
            ValueError: The fraction is out of range, the cut unknown, or this is a prefix already.
        """
        return self.first(self.prefix_length(fraction, cut))

    def prefix_length(self, fraction: float, cut: Cut = "steps") -> int:
        """Number of states in :meth:`prefix`."""
        if cut not in CUTS:
            raise ValueError(f"unknown cut {cut!r}; expected one of {list(CUTS)}")
        if not (0 <= fraction <= 1) or (fraction == 0 and cut == "steps"):
            raise ValueError(f"`fraction` must be in {'(0, 1]' if cut == 'steps' else '[0, 1]'}, got {fraction!r}")
        if not self.complete:
            raise ValueError("a fraction of a prefix has no meaning; cut the complete trajectory")
        if len(self.states) < 2:
            raise ValueError(f"a trajectory of {len(self.states)} states has no prefix; at least 2 are needed")
        return _CUTTERS[cut](self, float(fraction))

    def first(self, count: int) -> Trajectory:
        """The first ``count`` states as a prefix (0: nothing observed yet)."""
        if not 0 <= count <= len(self.states):
            raise ValueError(f"`count` must be 0..{len(self.states)}, got {count}")
        return self.observed(self.states[:count], self.times[:count])

    def observed(self, states: npt.NDArray[Any], times: npt.NDArray[np.float64]) -> Trajectory:
        """A prefix with the states observed so far in place of this trajectory's own, and all else as here.

        Nothing is checked, which keeps it cheap: predictors cut millions of prefixes, and streams check each point
        as it comes.

        Args:
            states: ``(t, d)`` cells (int64) or finite positions (float64).
            times: ``(t,)`` seconds, never decreasing.
        """
        part = object.__new__(Trajectory)
        part.__dict__.update(self.__dict__, states=states, times=times, complete=False)
        part.__dict__.pop("arc_lengths", None)
        return part

    @property
    def num_states(self) -> int:
        """Number of states ``T``."""
        return len(self.states)

    @property
    def is_grid(self) -> bool:
        """Whether the states are cells of a grid rather than positions."""
        return bool(np.issubdtype(self.states.dtype, np.integer))

    @cached_property
    def arc_lengths(self) -> npt.NDArray[np.float64]:
        """``(T,)`` path length until each state: steps on a grid (Manhattan), Euclidean elsewhere."""
        steps = np.diff(self.states.astype(np.float64), axis=0)
        lengths = np.abs(steps).sum(axis=1) if self.is_grid else np.sqrt((steps**2).sum(axis=1))
        return np.concatenate([np.zeros(min(len(self.states), 1)), np.cumsum(lengths)])

    # -- value semantics ----------------------------------------------------------------------------------------------

    def _content(self) -> tuple[Any, ...]:
        return tuple(getattr(self, f.name) for f in fields(self))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Trajectory):
            return NotImplemented
        return self._content()[2:] == other._content()[2:] and all(
            a.dtype == b.dtype and np.array_equal(a, b)
            for a, b in ((self.states, other.states), (self.times, other.times))
        )

    def __hash__(self) -> int:
        return hash((self.states.tobytes(), self.states.shape, self._content()[2:]))

    def __reduce__(self) -> tuple[Any, ...]:
        return Trajectory, self._content()


def _checked_states(states: npt.ArrayLike) -> npt.NDArray[Any]:
    try:
        array = np.array(states)
    except ValueError as error:
        raise ValueError(f"states must be a (T, d) array; these have mixed dimensions: {error}") from error
    if array.size == 0 and array.ndim == 1:
        array = np.zeros((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] == 0:
        raise ValueError(f"states must be a (T, d) array, got shape {array.shape}")
    if np.issubdtype(array.dtype, np.integer):
        array = array.astype(np.int64)
    elif np.issubdtype(array.dtype, np.floating):
        array = array.astype(np.float64)
        bad = np.argwhere(~np.isfinite(array))
        if len(bad):
            row, column = bad[0]
            raise ValueError(f"state {row}, coordinate {column} is {array[row, column]}; states must be finite")
    else:
        raise ValueError(f"states must be integers (cells) or floats (positions), got dtype {array.dtype}")
    array.flags.writeable = False
    return array


def _checked_positions(positions: npt.ArrayLike, count: int, states: npt.NDArray[Any]) -> tuple[tuple[float, ...], ...]:
    try:
        array = np.array(positions, dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"goal positions must be numbers of one dimension: {error}") from error
    if array.ndim != 2 or len(array) != count or not np.isfinite(array).all():
        raise ValueError(f"expected one finite position for each of {count} candidates, got {positions!r}")
    if len(states) and array.shape[1] != states.shape[1]:
        raise ValueError(f"goal positions have dimension {array.shape[1]}, the states {states.shape[1]}")
    return tuple(tuple(row) for row in array.tolist())


def _checked_times(times: npt.ArrayLike | None, count: int) -> npt.NDArray[np.float64]:
    array = np.arange(count, dtype=np.float64) if times is None else np.array(times, dtype=np.float64)
    if array.shape != (count,):
        raise ValueError(f"times must have shape ({count},) like the states, got {array.shape}")
    if not np.isfinite(array).all() or (np.diff(array) < 0).any():
        raise ValueError("times must be finite and never decrease")
    array.flags.writeable = False
    return array


# -- cuts -------------------------------------------------------------------------------------------------------------


def _cut_steps(whole: Trajectory, fraction: float) -> int:
    return min(max(round(fraction * len(whole.states)), 1), len(whole.states) - 1)


def _cut_cells(whole: Trajectory, fraction: float) -> int:
    return int(np.floor(fraction * (len(whole.states) - 2) + _SLACK)) + 1


def _cut_time(whole: Trajectory, fraction: float) -> int:
    first, last = whole.times[0], whole.times[-1]
    return _count_up_to(whole.times - first, fraction * (last - first))


def _cut_arc(whole: Trajectory, fraction: float) -> int:
    return _count_up_to(whole.arc_lengths, fraction * whole.arc_lengths[-1])


def _count_up_to(values: npt.NDArray[np.float64], limit: float) -> int:
    return max(int(np.count_nonzero(values <= limit + _SLACK * max(1.0, abs(limit)))), 1)


_CUTTERS: Final[dict[str, Callable[[Trajectory, float], int]]] = {
    "steps": _cut_steps,
    "cells": _cut_cells,
    "time": _cut_time,
    "arc": _cut_arc,
}
