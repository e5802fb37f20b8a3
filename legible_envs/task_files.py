"""What a task's file may hold: keys, types and bounds of :class:`~legible_envs.tasks.TaskGraph` as plain data."""

from __future__ import annotations

from typing import Annotated, Final

from legible_envs.subtasks import AGENTS
from legible_envs.support.models import Length, OneOrMore, Text, Whole, YamlModel
from legible_envs.task_states import MAX_SUBTASKS

__all__ = ["MOST_COPIES", "MOST_NAMES", "SubtaskEntry", "TaskContent"]

MOST_COPIES: Final = 1000
"""Interchangeable copies of a subtask."""

MOST_NAMES: Final = 256
"""Names in one list: goals, subtasks waited for, places passed, members of a group."""

Name = Annotated[str, Text()]
Names = Annotated[list[Name], Length(0, MOST_NAMES), OneOrMore()]


class SubtaskEntry(YamlModel):
    """One entry of ``subtasks``; see :class:`~legible_envs.tasks.Subtask`."""

    name: Name
    goals: Annotated[list[Name], Length(1, MOST_NAMES), OneOrMore()]
    after: Names = []
    then: Names = []
    count: Annotated[int, Whole(1, MOST_COPIES)] = 1
    agents: Annotated[list[Name], Length(1, MOST_NAMES), OneOrMore()] = list(AGENTS)


class TaskContent(YamlModel):
    """A task; see :class:`~legible_envs.tasks.TaskGraph`."""

    start: Name
    subtasks: Annotated[list[SubtaskEntry], Length(1, MAX_SUBTASKS)]
    groups: Annotated[dict[str, Names], Length(0, MAX_SUBTASKS)] = {}
    max_open: Annotated[int, Whole(1)] | None = None
