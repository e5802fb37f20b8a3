"""Simulated people at play: a walker of ``humans`` as a policy for ``LegibleOvercooked-v0``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.dynamics import walkable
from legible_envs.overcooked.layout import OBSTACLE
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.vectors import AT_PLAYERS, HEIGHT, INTERACT, STAY, WIDTH, Kitchen, Vector
from legible_envs.overcooked.walkers import Way, beside, choose_step, find_costs, look_around

if TYPE_CHECKING:
    from legible_envs.overcooked.walking import Walker

__all__ = ["WalkingPlayer"]


class WalkingPlayer(ScriptedPlayer):
    """Walks to a valid goal drawn uniformly as the walker does, uses it, and draws the next.

    Idles and looks around as often as the walker says. Soft virtual obstacles are kept off where there is another way.

    Args:
        env: An environment made by ``gymnasium.make("LegibleOvercooked-v0")``, or a vector environment of such.
        walker: How the person walks.
        rng: Source of all randomness.

    Example:
        >>> import gymnasium as gym, legible_envs, numpy as np
        >>> from legible_envs.overcooked.humans import BoltzmannWalker
        >>> env = gym.make("LegibleOvercooked-v0", max_episode_steps=5000)
        >>> player = BoltzmannWalker(rationality=1.3).policy(env, np.random.default_rng(0))
        >>> obs, info = env.reset(seed=0)
        >>> over = False
        >>> while not over:
        ...     obs, reward, terminated, truncated, info = env.step(player(obs, info))
        ...     over = terminated or truncated
        >>> info["deliveries"]
        3
    """

    def __init__(self, env: Any, walker: Walker, rng: np.random.Generator) -> None:
        super().__init__(env, rng)
        self.walker = walker
        self._walks: list[_Walk | None] = [None] * len(self._goals)

    def _forget_way(self, index: int) -> None:
        self._walks[index] = None

    def _act(
        self,
        index: int,
        arrays: tuple[Vector, Kitchen, Vector],
        valid_goals: npt.NDArray[np.bool_],
        action_mask: npt.NDArray[np.int8],
        layout_id: str,
    ) -> int:
        state, kitchen, rules = arrays
        self._width = int(rules[WIDTH])
        if not self._has_goal(index, valid_goals, layout_id):
            return STAY
        cell, facing = int(state[AT_PLAYERS]), int(state[AT_PLAYERS + 1])
        walk = self._walks[index]
        if walk is None or not walk.leads_from(cell):
            walk = self._walks[index] = _Walk(self.walker, cell, self._goals[index], kitchen, rules)
        chance = self.rng.random()
        if chance < self.walker.idle:
            return STAY
        if chance < self.walker.idle + self.walker.turn:
            towards = walk.look_around(cell, self.rng.random())
            return STAY if towards < 0 else towards
        direction = walk.next_direction(cell, self.walker, self.rng)
        if beside(cell, direction, walk.way.height, walk.way.width) != self._goals[index] or facing != direction:
            return direction
        if not action_mask[INTERACT]:
            return STAY
        self._goals[index] = -1
        return INTERACT


class _Walk:
    """One person's way to one goal in a running game, and what was decided on it."""

    def __init__(self, walker: Walker, cell: int, goal: int, kitchen: Kitchen, rules: Vector) -> None:
        height, width = int(rules[HEIGHT]), int(rules[WIDTH])
        codes = kitchen[: height * width]
        self._open = np.array([walkable(code, rules) for code in codes])
        self._memory = np.zeros(len(codes))
        self._weights = np.empty(4)
        self._heading = -1
        self._decided: tuple[int, int] | None = None
        costs = walker.costs((height, width)).ravel()
        best = np.empty(len(codes))
        for floor in (self._open & (codes != OBSTACLE), self._open):
            find_costs(height, width, floor, costs, goal, best)
            self.way = Way(height, width, floor, costs, goal, best)
            # Standing on an obstacle, or shut in by them, the only way leads across.
            if self.leads_from(cell):
                break

    def leads_from(self, cell: int) -> bool:
        return bool(self.way.best[cell] < np.inf)

    def look_around(self, cell: int, chance: float) -> int:
        return int(look_around(cell, self.way.height, self.way.width, self._open, chance))

    def next_direction(self, cell: int, walker: Walker, rng: np.random.Generator) -> int:
        """Decide once at each cell: a person who turns to the goal does not think again before using it."""
        if self._decided is None or self._decided[0] != cell:
            if self._decided is not None:
                self._heading = self._decided[1]
            if not self.leads_from(cell):
                return STAY
            direction = choose_step(
                walker.kind, walker.numbers, cell, self._heading, self.way, self._memory, rng.random(), self._weights
            )
            self._decided = cell, int(direction)
        return self._decided[1]
