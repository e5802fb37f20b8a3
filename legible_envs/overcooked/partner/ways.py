"""Ways through a kitchen with somebody else in it: to a goal, and out of the other's way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import HEIGHT, SOFT, WIDTH, Kitchen, Vector
from legible_envs.overcooked.grid_kernels import neighbour, steps_from
from legible_envs.overcooked.layout import FLOOR, OBSTACLE

__all__ = ["Floor", "Steps"]

Steps = npt.NDArray[np.int32]
"""``(H*W,)`` fewest moves; -1 where no path leads."""

_DETOUR: Final = 4  # steps round the other player that are better than to wait until they move


class Floor:
    """Where players can walk in a kitchen, and how far it is.

    Fields of steps from cells are kept: a kitchen has few goals.

    Args:
        kitchen: See :mod:`legible_envs.overcooked.game.vectors`.
        rules: See there.
    """

    def __init__(self, kitchen: Kitchen, rules: Vector) -> None:
        self.height, self.width = int(rules[HEIGHT]), int(rules[WIDTH])
        codes = kitchen[: self.height * self.width]
        self.clear = codes == FLOOR
        self.open = (self.clear | (codes == OBSTACLE)) if rules[SOFT] else self.clear
        self._fields: dict[int, Steps] = {}

    def steps_from(self, cell: int, without: int = -1) -> Steps:
        """Fewest moves from a cell, which need not be floor, over the floor without one cell."""
        if without < 0 and cell in self._fields:
            return self._fields[cell]
        steps = np.empty(len(self.open), dtype=np.int32)
        floor = self.open
        if without >= 0:
            floor = self.open.copy()
            floor[without] = False
        steps_from(np.array([cell]), floor, self.height, self.width, steps)
        if without < 0:
            self._fields[cell] = steps
        return steps

    def way(self, goal: int, here: int, other: int) -> Steps:
        """Fewest moves from a goal on a good way from ``here``: clear of obstacles where that can be, round the other."""
        direct = np.empty(len(self.open), dtype=np.int32)
        steps_from(np.array([goal]), self.clear, self.height, self.width, direct)
        floor = self.clear
        if direct[here] < 0:
            direct, floor = self.steps_from(goal), self.open
        around_floor = floor.copy()
        around_floor[other] = False
        around = np.empty_like(direct)
        steps_from(np.array([goal]), around_floor, self.height, self.width, around)
        return around if 0 <= around[here] <= direct[here] + _DETOUR else direct

    def beside(self, cell: int, direction: int) -> int:
        """The cell next to a cell; -1 outside the kitchen."""
        return int(neighbour(cell, direction, self.height, self.width))

    def in_the_way(self, walker: int, goals: Sequence[int], weights: Sequence[float]) -> npt.NDArray[np.float64]:
        """``(H*W,)`` for each cell the weights of the goals to which it lies on some shortest path of a walker."""
        away = self.steps_from(walker)
        total = np.zeros(len(self.open))
        for goal, weight in zip(goals, weights, strict=True):
            steps = self.steps_from(goal)
            if steps[walker] > 0:
                on_path = (away >= 0) & (steps >= 0) & (away + steps == steps[walker])
                total[on_path] += weight
        total[~self.open] = np.inf
        return total

    def blocks(self, cell: int, walker: int, goals: Sequence[int]) -> bool:
        """Whether a cell makes every goal that a walker can get to farther away, or cuts it off."""
        found = False
        for goal in goals:
            direct = self.steps_from(goal)
            if direct[walker] <= 0:
                continue
            around = self.steps_from(goal, without=cell)
            if 0 <= around[walker] <= direct[walker]:
                return False
            found = True
        return found

    def refuge(self, here: int, walker: int, cost: npt.NDArray[np.float64]) -> int:
        """Where to step aside: the nearest of the cells that cost least and are not behind the walker.

        Where everything costs the same, the cell farthest from the walker: further on there may be a way aside.

        Args:
            here: Where the one who steps aside stands.
            walker: Where the other one stands.
            cost: ``(H*W,)`` of each cell, as :meth:`in_the_way` gives it.
        """
        steps = self.steps_from(here, without=walker)
        cells = np.flatnonzero(steps >= 0)
        least = float(cost[cells].min())
        best = cells[cost[cells] <= least + 1e-12]
        if least >= float(cost[cells].max()) - 1e-12:
            away = self.steps_from(walker)
            return int(best[np.argmax(away[best])])
        return int(best[np.argmin(steps[best])])
