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
_POCKET: Final = 1e6


class Floor:
    """Where players can walk in a kitchen, and how far it is.

    Fields of steps from cells are kept: a kitchen has few goals. A *pocket* is a dead end one cell wide, up to where
    ways part: whoever is in it cannot get out while somebody stands at its mouth.

    Args:
        kitchen: See :mod:`legible_envs.overcooked.game.vectors`.
        rules: See there.

    Attributes:
        height: Rows.
        width: Columns.
        clear: ``(H*W,)`` floor without virtual obstacles.
        open: ``(H*W,)`` where players can stand.
        depth: ``(H*W,)`` how deep in a pocket a cell lies; 0 outside.
        mouth: ``(H*W,)`` for cells in a pocket, the cell outside that leads into it; else -1.
    """

    def __init__(self, kitchen: Kitchen, rules: Vector) -> None:
        self.height, self.width = int(rules[HEIGHT]), int(rules[WIDTH])
        codes = kitchen[: self.height * self.width]
        self.clear = codes == FLOOR
        self.open = (self.clear | (codes == OBSTACLE)) if rules[SOFT] else self.clear
        self._fields: dict[int, Steps] = {}
        self.depth, self.mouth = self._find_pockets()

    def _around(self, cell: int) -> list[int]:
        """The cells beside a cell that players can stand on."""
        beside = [self.beside(cell, direction) for direction in range(4)]
        return [after for after in beside if after >= 0 and self.open[after]]

    def _find_pockets(self) -> tuple[Steps, Steps]:
        depth, mouth = np.zeros(len(self.open), dtype=np.int32), np.full(len(self.open), -1, dtype=np.int32)
        ends = [cell for cell in np.flatnonzero(self.open).tolist() if len(self._around(cell)) == 1]
        for end in ends:
            chain, cell = [end], self._around(end)[0]
            while len(beside := self._around(cell)) == 2:
                chain.append(cell)
                cell = next(after for after in beside if after != chain[-2])
            if len(beside) > 2:
                depth[chain], mouth[chain] = np.arange(len(chain), 0, -1), cell
        return depth, mouth

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

    def way(self, goal: int, here: int, other: int, *, stands: bool) -> Steps:
        """Fewest moves from a goal on a good way from ``here``: round the other player, and clear of obstacles.

        Args:
            goal: Cell of the goal.
            here: Where the way begins.
            other: Where the other player is.
            stands: Whether they stand there for good, so that every detour is better than to wait.
        """
        direct = np.empty(len(self.open), dtype=np.int32)
        steps_from(np.array([goal]), self.clear, self.height, self.width, direct)
        floor = self.clear
        if direct[here] < 0:
            direct, floor = self.steps_from(goal), self.open
        around_floor = floor.copy()
        around_floor[other] = False
        around = np.empty_like(direct)
        steps_from(np.array([goal]), around_floor, self.height, self.width, around)
        return around if around[here] >= 0 and (stands or around[here] <= direct[here] + _DETOUR) else direct

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

    def access(self, steps: Steps, here: int) -> int:
        """The cell beside the goal at which a shortest way from ``here`` ends."""
        while steps[here] > 1:
            here = min((after for after in self._around(here) if steps[after] >= 0), key=lambda after: steps[after])
        return here

    def refuge(self, here: int, walker: int, cost: npt.NDArray[np.float64]) -> int:
        """Where to step aside: the nearest of the cells that cost least and are not behind the walker.

        Where everything costs the same, the cell farthest from the walker: further on there may be a way aside.

        Args:
            here: Where the one who steps aside stands.
            walker: Where the other one stands.
            cost: ``(H*W,)`` of each cell, as :meth:`in_the_way` gives it. Pockets cost more than all else.
        """
        steps = self.steps_from(here, without=walker)
        cost = cost + _POCKET * (self.depth > 0)
        cells = np.flatnonzero(steps >= 0)
        least = float(cost[cells].min())
        best = cells[cost[cells] <= least + 1e-12]
        if least >= float(cost[cells].max()) - 1e-12:
            away = self.steps_from(walker)
            return int(best[np.argmax(away[best])])
        return int(best[np.argmin(steps[best])])
