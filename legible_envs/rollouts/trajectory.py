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

from legible_envs.support.validation import flag, integer, is_real, shown

__all__ = ["CUTS", "LARGEST_COORDINATE", "LARGEST_TIME", "Cut", "Trajectory", "grid_kind"]

Cut = Literal["steps", "cells", "time", "arc"]
CandidateSet = Literal["task", "game", "all"]

CUTS: Final[dict[str, str]] = {
    "steps": "states 1..t of T, t = clip(round(f*T), 1, T-1); on a grid T counts the floor cells, repeats dropped, "
    "and the goal station as last node; elsewhere samples as recorded, pauses included",
    "cells": "states 0..floor(f*(n-1)) of the n = T-1 states before the last (the goal's own node)",
    "time": "states up to time t_0 + f*(t_T - t_0), at least one",
    "arc": "states up to arc length f*(whole length), at least one",
}
"""What "fraction f observed" means under each cut; printed beside every result."""

LARGEST_COORDINATE: Final = 1e9
"""Cells, and positions in metres or pixels, beyond this are none: the states are refused."""

LARGEST_TIME: Final = 1e12
"""Times in seconds, since any moment, beyond this are none: the times are refused."""

_SLACK: Final = 1e-9
_TEXTS: Final = ("start", "participant", "condition", "layout_name")


@dataclass(frozen=True, eq=False, init=False)
class Trajectory:
    """One person's motion from a start to a goal. Immutable, compared by content.

    On a grid ``states`` are the floor cells and the goal's own cell as the last node, ``(row, col)`` each. A cell
    that is given several times in a row, as where somebody stood still, is kept once, with the time of arrival: a
    fraction of the states is then a fraction of the way. Elsewhere states are positions in metres; pauses are part of
    the motion and stay.

    Attributes:
        states: ``(T, d)`` cells (integers) or positions (floats), up to :data:`LARGEST_COORDINATE` in magnitude. May be
            empty: nothing observed yet.
        times: ``(T,)`` seconds, never decreasing, up to :data:`LARGEST_TIME` in magnitude; on a grid the time of
            arrival. None counts the states given: 0, 1, 2, ….
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
        ValueError: Wrong shapes, numbers that are missing, not finite or too large, times that run backwards, no or
            repeated candidates, a goal that is not one, labels that are no text.

    Example:
        >>> trajectory = Trajectory([(1, 1), (1, 1), (1, 2), (0, 2)], goal="pot", candidates=("pot", "onion"))
        >>> trajectory.states.tolist(), trajectory.times.tolist()
        ([[1, 1], [1, 2], [0, 2]], [0.0, 2.0, 3.0])
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
        checked, arrivals = _without_repeats(checked, _checked_times(times, len(checked)))
        candidates = (candidates,) if isinstance(candidates, str) else tuple(candidates)
        if not candidates or len(set(candidates)) != len(candidates):
            raise ValueError(f"`candidates` must name at least one goal, each once, got {candidates!r}")
        if not all(isinstance(name, str) and name for name in candidates):
            raise ValueError(f"`candidates` must be non-empty names, got {candidates!r}")
        if goal is not None and goal not in candidates:
            raise ValueError(f"the goal {goal!r} is not among the candidates {candidates}")
        if candidate_set not in ("task", "game", "all"):
            raise ValueError(f"`candidate_set` must be 'task', 'game' or 'all', got {candidate_set!r}")
        texts = dict(zip(_TEXTS, (start, participant, condition, layout_name), strict=True))
        for name, value in texts.items():
            if not isinstance(value, str):
                raise ValueError(f"`{name}` must be a text, got {shown(value)}")
        self.__dict__.update(
            states=checked,
            times=arrivals,
            start=start,
            goal=goal,
            candidates=candidates,
            participant=participant,
            condition=condition,
            layout=layout,
            layout_name=layout_name,
            candidate_set=candidate_set,
            complete=flag("complete", complete),
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
        # Asked for every trajectory and fraction: a plain float, the usual case, is looked at once.
        is_number = type(fraction) is float or is_real(fraction)
        if not is_number or not 0 <= fraction <= 1 or (fraction == 0 and cut == "steps"):
            raise ValueError(f"`fraction` must be in {'(0, 1]' if cut == 'steps' else '[0, 1]'}, got {shown(fraction)}")
        if not self.complete:
            raise ValueError("a fraction of a prefix has no meaning; cut the complete trajectory")
        if len(self.states) < 2:
            count = f"{len(self.states)} state{'s' * (len(self.states) != 1)}"
            raise ValueError(f"a trajectory of {count} has no prefix; at least 2 are needed")
        return _CUTTERS[cut](self, float(fraction))

    def first(self, count: int) -> Trajectory:
        """The first ``count`` states as a prefix (0: nothing observed yet)."""
        if type(count) is not int or not 0 <= count <= len(self.states):
            count = integer("count", count, 0, len(self.states))
        return self.observed(self.states[:count], self.times[:count])

    def observed(self, states: npt.NDArray[Any], times: npt.NDArray[np.float64]) -> Trajectory:
        """A prefix with the states observed so far in place of this trajectory's own, and all else as here.

        Nothing is checked, which keeps it cheap: predictors cut millions of prefixes, and streams check each point
        as it comes.

        Args:
            states: ``(t, d)`` cells (int64, none twice in a row) or finite positions (float64).
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


