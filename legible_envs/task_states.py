"""Dynamic programming over task states: which subtasks are done, and where the person is.

Valid sequences are counted and weighted without listing any. Interchangeable subtasks are counted, not named, which
keeps states few: three soups have 7,484,400 sequences and 339 states.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from legible_envs.errors import TaskError

__all__ = ["StateSpace", "SubtaskClass"]

MAX_STATES: Final = 2_000_000

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
    """

    goals: tuple[str, ...]
    then: tuple[str, ...]
    count: int
    predecessors: tuple[int, ...]
    group: int | None

    @property
    def place_after(self) -> str:
        """Where the person is afterwards; at the first of the goals where these differ."""
        return self.then[-1] if self.then else self.goals[0]


class StateSpace:
    """All states a task can pass through.

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

    @property
    def num_sequences(self) -> int:
        """Number of valid sequences, copies counting as distinct."""
        return self.completions[self.initial]

    @property
    def num_states(self) -> int:
        """Number of states on some valid sequence."""
        return sum(1 for count in self.completions.values() if count)

    def ready(self, done: tuple[int, ...]) -> list[int]:
        """Classes of which a copy may be done next, by precedence and open groups."""
        begun, unfinished = set(), set()
        for cls, n in zip(self.classes, done, strict=True):
            if n > 0:
                begun.add(cls.group)
            if n < cls.count:
                unfinished.add(cls.group)
        is_open = (begun & unfinished) - {None}
        full = self.max_open is not None and len(is_open) >= self.max_open
        return [
            i
            for i, cls in enumerate(self.classes)
            if done[i] < cls.count
            and all(done[p] == self.classes[p].count for p in cls.predecessors)
            and not (full and cls.group is not None and cls.group not in is_open)
        ]

    def steps(self, state: State) -> list[tuple[int, str, float, State]]:
        """``(class, goal, copies, next state)`` of every step that precedence allows; goals share the copies."""
        done, _ = state
        steps = []
        for i in self.ready(done):
            cls = self.classes[i]
            for goal in cls.goals:
                following = (_with_one_more(done, i), cls.then[-1] if cls.then else goal)
                steps.append((i, goal, (cls.count - done[i]) / len(cls.goals), following))
        return steps

    @cached_property
    def layers(self) -> list[list[State]]:
        """All states that precedence reaches, by number of finished subtasks."""
        layers = [[self.initial]]
        seen = 1
        for _ in range(self.length):
            following = {step[3]: None for state in layers[-1] for step in self.steps(state)}
            seen += len(following)
            if seen > MAX_STATES:
                raise TaskError(f"more than {MAX_STATES:,} task states; merge interchangeable subtasks with `count`")
            layers.append(list(following))
        return layers

    @cached_property
    def completions(self) -> dict[State, int]:
        """Number of sequences that finish the task from each state (copies distinct, goals of one subtask not)."""
        completions: dict[State, int] = {}
        for layer in reversed(self.layers):
            for state in layer:
                done = state[0]
                # Which goal fulfils a subtask does not change what can follow, so one stands for all.
                completions[state] = (sum(done) == self.length) + sum(
                    (self.classes[i].count - done[i])
                    * completions[_with_one_more(done, i), self.classes[i].place_after]
                    for i in self.ready(done)
                )
        return completions

    def sample(self, rng: np.random.Generator) -> list[tuple[str, tuple[str, ...], str, tuple[str, ...]]]:
        """``(place, valid goals, goal, places afterwards)`` of every step of a uniformly random valid sequence."""
        completions, state, sequence = self.completions, self.initial, []
        for _ in range(self.length):
            steps = [step for step in self.steps(state) if completions[step[3]]]
            odds = [copies * (completions[following] / completions[state]) for _, _, copies, following in steps]
            i, goal, _, following = steps[rng.choice(len(steps), p=np.array(odds) / sum(odds))]
            goals = tuple(sorted({step[1] for step in steps}))
            sequence.append((state[1], goals, goal, self.classes[i].then))
            state = following
        return sequence

    def transition_weights(self) -> dict[tuple[str, tuple[str, ...], str, tuple[str, ...]], float]:
        """Expected number of each ``(place, valid goals, goal, places afterwards)`` in a random valid sequence."""
        completions = self.completions
        visits: dict[State, float] = defaultdict(float)
        visits[self.initial] = 1.0
        weights: dict[tuple[str, tuple[str, ...], str, tuple[str, ...]], float] = defaultdict(float)
        for layer in self.layers[:-1]:
            for state in layer:
                if not visits[state]:
                    continue
                steps = [step for step in self.steps(state) if completions[step[3]]]
                goals = tuple(sorted({goal for _, goal, _, _ in steps}))
                for i, goal, copies, following in steps:
                    # Python ints stay exact however long the task; only their quotient is a float.
                    probability = copies * (completions[following] / completions[state])
                    visits[following] += visits[state] * probability
                    weights[state[1], goals, goal, self.classes[i].then] += visits[state] * probability
        return dict(weights)


def _with_one_more(done: tuple[int, ...], i: int) -> tuple[int, ...]:
    return (*done[:i], done[i] + 1, *done[i + 1 :])
