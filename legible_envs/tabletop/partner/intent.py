"""Watching a person's reaches through any predictor, so that a predictor that fails stops nobody."""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.plugins import Registry
from legible_envs.tabletop.partner.belief import EqOne

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout
    from legible_envs.tabletop.partner.interface import Senses
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["ReachWatcher", "make_predictor"]

_SUM_SLACK: Final = 1e-6
_PEOPLE: Final = 3

_plugins = Registry("predictor", "legible.predictors", {}, ValueError)


def make_predictor(spec: Any) -> Any:
    """A predictor from what a user names.

    Args:
        spec: None: the built-in Eq. 1. A text: ``"module:Class"``, or the name of an installed package's entry point in
            group ``legible.predictors``; the class is made without arguments. Else the predictor itself: an object
            whose ``stream(context).update(point, time)`` returns ``{goal: probability}``, or one with
            ``predict_proba([prefix])`` and ``classes_``.

    Raises:
        ValueError: It cannot be imported or made.
        TypeError: It is no predictor.
    """
    if spec is None:
        return EqOne()
    predictor = spec
    if isinstance(spec, str):
        factory = _plugins.resolve(spec)
        try:
            predictor = factory()
        except Exception as error:
            raise ValueError(f"predictor {spec!r} cannot be made without arguments: {error}") from error
    if isinstance(predictor, type) or not any(
        callable(getattr(predictor, m, None)) for m in ("stream", "predict_proba")
    ):
        raise TypeError(
            f"a predictor is an object with a method `stream` or `predict_proba`, 'module:Class' or None; got {spec!r}"
        )
    return predictor


class ReachWatcher:
    """What a predictor believes about the present reach of a person.

    The predictor sees each reach from its beginning, in the order it happened and nothing of the future. Where the
    valid goals change under way, the same reach is shown again with the new ones. What raises, or gives anything but
    finite probabilities of the valid goals that sum to one, is reported once by a ``RuntimeWarning``; there is no
    belief then until the next reach.

    A predictor that is not fitted (it has ``fit`` but no ``classes_``) is fitted, in a copy, on simulated people who
    build the task on this very table, always the same ones; and anew on each other table.

    Args:
        predictor: See :func:`make_predictor`.

    Attributes:
        name: What the predictor is called in messages.
        failure: The first error of the predictor, or None.
    """

    def __init__(self, predictor: Any = None) -> None:
        self.name = predictor if isinstance(predictor, str) else None
        self._given = make_predictor(predictor)
        self.name = self.name or type(self._given).__name__
        self.failure: str | None = None
        self._predictor: Any = None
        self._fitted_on: tuple[Any, Any] | None = None
        self._layout: TabletopLayout | None = None
        self._reach: _Reach | None = None

    def reset(self, layout: TabletopLayout, task: TabletopTask) -> None:
        """Begin an episode on a table."""
        self._layout = layout
        self._reach = None
        if not hasattr(self._given, "fit") or hasattr(self._given, "classes_"):
            self._predictor = self._given
        elif self._fitted_on != (layout, task):
            self._predictor, self._fitted_on = None, (layout, task)
            try:
                fitted = copy.deepcopy(self._given)
                fitted.fit(_people_at(layout, task))
                self._predictor = fitted
            except Exception as error:
                self._report(error)

    def observe(self, senses: Senses) -> dict[str, float] | None:
        """``{goal: probability}`` now; None where there is no reach, no valid goal, or the predictor failed."""
        if not len(senses.reach) or not senses.goals or self._predictor is None or self._layout is None:
            return None
        occasion = (senses.reach_number, frozenset(senses.goals))
        if self._reach is None or self._reach.occasion != occasion:
            self._reach = _Reach(occasion)
        if self._reach.failed:
            return None
        try:
            if self._reach.stream is None:
                self._reach.stream = _open(self._predictor, _context(senses, self._layout))
            belief = self._reach.show(senses)
            _check(belief, senses.goals)
            return {goal: float(belief[goal]) for goal in senses.goals}
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


@dataclass
class _Reach:
    """One reach with one set of valid goals, as far as the predictor saw it."""

    occasion: tuple[int, frozenset[str]]
    stream: Any = None
    belief: Any = None
    seen: int = 0
    failed: bool = False

    def show(self, senses: Senses) -> Any:
        """Show the predictor what it has not seen yet; the belief after it."""
        # A copy, for a predictor may keep what it is shown.
        states, times = senses.reach[self.seen :].copy(), senses.times[self.seen :].tolist()
        # A stream may have `add`, which takes a point without the cost of a belief nobody asks for.
        add = getattr(self.stream, "add", self.stream.update)
        for point, time in zip(states[:-1], times[:-1], strict=True):
            add(point, time)
        if len(states):
            self.belief = self.stream.update(states[-1], times[-1])
        self.seen = len(senses.reach)
        return self.belief


class _PrefixStream:
    """A stream for predictors that only have ``predict_proba``."""

    def __init__(self, predictor: Any, context: Trajectory) -> None:
        self._predictor = predictor
        self._context = context
        self._points: list[Any] = []
        self._times: list[float] = []

    def add(self, point: Any, time: float) -> None:
        self._points.append(point)
        self._times.append(time)

    def update(self, point: Any, time: float) -> dict[str, float]:
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


def _open(predictor: Any, context: Trajectory) -> Any:
    return predictor.stream(context) if hasattr(predictor, "stream") else _PrefixStream(predictor, context)


def _context(senses: Senses, layout: TabletopLayout) -> Trajectory:
    """What is known of a reach before its first point."""
    starts = layout.table.starts
    nearest = min(starts, key=lambda name: math.dist(starts[name], senses.start))
    rows = [layout.index(goal) for goal in senses.goals]
    return Trajectory(
        np.zeros((0, 2)),
        start=nearest,
        candidates=senses.goals,
        layout=layout,
        candidate_set="game",
        complete=False,
        goal_positions=tuple(map(tuple, senses.positions[rows].tolist())),
    )


def _check(belief: Any, goals: tuple[str, ...]) -> None:
    if not isinstance(belief, Mapping) or set(belief) != set(goals):
        raise ValueError(f"expected probabilities of {sorted(goals)}, got {belief!r}")
    values = [float(p) for p in belief.values()]
    if not all(0 <= p < math.inf for p in values) or abs(math.fsum(values) - 1) > _SUM_SLACK:
        raise ValueError(f"expected probabilities that sum to one, got {dict(belief)!r}")


def _people_at(layout: TabletopLayout, task: TabletopTask) -> list[Trajectory]:
    """Reaches of a few simulated people who build the task."""
    from legible_envs.tabletop.humans.simulation import sample_person, simulate_task

    rng = np.random.default_rng(0)
    return [reach for _ in range(_PEOPLE) for reach in simulate_task(task, layout, sample_person(rng), rng)]