def grid_kind(dtype: np.dtype[Any]) -> bool | None:
    """Whether numbers of a dtype are cells (integers) or positions (floats); None where they are neither."""
    if np.issubdtype(dtype, np.integer):
        return True
    return False if np.issubdtype(dtype, np.floating) else None


def _checked_states(states: npt.ArrayLike) -> npt.NDArray[Any]:
    try:
        array = np.array(_unmasked("states", states))
    except ValueError as error:
        if _MISSING in str(error):
            raise
        raise ValueError(f"states must be a (T, d) array; these have mixed dimensions: {error}") from error
    if array.size == 0 and array.ndim == 1:
        array = np.zeros((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] == 0:
        raise ValueError(f"states must be a (T, d) array, got shape {array.shape}")
    is_grid = grid_kind(array.dtype)
    if is_grid is None:
        raise ValueError(f"states must be integers (cells) or floats (positions), got dtype {array.dtype}")
    # The bounds come before a narrower dtype, in which a number would become another one; and after a wider one, as
    # they would be infinite themselves in half precision.
    if not is_grid and array.dtype.itemsize < 8:
        array = array.astype(np.float64)
    bad = np.argwhere(~((array >= -LARGEST_COORDINATE) & (array <= LARGEST_COORDINATE)))
    if len(bad):
        row, column = bad[0]
        value = array[row, column]
        wanted = "finite" if not np.isfinite(value) else f"cells, or metres or pixels, up to {LARGEST_COORDINATE:g}"
        raise ValueError(f"state {row}, coordinate {column} is {value}; states must be {wanted}")
    array = np.array(array, dtype=np.int64 if is_grid else np.float64, order="C")
    array.flags.writeable = False
    return array


def _without_repeats(
    states: npt.NDArray[Any], times: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64]]:
    """Cells without those that are the same as the one before, and when each was reached; positions as they are."""
    if states.dtype != np.int64 or len(states) < 2:
        return states, times
    fresh = np.append(True, (states[1:] != states[:-1]).any(axis=1))
    if fresh.all():
        return states, times
    states, times = states[fresh], times[fresh]
    states.flags.writeable = times.flags.writeable = False
    return states, times


_MISSING: Final = "entries are missing (masked)"


def _unmasked(what: str, values: npt.ArrayLike) -> npt.ArrayLike:
    """Values none of which is masked: numpy would take what lies under the mask for data."""
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise ValueError(f"{np.ma.count_masked(values)} {_MISSING} in the {what}; leave these out")
    return values


def _numbers(what: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Real numbers as float64; texts, which numpy would read as numbers, are none."""
    array = np.array(_unmasked(what, values))
    if array.size and array.dtype.kind not in "iuf":
        raise ValueError(f"{what} must be numbers, got dtype {array.dtype}")
    with np.errstate(over="ignore"):
        return array.astype(np.float64)


def _checked_positions(positions: npt.ArrayLike, count: int, states: npt.NDArray[Any]) -> tuple[tuple[float, ...], ...]:
    try:
        array = _numbers("goal positions", positions)
    except ValueError as error:
        raise ValueError(f"goal positions must be numbers of one dimension: {error}") from error
    if array.ndim != 2 or len(array) != count or not np.isfinite(array).all():
        raise ValueError(f"expected one finite position for each of {count} candidates, got {shown(positions)}")
    if (np.abs(array) > LARGEST_COORDINATE).any():
        raise ValueError(
            f"goal positions must be metres or pixels up to {LARGEST_COORDINATE:g}, got {shown(positions)}"
        )
    if len(states) and array.shape[1] != states.shape[1]:
        raise ValueError(f"goal positions have dimension {array.shape[1]}, the states {states.shape[1]}")
    return tuple(tuple(row) for row in array.tolist())


def _checked_times(times: npt.ArrayLike | None, count: int) -> npt.NDArray[np.float64]:
    array = np.arange(count, dtype=np.float64) if times is None else _numbers("times", times)
    if array.shape != (count,):
        raise ValueError(f"times must have shape ({count},) like the states, got {array.shape}")
    if not np.isfinite(array).all() or (np.diff(array) < 0).any():
        raise ValueError("times must be finite and never decrease")
    if (np.abs(array) > LARGEST_TIME).any():
        raise ValueError(f"times must be seconds up to {LARGEST_TIME:g}, got {array[np.abs(array).argmax()]:g}")
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
