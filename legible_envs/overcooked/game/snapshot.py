"""From the vectors of the dynamics to words, text and pictures."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.rules import GameRules
from legible_envs.overcooked.game.vectors import (
    AT_ITEMS,
    AT_ORDERS,
    AT_PLAYERS,
    AT_POTS,
    CROSSINGS,
    DISH,
    NUM_PLAYERS,
    POT_RECORD,
    SOUP,
    STEPS,
    Vector,
)
from legible_envs.overcooked.game.view import GameView, Item, PlayerView, PotView
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout

__all__ = ["make_view", "name_goals", "to_text"]


_ARROWS: Final = "^v><"
_LETTERS: Final = {"tomato": "t", "onion": "o", "cabbage": "c", "fish": "f", "dish": "d", "soup": "s"}


def make_view(layout: OvercookedLayout, state: Vector, rules: Vector, game: GameRules) -> GameView:
    """A running game in words.

    Args:
        layout: Its kitchen.
        state: Its state vector.
        rules: Its rules vector.
        game: The rules that the vector was made from.
    """
    width = layout.shape[1]

    def cell_of(flat: int) -> tuple[int, int]:
        return flat // width, flat % width

    def item_of(code: int) -> Item | None:
        if code == 0:
            return None
        if code < DISH:
            return Item(INGREDIENTS[code - 1])
        return Item("dish") if code == DISH else Item("soup", game.recipes[code - SOUP])

    people = state[AT_PLAYERS : AT_PLAYERS + 3 * rules[NUM_PLAYERS]].reshape(-1, 3).tolist()
    items = state[rules[AT_ITEMS] : rules[AT_POTS]].tolist()
    orders = state[rules[AT_ORDERS] : rules[AT_ITEMS]].tolist()
    pots = {}
    for cell, *counts, ticks, order in state[rules[AT_POTS] :].reshape(-1, POT_RECORD).tolist():
        if cell >= 0:
            contents = tuple(kind for kind, n in zip(INGREDIENTS, counts, strict=True) for _ in range(n))
            ready = order >= 0 and ticks >= game.cook_time
            pots[cell_of(cell)] = PotView(contents, ticks, game.cook_time, order >= 0 and not ready, ready)
    return GameView(
        layout=layout,
        players=tuple(PlayerView(cell_of(cell), facing, item_of(held)) for cell, facing, held in people),
        counters={cell_of(cell): item for cell, code in enumerate(items) if (item := item_of(code)) is not None},
        pots=pots,
        delivered=tuple(recipe for recipe, done in zip(game.recipes, orders, strict=True) if done == 2),
        orders=tuple(recipe for recipe, done in zip(game.recipes, orders, strict=True) if done != 2),
        steps=int(state[STEPS]),
        crossings=int(state[CROSSINGS]),
    )


def to_text(view: GameView) -> str:
    """The game as a drawing in text: the layout's symbols, ``^ v > <`` players, small letters items on counters."""
    rows = [list(row) for row in view.layout.to_ascii().split("\n")]
    for row, col in view.layout.starts:
        rows[row][col] = " "
    for (row, col), item in view.counters.items():
        rows[row][col] = _LETTERS[item.kind]
    for player in view.players:
        rows[player.cell[0]][player.cell[1]] = _ARROWS[player.facing]
    lines = ["".join(row) for row in rows]
    for number, player in enumerate(view.players, 1):
        lines.append(f"player {number} holds {_describe(player.held)}")
    for (row, col), pot in view.pots.items():
        state = "ready" if pot.is_ready else f"cooking {pot.ticks}/{pot.cook_time}" if pot.is_cooking else "waiting"
        lines.append(f"pot ({row},{col}): {' '.join(pot.contents) or 'empty'}, {state}")
    lines.append(f"ordered: {'; '.join(' '.join(recipe) for recipe in view.orders) or 'nothing more'}")
    lines.append(f"step {view.steps}, delivered {len(view.delivered)}, crossings {view.crossings}")
    return "\n".join(lines) + "\n"


def _describe(item: Item | None) -> str:
    if item is None:
        return "nothing"
    return f"a soup of {' '.join(item.contents)}" if item.kind == "soup" else item.kind


def name_goals(layout: OvercookedLayout, goals: npt.NDArray[np.bool_]) -> tuple[str, ...]:
    """Names of the marked cells, in reading order; counters are ``counter@(row,col)``.

    Args:
        layout: The kitchen.
        goals: ``(H*W,)`` or ``(H, W)``.
    """
    names = layout.goal_names
    return tuple([names[cell] for cell in np.flatnonzero(goals).tolist()])
