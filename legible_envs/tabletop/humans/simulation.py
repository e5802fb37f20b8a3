"""Simulated people at tables: single reaches, and whole task executions.

A person follows the shortest path of the hand the way people reach, see :mod:`legible_envs.tabletop.humans.model`; one
who ignores virtual obstacles reaches as if they were absent.

>>> import numpy as np
>>> from legible_envs.tabletop import TabletopTask
>>> task = TabletopTask.named("columns")
>>> reaches = simulate_participants(task, task.layout, 2, np.random.default_rng(0))
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
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.humans.kernels import LEG, miss_goal, path_length, sample_reach, trace_path
from legible_envs.tabletop.humans.model import Person, ReachModel
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import CUBE, Point, point
from legible_envs.tabletop.task import TabletopTask

__all__ = [
    "Person",
    "ReachModel",
    "plan_reach",
    "sample_person",
    "simulate_participants",
    "simulate_reach",
    "simulate_task",
]

Floats = npt.NDArray[np.float64]

_NO_BOXES: Final = np.empty((0, 6))
_FARTHEST_BOW: Final = 0.5


@dataclass(frozen=True, eq=False)
class Surface:
    """What a hand moves over: obstacles, the table's edges, and the ways found so far."""

    layout: TabletopLayout | None
    ways: dict[tuple[object, ...], Floats] = field(default_factory=dict)

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
        """How wide what is reached for is: the shorter side of an object, a cube's otherwise."""
        if self.layout is not None and isinstance(goal, str) and goal in self.layout.goals:
            return min(self.layout.objects[self.layout.index(goal)].size)
        return CUBE

    def way(self, start: Point, goal: str | Point, crossing: bool) -> Floats:
        """``(j, 2)`` the shortest path, straight for those who cross obstacles."""
        key = (start, goal, crossing)
        if key not in self.ways:
            self.ways[key] = self._find_way(start, goal, crossing)
        return self.ways[key]

    def _find_way(self, start: Point, goal: str | Point, crossing: bool) -> Floats:
        if crossing or self.layout is None or not self.layout.obstacles:
            return np.array([start, self.place(goal, "the goal")])
        paths = self.layout.paths
        first = paths.nearest_free([start])[0]
        if isinstance(goal, str) and goal in self.layout.goals:
            return paths.polyline(first, goal)
        rows = [(*o.at, o.angle, *o.size) for o in self.layout.obstacles]
        target = paths.nearest_free([self.place(goal, "the goal")])
        return ShortestPaths(target, rows, self.hand, self.layout.table.size).polyline(first, 0)


def sample_person(rng: np.random.Generator, model: ReachModel | None = None) -> Person:
    """A random person of a population, the default one if None."""
    return (model or ReachModel()).sample_person(rng)


def plan_reach(
    layout: TabletopLayout | None,
    start: str | npt.ArrayLike,
    goal: str | npt.ArrayLike,
    person: Person,
    rng: np.random.Generator,
) -> tuple[Floats, float]:
    """What a person means to do: the way of one reach, and how long it shall take.

    Args:
        layout: The table; None for open space, where start and goal are points.
        start: Name of a start or object, or a point ``(x, y)``. One inside a grown obstacle is left from the nearest
            free point.
        goal: The same. Where it ends is off by ``person.endpoint_sd``, as far as there is room.
        person: Who reaches.
        rng: Source of randomness.

    Returns:
        ``(k, 2)`` points of a smooth way, and seconds.

    Raises:
        LayoutError: Unknown places, or no way.
    """
    surface = Surface(layout)
    intent = _intend(surface, start, goal, person, rng)
    return _trace(surface, intent, person, rng), intent.duration


def simulate_reach(
    layout: TabletopLayout | None,
    start: str | npt.ArrayLike,
    goal: str | npt.ArrayLike,
    person: Person,
    rng: np.random.Generator,
    rate: float = 30.0,
) -> tuple[Floats, Floats]:
    """One reach.

    Nothing of the goal shows in the first sample: where it lies depends on the start alone.

    Args:
        layout: See :func:`plan_reach`.
        start: See :func:`plan_reach`.
        goal: See :func:`plan_reach`.
        person: Who reaches. Unless they cross obstacles, they never lead their hand's centre through one as it is
            drawn; into the margin by which it is grown, noise and rounded corners sometimes do.
        rng: Source of randomness.
        rate: Samples per second.

    Returns:
        ``(T,)`` seconds from 0, and ``(T, 2)`` positions in metres; ``T >= 3``.

    Raises:
        LayoutError: Unknown places, or no way.
        ValueError: A rate out of range.

    Example:
        >>> import numpy as np
        >>> times, states = simulate_reach(None, (0, 0), (0.3, 0.4), Person(), np.random.default_rng(0))
        >>> states.shape, states[-1].round(1).tolist()
        ((23, 2), [0.3, 0.4])
    """
    return _reach(Surface(layout), start, goal, person, rng, _checked_rate(rate))


