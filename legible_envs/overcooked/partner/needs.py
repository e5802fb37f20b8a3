"""What is still needed if somebody else brings something too: kernels on the vectors described in ``game.vectors``.

An item is *needed beside others* if the pots can use them all: one more onion is not needed for a soup that lacks one
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

__all__ = ["can_use", "item_at", "needed_beside", "put_away_cells", "shared_counters", "used_cells"]

Flags = npt.NDArray[np.bool_]
Items = npt.NDArray[np.int64]


@kernel
def item_at(state: Vector, kitchen: Kitchen, rules: Vector, cell: int) -> int:
    """The item that empty hands would take from a station or counter; 0 for none, and for pots and serving."""
    code = kitchen[cell]
    if code == COUNTER:
        return int(state[rules[AT_ITEMS] + cell])
    return int(code) - 2 if OBSTACLE < code <= DISH_CELL else 0


@kernel
def can_use(kitchen: Kitchen, rules: Vector, cell: int, code: int) -> bool:
    """Whether one who stands on a cell can get to some station of a code."""
    cells = rules[HEIGHT] * rules[WIDTH]
    for station in range(cells):
        if kitchen[station] == code and usable(station, kitchen[cells + cell], kitchen, rules):
            return True
    return False


@kernel
def _accepted(state: Vector, rules: Vector, item: int) -> bool:
    """Whether some pot takes an ingredient."""
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] >= 0 and accepts(state, rules, pot, item):
            return True
    return False


@kernel
def _place_all(state: Vector, rules: Vector, others: Items, places: int) -> bool:
    """Put others into pots, as far as they are of use; whether they go where ``places`` says.

    Args:
        state: See ``vectors``; changed.
        rules: See ``vectors``.
        others: ``(k,)`` items.
        places: Numbers of their pots as the digits of a number, the first one lowest.
    """
    for other in others:
        number = places % rules[NUM_POTS]
        places //= rules[NUM_POTS]
        if not 0 < other < DISH or not _accepted(state, rules, other):
            continue
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] < 0 or not accepts(state, rules, pot, other):
            return False
        add_to_pot(state, rules, pot, other)
    return True


@kernel
def _accepted_beside(state: Vector, rules: Vector, item: int, others: Items) -> bool:
    """Whether some pot takes an ingredient after all others have gone to pots that take them, in some way."""
    # Not by recursion: numba's cache does not keep functions that call themselves in good order.
    for places in range(rules[NUM_POTS] ** len(others)):
        after = state.copy()
        if _place_all(after, rules, others, places) and _accepted(after, rules, item):
            return True
    return False


@kernel
def needed_beside(state: Vector, rules: Vector, item: int, others: Items) -> bool:
    """Whether an item is of use although somebody else brings others.

    Args:
        state: See ``vectors``.
        rules: See ``vectors``.
        item: An ingredient that a pot is to take, a dish for a soup in a pot, or a soup, which is always needed.
        others: ``(k,)`` what else is brought; what is of no use itself does not count.
    """
    if item >= SOUP:
        return True
    if item < DISH:
        return _accepted_beside(state, rules, item, others)
    wanted = 0
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] >= 0 and state[pot + 6] >= 0:
            wanted += 1
    for other in others:
        if other == DISH:
            wanted -= 1
    return wanted > 0


@kernel
def used_cells(state: Vector, kitchen: Kitchen, rules: Vector, player: int, item: int, cells: Flags) -> None:
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
def put_away_cells(state: Vector, kitchen: Kitchen, rules: Vector, player: int, item: int, cells: Flags) -> None:
    """Mark where a player can put what they hold out of the way: where it came from, and on free counters."""
    count = rules[HEIGHT] * rules[WIDTH]
    region = kitchen[count + state[AT_PLAYERS + 3 * player]]
    for cell in range(count):
        code = kitchen[cell]
        free = code == COUNTER and state[rules[AT_ITEMS] + cell] == 0
        came_from = code == item + 2 and item <= DISH and rules[PUT_BACK] != 0
        cells[cell] = (free or came_from) and usable(cell, region, kitchen, rules)


@kernel
def shared_counters(state: Vector, kitchen: Kitchen, rules: Vector, cells: Flags) -> None:
    """Mark the counters that the first two players can both get to."""
    count = rules[HEIGHT] * rules[WIDTH]
    for cell in range(count):
        cells[cell] = kitchen[cell] == COUNTER
        for player in range(2):
            region = kitchen[count + state[AT_PLAYERS + 3 * player]]
            cells[cell] = cells[cell] and usable(cell, region, kitchen, rules)
