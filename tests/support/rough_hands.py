"""Hands that do their worst on a table, and an oracle of what has happened to it, from corners alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.tabletop import Table, TableObject, TabletopLayout, TabletopTask, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tasks import Subtask, TaskGraph

__all__ = ["SPEEDS", "RoughHand", "Watch", "corners_of", "depths", "rough_table"]

Floats = npt.NDArray[np.float64]

SPEEDS = (0.5, 1.0, 3.0, 10.0, 30.0)
"""Of the hand, in m/s."""
PLANS = ("random", "jerk", "press", "press", "press", "sweep", "still", "work", "circle")


# -- the oracle --------------------------------------------------------------------------------------------------------


def corners_of(positions: Floats, angles: Floats, sizes: Floats) -> Floats:
    """``(n, 4, 2)`` corners of rectangles."""
    cos, sin = np.cos(angles), np.sin(angles)
    along = np.stack([cos, sin], axis=1) * sizes[:, :1] / 2
    across = np.stack([-sin, cos], axis=1) * sizes[:, 1:] / 2
    ends = np.stack([-along - across, along - across, along + across, -along + across], axis=1)
    return positions[:, None] + ends


def depths(first: Floats, second: Floats) -> Floats:
    """``(k,)`` metres that each of ``k`` pairs of rectangles ``(k, 4, 2)`` overlap: the shortest way to part them."""
    best = np.full(len(first), np.inf)
    for owner in (first, second):
        for edge in (owner[:, 1] - owner[:, 0], owner[:, 3] - owner[:, 0]):
            axis = edge / np.hypot(edge[:, 0], edge[:, 1])[:, None]
            a, b = np.einsum("kcd,kd->kc", first, axis), np.einsum("kcd,kd->kc", second, axis)
            best = np.minimum(best, np.minimum(a.max(1) - b.min(1), b.max(1) - a.min(1)))
    return np.maximum(best, 0.0)


class Watch:
    """Looks at a table after every step, and keeps the worst that it saw, in metres.

    Attributes:
        off: How far a corner of an object on the table was off it.
        overlap: How deep a loose object was in another.
        hand: How deep a low hand was in an object.
        pushed: Steps in which an object moved.
        low: Steps in which the hand was low.
    """

    def __init__(self) -> None:
        self.off = self.overlap = self.hand = 0.0
        self.pushed = self.low = self.steps = 0
        self._last = b""

    def __str__(self) -> str:
        return (
            f"{self.steps} steps, {self.pushed} in which an object moved, {self.low} with a low hand; at worst "
            f"{self.off * 1e3:.6f} mm off the table, {self.overlap * 1e3:.3f} mm overlap, hand {self.hand * 1e3:.3f} "
            "mm in an object"
        )

    def look(self, env: TabletopEnv, observation: npt.NDArray[np.float32]) -> None:
        """After a step."""
        view, size = env.view(), np.array(env.task.layout.table.size)
        layout = view.layout
        assert np.isfinite(observation).all()
        assert np.isfinite(view.positions).all()
        assert np.isfinite(view.angles).all()
        assert (view.hand >= 0).all()
        assert (view.hand <= size).all()
        loose, fixed = on_table(env)
        self.steps += 1
        corners = corners_of(view.positions, view.angles, np.array([obj.size for obj in layout.objects]))
        if observation[env.observation_names.index("hand is low")]:
            self.low += 1
            for i in np.flatnonzero(loose | fixed).tolist():
                self.hand = max(self.hand, layout.table.hand - _distance(view.hand, corners[i]))
        state = view.positions[loose].tobytes() + view.angles[loose].tobytes() + loose.tobytes() + fixed.tobytes()
        if state == self._last:
            return
        self.pushed += self._last != b""
        self._last = state
        on = corners[loose | fixed]
        self.off = max(self.off, float(-on.min(initial=0)), float((on - size).max(initial=0)))
        first, second = np.triu_indices(len(loose), 1)
        pairs = (loose[first] & (loose | fixed)[second]) | (fixed[first] & loose[second])
        if pairs.any():
            deep = depths(corners[first[pairs]], corners[second[pairs]])
            self.overlap = max(self.overlap, float(deep.max()))


def on_table(env: TabletopEnv) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """``(n,)`` masks of the objects on the table that can be moved, and of those that cannot.

    A piece that was put into a bin lies on no table: it is left out.
    """
    view, carries = env.view(), env._game.progress.carries
    is_carried = np.array([carries(name) for name in view.layout.goals])
    is_free = np.array([status == "free" for status in view.status])
    is_placed = np.array([status == "placed" for status in view.status])
    return is_free & is_carried, (is_free & ~is_carried) | (is_placed & (env.task.name != "bins"))


def _distance(point: Floats, corners: Floats) -> float:
    """From a point to a rectangle."""
    along, across = corners[1] - corners[0], corners[3] - corners[0]
    length, width = float(np.hypot(*along)), float(np.hypot(*across))
    u = float((point - corners[0]) @ along) / length
    v = float((point - corners[0]) @ across) / width
    return math.hypot(max(-u, u - length, 0.0), max(-v, v - width, 0.0))


# -- tables and hands --------------------------------------------------------------------------------------------------


def odd_task() -> TabletopTask:
    """Objects of many sizes, tilted, in a crowd at the edge; two stay where they are."""
    objects = [
        TableObject("rod", (0.30, 0.60), size=(0.40, 0.02), angle=0.3),
        TableObject("brick", (0.35, 0.30), size=(0.12, 0.05), angle=-0.5),
        TableObject("cube", (0.50, 0.40)),
        TableObject("chip", (0.60, 0.30), size=(0.02, 0.015), angle=0.8),
        TableObject("plate", (0.65, 0.55), size=(0.15, 0.15), angle=0.6),
        TableObject("post", (0.20, 0.40), size=(0.03, 0.03), angle=0.4),
        TableObject("wall", (0.72, 0.40), size=(0.20, 0.03), angle=1.2),
    ]
    table = Table(assembly=(0.80, 0.02, 1.19, 0.79), starts={"home": (0.60, 0.05), "assembly": (1.0, 0.4)}, hand=0.02)
    carried = [Subtask(obj.name, (obj.name,), then=("assembly",)) for obj in objects[:5]]
    touched = [Subtask(obj.name, (obj.name,), after=("cube",)) for obj in objects[5:]]
    graph = TaskGraph([*carried, *touched], "home")
    return TabletopTask("odd", TabletopLayout(objects, table=table), graph)


def rough_table(number: int, speed: float, rng: np.random.Generator) -> tuple[TabletopEnv, TabletopLayout | None]:
    """One of many tables: tasks, layouts with obstacles, robots, ways to push."""
    name = ("columns", "tea", "columns", "bins", "odd")[number % 5]
    task = odd_task() if name == "odd" else TabletopTask.named(name)
    arguments: dict[str, Any] = {"contact": ("always", "always", "slow")[number % 3], "max_speed": speed}
    if name in ("columns", "tea") and number % 2 == 0:
        robot = ("robot", {"max_speed": 1.0}, Dropper(int(rng.integers(2**31))))[number // 2 % 3]
        arguments |= {"partner": robot, "threshold": 0.0 if number % 4 else 0.5}
    if number % 7 == 4:
        arguments["slow_speed"] = min(speed, 0.6)
    if number % 7 == 6:
        arguments["virtual_obstacles"] = "soft"
    layout = None
    if number % 3 and name in ("columns", "tea"):
        workspace = TabletopWorkspace(task)
        layout = workspace.decode(workspace.sample(1, rng)[0])
    elif name == "odd" and number % 2:
        layout = task.layout.with_obstacles([VirtualObstacle((0.9, 0.4), 1.4)])
    return TabletopEnv(task=task, **arguments), layout


class Dropper:
    """A partner that takes any object and drops it anywhere, on others too, at full speed."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def reset(self, layout: TabletopLayout, task: TabletopTask, rng: object) -> None:
        self.layout = layout
        self.goal = np.zeros(2)
        self.left = 0

    def step(self, senses: Any) -> Any:
        from legible_envs.tabletop.partner.interface import Command

        near = np.hypot(*(senses.positions - senses.gripper).T) if senses.free else np.array([np.inf])
        if self.left <= 0:
            there = self.rng.integers(3)
            self.left = 40
            self.goal = senses.positions[self.rng.integers(len(senses.positions))].copy()
            if there == 0:
                self.goal = self.rng.uniform(0, 1, 2) * self.layout.table.size
        self.left -= 1
        offset = self.goal - senses.gripper
        drop = senses.holding is not None and float(np.hypot(*offset)) < 0.01
        if drop:
            self.left = 0
        grasp = self.layout.goals[int(near.argmin())] if senses.holding is None and near.min() < 0.02 else None
        return Command(velocity=offset * 20, grasp=grasp, release=drop)


