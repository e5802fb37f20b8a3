"""What an agent sees: kernels that write observations from the vectors described in ``vectors``."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.dynamics import walkable
from legible_envs.overcooked.game.vectors import (
    AT_ITEMS,
    AT_ORDERS,
    AT_PLAYERS,
    AT_POTS,
    COOK_TIME,
    DISH,
    HEIGHT,
    NUM_ORDERS,
    NUM_PLAYERS,
    NUM_POTS,
    POT_RECORD,
    RECIPES,
    SOUP,
    SOUPS_IN_POTS,
    WIDTH,
    Kitchen,
    Vector,
)
from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.overcooked.layout import COUNTER
from legible_envs.support.compiled import kernel

__all__ = [
    "GRID_CHANNELS",
    "NUM_FEATURES",
    "NUM_OTHER_FEATURES",
    "OTHER_CHANNELS",
    "find_routes",
    "grid_observation",
    "grid_observations",
    "redraw_motion",
    "vector_observation",
    "vector_observations",
]

GRID_CHANNELS: Final = (
    *("counter", "obstacle", "tomato station", "onion station", "cabbage station", "fish station", "dish station"),
    *("pot", "serving", "player", "facing N", "facing S", "facing E", "facing W"),
    *("tomatoes", "onions", "cabbages", "fish", "dish", "soup", "ticks cooked", "soup ready"),
)
"""Names of the channels of a grid observation; one channel per recipe follows them."""

PLAYER: Final = 9
CONTENTS: Final = 14
DISH_CHANNEL: Final = 18
SOUP_CHANNEL: Final = 19
TICKS: Final = 20
READY: Final = 21
ORDERS: Final = 22

OTHER_CHANNELS: Final = ("other player", "other facing N", "other facing S", "other facing E", "other facing W")
"""Names of the channels that follow the recipes' where there are several players."""

NUM_FEATURES: Final = 51
"""Length of a vector observation without the orders, one entry per recipe, that follow."""

NUM_OTHER_FEATURES: Final = 13
"""Entries that follow the orders for each other player."""

Grid = npt.NDArray[np.uint8]


@kernel
def _draw_item(item: int, rules: Vector, grid: Grid, row: int, col: int) -> None:
    """Mark an item on a cell; a soup is a dish, a soup, and its ingredients."""
    if item == 0:
        return
    if item < DISH:
        grid[row, col, CONTENTS + item - 1] = 1
        return
    grid[row, col, DISH_CHANNEL] = 1
    if item >= SOUP:
        grid[row, col, SOUP_CHANNEL] = 1
        for kind in range(4):
            grid[row, col, CONTENTS + kind] = rules[RECIPES + 4 * (item - SOUP) + kind]


