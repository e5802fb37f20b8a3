"""A round in a kitchen."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING, Any

import numpy as np

from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.game.view import Item
from legible_envs.overcooked.layouts import read_layout
from legible_envs.overcooked.settings import NUM_ACTIONS

if TYPE_CHECKING:
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["KitchenGame"]


class KitchenGame:
    """A round in a kitchen; see :class:`~benchmarks.study.games.base.Game`.

    Args:
        layout: The kitchen.
        soups: The ordered soups.
        cook_time: Ticks a soup cooks.
        virtual_obstacles: ``"hard"`` or ``"soft"``.
        obstacles: Whether the layout's virtual obstacles are there.
        max_steps: The round ends after so many.
        seed: Of the environment.
    """

    def __init__(
        self,
        layout: str,
        *,
        soups: Sequence[Sequence[str]],
        cook_time: int = 20,
        virtual_obstacles: str = "hard",
        obstacles: bool = True,
        max_steps: int = 1200,
        seed: int = 0,
    ) -> None:
        kitchen = read_layout(layout)
        self.layout = kitchen if obstacles else without_obstacles(kitchen)
        self.env = OvercookedEnv(
            layout=self.layout,
            recipes=soups,
            cook_time=cook_time,
            obs_type="vector",
            virtual_obstacles=virtual_obstacles,
        )
        self.max_steps = max_steps
        self.steps = 0
        self.finished = False
        self.obs, self.info = self.env.reset(seed=seed)

    @property
    def is_over(self) -> bool:
        """Whether every soup is delivered, or ``max_steps`` are taken."""
        return self.finished or self.steps >= self.max_steps

    def read_action(self, value: object) -> int:
        """The action of a message: an integer 0..5."""
        if type(value) is not int or not 0 <= value < NUM_ACTIONS:
            raise ValueError(f"an action in a kitchen is an integer from 0 to {NUM_ACTIONS - 1}, got {value!r:.80}")
        return value

    def step(self, action: Any) -> None:
        """Take a step."""
        if self.is_over:
            raise ValueError("the round is over")
        self.obs, _, self.finished, _, self.info = self.env.step(action)
        self.steps += 1

    def digest(self) -> str:
        """Of the state vector."""
        return blake2b(self.env.arrays()[0].tobytes(), digest_size=8).hexdigest()

    def scene(self) -> dict[str, Any]:
        """``kind, shape, cells`` (rows of symbols), ``soups`` and ``max_steps``."""
        rows = [row.replace("1", " ").replace("2", " ") for row in self.layout.to_ascii().split("\n")]
        return {
            "kind": "kitchen",
            "shape": list(self.layout.shape),
            "cells": rows,
            "soups": [list(recipe) for recipe in self.env.settings.rules.recipes],
            "soft": self.env.settings.rules.soft_obstacles,
            "max_steps": self.max_steps,
        }

    def state(self, belief: bool = False) -> dict[str, Any]:
        """What the page draws.

        Returns:
            ``n`` (steps taken), ``over``, ``players`` (``cell, facing, held``), ``counters`` (``[row, col, item]``),
            ``pots`` (``[row, col, contents, ticks, cook_time, status]`` with status 0 open, 1 cooking, 2 ready),
            ``delivered`` and ``orders`` (lists of soups), ``crossings``. An item is ``[kind, contents]`` or None.
        """
        view = self.env.view()
        return {
            "n": self.steps,
            "over": self.is_over,
            "players": [
                {"cell": list(player.cell), "facing": player.facing, "held": _item(player.held)}
                for player in view.players
            ],
            "counters": [[row, col, _item(item)] for (row, col), item in view.counters.items()],
            "pots": [
                [row, col, list(pot.contents), pot.ticks, pot.cook_time, 2 if pot.is_ready else int(pot.is_cooking)]
                for (row, col), pot in view.pots.items()
            ],
            "delivered": [list(recipe) for recipe in view.delivered],
            "orders": [list(recipe) for recipe in view.orders],
            "crossings": view.crossings,
        }

    def outcome(self) -> dict[str, Any]:
        """``steps, finished, done`` (soups delivered), ``crossings``."""
        return {
            "steps": self.steps,
            "finished": bool(self.finished),
            "done": int(self.info["deliveries"]),
            "crossings": int(self.info["crossings"]),
        }

    def trajectories(self, *, participant: str, condition: str, seconds: Any = None) -> list[Trajectory]:
        """The trajectories of the round.

        Args:
            participant: Of all trajectories.
            condition: Of all trajectories.
            seconds: ``(steps + 1,)`` when each state was reached; None: 0.15 s a step.
        """
        found = self.env.trajectories(participant=participant, condition=condition, layout_name=condition)
        if seconds is None:
            return found
        ticks = np.asarray(seconds, dtype=np.float64)
        return [dataclasses.replace(each, times=ticks[np.rint(each.times / 0.15).astype(np.int64)]) for each in found]

    def close(self) -> None:
        """Let go of the environment."""
        self.env.close()


def without_obstacles(layout: OvercookedLayout) -> OvercookedLayout:
    """The same kitchen with floor in place of virtual obstacles."""
    return read_layout(layout.to_ascii().replace("V", " "))


def _item(item: Item | None) -> list[Any] | None:
    return None if item is None else [item.kind, list(item.contents)]
