"""The rules of a game as data, and layouts and rules as the plain arrays that the kernels of ``dynamics`` read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.game.vectors import POT_CELL
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout
from legible_envs.overcooked.recipes import PAPER_SOUPS, Recipe, check_recipes
from legible_envs.support.validation import integer

__all__ = ["LEGIBLE", "OVERCOOKED_AI_2019", "RULE_SETS", "GameRules", "count_pots", "pack_kitchen", "pack_rules"]

MAX_ORDERS: Final = 32
MAX_COPIES: Final = 15
"""Most orders, and most copies of one ingredient in a recipe: limits of the bit masks and of the observation."""


@dataclass(frozen=True, slots=True)
class GameRules:
    """The rules of the game, independent of the kitchen.

    Attributes:
        recipes: The soups, in the order of the observation's order channels; :data:`PAPER_SOUPS` by default.
        cook_time: Ticks from the last ingredient to a soup that can be taken.
        deliver_once: Every recipe is an order that is cooked and delivered once; pots, carried soups and soups on
            counters claim orders, so that no ingredient is accepted that could not be used up. False: every pot
            accepts whatever fits a recipe, for ever.
        put_back: An ingredient or an empty dish can be put back at a station of its kind. This leaves no dead end: a
            player whose counters are all taken can still empty the hands.
        overtime: Ticks go on counting after ``cook_time`` (as Overcooked-AI's recordings do) instead of stopping there.
        soft_obstacles: Virtual obstacles can be crossed, and crossings are counted; otherwise they block.

    Raises:
        TaskError: Whatever :func:`~legible_envs.overcooked.recipes.check_recipes` rejects.
        ValueError: More than 32 recipes, more than 15 of one ingredient in a recipe, or a negative cook time.
    """

    recipes: tuple[Recipe, ...] = PAPER_SOUPS
    cook_time: int = 20
    deliver_once: bool = True
    put_back: bool = True
    overtime: bool = False
    soft_obstacles: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "recipes", check_recipes(self.recipes))
        if len(self.recipes) > MAX_ORDERS:
            raise ValueError(f"at most {MAX_ORDERS} recipes can be ordered in one game, got {len(self.recipes)}")
        for recipe in self.recipes:
            if max(recipe.count(i) for i in recipe) > MAX_COPIES:
                raise ValueError(f"a recipe may use an ingredient at most {MAX_COPIES} times, got {recipe}")
        cook_time = integer("cook_time", self.cook_time, 0, 10_000, whole_floats=True, unit="ticks")
        object.__setattr__(self, "cook_time", cook_time)


LEGIBLE: Final = GameRules()
"""The game of ``LegibleOvercooked-v0``."""

OVERCOOKED_AI_2019: Final = GameRules(
    recipes=(("onion", "onion", "onion"),), deliver_once=False, put_back=False, overtime=True
)
"""The game in which Overcooked-AI's 2019 human-human and human-AI data was recorded."""

RULE_SETS: Final = {"legible": LEGIBLE, "overcooked-ai-2019": OVERCOOKED_AI_2019}


def pack_rules(
    rules: GameRules, shape: tuple[int, int], num_players: int = 1, num_pots: int = 1
) -> npt.NDArray[np.int32]:
    """Rules and sizes as the ``rules`` vector described in :mod:`~legible_envs.overcooked.game.vectors`.

    Args:
        rules: The rules.
        shape: Rows and columns of the kitchen.
        num_players: Number of players.
        num_pots: Room for this many pots; kitchens may have fewer.
    """
    height, width = shape
    orders = len(rules.recipes)
    at_orders = 5 + 3 * num_players
    at_items = at_orders + orders
    at_pots = at_items + height * width
    head = [height, width, num_players, num_pots, orders, rules.cook_time, rules.deliver_once, rules.put_back]
    head += [rules.overtime, rules.soft_obstacles, at_orders, at_items, at_pots, at_pots + 7 * num_pots, 0, 0]
    counts = [recipe.count(kind) for recipe in rules.recipes for kind in INGREDIENTS]
    return np.array(head + counts, dtype=np.int32)


def pack_kitchen(
    layout: OvercookedLayout, rules: npt.NDArray[np.int32], starts: Sequence[tuple[int, int]] | None = None
) -> npt.NDArray[np.int16]:
    """A layout as the ``kitchen`` vector described in :mod:`~legible_envs.overcooked.game.vectors`.

    Args:
        layout: The kitchen; its shape must be the one in ``rules``.
        rules: The vector made by :func:`pack_rules`.
        starts: ``(row, col)`` where the players start instead of the layout's own starts.

    Raises:
        LayoutError: Fewer starts than players, or more pots than ``rules`` has room for.
    """
    from legible_envs.overcooked.game.dynamics import label_regions

    starts = layout.starts if starts is None else starts
    height, width, players, pots = (int(value) for value in rules[:4])
    if layout.shape != (height, width):
        raise LayoutError(f"expected a kitchen of shape {(height, width)}, got {layout.shape}", rule="shape")
    if len(starts) < players:
        raise LayoutError(f"{players} players need as many starts; the kitchen has {len(starts)}", rule="start")
    found = count_pots(layout)
    if found > pots:
        raise LayoutError(f"the kitchen has {found} pots, there is room for {pots}", rule="pots")
    cells = height * width
    kitchen = np.empty(2 * cells + players, dtype=np.int16)
    kitchen[:cells] = layout.cells.ravel()
    kitchen[2 * cells :] = [row * width + col for row, col in starts[:players]]
    label_regions(kitchen, rules)
    return kitchen


def count_pots(layout: OvercookedLayout) -> int:
    """Number of pots in a kitchen."""
    return int(np.count_nonzero(layout.cells == POT_CELL))