@kernel
def grid_observation(state: Vector, kitchen: Kitchen, rules: Vector, observer: int, grid: Grid) -> None:
    """Write a grid observation; channels as in ``GRID_CHANNELS``, then one per recipe: 1 until it is delivered.

    Args:
        state: See ``vectors``.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        observer: Number of the player who observes; where there are others, ``OTHER_CHANNELS`` come last.
        grid: ``(H, W, 22 + recipes)``, with several players ``(H, W, 27 + recipes)``; zeros, written.
    """
    width = rules[WIDTH]
    orders = rules[NUM_ORDERS]
    for row in range(rules[HEIGHT]):
        for col in range(width):
            cell = row * width + col
            code = kitchen[cell]
            if code > 0:
                grid[row, col, code - 1] = 1
                if code == COUNTER:
                    _draw_item(state[rules[AT_ITEMS] + cell], rules, grid, row, col)
            for order in range(orders):
                grid[row, col, ORDERS + order] = 1 if state[rules[AT_ORDERS] + order] != 2 else 0
    _draw_motion(state, rules, observer, grid)
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        for kind in range(4):
            if state[pot] >= 0:
                grid[state[pot] // width, state[pot] % width, CONTENTS + kind] = state[pot + 1 + kind]


@kernel
def grid_observations(state: Vector, kitchen: Kitchen, rules: Vector, grids: npt.NDArray[np.uint8]) -> None:
    """Write what each player sees; ``grids`` ``(players, H, W, C)``, zeros."""
    for player in range(rules[NUM_PLAYERS]):
        grid_observation(state, kitchen, rules, player, grids[player])


@kernel
def _draw_motion(state: Vector, rules: Vector, observer: int, grid: Grid) -> None:
    """Mark what changes without anything being used: players with what they hold, and pots that cook."""
    width = rules[WIDTH]
    for player in range(rules[NUM_PLAYERS]):
        at = AT_PLAYERS + 3 * player
        row, col = state[at] // width, state[at] % width
        channel = PLAYER if player == observer else ORDERS + rules[NUM_ORDERS]
        grid[row, col, channel] = 1
        grid[row, col, channel + 1 + state[at + 1]] = 1
        _draw_item(state[at + 2], rules, grid, row, col)
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] >= 0 and state[pot + 6] >= 0:
            row, col = state[pot] // width, state[pot] % width
            grid[row, col, TICKS] = min(state[pot + 5], 255)
            grid[row, col, READY] = 1 if state[pot + 5] >= rules[COOK_TIME] else 0


@kernel
def redraw_motion(state: Vector, rules: Vector, observer: int, before: Vector, grid: Grid) -> None:
    """Bring a grid observation up to date after a tick in which nothing was used.

    Args:
        state: See ``vectors``.
        rules: See ``vectors``.
        observer: Number of the player who observes.
        before: ``(players,)`` flat cells where the players were one tick ago.
        grid: The observation one tick ago, written.
    """
    others = ORDERS + rules[NUM_ORDERS]
    for player in range(before.shape[0]):
        row, col = before[player] // rules[WIDTH], before[player] % rules[WIDTH]
        # Only players stand on such a cell, so that all its items are theirs.
        grid[row, col, PLAYER:TICKS] = 0
        grid[row, col, others:] = 0
    _draw_motion(state, rules, observer, grid)


@kernel
def find_routes(kitchen: Kitchen, rules: Vector, routes: npt.NDArray[np.int16]) -> None:
    """Find the nearest station of every type from every cell.

    Args:
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        routes: ``(7, 2, H*W)``, written: for each station type the steps to a cell beside the nearest one, and the
            cell of that station; -1 where no path leads.
    """
    cells = rules[HEIGHT] * rules[WIDTH]
    queue = np.empty(cells, dtype=np.int32)
    routes[:] = -1
    for kind in range(7):
        head, tail = 0, 0
        for station in range(cells):
            if kitchen[station] != kind + 3:
                continue
            for direction in range(4):
                beside = neighbour(station, direction, rules[HEIGHT], rules[WIDTH])
                if beside >= 0 and walkable(kitchen[beside], rules) and routes[kind, 0, beside] < 0:
                    routes[kind, 0, beside] = 0
                    routes[kind, 1, beside] = station
                    queue[tail] = beside
                    tail += 1
        while head < tail:
            cell = queue[head]
            head += 1
            for direction in range(4):
                beside = neighbour(cell, direction, rules[HEIGHT], rules[WIDTH])
                if beside >= 0 and walkable(kitchen[beside], rules) and routes[kind, 0, beside] < 0:
                    routes[kind, 0, beside] = routes[kind, 0, cell] + 1
                    routes[kind, 1, beside] = routes[kind, 1, cell]
                    queue[tail] = beside
                    tail += 1


