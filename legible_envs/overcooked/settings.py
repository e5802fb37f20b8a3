"""Settings of a kitchen environment: arguments checked once, shared by the single and the batched one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from legible_envs.overcooked.game.observations import (
    GRID_CHANNELS,
    NUM_FEATURES,
    NUM_OTHER_FEATURES,
    OTHER_CHANNELS,
    find_routes,
)
from legible_envs.overcooked.game.players import MAX_PLAYERS, check_playable, player_starts
from legible_envs.overcooked.game.rules import RULE_SETS, count_pots, pack_kitchen, pack_rules
from legible_envs.overcooked.game.vectors import Kitchen, Vector
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout, check_shape
from legible_envs.overcooked.layouts import (
    DEFAULT_SHAPE,
    LayoutDistribution,
    default_layout,
    read_distribution,
    read_kitchen,
    shape_of,
)
from legible_envs.overcooked.recipes import check_recipes
from legible_envs.overcooked.rendering.board import RGB_TILE
from legible_envs.support.validation import (
    choice,
    integer,
    is_integer,
    is_masked,
    is_real,
    real,
    shown,
    switched_weights,
)

__all__ = ["NUM_ACTIONS", "OBS_TYPES", "SHAPING", "KitchenSettings", "PackedKitchen", "read_action", "read_actions"]

NUM_ACTIONS: Final = 6

OBS_TYPES: Final = ("grid", "vector", "rgb")
SHAPING: Final[Mapping[str, float]] = {"ingredient": 3.0, "dish": 3.0, "soup": 5.0}
"""Rewards of ``shaping=True``: an ingredient put in a pot, a dish fetched in need, a soup taken."""

DELIVERY_REWARD: Final = 20.0


class PackedKitchen(NamedTuple):
    """A kitchen as the kernels read it; see ``vectors``, and ``observations.find_routes`` for the routes."""

    layout: OvercookedLayout
    rules: Vector
    kitchen: Kitchen
    routes: npt.NDArray[np.int16]


class KitchenSettings:
    """The checked arguments of :class:`~legible_envs.overcooked.env.OvercookedEnv`, which documents them."""

    def __init__(
        self,
        *,
        shape: Sequence[int] | None = None,
        layout: Any = None,
        layouts: Any = None,
        recipes: Sequence[Sequence[str]] | Literal["own"] = "own",
        cook_time: int = 20,
        obs_type: str = "grid",
        virtual_obstacles: str = "hard",
        crossing_cost: float = 0.0,
        shaping: bool | Mapping[str, float] = False,
        num_players: int = 1,
        has_partner: bool = False,
        rules: str = "legible",
    ) -> None:
        asked = None if shape is None else check_shape(shape)
        self.obs_type = choice("obs_type", obs_type, OBS_TYPES)
        virtual_obstacles = choice("virtual_obstacles", virtual_obstacles, ("hard", "soft"))
        crossing_cost = real("crossing_cost", crossing_cost, 0)
        if layout is not None and layouts is not None:
            raise ValueError("give either `layout` (one kitchen) or `layouts` (a distribution), not both")
        takes_own = isinstance(recipes, str) and recipes == "own"
        kitchen = None if layout is None else read_kitchen(layout, asked, orders=takes_own)
        rule_set = RULE_SETS[choice("rules", rules, tuple(RULE_SETS))]
        own = rule_set.recipes if kitchen is None else kitchen.recipes or rule_set.recipes
        self.rules = replace(
            rule_set,
            recipes=check_recipes(own if takes_own else recipes),
            cook_time=cook_time,
            soft_obstacles=virtual_obstacles == "soft",
        )
        self.num_players = integer("num_players", num_players, 1, MAX_PLAYERS, whole_floats=True)
        if has_partner and self.num_players > 1:
            raise ValueError(
                f"with `partner` the agent is one of two players, so `num_players` must be 1, got {num_players}; or "
                "leave `partner` out and control all players"
            )
        self.num_agents = self.num_players
        """Players that an environment's actions and observations are of."""
        self.num_players += has_partner
        bonus = switched_weights("shaping", shaping, SHAPING) or dict.fromkeys(SHAPING, 0.0)
        self.weights = np.array([DELIVERY_REWARD, bonus["ingredient"], bonus["dish"], bonus["soup"], -crossing_cost])
        self.distribution: LayoutDistribution | None = None
        self.layout: OvercookedLayout | None = None
        if layouts is not None:
            self.distribution = read_distribution(layouts, asked)
            self.shape = asked or shape_of(self.distribution)
        else:
            self.layout = default_layout(asked or DEFAULT_SHAPE, self._needed()) if kitchen is None else kitchen.layout
            self.shape = self.layout.shape

    def _needed(self) -> tuple[str, ...]:
        """Types of stations without which the recipes cannot be cooked."""
        ingredients = {kind for recipe in self.rules.recipes for kind in recipe}
        return (*ingredients, "dish", "pot", "serving")

    def preview(self) -> OvercookedLayout:
        """The kitchen before the first reset: the only one, or an example of the distribution."""
        if self.distribution is None:
            assert self.layout is not None
            return self.layout
        return self.distribution.sample(np.random.default_rng(0))

    def pack(self, layout: OvercookedLayout) -> PackedKitchen:
        """The arrays that the kernels read, with room for as many pots as there are.

        Args:
            layout: A kitchen of the right shape.

        Raises:
            LayoutError: The recipes cannot be cooked in this kitchen.
        """
        rules = pack_rules(self.rules, self.shape, self.num_players, count_pots(layout))
        starts = player_starts(layout, self.num_players)
        kitchen = pack_kitchen(layout, rules, starts)
        check_playable(layout, kitchen, rules, starts)
        if self.obs_type != "vector":
            return PackedKitchen(layout, rules, kitchen, np.empty((0, 2, 0), dtype=np.int16))
        routes = np.empty((7, 2, self.shape[0] * self.shape[1]), dtype=np.int16)
        find_routes(kitchen, rules, routes)
        return PackedKitchen(layout, rules, kitchen, routes)

    def action_space(self) -> spaces.Discrete[Any] | spaces.MultiDiscrete[Any]:
        """The space of one environment's actions: those of all players."""
        if self.num_agents == 1:
            return self.player_action_space()
        return spaces.MultiDiscrete([NUM_ACTIONS] * self.num_agents)

    def observation_space(self) -> spaces.Box:
        """The space of one environment's observations: with several players one behind the other."""
        space = self.player_observation_space()
        if self.num_agents == 1:
            return space
        low, high = (np.repeat(bound[None], self.num_agents, axis=0) for bound in (space.low, space.high))
        return spaces.Box(low, high, dtype=space.dtype.type)  # type: ignore[union-attr]

    @staticmethod
    def player_action_space() -> spaces.Discrete[Any]:
        """The space of one player's actions."""
        return spaces.Discrete(NUM_ACTIONS)

    def player_observation_space(self) -> spaces.Box:
        """The space of what one player observes."""
        height, width = self.shape
        orders = len(self.rules.recipes)
        others = self.num_players - 1
        if self.obs_type == "vector":
            return spaces.Box(-1.0, 1.0, (NUM_FEATURES + orders + NUM_OTHER_FEATURES * others,), np.float32)
        if self.obs_type == "rgb":
            return spaces.Box(0, 255, (height * RGB_TILE, width * RGB_TILE, 3), np.uint8)
        channels = len(GRID_CHANNELS) + orders + (len(OTHER_CHANNELS) if others else 0)
        high = np.ones((height, width, channels), dtype=np.uint8)
        for number, kind in enumerate(INGREDIENTS):
            most = max(recipe.count(kind) for recipe in self.rules.recipes)
            high[..., GRID_CHANNELS.index("tomatoes") + number] = max(most, 1)
        longest = 255 if self.rules.overtime else min(self.rules.cook_time, 255)
        high[..., GRID_CHANNELS.index("ticks cooked")] = max(longest, 1)
        return spaces.Box(np.zeros_like(high), high, dtype=np.uint8)


