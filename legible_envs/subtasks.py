"""The parts of a task: subtasks and who can perform them, stages, and transitions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from legible_envs.errors import TaskError
from legible_envs.support.names import is_whole
from legible_envs.support.validation import entries, integer, shown

__all__ = ["AGENTS", "HUMAN", "ROBOT", "Stage", "Subtask", "Transition", "names_in"]

HUMAN: Final = "human"
"""The person, whose next goal an observer predicts."""

ROBOT: Final = "robot"
"""Whoever shares the work with the person."""

AGENTS: Final = (HUMAN, ROBOT)
"""Who may be named as able to perform a subtask."""


@dataclass(frozen=True, slots=True)
class Subtask:
    """One step of a task: reach one of ``goals``, then pass through ``then``.

    Attributes:
        name: Unique name within the task.
        goals: Goals any one of which fulfils the subtask (each equally likely where there are several).
        after: Names of subtasks that must be complete before this one may begin.
        then: Places visited after the goal, in order; the person is at the last of them afterwards. Empty means the
            person stays at the goal.
        count: Number of interchangeable copies, all of which have to be done.
        agents: Who can perform it: ``"human"``, ``"robot"``, or both, the default. Kept in this order.

    Raises:
        TaskError: A name that is none, no goal or one given twice, a count below 1, or agents that are nobody, unknown
            or given twice.

    Example:
        >>> Subtask("gut the fish", ("fish",), agents="robot").agents
        ('robot',)
    """

    name: str
    goals: tuple[str, ...]
    after: tuple[str, ...] = ()
    then: tuple[str, ...] = ()
    count: int = 1
    agents: tuple[str, ...] = AGENTS

    def __post_init__(self) -> None:
        for attribute in ("goals", "after", "then", "agents"):
            value = getattr(self, attribute)
            object.__setattr__(self, attribute, names_in(f"subtask {self.name!r}: `{attribute}`", value))
        if not isinstance(self.name, str) or not self.name or not is_whole(self.name):
            raise TaskError(f"a subtask needs a non-empty name of whole characters, got {self.name!r}")
        if not self.goals:
            raise TaskError(f"subtask {self.name!r} has no goals; give at least one")
        if len(set(self.goals)) != len(self.goals):
            raise TaskError(f"subtask {self.name!r} names a goal twice: {self.goals}")
        count = integer(f"subtask {self.name!r}: `count`", self.count, 1, error=TaskError)
        object.__setattr__(self, "count", count)
        object.__setattr__(self, "agents", _checked_agents(f"subtask {self.name!r}: `agents`", self.agents))


@dataclass(frozen=True, slots=True)
class Stage:
    """One point of the task's execution, where the person chooses what to do next.

    Attributes:
        start: Where the person is.
        goals: Goals that are valid next for the person, sorted by name.
        weight: Expected number of visits in a uniformly random valid sequence.
    """

    start: str
    goals: tuple[str, ...]
    weight: float


@dataclass(frozen=True, slots=True)
class Transition:
    """A stage together with the goal chosen next and the places passed afterwards.

    Attributes:
        start: Where the person is.
        goals: Goals that are valid next for the person, sorted by name.
        goal: The goal that is reached.
        then: Places visited after the goal, in order.
        weight: Expected number of such transitions in a uniformly random valid sequence.
    """

    start: str
    goals: tuple[str, ...]
    goal: str
    then: tuple[str, ...]
    weight: float


def names_in(what: str, value: object) -> tuple[str, ...]:
    """Names in a list, or a single one.

    Raises:
        TaskError: Anything else; the message begins with ``what``.
    """
    names = [value] if isinstance(value, str) else entries(value)
    empty_is_meant = isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping)
    if not all(isinstance(name, str) and name and is_whole(name) for name in names) or not (names or empty_is_meant):
        raise TaskError(f"{what} must hold non-empty names, got {shown(value)}")
    return tuple(names)


def _checked_agents(what: str, agents: tuple[str, ...]) -> tuple[str, ...]:
    """Agents in the order of :data:`AGENTS`, so that equal subtasks are equal."""
    if not agents:
        raise TaskError(f"{what} names nobody who could perform it; expected some of {list(AGENTS)}, or both")
    unknown = [agent for agent in agents if agent not in AGENTS]
    if unknown:
        raise TaskError(f"{what} must be some of {list(AGENTS)}, got {shown(unknown[0])}")
    if len(set(agents)) != len(agents):
        raise TaskError(f"{what} names an agent twice: {agents}")
    return tuple(agent for agent in AGENTS if agent in agents)
