"""The actions a player may take and the goals they may reach for next: kernels on the vectors described in ``vectors``.

The goals here are those of the running game (the candidate set ``game``): stations and counters where an INTERACT would
bring the game forward, as far as the player can get to them. With one pot they are the goals of
``soup_task(pots=1)`` (ingredients that the begun soup can still use, then a dish, then the pot, then serving), except
that the begun soup need not be decided: after an onion everything is valid that some soup with an onion still needs.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.dynamics import accepts, interaction, is_over, usable, walkable
from legible_envs.overcooked.game.vectors import (
    AT_ITEMS,
    AT_PLAYERS,
    AT_POTS,
    DISH,
    DISH_CELL,
    HEIGHT,
    NOTHING_HAPPENS,
    NUM_ORDERS,
    NUM_PLAYERS,
    NUM_POTS,
    POT_RECORD,
    PUT_BACK,
    RECIPES,
    SERVING_CELL,
    SOUP,
    STAY,
    WIDTH,
    Kitchen,
    Vector,
)
from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.overcooked.layout import COUNTER, OBSTACLE
from legible_envs.support.compiled import kernel

__all__ = ["find_actions", "find_goals", "missing_station"]


@kernel
def missing_station(kitchen: Kitchen, rules: Vector, player: int) -> int:
    """Cell code of a station that the recipes need and the player cannot get to from their start; 0 if none."""
    cells = rules[HEIGHT] * rules[WIDTH]
    region = kitchen[cells + kitchen[2 * cells + player]]
    for code in range(OBSTACLE + 1, SERVING_CELL + 1):
        needed = code >= DISH_CELL
        for order in range(rules[NUM_ORDERS]):
            needed = needed or rules[RECIPES + 4 * order + code - 3] > 0
        for cell in range(cells):
            if needed and kitchen[cell] == code and usable(cell, region, kitchen, rules):
                needed = False
        if needed:
            return code
    return 0


@kernel
def _pot_goals(
    state: Vector, kitchen: Kitchen, rules: Vector, region: int, held: int, goals: npt.NDArray[np.bool_]
) -> bool:
    """Mark the pots that take what is held; whether there are any."""
    found = False
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] < 0 or not usable(state[pot], region, kitchen, rules):
            continue
        if (held == DISH and state[pot + 6] >= 0) or (held < DISH and accepts(state, rules, pot, held)):
            goals[state[pot]] = True
            found = True
    return found


@kernel
def _in_use(cell: int, state: Vector, kitchen: Kitchen, rules: Vector) -> bool:
    """Whether any player can get to a cell: what one cannot bring there, another may be handed."""
    cells = rules[HEIGHT] * rules[WIDTH]
    for player in range(rules[NUM_PLAYERS]):
        if usable(cell, kitchen[cells + state[AT_PLAYERS + 3 * player]], kitchen, rules):
            return True
    return False


@kernel
def _wanted(state: Vector, kitchen: Kitchen, rules: Vector, player: int) -> int:
    """Bit mask of the items that empty hands should fetch; bit 6 stands for every soup."""
    wanted = 1 << SOUP
    soups = 0
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot] < 0 or not _in_use(state[pot], state, kitchen, rules):
            continue
        if state[pot + 6] >= 0:
            soups += 1
            continue
        for item in range(1, DISH):
            if not (wanted >> item) & 1 and accepts(state, rules, pot, item):
                wanted |= 1 << item
    for other in range(rules[NUM_PLAYERS]):
        if other != player and state[AT_PLAYERS + 3 * other + 2] == DISH:
            soups -= 1
    if soups > 0:
        wanted |= 1 << DISH
    return wanted


@kernel
def find_goals(state: Vector, kitchen: Kitchen, rules: Vector, player: int, goals: npt.NDArray[np.bool_]) -> None:
    """Mark the cells that a player may reach for next.

    Empty hands reach for what some pot accepts, for a dish once a soup is on the fire, and for soups on counters; full
    hands for where the item is of use. An item that is of no use now is taken back or put on any free counter. In a
    divided kitchen that is also what somebody else can use, and the counters to hand it over on.

    Args:
        state: See ``vectors``.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        player: Number of the player.
        goals: ``(H*W,)``, written.
    """
    goals[:] = False
    if is_over(state, rules):
        return
    cells = rules[HEIGHT] * rules[WIDTH]
    held = state[AT_PLAYERS + 3 * player + 2]
    region = kitchen[cells + state[AT_PLAYERS + 3 * player]]
    if 0 < held < SOUP and _pot_goals(state, kitchen, rules, region, held, goals):
        return
    wanted = _wanted(state, kitchen, rules, player) if held == 0 else 0
    for cell in range(cells):
        code = kitchen[cell]
        useful = False
        if code == COUNTER:
            item = min(state[rules[AT_ITEMS] + cell], SOUP)
            if held == 0:
                useful = item > 0 and (wanted >> item) & 1 != 0
            else:
                useful = item == 0 and held < SOUP
        elif OBSTACLE < code <= DISH_CELL:
            useful = (wanted >> (code - 2)) & 1 != 0 or (held == code - 2 and rules[PUT_BACK] != 0)
        elif code == SERVING_CELL:
            useful = held >= SOUP
        goals[cell] = useful and usable(cell, region, kitchen, rules)


@kernel
def find_actions(state: Vector, kitchen: Kitchen, rules: Vector, player: int, mask: npt.NDArray[np.int8]) -> None:
    """Mark the actions that do something: turn or move the player, or change what INTERACT can change; STAY always.

    Args:
        state: See ``vectors``.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        player: Number of the player.
        mask: ``(6,)``, written.
    """
    cell = state[AT_PLAYERS + 3 * player]
    facing = state[AT_PLAYERS + 3 * player + 1]
    for direction in range(4):
        target = neighbour(cell, direction, rules[HEIGHT], rules[WIDTH])
        moves = target >= 0 and walkable(kitchen[target], rules)
        mask[direction] = 1 if moves or facing != direction else 0
    mask[STAY] = 1
    mask[STAY + 1] = 1 if interaction(state, kitchen, rules, player) != NOTHING_HAPPENS else 0
