"""How fluently a person and a robot work together, from a log of what both did and when.

The four objective measures are those of G. Hoffman, *Evaluating Fluency in Human-Robot Collaboration*, IEEE
Transactions on Human-Machine Systems 49(3), 2019: human idle time, robot idle time, concurrent activity and functional
delay, each as a share of the time that the task took. Measures of early prediction are added: when the
robot was sure, whether rightly, and how often both wanted the same object.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from legible_envs.partner.interface import TeamCommand, TeamSenses

__all__ = ["MEASURES", "ReachPrediction", "TeamMetrics", "Tick", "known_measures", "tick_of"]

MEASURES: Final = (
    "completion_time",
    "human_idle",
    "robot_idle",
    "concurrent_activity",
    "functional_delay",
    "conflicts",
    "goals_lost",
    "decision_time",
    "decision_fraction",
    "decided",
    "decided_rightly",
)
"""The measures in ``info``, as :meth:`TeamMetrics.summary` names them."""


@dataclass(frozen=True, slots=True)
class Tick:
    """One line of a log: the state from ``time`` until the next line.

    An *action* is a stretch of lines in a row with the same label; None is no action. A person's action is a reach and
    the carrying until the object is placed, a robot's is to fetch one object.

    Attributes:
        time: Seconds, not before that of the line before.
        human: Label of the person's action; None while idle.
        robot: Label of the robot's action; None while idle (waiting, or returning home).
        reach: How many reaches the person has begun; 0 before the first.
        taken: Object in the person's hand.
        predicted: Goal that the robot is sure of; None while it is not sure.
        choices: How many objects the person may validly reach for; 0 while they must wait. Does not count while they
            hold something. A real choice unless told otherwise.
        conflict: Whether the robot gave up its target in this line because the person took it.
        lost: Whether the robot took the person's goal in this line, where that goal is known.
    """

    time: float
    human: Hashable | None = None
    robot: Hashable | None = None
    reach: int = 0
    taken: str | None = None
    predicted: str | None = None
    choices: int = 2
    conflict: bool = False
    lost: bool = False


def tick_of(senses: TeamSenses, command: TeamCommand, human_active: bool, lost: bool = False) -> Tick:
    """The line of a log for one step of a robot.

    Args:
        senses: The robot's senses.
        command: Its command.
        human_active: Whether the person is doing something: moving their hand, taking or placing an object.
        lost: Whether the robot took the person's goal.
    """
    return Tick(
        time=senses.time,
        human=senses.reach_number if human_active else None,
        robot=command.target,
        reach=senses.reach_number,
        taken=senses.person_holding,
        predicted=command.predicted,
        choices=len(senses.goals),
        conflict=command.conflict,
        lost=lost,
    )


def known_measures(summary: Mapping[str, float]) -> dict[str, float]:
    """The measures of a summary, as they stand in ``info``: ``inf`` where one is not known yet.

    Not NaN, which is equal to nothing, not even to itself in the same episode played again.
    """
    return {name: summary[name] if math.isfinite(summary[name]) else math.inf for name in MEASURES}


@dataclass(frozen=True, slots=True)
class ReachPrediction:
    """How a robot predicted the goal of one reach that ended in taking an object.

    Attributes:
        reach: Number of the reach.
        taken: Object that the person took.
        duration: Seconds from the reach's first line with a valid goal to that in which the object was taken.
        decision_time: Seconds from its first line to that in which the robot was sure for the first time; all of
            ``duration`` where it never was.
        predicted: Goal it was sure of then; None where it never was.
        choices: The most objects that could validly be reached for in one line; with 1 there is nothing to predict.
    """

    reach: int
    taken: str
    duration: float
    decision_time: float
    predicted: str | None
    choices: int

    @property
    def fraction(self) -> float:
        """Share of the reach that the robot had to see; 1 where it never was sure, or the reach took no time."""
        return self.decision_time / self.duration if self.duration > 0 else 1.0

    @property
    def correct(self) -> bool:
        """Whether the first goal the robot was sure of is the one that was taken."""
        return self.predicted == self.taken


@dataclass(slots=True)
class _Action:
    agent: str
    label: Hashable
    begin: float
    end: float | None = None


class TeamMetrics:
    """Team measures of one episode, kept up to date line by line.

    Attributes:
        predictions: One for every reach that ended in taking an object.
        conflicts: How often both wanted the same object: the person took the robot's target, or the robot took
            the person's known goal.
        goals_lost: How often the robot took the person's known goal, the price of acting on a wrong prediction.
    """

    def __init__(self) -> None:
        self.predictions: list[ReachPrediction] = []
        self.conflicts = 0
        self.goals_lost = 0
        self._first: Tick | None = None
        self._last: Tick | None = None
        self._human_idle = self._robot_idle = self._concurrent = 0.0
        self._actions: list[_Action] = []  # in the order they began
        self._acting: dict[str, _Action | None] = {"human": None, "robot": None}
        self._reach: Tick | None = None  # the line in which the last reach began
        self._reach_ended = True
        self._choices = 0
        self._sure: Tick | None = None  # the line in which the robot was sure for the first time in this reach
        self._completed = math.nan

    def add(self, tick: Tick) -> None:
        """Add a line.

        Raises:
            ValueError: Time runs backwards or is not finite.
        """
        last = self._last
        if not math.isfinite(tick.time) or (last is not None and tick.time < last.time):
            before = "" if last is None else f" after {last.time}"
            raise ValueError(f"a log's times must be finite and never decrease, got {tick.time}{before}")
        if last is None:
            self._first = last = tick
        self._count_time(last, tick.time)
        self._follow_actions(tick)
        self._follow_reach(tick)
        self.conflicts += tick.conflict + tick.lost
        self.goals_lost += tick.lost
        self._last = tick

    def complete(self, time: float) -> None:
        """Note that the task was finished; the last line holds until then.

        Raises:
            ValueError: Before the last line.
        """
        self.add(replace(self._last or Tick(time), time=time, conflict=False, lost=False))
        self._completed = time

    def summary(self) -> dict[str, float]:
        """The measures so far.

        Returns:
            ``time`` since the first line and ``completion_time``, the same once the task is done (NaN before), in
            seconds; as shares of ``time`` (NaN where it is 0) ``human_idle``, ``robot_idle``, ``concurrent_activity``
            and ``functional_delay``; ``conflicts``, ``goals_lost`` and ``reaches``, counted; over the reaches with more
            than one choice (NaN without any) the means ``decision_time`` in seconds and ``decision_fraction``, in which
            a reach that the robot was never sure of counts whole, and the shares ``decided`` and ``decided_rightly``.

            Functional delay adds up, for every action (in the order they began, the person's first of two at once)
            that follows one of the other agent, the time from that one's end to its own beginning: less than 0 where
            they overlap.
        """
        start = self._first.time if self._first else 0.0
        time = self._last.time - start if self._last else 0.0
        predictions = [prediction for prediction in self.predictions if prediction.choices > 1]

        def share(value: float) -> float:
            return value / time if time > 0 else math.nan

        def mean(values: Iterable[float]) -> float:
            return math.fsum(values) / len(predictions) if predictions else math.nan

        return {
            "time": time,
            "completion_time": self._completed - start,
            "human_idle": share(self._human_idle),
            "robot_idle": share(self._robot_idle),
            "concurrent_activity": share(self._concurrent),
            "functional_delay": share(self._functional_delay()),
            "conflicts": float(self.conflicts),
            "goals_lost": float(self.goals_lost),
            "reaches": float(len(self.predictions)),
            "decision_time": mean(p.decision_time for p in predictions),
            "decision_fraction": mean(p.fraction for p in predictions),
            "decided": mean(p.predicted is not None for p in predictions),
            "decided_rightly": mean(p.correct for p in predictions),
        }

    def _count_time(self, last: Tick, now: float) -> None:
        step = now - last.time
        if last.human is None:
            self._human_idle += step
        if last.robot is None:
            self._robot_idle += step
        if last.human is not None and last.robot is not None:
            self._concurrent += step

    def _follow_actions(self, tick: Tick) -> None:
        for agent, label in (("human", tick.human), ("robot", tick.robot)):
            acting = self._acting[agent]
            if acting is not None and acting.label != label:
                acting.end = tick.time
                acting = None
            if acting is None and label is not None:
                acting = _Action(agent, label, tick.time)
                self._actions.append(acting)
            self._acting[agent] = acting

    def _functional_delay(self) -> float:
        now = self._last.time if self._last else 0.0
        return math.fsum(
            following.begin - (now if action.end is None else action.end)
            for action, following in pairwise(self._actions)
            if following.agent != action.agent
        )

    def _follow_reach(self, tick: Tick) -> None:
        if self._reach is None or tick.reach != self._reach.reach:
            self._reach_ended = True  # given up, if it had not
            if tick.reach > 0 and (tick.choices > 0 or tick.taken is not None):
                self._reach, self._reach_ended, self._sure, self._choices = tick, False, None, 0
        if self._reach is None or self._reach_ended:
            return
        if tick.taken is None:
            self._choices = max(self._choices, tick.choices)
            if self._sure is None and tick.predicted is not None:
                self._sure = tick
            return
        duration = tick.time - self._reach.time
        sure = self._sure
        decision, goal = (duration, None) if sure is None else (sure.time - self._reach.time, sure.predicted)
        self.predictions.append(ReachPrediction(tick.reach, tick.taken, duration, decision, goal, self._choices))
        self._reach_ended = True