@kernel
def _describe_player(
    state: Vector,
    kitchen: Kitchen,
    rules: Vector,
    routes: npt.NDArray[np.int16],
    observer: int,
    out: npt.NDArray[np.float32],
) -> None:
    """Entries 0 to 37: where the player is, what they hold, where they can go, and how far the stations are."""
    height, width = rules[HEIGHT], rules[WIDTH]
    at_observer = AT_PLAYERS + 3 * observer
    cell = state[at_observer]
    row, col = cell // width, cell % width
    out[0] = row / (height - 1)
    out[1] = col / (width - 1)
    out[2 + state[at_observer + 1]] = 1.0
    out[6 + min(state[at_observer + 2], SOUP)] = 1.0
    for direction in range(4):
        target = neighbour(cell, direction, rules[HEIGHT], rules[WIDTH])
        if target >= 0 and walkable(kitchen[target], rules):
            out[13 + direction] = 1.0
    for kind in range(7):
        at = 17 + 3 * kind
        station = routes[kind, 1, cell]
        if station < 0:
            out[at + 2] = 1.0
            continue
        out[at] = (station // width - row) / (height - 1)
        out[at + 1] = (station % width - col) / (width - 1)
        out[at + 2] = routes[kind, 0, cell] / (height * width)


@kernel
def _describe_others(state: Vector, rules: Vector, observer: int, out: npt.NDArray[np.float32]) -> None:
    """The last entries: where the other players are, seen from this one, which way they face and what they hold."""
    height, width, players = rules[HEIGHT], rules[WIDTH], rules[NUM_PLAYERS]
    cell = state[AT_PLAYERS + 3 * observer]
    for number in range(1, players):
        at = AT_PLAYERS + 3 * ((observer + number) % players)
        first = NUM_FEATURES + rules[NUM_ORDERS] + NUM_OTHER_FEATURES * (number - 1)
        out[first] = (state[at] // width - cell // width) / (height - 1)
        out[first + 1] = (state[at] % width - cell % width) / (width - 1)
        out[first + 2 + state[at + 1]] = 1.0
        out[first + 6 + min(state[at + 2], SOUP)] = 1.0


@kernel
def vector_observation(
    state: Vector,
    kitchen: Kitchen,
    rules: Vector,
    routes: npt.NDArray[np.int16],
    observer: int,
    out: npt.NDArray[np.float32],
) -> None:
    """Write a vector observation; its entries are listed in the environment's documentation.

    Args:
        state: See ``vectors``.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        routes: Made by :func:`find_routes`.
        observer: Number of the player who observes.
        out: ``(51 + recipes + 13 * other players,)``, zeros, written.
    """
    _describe_player(state, kitchen, rules, routes, observer, out)
    _describe_others(state, rules, observer, out)
    largest = 1
    for order in range(rules[NUM_ORDERS]):
        size = 0
        for kind in range(4):
            size += rules[RECIPES + 4 * order + kind]
        largest = max(largest, size)
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] < 0:
            continue
        if state[pot + 6] < 0:
            for kind in range(4):
                out[38 + kind] = min(out[38 + kind] + state[pot + 1 + kind] / largest, 1.0)
            continue
        out[43] = max(out[43], min(state[pot + 5] / max(rules[COOK_TIME], 1), 1.0))
        if state[pot + 5] >= rules[COOK_TIME]:
            out[44] = 1.0
    out[42] = min(state[SOUPS_IN_POTS] / rules[NUM_ORDERS], 1.0)
    for cell in range(rules[HEIGHT] * rules[WIDTH]):
        item = min(state[rules[AT_ITEMS] + cell], SOUP)
        if item > 0:
            out[44 + item] = min(out[44 + item] + 0.25, 1.0)
    for order in range(rules[NUM_ORDERS]):
        if state[rules[AT_ORDERS] + order] != 2:
            out[NUM_FEATURES + order] = 1.0


@kernel
def vector_observations(
    state: Vector, kitchen: Kitchen, rules: Vector, routes: npt.NDArray[np.int16], out: npt.NDArray[np.float32]
) -> None:
    """Write what each player sees; ``out`` ``(players, D)``, zeros."""
    for player in range(rules[NUM_PLAYERS]):
        vector_observation(state, kitchen, rules, routes, player, out[player])
