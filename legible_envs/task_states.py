"""Dynamic programming over task states: which subtasks are done, and where the person is.

Valid sequences are counted and weighted without listing any. Interchangeable subtasks are counted, not named, which
keeps states few: three soups have 7,484,400 sequences and 339 states.

A step that only a robot can make changes what is done and leaves the person where they are.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from legible_envs.errors import TaskError
from legible_envs.subtasks import AGENTS, HUMAN

__all__ = ["StateSpace", "SubtaskClass"]

MAX_SUBTASKS: Final = 128
"""Subtasks of a task; copies of one, by ``count``, are not counted."""
MAX_DONE: Final = 131_072
"""Ways in which a task may stand: how many copies of each subtask are done."""
MAX_STEPS: Final = 1_000_000
"""Steps from one state to the next, which scores and environments go through."""

State = tuple[tuple[int, ...], str]
"""Copies done of each class, and where the person is."""


@dataclass(frozen=True, slots=True)
class SubtaskClass:
    """Interchangeable subtasks.

    Attributes:
        goals: Goals any one of which fulfils a copy.
        then: Places visited afterwards, in order; empty means the person stays at the goal.
        count: Number of copies.
        predecessors: Indices of classes that must be complete before.
        group: The exclusive group it belongs to, or None.
        agents: Who can perform it.
    """

    goals: tuple[str, ...]
    then: tuple[str, ...]
    count: int
    predecessors: tuple[int, ...]
    group: int | None
    agents: tuple[str, ...] = AGENTS

    @property
    def is_persons(self) -> bool:
        """Whether it is the person's step: whether they can perform it."""
        return HUMAN in self.agents

    @property
    def endings(self) -> tuple[tuple[str, str], ...]:
        """Ways to perform a copy, each equally likely: the goal, and where the person is then; none of the robot's."""
        return tuple((goal, self.then[-1] if self.then else goal) for goal in self.goals) if self.is_persons else ()


@dataclass(slots=True)
class _Standing:
    """What may follow where so many copies of each class are done.

    Attributes:
        free: Classes of which a copy may be done next by precedence alone, ascending.
        ready: Those of them that open groups allow.
        following: What is done after a copy of each of ``ready``.
        places: Where the person may be, in the order found.
    """

    free: tuple[int, ...]
    ready: tuple[int, ...]
    following: tuple[tuple[int, ...], ...]
    places: dict[str, None]


class _Odds(NamedTuple):
    """What may follow where so much is done.

    Attributes:
        goals: The person's valid goals, sorted by name.
        steps: ``(class, goal, probability, next state)`` of each step of the person.
        robots: ``(probability, done afterwards)`` of each step of the robot; the person stays where they are.
    """

    goals: tuple[str, ...]
    steps: list[tuple[int, str, float, State]]
    robots: list[tuple[float, tuple[int, ...]]]


