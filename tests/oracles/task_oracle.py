"""A second, slow account of tasks: every valid sequence is listed, and the person is followed through each."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from fractions import Fraction

from legible_envs.tasks import Subtask, TaskGraph


class TaskOracle:
    """A task by brute force; for tasks of a few steps.

    Copies are told apart, so a sequence is an order of ``(name, number)``. Weights are fractions, so they are exact.
    """

    def __init__(self, task: TaskGraph):
        self.task = task
        self.named = {s.name: s for s in task.subtasks}
        self.copies = [(s.name, number) for s in task.subtasks for number in range(s.count)]
        self.group = {member: group for group, members in task.groups.items() for member in members}
        self.sequences = list(self.orders(()))

    def orders(self, begun: tuple) -> Iterator[tuple]:
        """Every valid sequence that begins so."""
        if len(begun) == len(self.copies):
            yield begun
        for copy in self.copies:
            if copy not in begun and self.is_allowed(begun, copy[0]):
                yield from self.orders((*begun, copy))

    def is_allowed(self, before: tuple, name: str) -> bool:
        done = Counter(n for n, _ in before)
        if any(done[other] < self.named[other].count for other in self.named[name].after):
            return False
        if self.task.max_open is None or name not in self.group:
            return True
        in_progress = {self.group[name]}
        for group, members in self.task.groups.items():
            if any(done[m] for m in members) and any(done[m] < self.named[m].count for m in members):
                in_progress.add(group)
        return len(in_progress) <= self.task.max_open

    def visits(self) -> tuple[dict, dict]:
        """Expected visits of each stage ``(start, goals)``, and of each transition ``(start, goals, goal, then)``."""
        following = defaultdict(set)
        for sequence in self.sequences:
            for i, (name, _) in enumerate(sequence):
                following[frozenset(sequence[:i])].add(name)
        stages: dict = defaultdict(Fraction)
        transitions: dict = defaultdict(Fraction)
        for sequence in self.sequences:
            places = {self.task.start: Fraction(1, len(self.sequences))}  # where the person is, and how probably
            for i, (name, _) in enumerate(sequence):
                subtask = self.named[name]
                if "human" not in subtask.agents:
                    continue  # the robot's: the person stays
                valid = [self.named[other] for other in following[frozenset(sequence[:i])]]
                goals = tuple(sorted({goal for s in valid if "human" in s.agents for goal in s.goals}))
                places = self.go(subtask, places, goals, stages, transitions)
        return dict(stages), dict(transitions)

    @staticmethod
    def go(subtask: Subtask, places: dict, goals: tuple, stages: dict, transitions: dict) -> dict:
        afterwards: dict = defaultdict(Fraction)
        for place, odds in places.items():
            stages[place, goals] += odds
            for goal in subtask.goals:
                transitions[place, goals, goal, subtask.then] += odds / len(subtask.goals)
                afterwards[subtask.then[-1] if subtask.then else goal] += odds / len(subtask.goals)
        return afterwards
