"""Simulated participants at tables: single reaches, and whole task executions.

A person follows the shortest path of the hand as :mod:`legible_envs.tabletop.humans.model` describes; a person who
ignores virtual obstacles reaches as if they were absent.

>>> import numpy as np
>>> from legible_envs.tabletop import TabletopTask
>>> task = TabletopTask.named("columns")
>>> reaches = simulate_participants(task.layout, 2, np.random.default_rng(0))
>>> len(reaches), reaches[0].start, len(reaches[0].candidates), len(reaches[4].candidates)
(16, 'home', 4, 4)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.rollouts.counts import check_participants
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import real
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.humans.kernels import LEG, miss_goal, path_length, sample_reach, trace_path
from legible_envs.tabletop.humans.model import Person, ReachModel
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import CUBE, Point, point
from legible_envs.tabletop.task import TabletopTask

__all__ = [
    "Person",
    "ReachModel",
    "ReachPlan",
    "SimulatedReach",
    "plan_reach",
    "sample_person",
    "simulate_participants",
    "simulate_reach",
    "simulate_task",
]

Floats = npt.NDArray[np.float64]

FASTEST_RATE: Final = 10_000.0
"""Samples per second."""
_NO_BOXES: Final = np.empty((0, 6))
_FARTHEST_BOW: Final = 0.5


class _Route(NamedTuple):
    """The inputs of a shortest path."""

    start: Point
    goal: str | Point
    crossing: bool


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface that a hand moves over: obstacles, the table's edges, and the shortest paths found so far."""

    layout: TabletopLayout | None
    paths: dict[_Route, Floats] = field(default_factory=dict)

    @property
    def hand(self) -> float:
        """Half the hand's width; no matter without obstacles."""
        return 0.0 if self.layout is None else self.layout.table.hand

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """``(x0, y0, x1, y1)`` that the hand stays in."""
        return (
            (-math.inf, -math.inf, math.inf, math.inf) if self.layout is None else (0.0, 0.0, *self.layout.table.size)
        )

    def place(self, name: str | npt.ArrayLike, what: str) -> Point:
        """A point as it is, or of a start or object."""
        if not isinstance(name, str):
            return point(name, what)
        if self.layout is None:
            raise LayoutError(f"{what} must be a point where there is no layout, got {name!r}", rule="point")
        return self.layout.place(name)

    def width(self, goal: object) -> float:
        """Width of the goal: the shorter side of an object, a cube's otherwise."""
        if self.layout is not None and isinstance(goal, str) and goal in self.layout.goals:
            return min(self.layout.objects[self.layout.index(goal)].size)
        return CUBE

    def shortest_path(self, start: Point, goal: str | Point, crossing: bool) -> Floats:
        """``(j, 2)`` the shortest path, straight for a person who crosses obstacles."""
        route = _Route(start, goal, crossing)
        if route not in self.paths:
            self.paths[route] = self._find_path(start, goal, crossing)
        return self.paths[route]

    def _find_path(self, start: Point, goal: str | Point, crossing: bool) -> Floats:
        if crossing or self.layout is None or not self.layout.obstacles:
            return np.array([start, self.place(goal, "the goal")])
        paths = self.layout.paths
        first = paths.nearest_free([start])[0]
        if isinstance(goal, str) and goal in self.layout.goals:
            return paths.polyline(first, goal)
        target = paths.nearest_free([self.place(goal, "the goal")])
        return ShortestPaths.of(self.layout, target).polyline(first, 0)


def sample_person(rng: np.random.Generator, population: ReachModel | None = None) -> Person:
    """A random person of a population, the default one if None."""
    return (population or ReachModel()).sample_person(rng)


class ReachPlan(NamedTuple):
    """The plan of one reach.

    Attributes:
        path: ``(k, 2)`` points of a smooth path.
        duration: Seconds.
    """

    path: Floats
    duration: float


class SimulatedReach(NamedTuple):
    """One reach.

    Attributes:
        times: ``(T,)`` seconds from 0; ``T >= 3``.
        states: ``(T, 2)`` positions of the hand in metres.
    """

    times: Floats
    states: Floats


