"""A small kinematic table without physics: a hand that goes straight, and a robot, building a task together."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from legible_envs.partner.fluency import TeamMetrics, Tick, tick_of
from legible_envs.tabletop import TabletopLayout, TabletopTask
from legible_envs.tabletop.partner.interface import Command, Senses
from legible_envs.tabletop.partner.robot import RobotPartner

RATE = 30.0


@dataclass
class Team:
    """One episode. The person takes valid objects in an order of their own, and waits where there is none.

    ``deaf`` people go on to an object that the robot takes on their way; others choose another one.
    """

    robot: RobotPartner
    task: TabletopTask
    layout: TabletopLayout | None = None
    seed: int = 0
    hand_speed: float = 0.6
    idle: bool = False
    thinking: float = 0.2
    log: list[tuple[Senses, Command]] = field(default_factory=list)
    ticks: list[Tick] = field(default_factory=list)
    metrics: TeamMetrics = field(default_factory=TeamMetrics)

    def __post_init__(self):
        self.layout = self.layout or self.task.layout
        self.rng = np.random.default_rng(self.seed)
        self.names = self.layout.goals
        self.positions = self.layout.centres.copy()
        self.done: list[str] = []
        self.placed_by: dict[str, str] = {}
        self.hand = np.array(self.layout.place(self.task.graph.start))
        self.gripper = self.robot.reset(self.layout, self.task, np.random.default_rng(0))
        self.held: str | None = None
        self.caught: str | None = None
        self.time = 0.0
        self.goal: str | None = None
        self.rest = 0.0
        self.reach: list[np.ndarray] = []
        self.times: list[float] = []
        self.number = 0
        self.start = self.hand.copy()

    # -- the rules -----------------------------------------------------------------------------------------------------

    def valid(self):
        """Objects whose turn it is and that lie free."""
        states = self.task.graph.states
        done = tuple(sum(goal in self.done for goal in cls.goals) for cls in states.classes)
        ready = {goal for i in states.ready(done) for goal in states.classes[i].goals}
        return tuple(n for n in self.names if n in ready and n not in (*self.done, self.held, self.caught))

    def senses(self):
        free = self.valid()
        return Senses(
            time=self.time,
            hand=self.hand.copy(),
            reach=np.array(self.reach).reshape(-1, 2),
            times=np.array(self.times),
            reach_number=self.number,
            start=self.start.copy(),
            goals=() if self.held else free,
            free=free,
            positions=self.positions.copy(),
            person_holding=self.held,
            gripper=self.gripper.copy(),
            holding=self.caught,
        )

    @property
    def finished(self):
        return len(self.done) == len(self.names)

    # -- one thirtieth of a second -------------------------------------------------------------------------------------

    def step(self):
        senses = self.senses()
        command = self.robot.step(senses)
        self.log.append((senses, command))
        before = self.hand.copy()
        self.move_person()
        active = not np.array_equal(before, self.hand) or self.held is not None
        tick = tick_of(senses, command, active)
        self.ticks.append(tick)
        self.metrics.add(tick)
        self.move_robot(command)
        self.time += 1 / RATE
        if self.number and not self.held:
            self.reach.append(self.hand.copy())
            self.times.append(self.time)

    def move_person(self):
        if self.idle:
            return
        if self.held:
            if self.go(np.array(self.task.configuration[self.held])):
                self.put(self.held, "person")
                self.held, self.rest = None, self.thinking
            return
        self.rest -= 1 / RATE
        if self.rest > 0:
            return
        valid = self.valid()
        if self.goal not in valid:
            self.goal = str(self.rng.choice(valid)) if valid else None
            if self.goal:
                self.number += 1
                self.start = self.hand.copy()
                self.reach, self.times = [self.hand.copy()], [self.time]
        if self.goal and self.go(self.positions[self.names.index(self.goal)]):
            self.held, self.goal = self.goal, None

    def go(self, there):
        offset = there - self.hand
        distance = float(np.hypot(*offset))
        step = self.hand_speed / RATE
        self.hand = there.copy() if distance <= step else self.hand + offset / distance * step
        return distance <= step

    def move_robot(self, command):
        if command.grasp is not None:
            assert self.caught is None
            at = self.positions[self.names.index(command.grasp)]
            if command.grasp in self.valid() and math.dist(at, self.gripper) < 0.02:
                self.caught = command.grasp
        if command.release and self.caught:
            assert math.dist(self.task.configuration[self.caught], self.gripper) < 0.02
            self.put(self.caught, "robot")
            self.caught = None
        self.gripper = self.gripper + command.velocity / RATE

    def put(self, name, who):
        self.positions[self.names.index(name)] = self.task.configuration[name]
        self.done.append(name)
        self.placed_by[name] = who

    def play(self, seconds=120.0):
        while not self.finished and self.time < seconds:
            self.step()
        if self.finished:
            self.metrics.complete(self.time)
        return self
