"""A round in a kitchen."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING, Any

import numpy as np

from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.game.vectors import AT_ITEMS, AT_ORDERS, AT_PLAYERS, AT_POTS, CROSSINGS, POT_RECORD
from legible_envs.overcooked.layout import INGREDIENTS
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
        rules, self._cook_time = self.env.arrays()[2], cook_time
        self._places = tuple(int(rules[at]) for at in (AT_ORDERS, AT_ITEMS, AT_POTS))
        self._recipes = [list(recipe) for recipe in self.env.settings.rules.recipes]
        self._items: list[list[Any] | None] = [None, *([kind, []] for kind in (*INGREDIENTS, "dish"))]
        self._items += [["soup", recipe] for recipe in self._recipes]

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
        # Straight from the vector, not by `env.view()`: a server does this for every key of every participant.
        state, width, items = self.env.arrays()[0].tolist(), self.layout.shape[1], self._items
        at_orders, at_items, at_pots = self._places
        orders, recipes = state[at_orders:at_items], self._recipes
        return {
            "n": self.steps,
            "over": self.is_over,
            "players": [
                {"cell": list(divmod(state[i], width)), "facing": state[i + 1], "held": items[state[i + 2]]}
                for i in range(AT_PLAYERS, at_orders, 3)
            ],
            "counters": [
                [*divmod(cell, width), items[code]] for cell, code in enumerate(state[at_items:at_pots]) if code
            ],
            "pots": [
                self._pot(state[i : i + POT_RECORD]) for i in range(at_pots, len(state), POT_RECORD) if state[i] >= 0
            ],
            "delivered": [recipe for recipe, done in zip(recipes, orders, strict=True) if done == 2],
            "orders": [recipe for recipe, done in zip(recipes, orders, strict=True) if done != 2],
            "crossings": state[CROSSINGS],
        }

    def _pot(self, record: list[int]) -> list[Any]:
        cell, *counts, ticks, order = record
        contents = [kind for kind, count in zip(INGREDIENTS, counts, strict=True) for _ in range(count)]
        status = 0 if order < 0 else 2 if ticks >= self._cook_time else 1
        return [*divmod(cell, self.layout.shape[1]), contents, ticks, self._cook_time, status]

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