def plan_reach(
    layout: TabletopLayout | None,
    start: str | npt.ArrayLike,
    goal: str | npt.ArrayLike,
    person: Person,
    rng: np.random.Generator,
) -> ReachPlan:
    """Plan one reach: its path, and how long it shall take.

    Args:
        layout: The table; None for open space, where start and goal are points.
        start: Name of a start or object, or a point ``(x, y)``. One inside a grown obstacle is left from the nearest
            free point.
        goal: The same. The reach ends off it by ``person.endpoint_sd``, as far as there is room.
        person: How the person reaches.
        rng: Source of randomness.

    Raises:
        LayoutError: Unknown places, or no path.
    """
    surface = Surface(layout)
    intent = _intend(surface, start, goal, person, rng)
    return ReachPlan(_trace(surface, intent, person, rng), intent.duration)


def simulate_reach(
    layout: TabletopLayout | None,
    start: str | npt.ArrayLike,
    goal: str | npt.ArrayLike,
    person: Person,
    rng: np.random.Generator,
    *,
    rate: float = 30.0,
) -> SimulatedReach:
    """Simulate one reach.

    The first sample does not give the goal away: it depends on the start alone.

    Args:
        layout: The table; None for open space, where start and goal are points.
        start: Name of a start or object, or a point ``(x, y)``. A reach from inside a grown obstacle begins at the
            nearest free point.
        goal: The same. The reach ends off it by ``person.endpoint_sd``, as far as there is room.
        person: How the person reaches. Unless they cross obstacles, the centre of their hand never passes through one
            as it is drawn; noise and rounded corners may lead it into the margin by which obstacles are grown.
        rng: Source of randomness.
        rate: Samples per second.

    Raises:
        LayoutError: Unknown places, or no path.
        ValueError: A rate out of range.

    Example:
        >>> import numpy as np
        >>> times, states = simulate_reach(None, (0, 0), (0.3, 0.4), Person(), np.random.default_rng(0))
        >>> states.shape, states[-1].round(1).tolist()
        ((23, 2), [0.3, 0.4])
    """
    return _reach(Surface(layout), start, goal, person, rng, _checked_rate(rate))


def simulate_task(
    layout: TabletopLayout,
    person: Person,
    rng: np.random.Generator,
    *,
    task: TabletopTask | None = None,
    participant: str = "person",
    condition: str = "simulated",
    layout_name: str = "",
    rate: float = 30.0,
) -> list[Trajectory]:
    """The reaches of a person who does a whole task once, in a uniformly random valid sequence.

    Each stage of the task (start, valid goals) gives a trajectory, with the valid goals as candidates (candidate set
    ``task``). Grasping, carrying and letting go take their time and give no trajectory.

    Args:
        layout: The table, with the objects of the task.
        person: How the person reaches.
        rng: Source of all randomness.
        task: The task; the one of the package that has the layout's objects if None.
        participant: Of all trajectories.
        condition: Of all trajectories.
        layout_name: Of all trajectories.
        rate: Samples per second.

    Raises:
        LayoutError: The task cannot be done on this table, or no task of the package has its objects.
        ValueError: A rate out of range.
    """
    labels = {"participant": participant, "condition": condition, "layout_name": layout_name}
    task, rate = _checked_task(task, layout), _checked_rate(rate)
    return _execute(task, Surface(layout), person, 0.0, rng, rate, labels).reaches


def simulate_participants(
    layout: TabletopLayout,
    n: int,
    rng: np.random.Generator,
    *,
    task: TabletopTask | None = None,
    population: ReachModel | None = None,
    executions: int = 1,
    participant: str = "person",
    condition: str = "simulated",
    layout_name: str = "",
    rate: float = 30.0,
) -> list[Trajectory]:
    """The reaches of ``n`` participants, drawn from a population, who each do a whole task.

    Args:
        layout: The table, with the objects of the task.
        n: Number of participants, at most 100,000.
        rng: Source of all randomness.
        task: The task; the one of the package that has the layout's objects if None.
        population: Participants are drawn from it; the default population if None.
        executions: How often each participant does the task; all together do at most a million.
        participant: Names are ``"{participant}/0"``, ``"{participant}/1"``, ….
        condition: Of all trajectories.
        layout_name: Of all trajectories.
        rate: Samples per second.

    Raises:
        LayoutError: The task cannot be done on this table, or no task of the package has its objects.
        ValueError: A number out of range.
    """
    n, executions = check_participants(n, executions)
    task, rate, surface = _checked_task(task, layout), _checked_rate(rate), Surface(layout)
    found: list[Trajectory] = []
    for number in range(n):
        person, clock = sample_person(rng, population), 0.0
        labels = {"participant": f"{participant}/{number}", "condition": condition, "layout_name": layout_name}
        for _ in range(executions):
            reaches, clock = _execute(task, surface, person, clock, rng, rate, labels)
            found += reaches
    return found