class StateSpace:
    """All states a task can pass through.

    What may follow, and in how many ways the task can be finished, depends on what is done; where the person is only
    tells stages apart. So the former is found once for all places.

    Args:
        classes: The subtasks, interchangeable ones merged.
        start: Where the person is at the beginning.
        max_open: How many groups may be begun but unfinished; None means no limit.
    """

    def __init__(self, classes: Sequence[SubtaskClass], start: str, max_open: int | None) -> None:
        self.classes = tuple(classes)
        self.max_open = max_open
        self.initial: State = ((0,) * len(self.classes), start)
        self.length = sum(cls.count for cls in self.classes)
        self._endings = [cls.endings for cls in self.classes]

    @property
    def num_sequences(self) -> int:
        """Number of valid sequences, copies counting as distinct."""
        return self.completions[self.initial[0]]

    @property
    def num_states(self) -> int:
        """Number of states on some valid sequence."""
        completions = self.completions
        return sum(len(standing.places) for done, standing in self._standings.items() if completions[done])

    def ready(self, done: tuple[int, ...]) -> list[int]:
        """Classes of which a copy may be done next, by precedence and open groups."""
        is_open = self._open_groups(done)
        full = self.max_open is not None and len(is_open) >= self.max_open
        return [
            i
            for i, cls in enumerate(self.classes)
            if done[i] < cls.count
            and all(done[p] == self.classes[p].count for p in cls.predecessors)
            and not (full and cls.group is not None and cls.group not in is_open)
        ]

    def steps(self, state: State) -> list[tuple[int, str | None, float, State]]:
        """``(class, goal, copies, next state)`` of every step that precedence allows; goals share the copies.

        The goal of a step that is the robot's is None: it matters to nobody which of several it takes.
        """
        done, place = state
        steps: list[tuple[int, str | None, float, State]] = []
        for i in self.ready(done):
            endings, following = self._endings[i], _with_one_more(done, i)
            left = self.classes[i].count - done[i]
            if endings:
                steps += [(i, goal, left / len(endings), (following, there)) for goal, there in endings]
            else:
                steps.append((i, None, float(left), (following, place)))
        return steps

    # -- what is done --------------------------------------------------------------------------------------------------

    @cached_property
    def _standings(self) -> dict[tuple[int, ...], _Standing]:
        """Everything that precedence reaches, by what is done, the number of finished subtasks ascending.

        Raises:
            TaskError: There is more of it than this package goes through; said at once where that is plain.
        """
        if (least := self._least_steps()) > MAX_STEPS:
            raise TaskError(_too_large(f"at least {least:,} steps between task states"))
        done, start = self.initial
        layer = {done: self._standing(done, tuple(i for i, c in enumerate(self.classes) if not c.predecessors))}
        layer[done].places[start] = None
        found, steps = dict(layer), 0
        places = [dict.fromkeys(place for _, place in endings) for endings in self._endings]
        num_steps = [len(endings) or 1 for endings in self._endings]
        for _ in range(self.length):
            following: dict[tuple[int, ...], _Standing] = {}
            for standing in layer.values():
                for i, then in zip(standing.ready, standing.following, strict=True):
                    steps += len(standing.places) * num_steps[i]
                    if then not in following:
                        following[then] = self._standing(then, self._free_after(standing.free, then, i))
                    following[then].places.update(places[i] or standing.places)
                if steps > MAX_STEPS or len(found) + len(following) > MAX_DONE:
                    raise TaskError(_too_large("too many task states"))
            found |= following
            layer = following
        return found

    def _standing(self, done: tuple[int, ...], free: tuple[int, ...]) -> _Standing:
        ready = free
        if self.max_open is not None and len(is_open := self._open_groups(done)) >= self.max_open:
            ready = tuple(i for i in free if self.classes[i].group is None or self.classes[i].group in is_open)
        return _Standing(free, ready, tuple(_with_one_more(done, i) for i in ready), {})

    def _free_after(self, free: tuple[int, ...], done: tuple[int, ...], i: int) -> tuple[int, ...]:
        """What precedence allows after a copy of class ``i``, from what it allowed before."""
        if done[i] < self.classes[i].count:
            return free
        freed = (
            k for k in self._followers[i] if all(done[p] == self.classes[p].count for p in self.classes[k].predecessors)
        )
        return tuple(sorted({*free, *freed} - {i}))

    @cached_property
    def _followers(self) -> list[list[int]]:
        followers: list[list[int]] = [[] for _ in self.classes]
        for k, cls in enumerate(self.classes):
            for p in cls.predecessors:
                followers[p].append(k)
        return followers

    def _open_groups(self, done: tuple[int, ...]) -> set[int | None]:
        """Groups that are begun but unfinished."""
        begun, unfinished = set(), set()
        for cls, n in zip(self.classes, done, strict=True):
            if n > 0:
                begun.add(cls.group)
            if n < cls.count:
                unfinished.add(cls.group)
        return (begun & unfinished) - {None}

    def _least_steps(self) -> int:
        """A number of steps that there are in any case, told at once: of classes that do not wait for one another."""
        if self.max_open is not None:
            return _steps_between([cls for cls in self.classes if cls.group is None and not cls.predecessors])
        depths: list[int] = [-1] * len(self.classes)
        waiting = list(range(len(self.classes)))
        while waiting:  # precedence is free of cycles
            at, later = set(waiting), []
            for i in waiting:
                if at.intersection(self.classes[i].predecessors):
                    later.append(i)
                else:
                    depths[i] = 1 + max((depths[p] for p in self.classes[i].predecessors), default=-1)
            waiting = later
        levels = {depth: [c for c, d in zip(self.classes, depths, strict=True) if d == depth] for depth in set(depths)}
        return max(map(_steps_between, levels.values()), default=0)

    @cached_property
    def completions(self) -> dict[tuple[int, ...], int]:
        """Number of sequences that finish the task, by what is done (copies distinct, goals of one subtask not)."""
        counts = [cls.count for cls in self.classes]
        completions: dict[tuple[int, ...], int] = {}
        for done, standing in reversed(self._standings.items()):
            ways = int(sum(done) == self.length)
            for i, then in zip(standing.ready, standing.following, strict=True):
                ways += (counts[i] - done[i]) * completions[then]
            completions[done] = ways
        return completions

    # -- sequences -----------------------------------------------------------------------------------------------------

    def sample(self, rng: np.random.Generator) -> list[tuple[str, tuple[str, ...], str, tuple[str, ...]]]:
        """``(place, valid goals, goal, places afterwards)`` of the person's steps in a random valid sequence."""
        completions, state, sequence = self.completions, self.initial, []
        for _ in range(self.length):
            steps = [step for step in self.steps(state) if completions[step[3][0]]]
            odds = [copies * (completions[then[0]] / completions[state[0]]) for _, _, copies, then in steps]
            i, goal, _, following = steps[rng.choice(len(steps), p=np.array(odds) / sum(odds))]
            if goal is not None:
                goals = tuple(sorted({step[1] for step in steps if step[1] is not None}))
                sequence.append((state[1], goals, goal, self.classes[i].then))
            state = following
        return sequence

    def transition_weights(self) -> dict[tuple[str, tuple[str, ...], str, tuple[str, ...]], float]:
        """Expected number of each ``(place, valid goals, goal, places afterwards)`` in a random valid sequence."""
        weights: dict[tuple[str, tuple[str, ...], str, tuple[str, ...]], float] = defaultdict(float)
        layer: dict[State, float] = {self.initial: 1.0}
        for _ in range(self.length):
            visits: dict[State, float] = defaultdict(float)
            odds_of: dict[tuple[int, ...], _Odds] = {}
            for (done, place), visit in layer.items():
                if done not in odds_of:
                    odds_of[done] = self._odds(done)
                goals, steps, robots = odds_of[done]
                for i, goal, probability, following in steps:
                    visits[following] += visit * probability
                    weights[place, goals, goal, self.classes[i].then] += visit * probability
                for probability, then in robots:
                    visits[then, place] += visit * probability
            layer = visits
        return dict(weights)

    def _odds(self, done: tuple[int, ...]) -> _Odds:
        completions, standing, total = self.completions, self._standings[done], self.completions[done]
        steps: list[tuple[int, str, float, State]] = []
        robots: list[tuple[float, tuple[int, ...]]] = []
        for i, then in zip(standing.ready, standing.following, strict=True):
            if not completions[then]:
                continue
            endings, left = self._endings[i], self.classes[i].count - done[i]
            # Python ints stay exact however long the task; only their quotient is a float.
            share = left / (len(endings) or 1) * (completions[then] / total)
            for goal, place in endings:
                steps.append((i, goal, share, (then, place)))
            if not endings:
                robots.append((share, then))
        return _Odds(tuple(sorted({step[1] for step in steps})), steps, robots)


