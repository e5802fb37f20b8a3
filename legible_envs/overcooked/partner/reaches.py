"""The person's reaches while they happen: from emptied hands at a pot or serving station to a dispenser."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout
from legible_envs.overcooked.trajectories import dispensers_in_reach, station_beside

__all__ = ["ReachLog"]


class ReachLog:
    """Follows one player; :func:`~legible_envs.overcooked.trajectories.find_walks` finds the same reaches afterwards.

    Args:
        layout: The kitchen.
        cell: ``(row, col)`` where the player begins; beside a serving station they count as coming from there.

    Attributes:
        number: How many reaches have begun.
        start: Station where the present reach began; None where there is none.
        taken: Station at which the last reach ended, while the player holds what they took there.
        emptied: How often the hands were emptied.
    """

    def __init__(self, layout: OvercookedLayout, cell: Cell) -> None:
        self._layout = layout
        self.number = 0
        self.start: str | None = None
        self.taken: str | None = None
        self.emptied = 0
        self._cells: list[Cell] = []
        self._times: list[float] = []
        self._in_reach: tuple[str, ...] = ()
        beside = station_beside(layout, cell)
        if beside is not None:
            self._begin(beside, cell, 0.0)

    @property
    def points(self) -> npt.NDArray[np.int64]:
        """``(k, 2)`` cells since the reach began, consecutive repeats left out."""
        return np.array(self._cells, dtype=np.int64).reshape(-1, 2)

    @property
    def times(self) -> npt.NDArray[np.float64]:
        """``(k,)`` when the player came to each of them."""
        return np.array(self._times)

    def candidates(self, goals: tuple[str, ...]) -> tuple[str, ...]:
        """Those of the valid goals that a reach can end at; none where there is no reach."""
        return tuple(name for name in self._in_reach if name in goals) if self.start is not None else ()

    def follow(self, before: tuple[Cell, int, int], after: tuple[Cell, int, int], time: float) -> None:
        """Note one tick.

        Args:
            before: Cell, facing and item held before it.
            after: The same after it.
            time: Seconds since the episode began, after it.
        """
        (cell, facing, held), (there, _, holds) = before, after
        if held != holds:
            rows, cols = NEIGHBOURS[facing]
            self._change(held, holds, self._layout.station_at((cell[0] + rows, cell[1] + cols)), there, time)
        elif self.start is not None and there != self._cells[-1]:
            self._cells.append(there)
            self._times.append(time)

    def _change(self, held: int, holds: int, used: str | None, cell: Cell, time: float) -> None:
        kind = (used or "").partition("@")[0]
        ended = self.start is not None and held == 0 and kind in (*INGREDIENTS, "dish")
        self.start, self.taken = None, used if ended else None
        self._cells, self._times = [], []
        if holds == 0:
            self.emptied += 1
            if used is not None and kind in ("pot", "serving"):
                self._begin(used, cell, time)

    def _begin(self, start: str, cell: Cell, time: float) -> None:
        self.number += 1
        self.start = start
        self._cells, self._times = [cell], [time]
        self._in_reach = dispensers_in_reach(self._layout, cell)
