"""The vectors that hold a game for the kernels: where each number is, and the codes of items.

A game is three vectors, so that a batch of games is three matrices:

``rules`` (int32, made by :func:`legible_envs.overcooked.game.rules.pack_rules`): sizes, switches, offsets, recipes.
    ``[height, width, players, pots, orders, cook_time, deliver_once, put_back, overtime, soft, at_orders, at_items,
    at_pots, state_size, 0, 0, recipe 0's counts of tomato onion cabbage fish, recipe 1's, …]``

``kitchen`` (int16, made by :func:`~legible_envs.overcooked.game.rules.pack_kitchen`): what does not change.
    ``[cell codes (H*W), regions (H*W), start cell of each player]``; cells are flat, ``row * width + col``; walkable
    cells that can reach one another carry the same region 1, 2, …, other cells 0.

``state`` (int32): what changes.
    ``[steps, crossings, deliveries, dishes out, soups in pots, (cell, facing, held) of each player, orders (0 open,
    1 claimed by a soup, 2 delivered), item on each cell (H*W), pots (cell or -1, four counts, ticks, order or -1)]``

Facing is an action: 0 N, 1 S, 2 E, 3 W. Items: 0 nothing, 1 tomato, 2 onion, 3 cabbage, 4 fish, 5 dish, ``6 + r`` a
soup of recipe ``r``. For recorded games in named arrays instead of vectors see :mod:`.replay`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.int32]
Kitchen = npt.NDArray[np.int16]

STAY: Final = 4
INTERACT: Final = 5

DISH_CELL: Final = 7
POT_CELL: Final = 8
SERVING_CELL: Final = 9
DISH: Final = 5
SOUP: Final = 6

HEIGHT: Final = 0
WIDTH: Final = 1
NUM_PLAYERS: Final = 2
NUM_POTS: Final = 3
NUM_ORDERS: Final = 4
COOK_TIME: Final = 5
DELIVER_ONCE: Final = 6
PUT_BACK: Final = 7
OVERTIME: Final = 8
SOFT: Final = 9
AT_ORDERS: Final = 10
AT_ITEMS: Final = 11
AT_POTS: Final = 12
STATE_SIZE: Final = 13
RECIPES: Final = 16

STEPS: Final = 0
CROSSINGS: Final = 1
DELIVERIES: Final = 2
DISHES_OUT: Final = 3
SOUPS_IN_POTS: Final = 4
AT_PLAYERS: Final = 5
POT_RECORD: Final = 7

NOTHING_HAPPENS: Final = 0
TAKES: Final = 1
PUTS_BACK: Final = 2
PICKS_UP: Final = 3
PUTS_DOWN: Final = 4
ADDS: Final = 5
SCOOPS: Final = 6
DELIVERS: Final = 7
