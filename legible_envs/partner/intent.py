"""Observing a person's intent through any predictor; a predictor that fails does not stop the episode."""

from __future__ import annotations

import copy
import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from legible_envs.partner.interface import Floats, GoalStream, PrefixPredictor, ReachSenses, StreamingPredictor
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.plugins import Registry
from legible_envs.support.validation import shown

__all__ = ["Predictor", "ReachObserver", "predictor_registry", "read_predictor"]

Predictor = StreamingPredictor | PrefixPredictor
"""A predictor that a :class:`ReachObserver` can follow a reach with."""

_SUM_TOLERANCE: Final = 1e-6


def predictor_registry(bayesian: str) -> Registry:
    """The predictors that can be named; ``"bayesian"`` is the built-in one at ``"module:Class"``."""
    return Registry("predictor", "legible.predictors", {"bayesian": bayesian}, ValueError)


def read_predictor(spec: object, registry: Registry, default: Callable[[], Predictor]) -> Predictor:
    """A predictor from what a user names.

    Args:
        spec: None for the default; a name of the registry or ``"module:Class"``, made without arguments; or an object
            with ``stream`` or ``predict_proba``.
        registry: The predictors that have names.
        default: Makes the one that None means.

    Raises:
        ValueError: It cannot be imported or made.
        TypeError: It is no predictor.
    """
    if spec is None:
        return default()
    predictor = spec
    if isinstance(spec, str):
        factory = registry.resolve(spec)
        try:
            predictor = factory()
        except Exception as error:
            raise ValueError(f"predictor {spec!r} cannot be made without arguments: {error}") from error
    methods = ("stream", "predict_proba")
    if isinstance(predictor, type) or not any(callable(getattr(predictor, method, None)) for method in methods):
        raise TypeError(
            "a `predictor` must be an object with a method `stream` or `predict_proba`, a name, 'module:Class' or "
            f"None, got {shown(spec)}"
        )
    return predictor  # type: ignore[return-value]  # has one of the methods


class ReachObserver(ABC):
    """Follows the reaches of a person with a predictor, which says how probable each goal is.

    The predictor sees each reach from its beginning, in the order in which it happened and nothing of the future. Where
    the valid goals change during a reach, the predictor sees this reach again with the new ones. An exception, or an
    answer other than finite probabilities of the valid goals that sum to one, is reported once by a ``RuntimeWarning``;
    there is no belief then until the next reach.

    A predictor that must be fitted and is not (it has ``fit`` but no ``classes_``) is fitted, in a copy, on simulated
    participants who do the task in this very place, always the same ones; and anew in each other place. To use
    one that has learned from other trajectories, pass the fitted instance.

    Args:
        predictor: The predictor.
        name: Its name, where it was given by name.

    Attributes:
        name: Name of the predictor in messages.
        failure: The first error of the predictor, or None.
    """

    place: ClassVar[str]
    """Where people work, in messages: ``"at this table"``."""

    def __init__(self, predictor: Predictor, name: str | None = None) -> None:
        self._given = predictor
        self._is_named = name is not None
        self.name = name or type(predictor).__name__
        self.failure: str | None = None
        self._predictor: Predictor | None = None
        self._fitted_on: object = None
        self._reach: _Reach | None = None

    @abstractmethod
    def _context(self, senses: Any) -> Trajectory:
        """The facts of a reach that are known before its first point."""

    @abstractmethod
    def _simulate(self) -> list[Trajectory]:
        """Reaches of a few simulated participants in this place, to fit a predictor on."""

    def _begin(self, place: object) -> None:
        """Begin an episode in a place; one that equals the last one's needs no new fit.

        Raises:
            ValueError: A predictor that was given by name must be fitted, and cannot be fitted on simulated
                participants in this place. (An instance that cannot be fitted is reported by a ``RuntimeWarning``.)
        """
        self._reach = None
        if not hasattr(self._given, "fit") or hasattr(self._given, "classes_"):
            self._predictor = self._given
        elif self._fitted_on != place:
            self._predictor, self._fitted_on = None, place
            try:
                fitted: Any = copy.deepcopy(self._given)
                fitted.fit(self._simulate())
            except Exception as error:
                self._refuse_unfitted(error)
            else:
                self._predictor = fitted

    def _refuse_unfitted(self, error: Exception) -> None:
        kind = type(self._given).__name__
        reason = ValueError(
            f"predictor {self.name} must be fitted, and fitting it on simulated participants {self.place} "
            f"failed ({type(error).__name__}: {error}); pass a fitted instance, such as "
            f"predictor={kind}().fit(trajectories)"
        )
        if self._is_named:
            self._fitted_on = None
            raise reason from error
        self._report(reason)

    def observe(self, senses: ReachSenses) -> dict[str, float] | None:
        """``{goal: probability}`` now; None where there is no reach, no valid goal, or the predictor failed."""
        if not len(senses.reach) or not senses.goals or self._predictor is None:
            return None
        occasion = _Occasion(senses.reach_number, frozenset(senses.goals))
        if self._reach is None or self._reach.occasion != occasion:
            self._reach = _Reach(occasion)
        if self._reach.failed:
            return None
        try:
            if self._reach.stream is None:
                self._reach.stream = _open_stream(self._predictor, self._context(senses))
            belief = self._reach.show(senses)
            return _checked_belief(belief, senses.goals)
        except Exception as error:
            self._reach.failed = True
            self._report(error)
            return None

    def _report(self, error: Exception) -> None:
        if self.failure is None:
            self.failure = f"{type(error).__name__}: {error}"
            warnings.warn(
                f"predictor {self.name} failed, so the robot waits; later failures are not reported: {self.failure}",
                RuntimeWarning,
                stacklevel=2,
            )


