"""The interface of every goal predictor, in the manner of scikit-learn.

A sample is a :class:`~legible_envs.rollouts.Trajectory` (a complete one, or a prefix of one); the columns of
probabilities are ``classes_``, and each row is zero outside the trajectory's own candidates.

To write a predictor, subclass :class:`GoalPredictor`, take parameters in ``__init__`` and store them unchanged, and
define ``predict_proba`` (or subclass :class:`CandidatePredictor` and define the probabilities of one trajectory);
define ``fit`` if something is learned (call ``super().fit(X)``, which learns ``classes_``).
:func:`check_trajectories` and :meth:`GoalPredictor.candidate_columns` help with the input;
:func:`predictors.registry.check_predictor` says what a predictor gets wrong.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, Literal, Self, get_args

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError

from legible_envs.rollouts.trajectory import (
    LARGEST_COORDINATE,
    LARGEST_TIME,
    Cut,
    Trajectory,
    grid_kind,
)
from legible_envs.support.validation import choice, real, shown
from predictors.inputs import TrajectoryError, check_fractions, check_trajectories, prefix_lengths
from predictors.outputs import probability_fault

__all__ = [
    "FRACTIONS",
    "TIE_TOLERANCE",
    "CandidatePredictor",
    "GoalPredictor",
    "GoalStream",
    "TieCredit",
    "TrajectoryError",
    "check_fractions",
    "check_trajectories",
    "correctness",
    "prefix_lengths",
]

TieCredit = Literal["fractional", "strict"]
"""How a true goal counts that shares the top with others; see :func:`correctness`."""

FRACTIONS: Final = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Fractions observed at which predictors are evaluated by default."""

TIE_TOLERANCE: Final = 1e-9
"""Probabilities that differ by at most this much are tied."""


