"""Observations of the table: a vector of fixed length with a name for every number."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from legible_envs.tabletop.game.game import FREE, HAND, PLACED, ROBOT, TableGame
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.partner.team import GRIPPER_SPEED, Team
from legible_envs.tabletop.task import TabletopTask

__all__ = ["ObservationBuilder"]

_HAND = ("hand x", "hand y", "hand velocity x", "hand velocity y", "hand is low", "hand holds an object")
_PLACES = ("carry to x", "carry to y", "carry to a point", "reach start x", "reach start y")
_OBJECT = ("x", "y", "cos", "sin", "free", "in hand", "in gripper", "placed", "valid", "goal")
_OBSTACLE = ("active", "x", "y", "cos", "sin", "length", "width")
_ROBOT = ("gripper x", "gripper y", "gripper velocity x", "gripper velocity y")


class ObservationBuilder:
    """Writes observations of a game; :class:`~legible_envs.tabletop.env.TabletopEnv` lists the numbers.

    Args:
        task: The task, which fixes the objects.
        max_obstacles: Most obstacles a layout has.
        has_robot: Whether a robot takes part.

    Attributes:
        names: The name of each number.
        space: The observation space.
    """

    def __init__(self, task: TabletopTask, max_obstacles: int, has_robot: bool) -> None:
        self._count, self._max_obstacles, self._has_robot = len(task.layout.objects), max_obstacles, has_robot
        head = (*_HAND, *_PLACES)
        objects = tuple(f"{name}: {what}" for name in task.layout.goals for what in _OBJECT)
        obstacles = tuple(f"obstacle {k}: {what}" for k in range(max_obstacles) for what in _OBSTACLE)
        self.names = (*head, *objects, *obstacles, *(_ROBOT if has_robot else ()))
        self._objects = slice(len(head), len(head) + len(objects))
        self._obstacles = slice(self._objects.stop, self._objects.stop + len(obstacles))
        self.space = spaces.Box(*self._bounds(task.layout.table.size), dtype=np.float32)
        self._fixed = np.zeros(len(self.names))

    def _bounds(self, size: tuple[float, float]) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        low, high = np.zeros(len(self.names), dtype=np.float32), np.ones(len(self.names), dtype=np.float32)
        for i, name in enumerate(self.names):
            what = name.rpartition(": ")[2]
            if "velocity" in what or what in ("cos", "sin"):
                low[i] = -1.0
            elif what in ("length", "width"):
                high[i] = 2 * (size[0] + size[1])
            elif name.startswith("obstacle") and what in ("x", "y"):  # they may stick out of the table
                along = size[0] if what == "x" else size[1]
                low[i], high[i] = -along, 2 * along
            elif what.endswith((" x", " y")) or what in ("x", "y"):
                high[i] = size[0] if what.endswith("x") else size[1]
        return low, high

    def enter(self, layout: TabletopLayout) -> None:
        """Note the obstacles, which do not change during an episode."""
        self._fixed[:] = 0.0
        rows = self._fixed[self._obstacles].reshape(self._max_obstacles, len(_OBSTACLE))
        for row, obstacle in zip(rows, layout.obstacles, strict=False):
            angle = obstacle.angle % math.pi  # turned by half a circle an obstacle is the same
            row[:] = (1.0, *obstacle.at, math.cos(angle), math.sin(angle), *obstacle.size)

    def observe(self, game: TableGame, team: Team, goals: Sequence[str]) -> npt.NDArray[np.float32]:
        """A new vector; ``goals`` are the game's, which are looked up once a step."""
        values = self._fixed.copy()
        top = game.rules.max_speed
        at = game.delivery.at if game.delivery is not None else None
        values[:11] = (
            *game.hand,
            game.velocity[0] / top,
            game.velocity[1] / top,
            game.is_low,
            game.holding >= 0,
            *(at or (0.0, 0.0)),
            at is not None,
            *game.reaches.start,
        )
        rows = values[self._objects].reshape(self._count, len(_OBJECT))
        rows[:, :2] = game.positions
        rows[:, 2] = np.cos(game.physics.angles)
        rows[:, 3] = np.sin(game.physics.angles)
        for column, code in enumerate((FREE, HAND, ROBOT, PLACED), 4):
            rows[:, column] = game.status == code
        for name in goals:
            rows[game.index[name], 8] = 1.0
        if game.goal is not None:
            rows[game.index[game.goal], 9] = 1.0
        if self._has_robot and team.gripper is not None:
            values[-4:] = (*team.gripper, team.velocity[0] / GRIPPER_SPEED, team.velocity[1] / GRIPPER_SPEED)
        # An object pushed against the table's edge may stick out a little, and an obstacle may lie anywhere.
        return np.clip(values.astype(np.float32), self.space.low, self.space.high)
