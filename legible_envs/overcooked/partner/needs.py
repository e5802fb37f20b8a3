"""What is still needed if somebody else brings something too: kernels on the vectors described in ``game.vectors``.

An item is *needed beside another* if the pots can use both: one more onion is not needed for a soup that lacks one
onion while somebody brings it, unless another pot takes it for another order.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.dynamics import accepts, add_to_pot, usable
from legible_envs.overcooked.game.vectors import (
    AT_ITEMS,
    AT_PLAYERS,
    AT_POTS,
    DISH,
    DISH_CELL,
    HEIGHT,
    NUM_PLAYERS,
    NUM_POTS,
    POT_RECORD,
    PUT_BACK,
    SOUP,
    WIDTH,
    Kitchen,
    Vector,
)
from legible_envs.overcooked.layout import COUNTER, OBSTACLE
from legible_envs.support.compiled import kernel

__all__ = ["item_at", "needed_beside", "put_away_cells", "used_cells"]


@kernel
def item_at(state: Vector, kitchen: Kitchen, rules: Vector, cell: int) -> int:
    """The item that empty hands would take from a station or counter; 0 for none, and for pots and serving."""
    code = kitchen[cell]
    if code == COUNTER:
        return state[rules[AT_ITEMS] + cell]
    return code - 2 if OBSTACLE < code <= DISH_CELL else 0


@kernel
def _accepted(state: Vector, rules: Vector, item: int) -> bool:
    """Whether some pot takes an ingredient."""
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] >= 0 and accepts(state, rules, pot, item):
            return True
    return False


@kernel
def _dishes_wanted(state: Vector, rules: Vector, but: int) -> int:
    """Soups in pots, less the dishes in the hands of all players but one."""
    wanted = 0
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] >= 0 and state[pot + 6] >= 0:
            wanted += 1
    for player in range(rules[NUM_PLAYERS]):
        if player != but and state[AT_PLAYERS + 3 * player + 2] == DISH:
            wanted -= 1
    return wanted


@kernel
def needed_beside(state: Vector, rules: Vector, player: int, item: int, other: int) -> bool:
    """Whether an item that a player brings is of use although somebody else brings ``other``.

    Args:
        state: See ``vectors``.
        rules: See ``vectors``.
        player: Number of the player, whose own hands do not count.
        item: What the player would bring: an ingredient, a dish, or a soup, which is always needed.
        other: What somebody else, whose hands are empty now or hold just this, brings; 0 for nothing.
    """
    if item >= SOUP:
        return True
    if item == DISH:
        wanted = _dishes_wanted(state, rules, player)
        held = False
        for number in range(rules[NUM_PLAYERS]):
            held = held or (number != player and state[AT_PLAYERS + 3 * number + 2] == DISH)
        return wanted > (1 if other == DISH and not held else 0)
    if not 0 < other < DISH or not _accepted(state, rules, other):
        return _accepted(state, rules, item)
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] >= 0 and accepts(state, rules, pot, other):
            after = state.copy()
            add_to_pot(after, rules, pot, other)
            if _accepted(after, rules, item):
                return True
    return False


@kernel
def used_cells(
    state: Vector, kitchen: Kitchen, rules: Vector, player: int, item: int, cells: npt.NDArray[np.bool_]
) -> None:
    """Mark the pots that take an ingredient in the player's hands, and those whose soup a dish is for."""
    region = kitchen[rules[HEIGHT] * rules[WIDTH] + state[AT_PLAYERS + 3 * player]]
    cells[:] = False
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] < 0 or not usable(state[pot], region, kitchen, rules):
            continue
        if item == DISH:
            cells[state[pot]] = state[pot + 6] >= 0
        else:
            cells[state[pot]] = accepts(state, rules, pot, item)


@kernel
def put_away_cells(
    state: Vector, kitchen: Kitchen, rules: Vector, player: int, item: int, cells: npt.NDArray[np.bool_]
) -> None:
    """Mark where a player can put what they hold out of the way: where it came from, and on free counters."""
    count = rules[HEIGHT] * rules[WIDTH]
    region = kitchen[count + state[AT_PLAYERS + 3 * player]]
    for cell in range(count):
        code = kitchen[cell]
        free = code == COUNTER and state[rules[AT_ITEMS] + cell] == 0
        cells[cell] = (free or (code == item + 2 and item <= DISH and rules[PUT_BACK] != 0)) and usable(
            cell, region, kitchen, rules
        )
