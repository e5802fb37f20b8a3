"""The tables that tests of the environment play on."""

from __future__ import annotations

import gymnasium as gym

import legible_envs  # noqa: F401
from legible_envs.tabletop import TabletopTask, VirtualObstacle

NAME = "LegibleTabletop-v0"
TASK = TabletopTask.named("columns")
WALL = TASK.layout.with_obstacles([VirtualObstacle((0.55, 0.22), 0.0), VirtualObstacle((0.33, 0.45), 1.5)])
# The sorted cubes are too close to be told apart early, and to be pushed singly.
APART = TASK.layout.with_genome([*(0.45 + (TASK.layout.centres - 0.45) * (1.5, 5 / 3)).ravel(), *[0.0] * 16])
FIRST, SECOND = TASK.layout.goals[:4], TASK.layout.goals[4:]


def make(**arguments):
    return gym.make(NAME, **{"max_speed": 2.0, **arguments})
