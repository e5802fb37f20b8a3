"""The game's dynamics: kernels on plain arrays, for any number of players.

Every function works on one game, held in the vectors ``rules``, ``kitchen`` and ``state`` described in ``vectors``.

One tick: players who INTERACT do so in the order of their numbers, with the cell they face; then the others turn, and
move if the target is free (players whose moves would share or swap cells stay); then every full pot ticks.

A pot accepts an ingredient if afterwards every unfinished pot can still be completed to an order of its own (orders of
soups on the fire, in hands or on counters are taken): two pots never commit to one order. It starts by itself when it
holds a whole recipe. With ``put_back`` no state is a dead end for a single player: hands can always be emptied where
they were filled, accepted ingredients and soups are always of use, and soups on counters can be picked up again.
What remains: several players can block each other for ever, or, in a kitchen divided by counters, fill all
counters over which they hand objects to each other with objects that only the other side could use up.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import (
    ADDS,
    AT_ITEMS,
    AT_ORDERS,
    AT_PLAYERS,
    AT_POTS,
    COOK_TIME,
    CROSSINGS,
    DELIVER_ONCE,
    DELIVERIES,
    DELIVERS,
    DISH,
    DISH_CELL,
    DISHES_OUT,
    HEIGHT,
    INTERACT,
    NOTHING_HAPPENS,
    NUM_ORDERS,
    NUM_PLAYERS,
    NUM_POTS,
    OVERTIME,
    PICKS_UP,
    POT_CELL,
    POT_RECORD,
    PUT_BACK,
    PUTS_BACK,
    PUTS_DOWN,
    RECIPES,
    SCOOPS,
    SERVING_CELL,
    SOFT,
    SOUP,
    SOUPS_IN_POTS,
    STATE_SIZE,
    STAY,
    STEPS,
    TAKES,
    WIDTH,
    Kitchen,
    Vector,
)
from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.overcooked.layout import COUNTER, FLOOR, OBSTACLE
from legible_envs.support.compiled import kernel

# -- the floor plan ---------------------------------------------------------------------------------------------------


@kernel
def walkable(code: int, rules: Vector) -> bool:
    """Whether players can stand on a cell of this code."""
    return code == FLOOR or (code == OBSTACLE and rules[SOFT] != 0)


@kernel
def label_regions(kitchen: Kitchen, rules: Vector) -> None:
    """Write the regions of a kitchen whose cell codes are given."""
    cells = rules[HEIGHT] * rules[WIDTH]
    stack = np.empty(cells, dtype=np.int32)
    kitchen[cells : 2 * cells] = 0
    label = 0
    for first in range(cells):
        if kitchen[cells + first] != 0 or not walkable(kitchen[first], rules):
            continue
        label += 1
        kitchen[cells + first] = label
        stack[0] = first
        height = 1
        while height > 0:
            height -= 1
            cell = stack[height]
            for direction in range(4):
                following = neighbour(cell, direction, rules[HEIGHT], rules[WIDTH])
                if following >= 0 and kitchen[cells + following] == 0 and walkable(kitchen[following], rules):
                    kitchen[cells + following] = label
                    stack[height] = following
                    height += 1


@kernel
def usable(cell: int, region: int, kitchen: Kitchen, rules: Vector) -> bool:
    """Whether a player of this region can stand next to the cell."""
    cells = rules[HEIGHT] * rules[WIDTH]
    for direction in range(4):
        beside = neighbour(cell, direction, rules[HEIGHT], rules[WIDTH])
        if beside >= 0 and kitchen[cells + beside] == region:
            return True
    return False


# -- pots and orders --------------------------------------------------------------------------------------------------


@kernel
def _fits(state: Vector, rules: Vector, pot: int, item: int, order: int) -> bool:
    """Whether a pot's contents and one more item (0: none) are contained in an order's recipe."""
    for kind in range(4):
        count = state[pot + 1 + kind]
        if item == kind + 1:
            count += 1
        if count > rules[RECIPES + 4 * order + kind]:
            return False
    return True


@kernel
def _open_orders(state: Vector, rules: Vector, pot: int, item: int) -> int:
    """Bit mask of the orders that a pot with one more item could still become."""
    mask = 0
    for order in range(rules[NUM_ORDERS]):
        if state[rules[AT_ORDERS] + order] == 0 and _fits(state, rules, pot, item, order):
            mask |= 1 << order
    return mask


@kernel
def _augment(
    pot: int, candidates: npt.NDArray[np.int64], owner: npt.NDArray[np.int64], visited: npt.NDArray[np.bool_]
) -> bool:
    """Find pot ``pot`` an order, moving other pots to other orders where necessary (Kuhn's matching)."""
    for order in range(owner.shape[0]):
        if (candidates[pot] >> order) & 1 and not visited[order]:
            visited[order] = True
            if owner[order] < 0 or _augment(owner[order], candidates, owner, visited):
                owner[order] = pot
                return True
    return False


@kernel
def accepts(state: Vector, rules: Vector, pot: int, item: int) -> bool:
    """Whether the pot whose record starts at ``pot`` takes an ingredient."""
    if state[pot + 6] >= 0:
        return False
    mine = _open_orders(state, rules, pot, item)
    if mine == 0:
        return False
    if rules[DELIVER_ONCE] == 0:
        return True
    candidates = np.empty(rules[NUM_POTS], dtype=np.int64)
    candidates[0] = mine
    unfinished = 1
    for number in range(rules[NUM_POTS]):
        other = rules[AT_POTS] + POT_RECORD * number
        if other == pot or state[other] < 0 or state[other + 6] >= 0:
            continue
        if state[other + 1] + state[other + 2] + state[other + 3] + state[other + 4] > 0:
            candidates[unfinished] = _open_orders(state, rules, other, 0)
            unfinished += 1
    if unfinished == 1:
        return True
    owner = np.full(rules[NUM_ORDERS], -1, dtype=np.int64)
    for number in range(unfinished):
        if not _augment(number, candidates, owner, np.zeros(rules[NUM_ORDERS], dtype=np.bool_)):
            return False
    return True


@kernel
def pot_at(state: Vector, rules: Vector, cell: int) -> int:
    """Where in ``state`` the record of the pot on a cell starts."""
    for number in range(rules[NUM_POTS]):
        record = rules[AT_POTS] + POT_RECORD * number
        if state[record] == cell:
            return record
    return -1


@kernel
def _complete(state: Vector, rules: Vector, pot: int) -> int:
    """Number of the first open order that the pot's contents fulfil; -1 if none."""
    for order in range(rules[NUM_ORDERS]):
        if state[rules[AT_ORDERS] + order] != 0:
            continue
        equal = True
        for kind in range(4):
            equal = equal and state[pot + 1 + kind] == rules[RECIPES + 4 * order + kind]
        if equal:
            return order
    return -1


# -- one tick ---------------------------------------------------------------------------------------------------------


@kernel
def interaction(state: Vector, kitchen: Kitchen, rules: Vector, player: int) -> int:
    """What INTERACT would do for a player now: one of the constants ``NOTHING_HAPPENS`` to ``DELIVERS``."""
    at = AT_PLAYERS + 3 * player
    held = state[at + 2]
    target = neighbour(state[at], state[at + 1], rules[HEIGHT], rules[WIDTH])
    if target < 0:
        return NOTHING_HAPPENS
    code = kitchen[target]
    if code == COUNTER:
        item = state[rules[AT_ITEMS] + target]
        if held == 0:
            return PICKS_UP if item != 0 else NOTHING_HAPPENS
        return PUTS_DOWN if item == 0 else NOTHING_HAPPENS
    if OBSTACLE < code <= DISH_CELL:
        if held == 0:
            return TAKES
        return PUTS_BACK if held == code - 2 and rules[PUT_BACK] != 0 else NOTHING_HAPPENS
    if code == POT_CELL:
        pot = pot_at(state, rules, target)
        if 0 < held < DISH:
            return ADDS if accepts(state, rules, pot, held) else NOTHING_HAPPENS
        if held == DISH and state[pot + 6] >= 0 and state[pot + 5] >= rules[COOK_TIME]:
            return SCOOPS
    if code == SERVING_CELL and held >= SOUP:
        return DELIVERS
    return NOTHING_HAPPENS


@kernel
def add_to_pot(state: Vector, rules: Vector, pot: int, item: int) -> None:
    """Put an ingredient into the pot whose record starts at ``pot``; a soup that is complete starts."""
    state[pot + item] += 1
    order = _complete(state, rules, pot)
    if order >= 0:
        state[pot + 6] = order
        state[SOUPS_IN_POTS] += 1
        if rules[DELIVER_ONCE] != 0:
            state[rules[AT_ORDERS] + order] = 1


@kernel
def _scoop(state: Vector, rules: Vector, pot: int) -> int:
    item = SOUP + state[pot + 6]
    state[pot + 1 : pot + 6] = 0
    state[pot + 6] = -1
    state[SOUPS_IN_POTS] -= 1
    state[DISHES_OUT] -= 1
    return item


@kernel
def interact(state: Vector, kitchen: Kitchen, rules: Vector, player: int) -> int:
    """Carry out a player's INTERACT and return what it did; see :func:`interaction`."""
    what = interaction(state, kitchen, rules, player)
    if what == NOTHING_HAPPENS:
        return what
    at = AT_PLAYERS + 3 * player
    held = state[at + 2]
    target = neighbour(state[at], state[at + 1], rules[HEIGHT], rules[WIDTH])
    if what == TAKES:
        state[at + 2] = kitchen[target] - 2
        if kitchen[target] == DISH_CELL:
            state[DISHES_OUT] += 1
    elif what == PUTS_BACK:
        state[at + 2] = 0
        if held == DISH:
            state[DISHES_OUT] -= 1
    elif what in (PICKS_UP, PUTS_DOWN):
        state[at + 2] = state[rules[AT_ITEMS] + target]
        state[rules[AT_ITEMS] + target] = held
    elif what == ADDS:
        add_to_pot(state, rules, pot_at(state, rules, target), held)
        state[at + 2] = 0
    elif what == SCOOPS:
        state[at + 2] = _scoop(state, rules, pot_at(state, rules, target))
    else:
        state[at + 2] = 0
        state[DELIVERIES] += 1
        if rules[DELIVER_ONCE] != 0:
            state[rules[AT_ORDERS] + held - SOUP] = 2
    return what


@kernel
def _move_together(state: Vector, targets: Vector) -> None:
    """Move all players to their targets, except those whose moves would share or swap cells with another's."""
    stuck = np.empty(targets.shape[0], dtype=np.bool_)
    blocked = True
    while blocked:
        stuck[:] = False
        for a in range(targets.shape[0]):
            for b in range(a):
                swap = targets[a] == state[AT_PLAYERS + 3 * b] and targets[b] == state[AT_PLAYERS + 3 * a]
                if targets[a] == targets[b] or swap:
                    stuck[a] = stuck[b] = True
        blocked = False
        for player in range(targets.shape[0]):
            # A player who stays may now block another, so look again.
            if stuck[player] and targets[player] != state[AT_PLAYERS + 3 * player]:
                targets[player] = state[AT_PLAYERS + 3 * player]
                blocked = True
    for player in range(targets.shape[0]):
        state[AT_PLAYERS + 3 * player] = targets[player]


@kernel
def _target(state: Vector, kitchen: Kitchen, rules: Vector, player: int, action: int) -> int:
    """Turn a player who moves, and return the cell they would stand on if no other player were there."""
    at = AT_PLAYERS + 3 * player
    cell = state[at]
    if action >= STAY:
        return cell
    state[at + 1] = action
    target = neighbour(cell, action, rules[HEIGHT], rules[WIDTH])
    return target if target >= 0 and walkable(kitchen[target], rules) else cell


@kernel
def _move(state: Vector, kitchen: Kitchen, rules: Vector, actions: npt.NDArray[np.int64]) -> int:
    """Move all players; returns how many stepped onto a virtual obstacle."""
    if rules[NUM_PLAYERS] == 1:
        before = state[AT_PLAYERS]
        state[AT_PLAYERS] = _target(state, kitchen, rules, 0, actions[0])
        crossed = state[AT_PLAYERS] != before and kitchen[state[AT_PLAYERS]] == OBSTACLE
        return 1 if crossed else 0
    targets = np.empty(rules[NUM_PLAYERS], dtype=np.int32)
    before_all = np.empty(rules[NUM_PLAYERS], dtype=np.int32)
    for player in range(rules[NUM_PLAYERS]):
        before_all[player] = state[AT_PLAYERS + 3 * player]
        targets[player] = _target(state, kitchen, rules, player, actions[player])
    _move_together(state, targets)
    crossings = 0
    for player in range(rules[NUM_PLAYERS]):
        cell = state[AT_PLAYERS + 3 * player]
        if cell != before_all[player] and kitchen[cell] == OBSTACLE:
            crossings += 1
    return crossings


@kernel
def step(
    state: Vector, kitchen: Kitchen, rules: Vector, weights: npt.NDArray[np.float64], actions: npt.NDArray[np.int64]
) -> tuple[float, bool]:
    """Advance a game by one tick.

    Args:
        state: ``(state_size,)``, changed in place.
        kitchen: See the module.
        rules: See the module.
        weights: ``(5,)`` float64 rewards for a delivery, an ingredient in a pot, a dish in need, a soup taken, and a
            crossing of a virtual obstacle.
        actions: ``(players,)`` integers 0..5.

    Returns:
        ``(reward, changed)``: the reward of all players together, and whether any INTERACT did something.
    """
    in_need = min(state[DISHES_OUT], state[SOUPS_IN_POTS])
    reward = 0.0
    changed = False
    for player in range(rules[NUM_PLAYERS]):
        if actions[player] != INTERACT:
            continue
        what = interact(state, kitchen, rules, player)
        changed = changed or what != NOTHING_HAPPENS
        if what == DELIVERS:
            reward += weights[0]
        elif what == ADDS:
            reward += weights[1]
        elif what == SCOOPS:
            # The dish stops being one in need, which the difference below takes back.
            reward += weights[2] + weights[3]
    reward += weights[2] * (min(state[DISHES_OUT], state[SOUPS_IN_POTS]) - in_need)
    crossings = _move(state, kitchen, rules, actions)
    state[CROSSINGS] += crossings
    reward += weights[4] * crossings
    for number in range(rules[NUM_POTS]):
        pot = rules[AT_POTS] + POT_RECORD * number
        if state[pot + 6] >= 0 and (state[pot + 5] < rules[COOK_TIME] or rules[OVERTIME] != 0):
            state[pot + 5] += 1
    state[STEPS] += 1
    return reward, changed


@kernel
def is_over(state: Vector, rules: Vector) -> bool:
    """Whether every order is delivered."""
    return rules[DELIVER_ONCE] != 0 and state[DELIVERIES] == rules[NUM_ORDERS]


@kernel
def start(state: Vector, kitchen: Kitchen, rules: Vector) -> None:
    """Write the first state of a game: empty hands, pots and counters, everyone facing north."""
    cells = rules[HEIGHT] * rules[WIDTH]
    state[:] = 0
    for player in range(rules[NUM_PLAYERS]):
        state[AT_PLAYERS + 3 * player] = kitchen[2 * cells + player]
    pot = rules[AT_POTS]
    for cell in range(cells):
        if kitchen[cell] == POT_CELL:
            state[pot] = cell
            state[pot + 6] = -1
            pot += POT_RECORD
    while pot < rules[STATE_SIZE]:
        state[pot] = -1
        state[pot + 6] = -1
        pot += POT_RECORD