class GoalPredictor(BaseEstimator, ABC):
    """Base class of predictors.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
    """

    classes_: npt.NDArray[np.str_]
    _looked_up: tuple[npt.NDArray[np.str_], dict[tuple[str, ...], npt.NDArray[np.intp]]]

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from how people moved, beyond the names of goals and where these are.

        A predictor that does not can be evaluated where there is nothing to learn from, such as trajectories that all
        go to one goal. By default one does that has a ``fit`` of its own.
        """
        return type(self).fit is not GoalPredictor.fit

    def _check_parameters(self) -> None:
        """Raise ``ValueError`` if a parameter is bad; ``fit`` and evaluations call this before anything else."""

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Self:
        """Learn from complete trajectories.

        Args:
            X: Trajectories.
            y: Ignored; goals are part of the trajectories.

        Raises:
            ValueError: No trajectories, or bad parameters.
            TypeError: Samples that are not trajectories.
        """
        self._check_parameters()
        trajectories = check_trajectories(X)
        if not trajectories:
            raise ValueError(f"{type(self).__name__}.fit needs at least one trajectory, got none")
        names = sorted({name for trajectory in trajectories for name in trajectory.candidates})
        unsafe = [name for name in names if name.endswith("\0")]
        if unsafe:  # arrays of texts drop these, so that two goals would become one
            raise ValueError(f"names of goals must not end in a NUL character, got {unsafe}")
        self.classes_ = np.array(names)
        return self

    @abstractmethod
    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """Probability of each goal, given all states of each trajectory.

        Args:
            X: ``n`` trajectories or prefixes; an empty prefix asks for the prior.

        Returns:
            ``(n, K)``, rows summing to one, columns as in ``classes_``, zero for goals that are not candidates.

        Raises:
            ValueError: A candidate that ``fit`` did not see, or states that do not suit this predictor.
            NotFittedError: Before ``fit``.
        """

    def predict_proba_at(
        self, X: Sequence[Trajectory], fractions: Sequence[float] = FRACTIONS, cut: Cut = "steps"
    ) -> npt.NDArray[np.float64]:
        """Probabilities when only a fraction of each trajectory is observed.

        Args:
            X: ``n`` complete trajectories.
            fractions: ``F`` fractions, in any order.
            cut: What the fraction is a share of, a key of :data:`legible_envs.rollouts.CUTS`.

        Returns:
            ``(n, F, K)``, fractions in the order given.

        Raises:
            TrajectoryError: A prefix, or a trajectory that does not suit this predictor, with its number.
            ValueError: Fractions out of range, or an unknown cut.
        """
        trajectories, fractions = check_trajectories(X), check_fractions(fractions, cut)
        # Neighbouring fractions of short trajectories are the same prefix: predict once for each.
        lengths = prefix_lengths(trajectories, fractions, cut)
        keys = sorted({(i, length) for i, row in enumerate(lengths) for length in row})
        row_of = {key: row for row, key in enumerate(keys)}
        try:
            probabilities = self.predict_proba([trajectories[i].first(length) for i, length in keys])
        except TrajectoryError as error:  # numbered among the prefixes
            raise TrajectoryError(keys[error.number][0], error.participant, error.reason) from error
        rows = np.array([[row_of[i, length] for length in row] for i, row in enumerate(lengths)], dtype=np.intp)
        return probabilities[rows.reshape(len(trajectories), len(fractions))]

    def predict(self, X: Sequence[Trajectory]) -> npt.NDArray[np.str_]:
        """The most probable goal of each trajectory; among tied goals the first in ``classes_``.

        Do not evaluate predictors by these labels: :meth:`score` shares ties out instead.
        """
        probabilities = self.predict_proba(X)
        best = probabilities.max(axis=1, keepdims=True, initial=0.0)
        return self.classes_[(probabilities >= best - TIE_TOLERANCE).argmax(axis=1)]

    def score(
        self,
        X: Sequence[Trajectory],
        y: object = None,
        *,
        fractions: Sequence[float] = FRACTIONS,
        cut: Cut = "steps",
        ties: TieCredit = "fractional",
    ) -> float:
        """Mean accuracy over trajectories and fractions observed.

        Args:
            X: Trajectories with known goals: complete ones, scored at ``fractions``, or prefixes, scored as they are.
            y: Ignored; goals are part of the trajectories.
            fractions: Fractions observed.
            cut: What the fraction is a share of, a key of :data:`legible_envs.rollouts.CUTS`.
            ties: ``"fractional"``: a true goal among ``k`` tied ones counts 1/k. ``"strict"``: it counts 0.

        Raises:
            ValueError: No trajectories, prefixes among complete ones, unknown goals, fractions out of range or given
                twice, or probabilities that are none.
        """
        trajectories, fractions = check_trajectories(X), check_fractions(fractions, cut, distinct=True)
        choice("ties", ties, get_args(TieCredit))
        if not trajectories:
            raise ValueError("no trajectories to score")
        complete = sum(trajectory.complete for trajectory in trajectories)
        if 0 < complete < len(trajectories):
            raise ValueError(
                f"give complete trajectories or prefixes, not both ({complete} and {len(trajectories) - complete})"
            )
        axes: tuple[int, ...] = (len(fractions),) if complete else ()
        if complete:
            probabilities = self.predict_proba_at(trajectories, fractions, cut)
        else:
            probabilities = self.predict_proba(trajectories)
        fault = probability_fault(probabilities, trajectories, self.classes_, axes)
        if fault:
            raise ValueError(f"{type(self).__name__}: {fault}")
        return float(correctness(probabilities, self.goal_columns(trajectories), ties).mean())

    def stream(self, context: Trajectory) -> GoalStream:
        """Predict one person's goal while they move.

        Args:
            context: What is known beforehand: start, candidates, layout. Its states are ignored.

        Returns:
            A stream; ``stream.update(point)`` returns ``{goal: probability}`` and equals :meth:`predict_proba` of the
            same prefix.
        """
        return GoalStream(self, context)

    def goal_columns(self, trajectories: Sequence[Trajectory]) -> npt.NDArray[np.intp]:
        """``(n,)`` column of each trajectory's goal in ``classes_``.

        Raises:
            ValueError: A trajectory without a known goal, or candidates that ``fit`` did not see.
        """
        columns = []
        for number, trajectory in enumerate(trajectories):
            if trajectory.goal is None:
                raise TrajectoryError(number, trajectory.participant, "it has no known goal to compare with")
            columns.append(self.candidate_columns(trajectory)[trajectory.candidates.index(trajectory.goal)])
        return np.array(columns, dtype=np.intp)

    def candidate_columns(self, trajectory: Trajectory) -> npt.NDArray[np.intp]:
        """``(len(trajectory.candidates),)`` columns of the candidates in ``classes_``, in the candidates' order.

        Raises:
            ValueError: A candidate that ``fit`` did not see.
            NotFittedError: Before ``fit``.
        """
        if not hasattr(self, "classes_"):
            raise NotFittedError(f"this {type(self).__name__} is not fitted yet; call `fit` with trajectories first")
        # The same few sets of candidates come again and again: look each one up once per fit.
        looked_up = self.__dict__.get("_looked_up")
        if looked_up is None or looked_up[0] is not self.classes_:
            looked_up = self._looked_up = (self.classes_, {})
        found: npt.NDArray[np.intp] | None = looked_up[1].get(trajectory.candidates)
        if found is None:
            found = looked_up[1][trajectory.candidates] = self._look_up(trajectory.candidates)
        return found

    def _look_up(self, candidates: tuple[str, ...]) -> npt.NDArray[np.intp]:
        columns = np.searchsorted(self.classes_, candidates)
        known = self.classes_[np.minimum(columns, len(self.classes_) - 1)] == np.array(candidates)
        if not known.all():
            unknown = [name for name, is_known in zip(candidates, known, strict=True) if not is_known]
            raise ValueError(f"unknown goals {unknown}; `fit` saw {self.classes_.tolist()}")
        columns.flags.writeable = False
        return columns


class CandidatePredictor(GoalPredictor):
    """A predictor that takes one trajectory at a time; subclasses define ``candidate_probabilities``."""

    @abstractmethod
    def candidate_probabilities(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        """``(len(trajectory.candidates),)`` probabilities in the order of the candidates."""

    def with_possible_goals(self, trajectory: Trajectory) -> Trajectory:
        """The trajectory without candidates that cannot be its goal, which get probability 0; here all can."""
        return trajectory

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        """See :meth:`GoalPredictor.predict_proba`."""
        trajectories = check_trajectories(X)
        columns = [self.candidate_columns(trajectory) for trajectory in trajectories]
        probabilities = np.zeros((len(trajectories), len(self.classes_)))
        for row, trajectory in enumerate(trajectories):
            try:
                asked = self.with_possible_goals(trajectory)
                here = columns[row] if asked is trajectory else self.candidate_columns(asked)
                probabilities[row, here] = self.candidate_probabilities(asked)
            except ValueError as error:
                raise TrajectoryError.of(row, trajectory, error) from error
        return probabilities


def correctness(
    probabilities: npt.NDArray[np.float64], goals: npt.NDArray[np.integer], ties: TieCredit = "fractional"
) -> npt.NDArray[np.float64]:
    """How right predictions are, 0 to 1.

    Args:
        probabilities: ``(n, K)`` or ``(n, F, K)``.
        goals: ``(n,)`` column of each true goal.
        ties: ``"fractional"``: a true goal among ``k`` at the top counts 1/k, the expected accuracy of picking one of
            them at random. ``"strict"``: only a true goal alone at the top counts.

    Returns:
        ``(n,)`` or ``(n, F)``.
    """
    choice("ties", ties, get_args(TieCredit))
    top = probabilities >= probabilities.max(axis=-1, keepdims=True) - TIE_TOLERANCE
    index = np.asarray(goals).reshape(-1, *(1,) * (probabilities.ndim - 1))
    is_top = np.take_along_axis(top, index, axis=-1)[..., 0]
    sharing = top.sum(axis=-1)
    return np.where(is_top, 1.0 / sharing, 0.0) if ties == "fractional" else np.where(is_top & (sharing == 1), 1.0, 0.0)


class GoalStream:
    """A predictor's belief about the goal of one person, updated while they move.

    Made by :meth:`GoalPredictor.stream`. A stream is about cells (integers) or about positions (floats): the first
    point decides, unless the predictor takes one of the two only. Standing still on a cell is no new state.

    Args:
        predictor: A fitted predictor.
        context: What is known beforehand.
        cells: Whether points are cells; None leaves it to the first one.
    """

    def __init__(self, predictor: GoalPredictor, context: Trajectory, *, cells: bool | None = None) -> None:
        self._predictor = predictor
        self._context = context.first(0)
        self._columns = predictor.candidate_columns(context)
        self._cells = cells
        self._points: list[tuple[Any, ...]] = []
        self._times: list[float] = []

    @property
    def num_states(self) -> int:
        """How many states were observed; standing still on a cell of a grid adds none."""
        return len(self._points)

    @property
    def last_time(self) -> float:
        """Time of the last state; NaN before the first."""
        return self._times[-1] if self._times else math.nan

    @property
    def belief(self) -> dict[str, float]:
        """``{goal: probability}`` now; the prior before the first point."""
        try:
            row = self._predictor.predict_proba([self._observed()])[0]
        except TrajectoryError as error:  # there is but one
            raise ValueError(error.reason) from error
        return dict(zip(self._context.candidates, row[self._columns].tolist(), strict=True))

    def update(self, point: npt.ArrayLike, time: float | None = None) -> dict[str, float]:
        """Add a state and return the belief.

        Args:
            point: ``(d,)`` cell or position. Standing still on a cell of a grid adds nothing.
            time: When, in seconds; one second after the state before if None.

        Raises:
            ValueError: A point that is not finite, has another dimension than those before or does not suit the
                predictor, or a time that runs backwards. The stream stays as it was.
        """
        count, cells = len(self._points), self._cells
        self.add(point, time)
        try:
            return self.belief
        except ValueError:
            self._cells = cells
            del self._points[count:], self._times[count:]
            raise

    def add(self, point: npt.ArrayLike, time: float | None = None) -> None:
        """Add a state without asking for the belief; see :meth:`update`."""
        state, is_cell = self._checked(point)
        when = (self._times[-1] + 1.0 if self._times else 0.0) if time is None else real("time", time)
        if self._times and not when >= self._times[-1]:
            raise ValueError(f"time runs backwards: {when} after {self._times[-1]}")
        if abs(when) > LARGEST_TIME:
            raise ValueError(f"times must be seconds up to {LARGEST_TIME:g}, got {when:g}")
        self._cells = is_cell
        if is_cell and self._points and self._points[-1] == state:
            return
        self._points.append(state)
        self._times.append(when)

    def _checked(self, point: npt.ArrayLike) -> tuple[tuple[Any, ...], bool]:
        """The point as plain numbers, and whether it is a cell."""
        try:
            array = np.asarray(point)
        except ValueError:  # ragged
            array = np.zeros((0, 0))
        if isinstance(point, np.ma.MaskedArray) and np.ma.is_masked(point):
            array = np.zeros((0, 0))
        is_cell = grid_kind(array.dtype)
        if is_cell is False:
            with np.errstate(over="ignore"):  # of numbers beyond double precision, refused as infinite
                array = array.astype(np.float64)
        if array.ndim != 1 or not len(array) or is_cell is None or not np.isfinite(array).all():
            raise ValueError(f"expected one finite point of shape (d,), got {shown(point)}")
        if self._points and len(self._points[-1]) != len(array):
            raise ValueError(f"expected a point of dimension {len(self._points[-1])} as before, got {len(array)}")
        if ((array > LARGEST_COORDINATE) | (array < -LARGEST_COORDINATE)).any():
            raise ValueError(
                f"a point must be a cell, or metres or pixels, up to {LARGEST_COORDINATE:g}, got {shown(point)}"
            )
        if self._cells and not is_cell:
            raise ValueError(
                f"expected a point that is a cell (integers), got {shown(point)}; where points are positions, give "
                "floats from the first one on"
            )
        if self._cells is False and is_cell:
            array, is_cell = array.astype(np.float64), False
        return tuple(array.tolist()), is_cell

    def _observed(self) -> Trajectory:
        """The prefix observed so far, with the context's labels but without its goal."""
        if not self._points:
            return self._context
        return replace(self._context, states=np.array(self._points), times=np.array(self._times), goal=None)
