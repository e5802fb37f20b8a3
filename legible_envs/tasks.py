"""Tasks: precedence graphs of subtasks, and the exact weights of the stages they pass through.

A person executing a task reaches for one goal after another. A *stage* is the place where the person chooses the next
goal, and the set of goals that are valid then. Eq. 3 of Tung et al. (HRI 2024) sums the legibility of every reach over
all valid orderings of the subtasks. That sum only needs, for every stage, how often a uniformly random valid ordering
visits it. Dynamic programming over task states gives these weights without listing a single ordering.

In a heterogeneous team some subtasks are beyond the person or beyond the robot (``Subtask(agents=...)``). A valid
sequence still orders all of them; each step of it is one of the person's if they can perform the subtask, else one of
the robot's. Stages are those of the person's steps alone.
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from legible_envs.errors import TaskError
from legible_envs.subtasks import AGENTS, HUMAN, Stage, Subtask, Transition, names_in
from legible_envs.support.names import is_whole
from legible_envs.support.text import dump_yaml, read_source
from legible_envs.support.validation import choice, entries, integer, shown
from legible_envs.task_states import MAX_SUBTASKS, StateSpace, SubtaskClass

if TYPE_CHECKING:
    import networkx as nx
    import numpy as np

__all__ = ["AGENTS", "Stage", "Subtask", "TaskGraph", "Transition"]


@dataclass(frozen=True)
class TaskGraph:
    """A precedence graph of subtasks, and the stages its valid sequences pass through.

    A *valid sequence* orders all copies of all subtasks so that each comes after everything it waits for and never
    more than ``max_open`` groups are begun but unfinished. Copies count as distinct, as in the paper's appendix.

    Legibility is about what the person may do next. Where subtasks name who can perform them, a step of a sequence is
    the *person's* if they can perform the subtask, and the *robot's* if only the robot can. What both can perform
    counts as the person's: they may do it next, so an observer has to reckon with it, and the robot takes it only
    after it has predicted that the person goes elsewhere. A stage is visited before each step of the person. Its goals
    are those of all subtasks that are valid then and that the person can perform; its start is where their last step
    ended. A step of the robot moves no person and visits no stage; it is done, and what waits for it may follow.
    Sequences, and so weights, are those of the whole task: ``num_sequences``, precedence, groups and ``max_open``
    count the subtasks of all.

    Args:
        subtasks: The subtasks, in any order.
        start: Where the person is at the beginning.
        groups: Optional disjoint groups of subtasks, ``{group: [subtask, ...]}``, for example one per soup.
        max_open: How many groups may be in progress at once (``pots=1`` is ``max_open=1``); None means no limit.

    Raises:
        TaskError: Duplicate or unknown names, a cycle (named), overlapping groups, no valid sequence at all, no
            subtask that the person can perform, or more than 128 subtasks, 131,072 ways to have done some of them, or
            a million steps between task states.

    Example:
        >>> task = TaskGraph([Subtask("first", ("red",)), Subtask("second", ("blue",), after=("first",))], start="home")
        >>> task.num_sequences, [(s.start, s.goals, s.weight) for s in task.stages()]
        (1, [('home', ('red',), 1.0), ('red', ('blue',), 1.0)])

        The robot alone handles the red one; the person, still at home, waits for that.

        >>> task = TaskGraph([Subtask("first", ("red",), agents="robot"), *task.subtasks[1:]], start="home")
        >>> [(s.start, s.goals, s.weight) for s in task.stages()]
        [('home', ('blue',), 1.0)]
    """

    subtasks: tuple[Subtask, ...]
    start: str
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    max_open: int | None = None

    def __init__(
        self,
        subtasks: Iterable[Subtask],
        start: str,
        groups: Mapping[str, Sequence[str]] | None = None,
        max_open: int | None = None,
    ) -> None:
        listed = entries(subtasks)
        if len(listed) > MAX_SUBTASKS:
            raise TaskError(
                f"a task has at most {MAX_SUBTASKS} subtasks, got {len(listed):,}; `count` repeats one of them"
            )
        for number, subtask in enumerate(listed, 1):
            if not isinstance(subtask, Subtask):
                raise TaskError(f"entry {number} of `subtasks` must be a Subtask, got {shown(subtask)}")
        if groups is not None and not isinstance(groups, Mapping):
            raise TaskError(f"`groups` must map group names to lists of subtasks, got {shown(groups)}")
        grouped = {name: names_in(f"group {name!r} of `groups`", members) for name, members in (groups or {}).items()}
        object.__setattr__(self, "subtasks", tuple(listed))
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "groups", grouped)
        object.__setattr__(self, "max_open", max_open)
        self._check_names()
        self._check_acyclic()
        if self._space.num_sequences == 0:
            raise TaskError(
                f"the task has no valid sequence: max_open={max_open} and the precedence contradict each other"
            )

    def __hash__(self) -> int:
        return hash((self.subtasks, self.start, tuple(sorted(self.groups.items())), self.max_open))

    # -- checks --------------------------------------------------------------------------------------------------------

    def _check_names(self) -> None:
        if not self.subtasks:
            raise TaskError("a task needs at least one subtask; `subtasks` must be a list of Subtask")
        if not isinstance(self.start, str) or not self.start or not is_whole(self.start):
            raise TaskError(f"`start` must name a place, got {self.start!r}")
        names = [s.name for s in self.subtasks]
        repeated = sorted({n for n in names if names.count(n) > 1})
        if repeated:
            raise TaskError(f"subtask names must be unique; repeated: {repeated}")
        for subtask in self.subtasks:
            unknown = [n for n in subtask.after if n not in names]
            if unknown:
                raise TaskError(f"subtask {subtask.name!r} waits for unknown subtasks {unknown}; known: {names}")
        seen: dict[str, str] = {}
        for group, members in self.groups.items():
            for member in members:
                if member not in names:
                    raise TaskError(f"group {group!r} names an unknown subtask {member!r}; known: {names}")
                if member in seen:
                    raise TaskError(f"subtask {member!r} is in group {seen[member]!r} and in group {group!r}")
                seen[member] = group
        if not self.subtasks_of(HUMAN):
            raise TaskError(
                "the person can perform no subtask of the task, so that there is nothing to predict: every one has "
                f"`agents` {list(self.subtasks[0].agents)}; expected {HUMAN!r} among those of at least one"
            )
        if self.max_open is not None:
            max_open = integer("max_open", self.max_open, 1, also="None", error=TaskError)
            object.__setattr__(self, "max_open", max_open)

    def _check_acyclic(self) -> None:
        waits = {s.name: set(s.after) for s in self.subtasks}
        while ready := [n for n, after in waits.items() if not after]:
            for name in ready:
                del waits[name]
            for after in waits.values():
                after.difference_update(ready)
        if waits:
            path = [next(iter(waits))]
            while path[-1] not in path[:-1]:
                path.append(min(waits[path[-1]] & waits.keys()))
            cycle = path[path.index(path[-1]) :]
            raise TaskError("the precedence has a cycle: " + " waits for ".join(cycle))

    @cached_property
    def _space(self) -> StateSpace:
        return StateSpace(self._classes(), self.start, self.max_open)

    def _classes(self) -> list[SubtaskClass]:
        """Merge interchangeable subtasks, so that states count copies instead of naming them."""
        followers: dict[str, set[str]] = {s.name: set() for s in self.subtasks}
        for s in self.subtasks:
            for before in s.after:
                followers[before].add(s.name)
        group_of = {member: i for i, members in enumerate(self.groups.values()) for member in members}
        alike: dict[object, list[Subtask]] = defaultdict(list)
        for s in self.subtasks:
            waiting = frozenset(s.after), frozenset(followers[s.name])
            alike[s.goals, s.then, waiting, group_of.get(s.name), s.agents].append(s)
        index = {s.name: i for i, members in enumerate(alike.values()) for s in members}
        return [
            SubtaskClass(
                goals=first.goals,
                then=first.then,
                count=sum(s.count for s in members),
                predecessors=tuple(sorted({index[name] for name in first.after})),
                group=group_of.get(first.name),
                agents=first.agents,
            )
            for members in alike.values()
            for first in members[:1]
        ]

    # -- properties, stages and sequences ------------------------------------------------------------------------------

    @property
    def states(self) -> StateSpace:
        """All states of the task, for programs that play it: what may follow what."""
        return self._space

    @property
    def num_sequences(self) -> int:
        """Exact number of valid sequences."""
        return self._space.num_sequences

    @property
    def num_states(self) -> int:
        """Number of task states (subtasks done, place of the person) that lie on some valid sequence."""
        return self._space.num_states

    @property
    def length(self) -> int:
        """Number of subtasks in every valid sequence, copies counted, whoever performs them."""
        return sum(s.count for s in self.subtasks)

    @property
    def num_choices(self) -> int:
        """Number of the person's steps in every valid sequence: how often they choose what to do next."""
        return sum(s.count for s in self.subtasks_of(HUMAN))

    @property
    def goals(self) -> tuple[str, ...]:
        """All goals of the task, sorted by name."""
        return tuple(sorted({goal for s in self.subtasks for goal in s.goals}))

    @property
    def places(self) -> tuple[str, ...]:
        """Every place the task names: the start, goals, and places passed afterwards; sorted by name."""
        passed = {place for s in self.subtasks for place in s.then}
        return tuple(sorted(passed | {self.start} | set(self.goals)))

    def subtasks_of(self, agent: str) -> tuple[Subtask, ...]:
        """Subtasks that an agent, ``"human"`` or ``"robot"``, can perform."""
        choice("agent", agent, AGENTS, error=TaskError)
        return tuple(s for s in self.subtasks if agent in s.agents)

    def reserved_for(self, agent: str) -> tuple[Subtask, ...]:
        """Subtasks that nobody but an agent, ``"human"`` or ``"robot"``, can perform."""
        return tuple(s for s in self.subtasks_of(agent) if len(s.agents) == 1)

    def goals_of(self, agent: str) -> tuple[str, ...]:
        """Goals of the subtasks that an agent can perform, sorted by name."""
        return tuple(sorted({goal for s in self.subtasks_of(agent) for goal in s.goals}))

    def places_of(self, agent: str) -> tuple[str, ...]:
        """Places that an agent may have to get to: of the subtasks it can perform, and the start if it is the person's.

        Sorted by name.
        """
        passed = {place for s in self.subtasks_of(agent) for place in s.then}
        return tuple(sorted(passed | set(self.goals_of(agent)) | ({self.start} if agent == HUMAN else set())))

    def stages(self) -> tuple[Stage, ...]:
        """All distinct stages with their exact expected visits; weights sum to :attr:`num_choices`."""
        weights: dict[tuple[str, tuple[str, ...]], list[float]] = defaultdict(list)
        for t in self._transitions:
            weights[t.start, t.goals].append(t.weight)
        return tuple(Stage(start, goals, math.fsum(w)) for (start, goals), w in weights.items())

    def transitions(self) -> tuple[Transition, ...]:
        """All distinct transitions (stage, next goal, places afterwards) with their expected number."""
        return self._transitions

    @cached_property
    def _transitions(self) -> tuple[Transition, ...]:
        return tuple(Transition(*key, weight) for key, weight in sorted(self._space.transition_weights().items()))

    def sample(self, rng: np.random.Generator) -> tuple[Transition, ...]:
        """One uniformly random valid sequence, as the person's transitions in it; each weighs 1."""
        return tuple(Transition(*step, 1.0) for step in self._space.sample(rng))

    def legs(self) -> dict[tuple[str, str], float]:
        """Expected number of the person's legs from each place to each other place in a random valid sequence."""
        legs: dict[tuple[str, str], float] = defaultdict(float)
        for t in self._transitions:
            stops = (t.start, t.goal, *t.then)
            for a, b in itertools.pairwise(stops):
                legs[a, b] += t.weight
        return dict(legs)

    # -- in and out ----------------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Plain data that :meth:`from_dict` reads back; the structure of the YAML files."""
        subtasks = []
        for s in self.subtasks:
            entry: dict[str, Any] = {"name": s.name, "goals": list(s.goals)}
            if s.after:
                entry["after"] = list(s.after)
            if s.then:
                entry["then"] = list(s.then)
            if s.count != 1:
                entry["count"] = s.count
            if s.agents != AGENTS:
                entry["agents"] = list(s.agents)
            subtasks.append(entry)
        data: dict[str, Any] = {"start": self.start, "subtasks": subtasks}
        if self.groups:
            data["groups"] = {name: list(members) for name, members in self.groups.items()}
        if self.max_open is not None:
            data["max_open"] = self.max_open
        return data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TaskGraph:
        """Build a task from plain data.

        Args:
            data: Keys ``start``, ``subtasks`` (a list of mappings with the fields of :class:`Subtask`), and optionally
                ``groups`` and ``max_open``. A single name may stand for a list of one.

        Raises:
            TaskError: A missing or unknown key, or anything :class:`TaskGraph` rejects.
        """
        from legible_envs.support.models import as_plain, validated
        from legible_envs.task_files import TaskContent

        try:
            content = validated(TaskContent, as_plain(data), "the task")
            subtasks = [
                Subtask(
                    entry.name,
                    tuple(entry.goals),
                    tuple(entry.after),
                    tuple(entry.then),
                    entry.count,
                    tuple(entry.agents),
                )
                for entry in content.subtasks
            ]
            return cls(subtasks, content.start, content.groups, content.max_open)
        except ValueError as error:
            raise TaskError(str(error)) from error

    def to_yaml(self, path: str | Path | None = None) -> str:
        """Return the task as YAML text, and write it to ``path`` if given."""
        text = dump_yaml(self.to_dict())
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    @classmethod
    def from_yaml(cls, source: str | Path) -> TaskGraph:
        """Read a task from a YAML file (a ``Path``, or a string naming a ``.yaml``/``.yml`` file) or from YAML text.

        Raises:
            TaskError: The text is not YAML, or not a task.
            FileNotFoundError: The file does not exist.
        """
        from legible_envs.support.plain_data import parse_yaml

        where = ""
        try:
            text, where = read_source(source, (".yaml", ".yml"))
            return cls.from_dict(parse_yaml(text))
        except ValueError as error:
            raise TaskError(f"{where}{error}") from error

    def to_networkx(self) -> nx.DiGraph:
        """The precedence graph; an edge runs from each subtask to the subtasks that wait for it."""
        import networkx as nx

        graph: nx.DiGraph = nx.DiGraph(start=self.start, max_open=self.max_open)
        group_of = {member: group for group, members in self.groups.items() for member in members}
        for s in self.subtasks:
            group = group_of.get(s.name)
            graph.add_node(s.name, goals=s.goals, then=s.then, count=s.count, agents=s.agents, group=group)
        graph.add_edges_from((before, s.name) for s in self.subtasks for before in s.after)
        return graph