class _Occasion(NamedTuple):
    """A reach and the goals that were valid."""

    reach_number: int
    goals: frozenset[str]


@dataclass
class _Reach:
    """One reach with one set of valid goals, as far as the predictor saw it."""

    occasion: _Occasion
    stream: GoalStream | None = None
    belief: object = None
    seen: int = 0
    failed: bool = False

    def show(self, senses: ReachSenses) -> object:
        """Show the predictor the points it has not seen yet; the belief after the last."""
        assert self.stream is not None
        # A copy, since a predictor may keep what it is shown.
        states, times = senses.reach[self.seen :].copy(), senses.times[self.seen :].tolist()
        # A stream may have `add`, which takes a point without the cost of a belief that is not asked for.
        add = getattr(self.stream, "add", self.stream.update)
        for point, time in zip(states[:-1], times[:-1], strict=True):
            add(point, time)
        if len(states):
            self.belief = self.stream.update(states[-1], times[-1])
        self.seen = len(senses.reach)
        return self.belief


class _PrefixStream:
    """A stream for predictors that only have ``predict_proba``."""

    def __init__(self, predictor: PrefixPredictor, context: Trajectory) -> None:
        self._predictor = predictor
        self._context = context
        self._points: list[Floats] = []
        self._times: list[float] = []

    def add(self, point: Floats, time: float) -> None:
        self._points.append(point)
        self._times.append(time)

    def update(self, point: Floats, time: float) -> dict[str, float]:
        self.add(point, time)
        known = self._context
        prefix = Trajectory(
            np.array(self._points),
            np.array(self._times),
            start=known.start,
            candidates=known.candidates,
            layout=known.layout,
            candidate_set=known.candidate_set,
            complete=False,
            goal_positions=known.goal_positions,
        )
        row = dict(zip(self._predictor.classes_, self._predictor.predict_proba([prefix])[0], strict=True))
        return {goal: float(row[goal]) for goal in known.candidates}


def _open_stream(predictor: Predictor, context: Trajectory) -> GoalStream:
    # Not by isinstance: a protocol's check at run time takes several times as long.
    if hasattr(predictor, "stream"):
        return predictor.stream(context)
    return _PrefixStream(predictor, context)


def _checked_belief(belief: object, goals: tuple[str, ...]) -> dict[str, float]:
    if not isinstance(belief, Mapping) or set(belief) != set(goals):
        raise ValueError(f"expected probabilities of {sorted(goals)}, got {belief!r}")
    values = [float(p) for p in belief.values()]
    if not all(0 <= p < math.inf for p in values) or abs(math.fsum(values) - 1) > _SUM_TOLERANCE:
        raise ValueError(f"expected probabilities that sum to one, got {dict(belief)!r}")
    return {goal: float(belief[goal]) for goal in goals}
