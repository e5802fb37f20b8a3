"""Whether a recording obeys the rules of its game: every state is worked out again from the one before.

The rules, for one tick and any number of players:

1. Players who interact do so in their order, with the cell they face. Empty hands take from a station of
   ingredients or dishes, or what lies on a counter; a counter takes what is held. A pot takes an ingredient while it
   does not cook and has fewer than three (in 2019: of one kind); a dish takes out a soup that is done. Serving takes
   soups.
2. Players who move turn, and step where there is floor. If two would share or swap cells, all stay.
3. Soups that cook do so for another tick. In 2019 a pot cooks when it holds three; in 2020 once a player with
   empty hands has interacted with it. Recordings of 2019 that are published in the newer form may follow either.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from legible_envs.datasets.overcooked_ai.games import RecordedGame
from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.overcooked.layout import INGREDIENTS

__all__ = ["ReplayCheck", "check_replay"]

_STAY, _INTERACT = 4, 5
_DISH, _SOUP = 5, 6
_FULL: Final = 3
_COOK_TIME: Final = 20


@dataclass(frozen=True)
class ReplayCheck:
    """How many ticks of a game follow from the rules.

    Attributes:
        ticks: All ticks.
        positions: Those after which every player stands and faces as the rules say.
        complete: Those after which hands, counters and pots are as the rules say too.
        starts_itself: Whether pots cook when they are full, the better of both rules for this game.
        first_difference: The first tick that does not follow, and in what; empty if all do.
    """

    ticks: int
    positions: int
    complete: int
    starts_itself: bool
    first_difference: str = ""

    @property
    def moves_replay(self) -> bool:
        """Whether all positions follow, so that the trajectories can be trusted."""
        return self.positions == self.ticks


def check_replay(game: RecordedGame) -> ReplayCheck:
    """Work out every tick of a game by the rules, with pots that start themselves or are started.

    Example:
        >>> check_replay(game).moves_replay                                               # doctest: +SKIP
        True
    """
    if game.rules == "overcooked-ai-2019":
        return _checked(game, True)
    found = [_checked(game, starts_itself) for starts_itself in (False, True)]
    return max(found, key=lambda check: check.complete)


def _checked(game: RecordedGame, starts_itself: bool) -> ReplayCheck:
    kitchen = _Kitchen(game, starts_itself)
    positions = complete = 0
    first = ""
    for tick in range(game.num_ticks):
        different = kitchen.differences(tick)
        positions += not {"cells", "facing"} & set(different)
        complete += not different
        if different and not first:
            first = f"tick {tick}: {', '.join(different)}"
    return ReplayCheck(game.num_ticks, positions, complete, starts_itself, first)


class _Pot:
    """A pot during one tick."""

    def __init__(self, counts: list[int], ticks: int, cook_time: int) -> None:
        self.counts, self.ticks, self.cook_time = counts, ticks, cook_time
        self.is_cooking = ticks > 0

    @property
    def is_ready(self) -> bool:
        return self.is_cooking and self.ticks >= self.cook_time


class _Kitchen:
    """A game as plain lists, a tenth of the time of arrays: every state is small and looked at once."""

    def __init__(self, game: RecordedGame, starts_itself: bool) -> None:
        layout = game.layout
        self._starts_itself = starts_itself
        self._mixes = game.rules != "overcooked-ai-2019"
        self._stations = {cell: name.partition("@")[0] for name, cell in layout.stations.items()}
        self._pot_at = {layout.stations[name]: number for number, name in enumerate(layout.named("pot"))}
        height, width = layout.shape
        self._floor = {(r, c) for r in range(height) for c in range(width) if layout.is_floor((r, c))}
        self._cells = [[(row, column) for row, column in state] for state in game.cells.tolist()]
        self._facing, self._held, self._actions = game.facing.tolist(), game.held.tolist(), game.actions.tolist()
        self._pots = [[(row[:-1], row[-1]) for row in state] for state in game.pots.tolist()]
        self._cook_times = [[-1] * len(row) for row in self._pots]
        if game.cook_times is not None:
            self._cook_times = game.cook_times.tolist()
        self._counters = game.counters
        self._laid: list[dict[Cell, int]] = [{} for _ in self._actions]
        for tick, row, column in np.argwhere(game.counters[1:] != game.counters[:-1]).tolist():
            self._laid[tick][row, column] = int(game.counters[tick + 1, row, column])

    def differences(self, tick: int) -> list[str]:
        """What is otherwise after a tick than the rules say."""
        cells, facing, held, actions = self._cells[tick], self._facing[tick], [*self._held[tick]], self._actions[tick]
        pots = [
            _Pot([*counts], ticks, self._cook_time(tick, number))
            for number, (counts, ticks) in enumerate(self._pots[tick])
        ]
        laid: dict[Cell, int] = {}
        for player, action in enumerate(actions):
            if action == _INTERACT:
                step = NEIGHBOURS[facing[player]]
                target = cells[player][0] + step[0], cells[player][1] + step[1]
                held[player] = self._interact(tick, held[player], target, laid, pots)
        after, facing = self._move(cells, facing, actions)
        for pot in pots:
            self._cook(pot)
        laid = {cell: item for cell, item in laid.items() if item != self._counters[(tick, *cell)]}
        found = {
            "cells": after == self._cells[tick + 1],
            "facing": facing == self._facing[tick + 1],
            "hands": held == self._held[tick + 1],
            "counters": laid == self._laid[tick],
            "pots": all(self._is_same(pot, *state) for pot, state in zip(pots, self._pots[tick + 1], strict=True)),
        }
        return [what for what, same in found.items() if not same]

    def _interact(self, tick: int, item: int, target: Cell, laid: dict[Cell, int], pots: list[_Pot]) -> int:
        """What the player holds afterwards; ``laid`` takes what lies on counters then."""
        kind = self._stations.get(target)
        if target in self._pot_at:
            return self._use_pot(item, pots[self._pot_at[target]])
        if kind == "serving":
            return 0 if item == _SOUP else item
        if kind == "dish":
            return item or _DISH
        if kind is not None:
            return item or INGREDIENTS.index(kind) + 1
        if target in self._floor:
            return item
        lies = laid[target] if target in laid else int(self._counters[(tick, *target)])
        if (item == 0) == (lies == 0):
            return item
        laid[target] = item
        return lies

    def _use_pot(self, item: int, pot: _Pot) -> int:
        if item == _DISH and pot.is_ready:
            pot.counts, pot.ticks, pot.is_cooking = [0] * len(INGREDIENTS), 0, False
            return _SOUP
        if item == 0:
            pot.is_cooking |= not self._starts_itself and sum(pot.counts) > 0
            return 0
        total = sum(pot.counts)
        if item > len(INGREDIENTS) or pot.is_cooking or total >= _FULL:
            return item
        if total > pot.counts[item - 1] and not self._mixes:
            return item
        pot.counts[item - 1] += 1
        return 0

    def _move(self, cells: list[Cell], facing: list[int], actions: list[int]) -> tuple[list[Cell], list[int]]:
        after, turned = list(cells), list(facing)
        for player, action in enumerate(actions):
            if action < _STAY:
                turned[player] = action
                cell = cells[player][0] + NEIGHBOURS[action][0], cells[player][1] + NEIGHBOURS[action][1]
                after[player] = cell if cell in self._floor else cells[player]
        for one, other in combinations(range(len(cells)), 2):
            shares = after[one] == after[other]
            if shares or (after[one] == cells[other] and after[other] == cells[one]):
                return cells, turned
        return after, turned

    def _cook(self, pot: _Pot) -> None:
        if self._starts_itself and sum(pot.counts) == _FULL:
            pot.is_cooking = True
        pot.ticks += pot.is_cooking and not pot.is_ready

    def _is_same(self, pot: _Pot, counts: list[int], ticks: int) -> bool:
        return pot.counts == counts and min(pot.ticks, pot.cook_time) == min(ticks, pot.cook_time)

    def _cook_time(self, tick: int, pot: int) -> int:
        """As the state says, or the next one where the soup starts to cook; else that of 2019."""
        said = self._cook_times[tick][pot], self._cook_times[tick + 1][pot]
        return next((time for time in said if time > 0), _COOK_TIME)
