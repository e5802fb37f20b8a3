"""States and actions of Overcooked-AI, in both of its notations, as the arrays of a recorded game.

Recorded positions are ``[x, y]`` with y down. A soup of 2019 is ``"state": [ingredient, amount, ticks]``; one of 2020
lists its ``_ingredients`` and counts ``cooking_tick`` from -1 (not cooking) to ``cook_time``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout

__all__ = ["StateArrays", "read_action", "read_literal"]

# Recorded directions are (dx, dy) with y down: north is (0, -1).
_FACING: Final = {(0, -1): 0, (0, 1): 1, (1, 0): 2, (-1, 0): 3}
_STAY, _INTERACT = 4, 5
_ITEMS: Final = {**{kind: code for code, kind in enumerate(INGREDIENTS, 1)}, "dish": 5, "soup": 6}
_MOST_TICKS: Final = 30_000
_MOST_CELLS: Final = 2**30
"""Of all states of a game together; an hour of play in a kitchen of 64 x 64 cells has a tenth of that."""


def read_literal(text: str) -> Any:
    """A JSON value, or a Python literal of numbers, strings, lists and dicts: eight times as fast as ``ast``.

    Raises:
        ValueError: It is neither.
    """
    try:
        return json.loads(text)
    except ValueError:
        return json.loads(
            text.replace("'", '"').replace("False", "false").replace("True", "true").replace("None", "null")
        )


def read_action(action: object) -> int:
    """0 N, 1 S, 2 E, 3 W, 4 STAY, 5 INTERACT.

    Raises:
        ValueError: Another action.
    """
    if isinstance(action, str) and action.lower() == "interact":
        return _INTERACT
    if isinstance(action, list | tuple) and all(type(step) is int for step in action):
        if tuple(action) == (0, 0):
            return _STAY
        if tuple(action) in _FACING:
            return _FACING[tuple(action)]  # type: ignore[index]
    raise ValueError(f"expected a direction such as [0, -1], [0, 0] or 'INTERACT', got {str(action)[:60]!r}")


class StateArrays:
    """Arrays of a game's states, filled one by one; names and shapes as in :class:`.RecordedGame`.

    Args:
        layout: The kitchen.
        count: Number of states.
        players: Number of players.

    Raises:
        ValueError: More states than any recording has.
    """

    def __init__(self, layout: OvercookedLayout, count: int, players: int = 2) -> None:
        height, width = layout.shape
        if count * height * width > _MOST_CELLS:
            raise ValueError(f"{count} states of {height} x {width} cells are more than a recording has")
        self._layout = layout
        self._pots = [layout.stations[name] for name in layout.named("pot")]
        self._pot_at = {cell: number for number, cell in enumerate(self._pots)}
        self.cells = np.zeros((count, players, 2), dtype=np.int16)
        self.facing = np.zeros((count, players), dtype=np.int8)
        self.held = np.zeros((count, players), dtype=np.int8)
        self.counters = np.zeros((count, height, width), dtype=np.int8)
        self.pots = np.zeros((count, len(self._pots), 5), dtype=np.int16)
        self.cook_times = np.full((count, len(self._pots)), -1, dtype=np.int16)

    def write(self, tick: int, state: Mapping[str, Any]) -> None:
        """Write a state.

        Raises:
            KeyError: An entry is missing.
            ValueError: Something stands where nothing can, or is unknown.
            TypeError: Not the form of a state.
        """
        players = state["players"]
        if len(players) != self.held.shape[1]:
            raise ValueError(f"expected {self.held.shape[1]} players, got {len(players)}")
        for number, player in enumerate(players):
            cell = self._cell(player["position"])
            if not self._layout.is_floor(cell):
                raise ValueError(f"player {number} stands on {cell}, which is no floor (row, column)")
            self.cells[tick, number] = cell
            self.facing[tick, number] = _FACING[tuple(player["orientation"])]
            item = player.get("held_object")
            self.held[tick, number] = _code(item["name"]) if item else 0
        objects = state["objects"]
        for item in objects.values() if isinstance(objects, Mapping) else objects:
            cell = self._cell(item["position"])
            pot = self._pot_at.get(cell)
            if pot is None:
                self.counters[(tick, *cell)] = _code(item["name"])
            else:
                self._write_soup(tick, pot, item)

    def _write_soup(self, tick: int, pot: int, soup: Mapping[str, Any]) -> None:
        counts, ticks, cook_time = _contents(soup)
        if sum(counts) > 100 or not 0 <= ticks <= _MOST_TICKS or cook_time > _MOST_TICKS:
            raise ValueError(f"a soup of {sum(counts)} ingredients after {ticks} of {cook_time} ticks")
        self.pots[tick, pot] = *counts, ticks
        self.cook_times[tick, pot] = max(cook_time, -1)

    def _cell(self, position: Any) -> tuple[int, int]:
        column, row = position
        height, width = self._layout.shape
        if type(row) is not int or type(column) is not int or not (0 <= row < height and 0 <= column < width):
            raise ValueError(f"{str(position)[:60]} is no cell [x, y] of this kitchen of {width} x {height}")
        return row, column


def _code(name: Any) -> int:
    if not isinstance(name, str) or name not in _ITEMS:
        raise ValueError(f"an item called {str(name)[:60]!r}; known: {sorted(_ITEMS)}")
    return _ITEMS[name]


def _contents(soup: Mapping[str, Any]) -> tuple[list[int], int, int]:
    """Counts of tomato, onion, cabbage, fish; ticks cooked; ticks it takes, -1 where that is not said."""
    if "state" in soup:
        kind, amount, ticks = soup["state"]
        if kind not in INGREDIENTS or type(amount) is not int or type(ticks) is not int or amount < 0:
            raise ValueError(f"a soup whose state is {str(soup['state'])[:60]}")
        return [amount if each == kind else 0 for each in INGREDIENTS], ticks, -1
    found = soup["_ingredients"] if "_ingredients" in soup else soup["ingredients"]
    names = [entry["name"] if isinstance(entry, Mapping) else entry for entry in found]
    if unknown := [name for name in names if name not in INGREDIENTS]:
        raise ValueError(f"a soup with {str(unknown[0])[:60]!r}; known ingredients: {list(INGREDIENTS)}")
    ticks, cook_time = (
        soup["_cooking_tick"] if "_cooking_tick" in soup else soup["cooking_tick"],
        soup.get("cook_time", -1),
    )
    if type(ticks) is not int or type(cook_time) is not int:
        raise ValueError("a soup whose ticks are no whole numbers")
    return [names.count(each) for each in INGREDIENTS], max(ticks, 0), cook_time