def _steps_between(classes: Sequence[SubtaskClass]) -> int:
    """Number of steps between states of classes that may be done in any order, all else being as it is.

    Of all ways to have done some copies, those in which a place was passed and a class is unfinished are counted as
    those in which the class is unfinished less those in which nothing that leads to the place was done. The robot's
    steps lead the person nowhere.
    """
    whole = math.prod(cls.count + 1 for cls in classes)
    endings = [cls.endings for cls in classes]
    num_steps = [len(ways) or 1 for ways in endings]
    leading: dict[str, list[int]] = defaultdict(list)
    for i, ways in enumerate(endings):
        for place in {place for _, place in ways}:
            leading[place].append(i)
    unfinished = [whole // (cls.count + 1) * cls.count for cls in classes]
    steps = 0
    for there in leading.values():
        none = whole // math.prod(classes[i].count + 1 for i in there)
        for i, cls in enumerate(classes):
            without = none if i in there else none // (cls.count + 1) * cls.count
            steps += num_steps[i] * (unfinished[i] - without)
        if steps > MAX_STEPS:
            break
    return steps


def _too_large(what: str) -> str:
    return (
        f"{what}; expected at most {MAX_STEPS:,} steps between states and {MAX_DONE:,} ways to have done some of the "
        "subtasks: merge interchangeable subtasks with `count`, order them with `after`, or let them end in one place "
        "with `then`"
    )


def _with_one_more(done: tuple[int, ...], i: int) -> tuple[int, ...]:
    return (*done[:i], done[i] + 1, *done[i + 1 :])