def simulate_task(
    task: TabletopTask,
    layout: TabletopLayout,
    person: Person,
    rng: np.random.Generator,
    *,
    rate: float = 30.0,
    participant: str = "person",
    condition: str = "simulated",
    layout_name: str = "",
) -> list[Trajectory]:
    """The reaches of a person who does a whole task once, in a uniformly random valid sequence.

    Each stage of the task (start, valid goals) gives a trajectory, with the valid goals as candidates (candidate set
    ``task``). Grasping, carrying and letting go take their time and give none.

    Args:
        task: What to do.
        layout: The table, with the objects of the task.
        person: Who does it.
        rng: Source of all randomness.
        rate: Samples per second.
        participant: Of all trajectories.
        condition: Of all trajectories.
        layout_name: Of all trajectories.

    Raises:
        LayoutError: The task cannot be done on this table.
        ValueError: A rate out of range.
    """
    labels = {"participant": participant, "condition": condition, "layout_name": layout_name}
    return _execute(task, Surface(layout), person, 0.0, rng, _checked_rate(rate), labels)[0]


def simulate_participants(
    task: TabletopTask,
    layout: TabletopLayout,
    n: int,
    rng: np.random.Generator,
    *,
    model: ReachModel | None = None,
    executions: int = 1,
    rate: float = 30.0,
    participant: str = "person",
    condition: str = "simulated",
    layout_name: str = "",
) -> list[Trajectory]:
    """The reaches of ``n`` people, drawn from a population, who each do a whole task.

    Args:
        task: What to do.
        layout: The table, with the objects of the task.
        n: Number of people.
        rng: Source of all randomness.
        model: The population; the default one if None.
        executions: How often each person does the task.
        rate: Samples per second.
        participant: Names are ``"{participant}/0"``, ``"{participant}/1"``, ….
        condition: Of all trajectories.
        layout_name: Of all trajectories.

    Raises:
        LayoutError: The task cannot be done on this table.
        ValueError: A number out of range.
    """
    for name, value in (("n", n), ("executions", executions)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
            raise ValueError(f"{name} must be an integer >= 0, got {value!r}")
    rate, surface = _checked_rate(rate), Surface(layout)
    found: list[Trajectory] = []
    for number in range(n):
        person, clock = sample_person(rng, model), 0.0
        labels = {"participant": f"{participant}/{number}", "condition": condition, "layout_name": layout_name}
        for _ in range(executions):
            reaches, clock = _execute(task, surface, person, clock, rng, rate, labels)
            found += reaches
    return found


def _execute(
    task: TabletopTask,
    surface: Surface,
    person: Person,
    clock: float,
    rng: np.random.Generator,
    rate: float,
    labels: dict[str, Any],
) -> tuple[list[Trajectory], float]:
    """One task execution: its trajectories, and the time at its end."""
    layout = surface.layout
    assert layout is not None
    _check_objects(task, layout)
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
    return found, clock


class _Intent(NamedTuple):
    """What a person decides before setting out.

    Attributes:
        start: Where from.
        corners: ``(j, 2)`` the shortest path to the goal.
        boxes: ``(m, 6)`` grown obstacles that count for this reach; none for one who crosses.
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
    corners = surface.way(first, target, crossing)
    duration = person.duration(float(path_length(corners)), surface.width(goal), len(corners) - 2)
    boxes = _NO_BOXES if crossing or surface.layout is None else surface.layout.paths.boxes
    return _Intent(first, corners, boxes, duration * math.exp(person.duration_trial * rng.standard_normal()))


def _trace(surface: Surface, intent: _Intent, person: Person, rng: np.random.Generator) -> Floats:
    """``(k, 2)`` the way a hand takes along the shortest path."""
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
) -> tuple[Floats, Floats]:
    """See :func:`simulate_reach`."""
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
    return np.arange(count) / rate, states


def _checked_rate(rate: float) -> float:
    if isinstance(rate, bool) or not isinstance(rate, int | float | np.number) or not 0 < rate < math.inf:
        raise ValueError(f"rate must be a finite number of samples per second above 0, got {rate!r}")
    return float(rate)


def _check_objects(task: TabletopTask, layout: TabletopLayout) -> None:
    known = {*layout.goals, *layout.table.starts}
    missing = [place for place in task.graph.places if place not in known]
    if missing:
        raise LayoutError(
            f"task {task.name!r} needs {missing}, which this layout lacks; it has {sorted(known)}", rule="object"
        )
