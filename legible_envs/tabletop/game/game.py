"""The rules of a table in play: a hand moves, pushes, takes, carries and places objects."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.tabletop.game.contact_kernels import TOLERANCE, TOUCH
from legible_envs.tabletop.game.physics import TablePhysics
from legible_envs.tabletop.game.progress import Delivery, TaskProgress
from legible_envs.tabletop.game.reach_log import ReachLog
from legible_envs.tabletop.game.view import STATUSES
from legible_envs.tabletop.geometry.motion_kernels import count_entered, slide, touch_distances
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.objects import rectangle, rectangles_overlap
from legible_envs.tabletop.task import TabletopTask

__all__ = ["CONTACTS", "RATE", "GameRules", "TableGame"]

Floats = npt.NDArray[np.float64]

RATE: Final = 30
DT: Final = 1.0 / RATE
CONTACTS: Final = ("slow", "always", "never")

FREE, HAND, ROBOT, PLACED = range(4)
_NO_BOXES: Final = np.empty((0, 6))
_EDGE: Final = 1e-9


@dataclass(frozen=True, slots=True)
class GameRules:
    """The options of the game; :class:`~legible_envs.tabletop.env.TabletopEnv` documents them."""

    virtual_obstacles: Literal["hard", "soft"] = "hard"
    contact: Literal["slow", "always", "never"] = "slow"
    max_speed: float = 3.0
    slow_speed: float = 0.2
    grasp_distance: float = 0.03
    release_distance: float = 0.05


class TableGame:
    """One table in play.

    Args:
        task: The task.
        rules: The options of the game.

    Attributes:
        progress: Subtasks done, and goals that are valid.
        physics: Positions of the objects.
        reaches: The path of the hand.
        hand: ``(x, y)`` in metres.
        velocity: ``(x, y)`` in m/s, of the last step.
        is_low: Whether the hand is at the height of the objects.
        holding: Index of the object in the hand, or -1.
        delivery: Where that belongs, or None.
        status: ``(n,)`` int, 0 to 3: free, in the hand, in the gripper, placed.
        goal: The person's goal, where it was set.
        time: Seconds since the episode began.
        path_length: Metres the hand has moved.
        crossings: Virtual obstacles crossed.
    """

    def __init__(self, task: TabletopTask, rules: GameRules) -> None:
        self.task = task
        self.rules = rules
        self.progress = TaskProgress(task)
        self.reaches = ReachLog()
        names = task.layout.goals
        self.index = {name: i for i, name in enumerate(names)}
        self.names = names
        self._loose = np.array([self.progress.carries(name) for name in names])
        self._half_sizes = np.array([obj.size for obj in task.layout.objects]) / 2
        self._distances = np.empty(len(names))
        self.begin(task.layout, task.layout.place(task.graph.start), task.graph.start)

    def begin(self, layout: TabletopLayout, at: tuple[float, float], start: str, goal: str | None = None) -> None:
        """Start an episode with the hand at a point, called by a name."""
        self.layout = layout
        paths = layout.paths
        self._size = paths.size
        self._grown = paths.boxes if self.rules.virtual_obstacles == "hard" else _NO_BOXES
        drawn = paths.boxes.copy()
        drawn[:, 4:] -= layout.table.hand
        self._drawn = drawn if self.rules.virtual_obstacles == "soft" else _NO_BOXES
        self._radius = layout.table.hand
        self.physics = TablePhysics(layout, self._radius, DT, self._loose)
        self.progress.restart()
        self.progress.place = start
        self.hand = (float(at[0]), float(at[1]))
        self.velocity = (0.0, 0.0)
        self.is_low = False
        self.holding = -1
        self.delivery: Delivery | None = None
        self.status = np.zeros(len(self.names), dtype=np.int64)
        self.goal = goal
        self.steps = 0
        self.path_length = 0.0
        self.crossings = 0
        self._robot_delivery: Delivery | None = None
        self.reaches.clear()
        self.reaches.begin(np.array(self.hand), 0.0)
        self._look()

    # -- state --------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Seconds since the episode began."""
        return self.steps * DT

    @property
    def speed(self) -> float:
        """Of the hand in the last step, m/s."""
        return math.hypot(*self.velocity)

    @property
    def positions(self) -> Floats:
        """``(n, 2)`` where the objects are; not a copy."""
        return self.physics.positions

    @property
    def goals(self) -> tuple[str, ...]:
        """Objects that the person may validly reach for now; none while they carry one to a given place."""
        if self.delivery is not None and self.delivery.kind != "goal":
            return ()
        wanted = "touch" if self.delivery is not None else None
        return tuple(
            name
            for name, delivery in self.progress.goals.items()
            if self.status[self.index[name]] == FREE and (wanted is None or delivery.kind == wanted)
        )

    @property
    def robot_goals(self) -> tuple[str, ...]:
        """Objects that a robot may validly take now: those that lie free and belong to a point."""
        return tuple(
            name
            for name, delivery in self.progress.robot_goals.items()
            if self.status[self.index[name]] == FREE and delivery.kind == "slot"
        )

    @property
    def robot_holding(self) -> int:
        """Index of the object in the gripper, or -1."""
        return -1 if self._robot_delivery is None else self.index[self._robot_delivery.goal]

    # -- the person ----------------------------------------------------------------------------------------------------

    def move_hand(self, x: float, y: float) -> int:
        """Advance by one tick.

        Args:
            x: Velocity of the hand, m/s.
            y: The same.

        Returns:
            How many subtasks this finished.
        """
        before = self.hand
        speed = math.hypot(x, y)
        if speed > self.rules.max_speed:
            x, y = x * self.rules.max_speed / speed, y * self.rules.max_speed / speed
        hand_x, hand_y, _ = slide(self._grown, self._size, *before, x * DT, y * DT)
        if len(self._drawn):
            self.crossings += count_entered(self._drawn, *before, hand_x, hand_y)
        dx, dy = hand_x - before[0], hand_y - before[1]
        moved = math.hypot(dx, dy)
        self.hand, self.velocity = (hand_x, hand_y), (dx * RATE, dy * RATE)
        self.path_length += moved
        self.steps += 1
        self._set_height(moved * RATE)
        self._push(before, moved)
        if self.holding >= 0:
            self.positions[self.holding] = self.hand
        self._look()
        if self.holding < 0 or (self.delivery is not None and self.delivery.kind == "goal"):
            self.reaches.add(np.array(self.hand), self.time)
        return self._take_or_place() if moved * RATE <= self.rules.slow_speed else 0

    def _set_height(self, speed: float) -> None:
        """A hand comes down beside objects, never onto one, and goes up to carry or to hurry."""
        contact = self.rules.contact
        if self.holding >= 0 or contact == "never" or (contact == "slow" and speed > self.rules.slow_speed):
            self.is_low = False
        elif not self.is_low:
            self.is_low = self._nearest() >= self._radius - TOUCH

    def _push(self, before: tuple[float, float], moved: float) -> None:
        is_near = self.is_low and self._nearest() <= self._radius + moved + 1e-3
        if is_near or not self.physics.is_resting:
            self.is_low = self.physics.advance(before, self.velocity, self.is_low)
        else:
            self.physics.settle()

    def _look(self) -> None:
        """Measure the distances of the objects to the hand, which rises where it would be in one."""
        touch_distances(self.physics.positions, self.physics.angles, self._half_sizes, *self.hand, self._distances)
        self.is_low = self.is_low and self._nearest() >= self._radius - TOLERANCE

    def _nearest(self) -> float:
        """Metres from the hand's centre to the nearest object on the table."""
        return float(self._distances[self.physics.solid].min(initial=np.inf))

    def _take_or_place(self) -> int:
        if self.delivery is not None and self.delivery.kind != "goal":
            return self._place(self.delivery)
        goal = self._touched()
        return 0 if goal is None else self._reached(self.progress.goals[goal])

    def _touched(self) -> str | None:
        """The valid goal that the hand touches, the nearest if several."""
        best, found = (self.rules.grasp_distance, math.inf), None
        for name in self.goals if self._distances.min() <= self.rules.grasp_distance else ():
            i = self.index[name]
            there = self._distances[i], math.dist(self.hand, self.positions[i])
            if there <= best and self.goal in (None, name):
                best, found = there, name
        return found

    def _reached(self, delivery: Delivery) -> int:
        goals, i = self.goals, self.index[delivery.goal]
        rows = [self.index[name] for name in goals]
        self.reaches.finish(self.progress.place, delivery.goal, goals, self.positions[rows])
        self.goal = None
        self.progress.begin(delivery)
        if self.delivery is not None:  # the held object stays here, as in a bin
            self.status[self.holding] = PLACED
            self.holding, self.delivery = -1, None
        elif delivery.kind != "touch":
            self.physics.take(i)
            self.status[i] = HAND
            self.holding, self.delivery = i, delivery
            self.positions[i] = self.hand
        if delivery.kind in ("touch", "goal"):
            self._finish(delivery)
            return 1
        return 0

    def _place(self, delivery: Delivery) -> int:
        """Put down the held object if it belongs here."""
        i = self.holding
        if delivery.at is not None:
            if math.dist(self.hand, delivery.at) > self.rules.release_distance:
                return 0
            at, angle = delivery.at, self.task.layout.objects[i].angle
        else:
            at, angle = self.hand, float(self.physics.angles[i])
            if not self._has_room(i, at, angle):
                return 0
        if not self.physics.put(i, at, angle, is_fixed=True):
            return 0
        self.status[i] = PLACED
        self.holding, self.delivery = -1, None
        self._finish(delivery)
        return 1

    def _has_room(self, i: int, at: tuple[float, float], angle: float) -> bool:
        """Whether an object may be put down at a point of the assembly zone, beside those that are fixed."""
        x0, y0, x1, y1 = self.layout.table.assembly
        if not (x0 <= at[0] <= x1 and y0 <= at[1] <= y1):
            return False
        objects, there = self.layout.objects, rectangle(*at, angle, *self.layout.objects[i].size)
        if (there < -_EDGE).any() or (there > np.array(self._size) + _EDGE).any():
            return False
        for j in np.flatnonzero(self.physics.solid & ~self.physics.loose):
            x, y = self.positions[j].tolist()
            if rectangles_overlap(there, rectangle(x, y, float(self.physics.angles[j]), *objects[j].size)):
                return False
        return True

    def _finish(self, delivery: Delivery) -> None:
        self.progress.finish(delivery)
        self.progress.go_on(delivery)
        self.reaches.begin(np.array(self.hand), self.time)
        self._look()

    # -- the robot -----------------------------------------------------------------------------------------------------

    def robot_take(self, name: str) -> bool:
        """Take an object into the gripper; False where the robot may not."""
        if self._robot_delivery is not None or name not in self.robot_goals:
            return False
        self._robot_delivery = self.progress.robot_goals[name]
        self.progress.begin(self._robot_delivery)
        self.physics.take(self.index[name])
        self.status[self.index[name]] = ROBOT
        if self.goal == name:
            self.goal = None
        self._look()
        return True

    def robot_put(self, at: tuple[float, float], near: float) -> int:
        """Open the gripper at a point: the object stays in its place if that is near, else it lies free again.

        The gripper stays closed where the whole table has no room for the object.

        Returns:
            How many subtasks this finished.
        """
        delivery, i = self._robot_delivery, self.robot_holding
        if delivery is None:
            return 0
        assert delivery.at is not None
        is_there = math.dist(at, delivery.at) <= near
        there = (delivery.at, self.task.layout.objects[i].angle) if is_there else (at, float(self.physics.angles[i]))
        if not self.physics.put(i, *there, is_fixed=is_there):
            return 0
        self._robot_delivery = None
        if is_there:
            self.progress.finish(delivery)
        else:
            self.progress.give_up(delivery)
        self.status[i] = PLACED if is_there else FREE
        self._look()
        return int(is_there)

    def carry_along(self, at: tuple[float, float]) -> None:
        """Move the object in the gripper along with it."""
        if self._robot_delivery is not None:
            self.positions[self.robot_holding] = at

    def statuses(self) -> tuple[str, ...]:
        """The status of each object, in words."""
        return tuple(STATUSES[code] for code in self.status)