class RoughHand:
    """Presses objects into edges, corners and one another, sweeps, circles, jerks; sometimes it works."""

    def __init__(self, env: TabletopEnv, rng: np.random.Generator) -> None:
        self.env, self.rng, self.left = env, rng, 0

    def __call__(self) -> npt.NDArray[np.float32]:
        if self.left <= 0:
            self._plan()
        self.left -= 1
        velocity = getattr(self, f"_{self.plan}")()
        return np.asarray(velocity / max(1.0, float(np.hypot(*velocity))) * self.scale, dtype=np.float32)

    def _plan(self) -> None:
        rng, env = self.rng, self.env
        self.left = int(rng.integers(2, 40))
        self.plan = str(rng.choice(PLANS))
        self.scale = float(rng.choice([1.0, 1.0, rng.uniform(0.05, 1), min(1, 0.19 / env.max_speed)]))
        size = np.array(env.task.layout.table.size)
        self.victim = int(rng.integers(len(env.positions)))
        edge = np.array([rng.integers(2), rng.uniform()]) * size
        corner = rng.integers(0, 2, 2) * size
        other = env.positions[rng.integers(len(env.positions))]
        self.to = (edge, corner, other, rng.uniform(0, 1, 2) * size)[rng.integers(4)]
        self.direction, self.is_behind = rng.uniform(0, 2 * math.pi), False

    def _random(self) -> Floats:
        return self.rng.uniform(-1, 1, 2)

    def _jerk(self) -> Floats:
        return self.rng.choice([-1.0, 0.0, 1.0], 2)

    def _still(self) -> Floats:
        return self.rng.uniform(-0.02, 0.02, 2)

    def _sweep(self) -> Floats:
        return np.array([math.cos(self.direction), math.sin(self.direction)])

    def _circle(self) -> Floats:
        self.direction += 0.5
        return self._sweep()

    def _work(self) -> Floats:
        """Take an object that is valid, or carry it to its place; slow at the end."""
        env, self.scale = self.env, 1.0
        goals = env.goals
        at = self.to if env.carry_to is None else env.carry_to
        if env.carry_to is None and goals:
            at = env.positions[env.task.layout.index(goals[0])]
        velocity = (at - env.hand) * 30 / env.max_speed
        length = float(np.hypot(*velocity))
        return velocity if length > 1 or length < 0.19 / env.max_speed else velocity / length * 0.15 / env.max_speed

    def _press(self) -> Floats:
        """Go behind an object, then through it to where it is to be crushed."""
        env = self.env
        at = env.positions[self.victim]
        way = self.to - at
        way = way / max(float(np.hypot(*way)), 1e-9)
        behind = at - way * (0.75 * max(env.task.layout.objects[self.victim].size) + 0.03)
        if not self.is_behind and np.hypot(*(behind - env.hand)) > 0.012:
            self.left += self.rng.random() < 0.5
            return (behind - env.hand) * 30 / env.max_speed
        self.is_behind = True
        there = at + way * 0.05 - env.hand
        return there / max(float(np.hypot(*there)), 1e-9)