def read_action(action: Any) -> int:
    """An action as a plain integer.

    Args:
        action: An integer 0..5, as a number of Python or numpy or an array of one element.

    Raises:
        ValueError: Anything else.
    """
    if type(action) is int and 0 <= action < NUM_ACTIONS:
        return action  # nearly always; the rest takes a microsecond
    number = action
    if isinstance(number, np.ndarray) and number.size == 1 and not is_masked(number):
        number = number.item()
    if (is_integer(number) or (is_real(number) and float(number).is_integer())) and 0 <= number < NUM_ACTIONS:
        return int(number)
    raise ValueError(f"expected an action 0..{NUM_ACTIONS - 1}, got {shown(action)}")


def read_actions(actions: Any, num_players: int) -> list[int]:
    """A joint action as plain integers.

    Args:
        actions: ``(num_players,)`` integers 0..5, as a list, tuple or array.
        num_players: How many there must be.

    Raises:
        ValueError: Anything else.
    """
    listed = actions.tolist() if isinstance(actions, np.ndarray) and not is_masked(actions) else actions
    if not isinstance(listed, list | tuple) or len(listed) != num_players:
        raise ValueError(f"expected {num_players} actions 0..{NUM_ACTIONS - 1}, one per player, got {shown(actions)}")
    return [read_action(action) for action in listed]
