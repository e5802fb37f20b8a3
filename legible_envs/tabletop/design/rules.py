"""Layouts that a genome of a table can express, and the rules that make a design valid, each with its message."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.tabletop.design.validity_kernels import EDGE, Rules
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import VirtualObstacle, numbers, rectangle, rectangles_overlap
from legible_envs.tabletop.task import TabletopTask

__all__ = ["DesignRules"]

HALF_TURN: Final = math.pi / 2
Floats = npt.NDArray[np.float64]


class DesignRules:
    """The rules of :class:`~legible_envs.tabletop.design.workspace.TabletopWorkspace`, which documents the arguments.

    Attributes:
        task: The task.
        home: The arrangement that objects stay in where the workspace does not move them.
        lower_bounds: ``(d,)`` least value of each gene.
        upper_bounds: ``(d,)`` greatest value of each gene.
        arrays: The same as numbers for the kernels.
    """

    def __init__(
        self,
        task: TabletopTask,
        home: TabletopLayout,
        *,
        moves_objects: bool,
        moves_obstacles: bool,
        max_obstacles: int,
        obstacle_size: tuple[float, float],
        max_detour: float | None,
        start_clearance: float,
        object_clearance: float,
        object_spacing: float,
        obstacles_on_table: bool,
        obstacles_apart: bool,
    ) -> None:
        self.task = task
        self.check_objects(home)
        self.home = home
        self.moves_objects = moves_objects
        self.moves_obstacles = moves_obstacles
        self.max_obstacles = max_obstacles
        self.obstacle_size = obstacle_size
        self.max_detour = math.inf if max_detour is None else max_detour
        self.start_clearance = start_clearance
        self.object_clearance = object_clearance
        self.object_spacing = object_spacing
        self.obstacles_on_table = obstacles_on_table
        self.obstacles_apart = obstacles_apart
        self.movable = [i for i, o in enumerate(task.layout.objects) if o.movable]
        self.slots = [
            (name, at, task.layout.objects[task.layout.index(name)]) for name, at in task.configuration.items()
        ]
        self.lower_bounds, self.upper_bounds = self._bounds()
        self.reaches = self._reaches()
        self.arrays = self._arrays()

    def _bounds(self) -> tuple[Floats, Floats]:
        x0, y0, x1, y1 = self.task.layout.table.region
        width, depth = self.task.layout.table.size
        lower, upper = [x0, y0] * len(self.movable), [x1, y1] * len(self.movable)
        if not self.moves_objects:
            lower = upper = [x for i in self.movable for x in self.home.objects[i].at]
        if self.moves_obstacles:
            lower = [*lower, *[0.0, 0.0, 0.0, -HALF_TURN] * self.max_obstacles]
            upper = [*upper, *[1.0, width, depth, HALF_TURN] * self.max_obstacles]
        else:
            lower, upper = ([*ends, *[0.0] * 4 * self.max_obstacles] for ends in (lower, upper))
        bounds = np.array(lower), np.array(upper)
        for array in bounds:
            array.setflags(write=False)
        return bounds

    def _reaches(self) -> dict[tuple[str, str], float]:
        """``(start, goal)`` of every reach of the task, and its share of all."""
        reaches: dict[tuple[str, str], float] = {}
        for transition in self.task.graph.transitions():
            key = transition.start, transition.goal
            reaches[key] = reaches.get(key, 0.0) + transition.weight
        total = math.fsum(reaches.values())
        return {key: weight / total for key, weight in reaches.items()}

    def _arrays(self) -> Rules:
        layout = self.task.layout
        places = layout.place_names
        length, width = self.obstacle_size
        return Rules(
            template=layout.points,
            movable=np.array(self.movable, dtype=np.int64),
            fixed=np.array([not (o.movable and self.moves_objects) for o in layout.objects]),
            shapes=np.array([_shape(o.angle, *o.size) for o in layout.objects]),
            lower=self.lower_bounds,
            upper=self.upper_bounds,
            size=layout.table.size,
            hand=layout.table.hand,
            obstacle=(length / 2, width / 2),
            max_detour=self.max_detour,
            start_clearance=self.start_clearance,
            object_clearance=self.object_clearance,
            object_spacing=self.object_spacing,
            on_table=self.obstacles_on_table,
            apart=self.obstacles_apart,
            slots=np.array([(*at, *_shape(o.angle, *o.size)) for _, at, o in self.slots]).reshape(-1, 6),
            reach_from=np.array([places.index(start) for start, _ in self.reaches], dtype=np.int64),
            reach_to=np.array([places.index(goal) for _, goal in self.reaches], dtype=np.int64),
            reach_weight=np.array(list(self.reaches.values())),
        )

    # -- genomes and layouts -------------------------------------------------------------------------------------------

    def decode(self, genome: npt.NDArray[Any]) -> TabletopLayout:
        """The layout of a ``(d,)`` genome.

        Raises:
            LayoutError: It breaks a rule; the message names gene or object, rule and numbers.
        """
        layout = self.task.layout.with_genome(genome, self.max_obstacles, self.obstacle_size)
        genome = np.asarray(genome, dtype=np.float64)
        bad = np.flatnonzero(~((genome >= self.lower_bounds) & (genome <= self.upper_bounds)))
        if len(bad):
            i = int(bad[0])
            raise LayoutError(
                f"gene {i} ({self._gene(i)}) is {float(genome[i])!r}; expected {self.lower_bounds[i]:g} to "
                f"{self.upper_bounds[i]:g}",
                rule="range",
            )
        self.check(layout)
        return layout

    def _gene(self, i: int) -> str:
        if i < 2 * len(self.movable):
            return f"{'xy'[i % 2]} of {self.task.layout.objects[self.movable[i // 2]].name!r}"
        number, part = divmod(i - 2 * len(self.movable), 4)
        return f"{('active', 'x', 'y', 'angle')[part]} of obstacle place {number + 1}"

    def encode(self, layout: TabletopLayout) -> Floats:
        """The ``(d,)`` genome of a layout; an obstacle's angle is written in [-pi/2, pi/2], which looks the same.

        Raises:
            LayoutError: The layout breaks a rule or cannot be written as a genome.
        """
        self.check_objects(layout)
        turned = [VirtualObstacle(o.at, o.angle - math.pi * round(o.angle / math.pi), o.size) for o in layout.obstacles]
        genome = layout.with_obstacles(turned).to_genome(self.max_obstacles, self.obstacle_size)
        near = np.clip(genome, self.lower_bounds, self.upper_bounds)
        genome = np.where(np.abs(near - genome) <= EDGE, near, genome)
        self.decode(genome)
        return genome

    def check_objects(self, layout: TabletopLayout) -> None:
        """Whether a layout has the table and the objects of the task, movable ones anywhere.

        Raises:
            LayoutError: It has not; the message says which differs.
        """
        ours = self.task.layout
        if layout.table != ours.table:
            raise LayoutError(f"the layout has another table than task {self.task.name!r}", rule="table")
        if layout.goals != ours.goals:
            raise LayoutError(
                f"task {self.task.name!r} is about {list(ours.goals)}, the layout has {list(layout.goals)}",
                rule="object",
            )
        for mine, other in zip(ours.objects, layout.objects, strict=True):
            for attribute in ("size", "angle", "movable", *([] if mine.movable else ["at"])):
                expected, got = getattr(mine, attribute), getattr(other, attribute)
                if expected != got:
                    raise LayoutError(
                        f"{mine.name} has `{attribute}` {got!r}; in task {self.task.name!r} it is {expected!r}",
                        rule="object",
                    )

    # -- rules ---------------------------------------------------------------------------------------------------------

    def check(self, layout: TabletopLayout) -> None:
        """Check every rule of a layout of this task.

        Raises:
            LayoutError: ``rule`` is one of :meth:`~legible_envs.tabletop.layout.TabletopLayout.validate`, or
                ``"object-spacing"``, ``"obstacle-off-table"``, ``"start-clearance"``, ``"object-clearance"``,
                ``"slot"`` (an obstacle over a place of the desired configuration, or no path there),
                ``"obstacle-apart"`` or ``"detour"``.
        """
        layout.validate()
        self._check_spacing(layout)
        for number, obstacle in enumerate(layout.obstacles, 1):
            self._check_obstacle(layout, number, obstacle)
        if layout.obstacles:
            self._check_slots(layout)
            self._check_detours(layout)

    def _check_spacing(self, layout: TabletopLayout) -> None:
        for i, a in enumerate(layout.objects):
            for b in layout.objects[:i]:
                stay = not self.moves_objects or not (a.movable or b.movable)
                if not stay and math.dist(a.at, b.at) < self.object_spacing - EDGE:
                    raise LayoutError(
                        f"{b.name} and {a.name} are {math.dist(a.at, b.at):.4g} m apart; object_spacing is "
                        f"{self.object_spacing:g} m",
                        rule="object-spacing",
                    )

    def _check_obstacle(self, layout: TabletopLayout, number: int, obstacle: VirtualObstacle) -> None:
        corners, what = obstacle.corners, f"obstacle {number} at {obstacle.at}"
        width, depth = layout.table.size
        if self.obstacles_on_table and ((corners < -EDGE) | (corners > np.array([width, depth]) + EDGE)).any():
            raise LayoutError(
                f"{what} sticks out of the table of {width:g} x {depth:g} m (obstacles_on_table)",
                rule="obstacle-off-table",
            )
        places = [("start-clearance", self.start_clearance, name, at) for name, at in layout.table.starts.items()]
        places += [("object-clearance", self.object_clearance, o.name, o.at) for o in layout.objects]
        places += [("slot", self.object_clearance, f"the slot of {name}", at) for name, at, _ in self.slots]
        for rule, clearance, name, at in places:
            distance = _distance(obstacle, at)
            if distance < clearance - EDGE:
                raise LayoutError(
                    f"{what} is {distance:.4g} m from {name} at {at}; at least {clearance:g} m are needed", rule=rule
                )
        for name, at, placed in self.slots:
            if rectangles_overlap(corners, rectangle(*at, placed.angle, *placed.size)):
                raise LayoutError(f"{what} lies over the slot of {name} at {at}", rule="slot")
        for other_number, other in enumerate(layout.obstacles[: number - 1], 1):
            if self.obstacles_apart and not _apart(corners, other.corners):
                raise LayoutError(
                    f"obstacle {other_number} at {other.at} and {what} cross or touch (obstacles_apart)",
                    rule="obstacle-apart",
                )

    def _check_slots(self, layout: TabletopLayout) -> None:
        for name, at, _ in self.slots:
            if np.isinf(layout.paths.lengths([at])[0, 0]):
                raise LayoutError(f"the slot of {name} at {at} cannot be reached", rule="slot")

    def _check_detours(self, layout: TabletopLayout) -> None:
        starts = sorted({start for start, _ in self.reaches})
        lengths = dict(zip(starts, layout.paths.lengths([layout.place(s) for s in starts]), strict=True))
        for start, goal in self.reaches:
            straight = math.dist(layout.place(start), layout.place(goal))
            length = lengths[start][layout.index(goal)]
            if length > (self.max_detour + EDGE) * straight:
                raise LayoutError(
                    f"the path from {start} to {goal} is {length / straight:.3g} x its straight line; max_detour is "
                    f"{self.max_detour:g}",
                    rule="detour",
                )

    def settings(self) -> dict[str, Any]:
        """The rules as JSON-ready data."""
        return {
            "max_obstacles": self.max_obstacles,
            "obstacle_size": list(self.obstacle_size),
            "max_detour": None if math.isinf(self.max_detour) else self.max_detour,
            "start_clearance": self.start_clearance,
            "object_clearance": self.object_clearance,
            "object_spacing": self.object_spacing,
            "obstacles_on_table": self.obstacles_on_table,
            "obstacles_apart": self.obstacles_apart,
        }


def _shape(angle: float, length: float, width: float) -> tuple[float, float, float, float]:
    return math.cos(angle), math.sin(angle), length / 2, width / 2


def _distance(obstacle: VirtualObstacle, at: Sequence[float]) -> float:
    """Metres from a point to an obstacle's rectangle; 0 inside."""
    x, y = numbers(at, 2, "a point")
    dx, dy = x - obstacle.at[0], y - obstacle.at[1]
    cos, sin = math.cos(obstacle.angle), math.sin(obstacle.angle)
    u = abs(dx * cos + dy * sin) - obstacle.size[0] / 2
    v = abs(dy * cos - dx * sin) - obstacle.size[1] / 2
    return math.hypot(max(u, 0.0), max(v, 0.0))


def _apart(a: Floats, b: Floats) -> bool:
    """Whether two ``(4, 2)`` rectangles neither overlap nor touch, up to 1e-9 m."""
    for corners in (a, b):
        for edge in (corners[1] - corners[0], corners[3] - corners[0]):
            axis = edge / np.hypot(*edge)
            p, q = a @ axis, b @ axis
            if max(p.min(), q.min()) - min(p.max(), q.max()) > EDGE:
                return True
    return False
