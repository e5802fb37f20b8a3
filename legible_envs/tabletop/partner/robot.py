"""A robot that shares the table: it waits until it is sure of the person's goal, then takes another object.

An environment calls :meth:`RobotPartner.step` with what the robot senses, and carries out the command that comes back:
it moves the gripper, closes it on an object within reach, and opens it again. Any object with these two methods can
take the robot's place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from legible_envs.support.validation import real
from legible_envs.tabletop.objects import Point, point
from legible_envs.tabletop.partner.intent import IntentObserver
from legible_envs.tabletop.partner.interface import Command, Floats, Senses, State, gripper_home
from legible_envs.tabletop.partner.steering import Steering

if TYPE_CHECKING:
    from legible_envs.tabletop.layout import TabletopLayout
    from legible_envs.tabletop.task import TabletopTask

__all__ = ["RobotPartner"]


_TIE: Final = 1e-9


class _Prediction(NamedTuple):
    """The belief about the present reach, and the goal the robot is sure of."""

    belief: dict[str, float] | None
    goal: str | None


class _Jaws(NamedTuple):
    """What the gripper does: the object to close on, or whether to open."""

    grasp: str | None = None
    release: bool = False


class RobotPartner:
    """A robot arm that works with a person and keeps clear of their hand.

    It waits at home until it is *sure*: until one goal is more probable than ``threshold``, or the person holds an
    object. Then it takes another one: the nearest to its gripper of those it may validly take, never the one the
    person goes for; puts it at its place in the task's configuration; and goes on while it is sure. An object that the
    person may not reach for at present, since only the robot can perform its subtask, it takes without waiting. Its
    states:

    =========  ==================================================  ====================================================
    state      action                                              end of it
    =========  ==================================================  ====================================================
    wait       goes home and stays there                           there is an object to take: *approach*
    approach   goes to its target                                  there: *grasp*
    grasp      stands still for ``grasp_time``, closes             caught: *carry*; missed: *approach*
    carry      goes to the place of what it holds                  there: *place*
    place      stands still for ``grasp_time``, opens              nothing in the gripper: *wait*
    =========  ==================================================  ====================================================

    In *approach* and *grasp* it yields, and decides anew, when its target is no longer there to take (a *conflict* if
    the person took it), or as soon as it is sure that the person goes for it.

    **Motion.** A velocity that changes by at most ``acceleration``, straight to where it goes, over objects and virtual
    obstacles (these are projected for the person). It does not move nearer to the hand than ``clearance``: it slows
    down before, goes round a hand that blocks its path, waits beside one that rests at its target, and backs off from
    one that comes nearer. A hand faster than ``max_speed`` can still reach it, and keeping clear takes precedence over
    ``acceleration``.

    All of it is deterministic.

    Args:
        predictor: Predicts the person's goals: None or ``"bayesian"`` for the built-in Bayesian goal inference along
            shortest paths among obstacles, the name of another predictor, ``"module:Class"``, or a predictor; see
            :class:`.IntentObserver`. Where it fails the robot waits and the episode goes on.
        threshold: Probability a goal must exceed, 0 to 1. 0: acts at once, on whatever goal is most probable (of tied
            ones the nearest to the hand); 1: never acts.
        rate: How often per second :meth:`step` is called.
        max_speed: Of the gripper, m/s; .25 is the reduced speed of ISO 10218-1.
        acceleration: m/s^2.
        reach: How near to an object or a place the gripper must be to close or open, m.
        grasp_time: Seconds it takes to close or open.
        clearance: Distance kept from the hand, m.
        home: ``(2,)`` where it waits; None for the middle of the table's far side, 5 cm from the edge.

    Attributes:
        failure: The first error of the predictor, or None.

    Raises:
        ValueError: An argument out of range, or a predictor that cannot be imported.
        TypeError: An object that is no predictor.
    """

    def __init__(
        self,
        predictor: object = None,
        *,
        threshold: float = 0.8,
        rate: float = 30.0,
        max_speed: float = 0.5,
        acceleration: float = 1.0,
        reach: float = 0.01,
        grasp_time: float = 0.3,
        clearance: float = 0.06,
        home: Point | None = None,
    ) -> None:
        self.threshold = real("the robot's `threshold`", threshold, 0, 1)
        self.rate = real("the robot's `rate`", rate, 1)
        self.max_speed = real("the robot's `max_speed`", max_speed, 1e-3)
        self.acceleration = real("the robot's `acceleration`", acceleration, 1e-3)
        self.reach = real("the robot's `reach`", reach, 1e-4)
        self.grasp_time = real("the robot's `grasp_time`", grasp_time, 0)
        self.clearance = real("the robot's `clearance`", clearance, 0)
        self.home = None if home is None else point(home, "the robot's `home`")
        self._observer = IntentObserver(predictor)

    def __repr__(self) -> str:
        return f"RobotPartner({self._observer.name}, threshold={self.threshold!r}, max_speed={self.max_speed!r})"

    @property
    def failure(self) -> str | None:
        """The first error of the predictor, or None."""
        return self._observer.failure

    def reset(self, layout: TabletopLayout, task: TabletopTask, rng: np.random.Generator | None = None) -> Floats:
        """Begin an episode.

        Args:
            layout: The table, as the episode begins.
            task: The task; the robot takes only objects that have a place in its configuration.
            rng: Ignored: this robot does nothing at random.

        Returns:
            ``(2,)`` where the gripper is at the beginning.
        """
        width, depth = layout.table.size
        self._home = gripper_home(layout) if self.home is None else self.home
        if not (0 <= self._home[0] <= width and 0 <= self._home[1] <= depth):
            raise ValueError(f"the robot's `home` at {self._home} is off the table of {width:g} x {depth:g} m")
        self._row = {name: row for row, name in enumerate(layout.goals)}
        self._place = {name: (float(x), float(y)) for name, (x, y) in task.configuration.items()}
        self._observer.reset(layout, task)
        self._state: State = "wait"
        self._target: str | None = None
        self._since = 0.0
        self._steering = Steering(self.max_speed, self.acceleration, self.clearance, self.rate)
        self._ended_reach = -1
        return np.array(self._home)

    def step(self, senses: Senses) -> Command:
        """The command until the next call, 1 / ``rate`` seconds later."""
        belief, predicted = self._predict(senses)
        conflict = self._revise(senses, predicted)
        gripper = _pair(senses.gripper)
        there = self._destination(senses, gripper)
        jaws = self._work(senses.time, math.dist(there, gripper))
        return Command(
            velocity=np.array(self._steering.towards(there, gripper, _pair(senses.hand))),
            grasp=jaws.grasp,
            release=jaws.release,
            target=self._target,
            belief=belief,
            decided=predicted is not None,
            predicted=predicted,
            state=self._state,
            conflict=conflict,
        )

    # -- the person --------------------------------------------------------------------------------------------------

    def _predict(self, senses: Senses) -> _Prediction:
        if senses.person_holding is not None:
            self._ended_reach = senses.reach_number
            return _Prediction(None, senses.person_holding if self.threshold < 1 else None)
        if senses.reach_number == self._ended_reach:
            return _Prediction(None, None)
        belief = self._observer.observe(senses)
        return _Prediction(belief, None if belief is None else self._sure_of(belief, senses))

    def _sure_of(self, belief: Mapping[str, float], senses: Senses) -> str | None:
        most = max(belief.values())
        if not most > self.threshold:
            return None
        top = [goal for goal, p in belief.items() if p >= most - _TIE]
        if len(top) == 1:
            return top[0]
        hand = _pair(senses.hand)
        return min(top, key=lambda goal: math.dist(hand, senses.positions[self._row[goal]]))

    # -- the robot ----------------------------------------------------------------------------------------------------

    def _revise(self, senses: Senses, predicted: str | None) -> bool:
        """Change state after events in the world; whether the person took the target."""
        if senses.holding is not None and self._state not in ("carry", "place"):
            self._state, self._target = "carry", senses.holding
        elif senses.holding is None and self._state in ("carry", "place"):
            self._state, self._target = "wait", None
        conflict = False
        if self._state in ("approach", "grasp") and (self._target not in senses.free or self._target == predicted):
            conflict = senses.person_holding == self._target
            self._state, self._target = "wait", None
        if self._state == "wait":
            self._target = self._choose(senses, predicted)
            self._state = "wait" if self._target is None else "approach"
        return conflict

    def _choose(self, senses: Senses, predicted: str | None) -> str | None:
        """The nearest object to take that is not the person's; while not sure, one that cannot be."""
        gripper = _pair(senses.gripper)
        options = [name for name in senses.free if name != predicted and name in self._place]
        if predicted is None:
            options = [] if senses.person_holding is not None else [n for n in options if n not in senses.goals]
        return min(
            options, key=lambda name: (math.dist(gripper, senses.positions[self._row[name]]), name), default=None
        )

    def _destination(self, senses: Senses, gripper: Point) -> Point:
        if self._state == "wait" or self._target is None:
            return self._home
        if self._state in ("carry", "place"):
            # An object without a place, which came into the gripper by other hands, is put down here.
            return self._place.get(self._target, gripper)
        return _pair(senses.positions[self._row[self._target]])

    def _work(self, time: float, distance: float) -> _Jaws:
        """Close or open the gripper when it is time to."""
        if self._state == "wait":
            return _Jaws()
        if distance > self.reach:
            self._state = "approach" if self._state in ("approach", "grasp") else "carry"
            return _Jaws()
        if self._state in ("approach", "carry"):
            self._state = "grasp" if self._state == "approach" else "place"
            self._since = time
        if time - self._since < self.grasp_time - 0.5 / self.rate:
            return _Jaws()
        return _Jaws(grasp=self._target) if self._state == "grasp" else _Jaws(release=True)


def _pair(array: Floats) -> Point:
    x, y = array.tolist()
    return x, y