class _Execution(NamedTuple):
    """One task execution: its trajectories, and the time at its end."""

    reaches: list[Trajectory]
    end: float


def _execute(
    task: TabletopTask,
    surface: Surface,
    person: Person,
    clock: float,
    rng: np.random.Generator,
    rate: float,
    labels: dict[str, Any],
) -> _Execution:
    """One task execution that begins at a time."""
    layout = surface.layout
    assert layout is not None
    found = []
    for step in task.graph.sample(rng):
        times, states = _reach(surface, step.start, step.goal, person, rng, rate)
        found.append(
            Trajectory(
                states=states,
                times=clock + times,
                start=step.start,
                goal=step.goal,
                candidates=step.goals,
                layout=layout,
                candidate_set="task",
                goal_positions=tuple(layout.place(goal) for goal in step.goals),
                **labels,
            )
        )
        clock += float(times[-1]) + person.pause
        for before, after in zip((step.goal, *step.then), step.then, strict=False):
            clock += _intend(surface, before, after, person, rng).duration + person.pause
    return _Execution(found, clock)


class _Intent(NamedTuple):
    """The decisions of a person before they set out.

    Attributes:
        start: Point where the reach begins.
        corners: ``(j, 2)`` the shortest path to the goal.
        boxes: ``(m, 6)`` grown obstacles that count for this reach; none for a person who crosses them.
        duration: Seconds.
    """

    start: Point
    corners: Floats
    boxes: Floats
    duration: float


def _intend(
    surface: Surface, start: str | npt.ArrayLike, goal: str | npt.ArrayLike, person: Person, rng: np.random.Generator
) -> _Intent:
    crossing = rng.random() < person.crossing_rate
    first = surface.place(start, "the start")
    target = goal if isinstance(goal, str) else point(goal, "the goal")
    corners = surface.shortest_path(first, target, crossing)
    duration = person.duration(float(path_length(corners)), surface.width(goal), len(corners) - 2)
    boxes = _NO_BOXES if crossing or surface.layout is None else surface.layout.paths.boxes
    return _Intent(first, corners, boxes, duration * math.exp(person.duration_trial * rng.standard_normal()))


def _trace(surface: Surface, intent: _Intent, person: Person, rng: np.random.Generator) -> Floats:
    """``(k, 2)`` the path of the hand along the shortest one."""
    bow, aim, x, y = rng.standard_normal(4).tolist()
    corners = miss_goal(intent.boxes, surface.bounds, intent.corners, person.endpoint_sd * x, person.endpoint_sd * y)
    lean = person.bow_towards(intent.start, (corners[-1, 0], corners[-1, 1])) + person.bow_trial * bow
    path = np.empty(((len(corners) - 1) * LEG + 1, 2))
    trace_path(
        intent.boxes,
        surface.hand,
        surface.bounds,
        corners,
        min(max(lean, -_FARTHEST_BOW), _FARTHEST_BOW),
        min(max(person.aim * aim, -_FARTHEST_BOW), _FARTHEST_BOW),
        person.corner_radius,
        path,
    )
    return path


def _reach(
    surface: Surface,
    start: str | npt.ArrayLike,
    goal: str | npt.ArrayLike,
    person: Person,
    rng: np.random.Generator,
    rate: float,
) -> SimulatedReach:
    """One reach with checked arguments."""
    intent = _intend(surface, start, goal, person, rng)
    path = _trace(surface, intent, person, rng)
    skew = person.skew * math.exp(person.skew_trial * rng.standard_normal())
    count = max(round(intent.duration * rate), 2) + 1
    states = np.empty((count, 2))
    sample_reach(
        intent.boxes,
        surface.hand,
        surface.bounds,
        path,
        skew,
        person.start_sd,
        math.exp(-1.0 / (rate * person.drift_time)),
        person.signal_sd,
        rng.standard_normal((2, count, 2)),
        states,
    )
    return SimulatedReach(np.arange(count) / rate, states)


def _checked_rate(rate: float) -> float:
    return real("rate", rate, 0, FASTEST_RATE, closed="right", unit="samples per second")


def _checked_task(task: TabletopTask | None, layout: TabletopLayout) -> TabletopTask:
    if task is None:
        return TabletopTask.for_layout(layout)
    known = layout.place_names
    missing = [place for place in task.graph.places if place not in known]
    if missing:
        raise LayoutError(
            f"task {task.name!r} needs {missing}, which this layout lacks; it has {sorted(known)}", rule="object"
        )
    return task
