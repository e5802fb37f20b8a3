"""Recorded games in named arrays, and what the dynamics say should happen next in each of their states.

The arrays are plain, so that they can be stored as they are; ``T`` is the number of states, ``n`` of players, ``K`` of
pots (in reading order of their cells), ``R`` of recipes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.rules import RULE_SETS, GameRules, pack_kitchen, pack_rules
from legible_envs.overcooked.game.vectors import (
    AT_ITEMS,
    AT_ORDERS,
    AT_PLAYERS,
    AT_POTS,
    DELIVERIES,
    DISH,
    DISHES_OUT,
    NUM_POTS,
    POT_RECORD,
    SOUP,
    SOUPS_IN_POTS,
    STATE_SIZE,
)
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout

__all__ = ["GameArrays", "predict_transitions"]


class GameArrays(NamedTuple):
    """States of one kitchen's games.

    Attributes:
        cells: ``(T, n, 2)`` row and column of each player.
        facing: ``(T, n)`` 0 N, 1 S, 2 E, 3 W.
        held: ``(T, n)`` item: 0 nothing, 1 tomato, 2 onion, 3 cabbage, 4 fish, 5 dish, ``6 + r`` soup of recipe ``r``.
        counters: ``(T, H, W)`` item on each counter, coded like ``held``.
        pots: ``(T, K, 5)`` counts of tomato, onion, cabbage, fish; ticks cooked.
        delivered: ``(T, R)`` whether each order is delivered; ignored by rules without ``deliver_once``.
    """

    cells: npt.NDArray[np.int16]
    facing: npt.NDArray[np.int8]
    held: npt.NDArray[np.int8]
    counters: npt.NDArray[np.int8]
    pots: npt.NDArray[np.int16]
    delivered: npt.NDArray[np.bool_] | None = None


def predict_transitions(
    layout: OvercookedLayout,
    states: GameArrays,
    actions: npt.ArrayLike,
    rules: GameRules | str = "overcooked-ai-2019",
) -> tuple[GameArrays, npt.NDArray[np.float64]]:
    """The state after each state, by the dynamics.

    Args:
        layout: The kitchen all states are of.
        states: ``T`` states.
        actions: ``(T, n)`` joint actions, 0 N, 1 S, 2 E, 3 W, 4 STAY, 5 INTERACT.
        rules: A rule set or the name of one (``"overcooked-ai-2019"``, ``"legible"``).

    Returns:
        ``(following, rewards)``: the ``T`` states that follow, and ``(T,)`` rewards (20 per delivery).

    Raises:
        ValueError: Arrays whose shapes do not fit each other or the kitchen; actions, cells, directions or items out of
            range.

    Example:
        >>> following, _ = predict_transitions(layout, states, actions)                   # doctest: +SKIP
        >>> np.array_equal(following.cells[:-1], states.cells[1:])                        # doctest: +SKIP
        True
    """
    from legible_envs.overcooked.game.batch import step_all

    game = RULE_SETS[rules] if isinstance(rules, str) else rules
    joint = np.ascontiguousarray(actions, dtype=np.int64)
    _check_shapes(layout, states, joint, len(game.recipes))
    _check_values(layout, states, len(game.recipes))
    num_pots = len(layout.named("pot"))
    packed = pack_rules(game, layout.shape, joint.shape[1], num_pots)
    starts = [(int(row), int(col)) for row, col in states.cells[0]] if len(joint) else [(0, 0)] * joint.shape[1]
    kitchen = pack_kitchen(layout, packed, starts)
    vectors = _pack(states, layout, game, packed)
    weights = np.array([20.0, 0.0, 0.0, 0.0, 0.0])
    rewards = np.empty(len(joint))
    step_all(vectors, kitchen, packed, weights, joint, rewards)
    return _unpack(vectors, packed), rewards


def _check_shapes(
    layout: OvercookedLayout, states: GameArrays, actions: npt.NDArray[np.int64], num_orders: int
) -> None:
    if actions.ndim != 2 or (actions.size and not (actions.min() >= 0 and actions.max() <= 5)):
        raise ValueError(f"actions must be (T, n) integers 0..5, got shape {actions.shape}")
    count, players = actions.shape
    expected = {
        "cells": (count, players, 2),
        "facing": (count, players),
        "held": (count, players),
        "counters": (count, *layout.shape),
        "pots": (count, len(layout.named("pot")), 5),
        "delivered": (count, num_orders),
    }
    for name, shape in expected.items():
        array = getattr(states, name)
        if array is not None and np.shape(array) != shape:
            raise ValueError(f"`{name}` must have shape {shape} to fit the actions, got {np.shape(array)}")


def _check_values(layout: OvercookedLayout, states: GameArrays, num_orders: int) -> None:
    """The kernels look up cells and orders by these numbers."""
    height, width = layout.shape
    greatest_item = SOUP + num_orders - 1
    ranges: dict[str, tuple[npt.NDArray[Any], int]] = {
        "rows of `cells`": (np.asarray(states.cells)[..., 0], height - 1),
        "columns of `cells`": (np.asarray(states.cells)[..., 1], width - 1),
        "`facing`": (np.asarray(states.facing), 3),
        "`held`": (np.asarray(states.held), greatest_item),
        "`counters`": (np.asarray(states.counters), greatest_item),
    }
    for name, (values, greatest) in ranges.items():
        wrong = ~((values >= 0) & (values <= greatest))
        if wrong.any():
            first = np.argwhere(wrong)[0].tolist()
            raise ValueError(f"{name} must be integers 0..{greatest}, got {values[tuple(first)]} in state {first[0]}")


def _pack(
    states: GameArrays, layout: OvercookedLayout, game: GameRules, rules: npt.NDArray[np.int32]
) -> npt.NDArray[np.int32]:
    """States as the rows that the kernels read."""
    count, players = states.held.shape
    width = layout.shape[1]
    num_pots, num_orders = int(rules[NUM_POTS]), len(game.recipes)
    vectors = np.zeros((count, int(rules[STATE_SIZE])), dtype=np.int32)
    people = vectors[:, AT_PLAYERS : AT_PLAYERS + 3 * players].reshape(count, players, 3)
    people[..., 0] = states.cells[..., 0].astype(np.int32) * width + states.cells[..., 1]
    people[..., 1] = states.facing
    people[..., 2] = states.held
    items = np.asarray(states.counters).reshape(count, -1)
    vectors[:, rules[AT_ITEMS] : rules[AT_ITEMS] + items.shape[1]] = items
    orders = vectors[:, rules[AT_ORDERS] : rules[AT_ORDERS] + num_orders]
    if game.deliver_once:
        loose = np.concatenate([np.asarray(states.held), items], axis=1)
        for order in range(num_orders):
            orders[:, order] = (loose == SOUP + order).any(axis=1)
        if states.delivered is not None:
            orders[np.asarray(states.delivered, dtype=bool)] = 2
    pots = vectors[:, rules[AT_POTS] :].reshape(count, num_pots, POT_RECORD)
    pots[..., 1:6] = states.pots
    pots[..., 6] = -1
    for number, (row, col) in enumerate(layout.stations[name] for name in layout.named("pot")):
        pots[:, number, 0] = row * width + col
        for order, recipe in enumerate(game.recipes):
            counts = [recipe.count(kind) for kind in INGREDIENTS]
            full = (pots[:, number, 1:5] == counts).all(axis=1) & (pots[:, number, 6] < 0) & (orders[:, order] == 0)
            pots[full, number, 6] = order
            if game.deliver_once:
                orders[full, order] = 1
    vectors[:, DELIVERIES] = (orders == 2).sum(axis=1)
    vectors[:, DISHES_OUT] = (people[..., 2] == DISH).sum(axis=1) + (items == DISH).sum(axis=1)
    vectors[:, SOUPS_IN_POTS] = (pots[..., 6] >= 0).sum(axis=1)
    return vectors


def _unpack(vectors: npt.NDArray[np.int32], rules: npt.NDArray[np.int32]) -> GameArrays:
    """The arrays of :class:`GameArrays` from the rows of the kernels."""
    count = len(vectors)
    height, width, players = (int(value) for value in rules[:3])
    people = vectors[:, AT_PLAYERS : AT_PLAYERS + 3 * players].reshape(count, players, 3)
    items = vectors[:, rules[AT_ITEMS] : rules[AT_POTS]].reshape(count, height, width)
    pots = vectors[:, rules[AT_POTS] :].reshape(count, int(rules[NUM_POTS]), POT_RECORD)
    return GameArrays(
        cells=np.stack([people[..., 0] // width, people[..., 0] % width], axis=-1).astype(np.int16),
        facing=people[..., 1].astype(np.int8),
        held=people[..., 2].astype(np.int8),
        counters=items.astype(np.int8),
        pots=pots[..., 1:6].astype(np.int16),
        delivered=vectors[:, rules[AT_ORDERS] : rules[AT_ITEMS]] == 2,
    )
