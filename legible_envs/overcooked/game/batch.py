"""Kernels over whole games and many games at once: one row of ``states`` and ``kitchens`` per game; see ``vectors``.

``P`` is the number of players.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.dynamics import is_over, start, step
from legible_envs.overcooked.game.goals import find_actions, find_goals
from legible_envs.overcooked.game.observations import grid_observation, redraw_motion
from legible_envs.overcooked.game.observations import vector_observations as observe_game
from legible_envs.overcooked.game.vectors import AT_PLAYERS, NUM_PLAYERS, STEPS, Kitchen, Vector
from legible_envs.support.compiled import kernel

Vectors = npt.NDArray[np.int32]


@kernel
def step_all(
    states: Vectors,
    kitchen: Kitchen,
    rules: Vector,
    weights: npt.NDArray[np.float64],
    actions: npt.NDArray[np.int64],
    rewards: npt.NDArray[np.float64],
) -> None:
    """Advance ``T`` states of one kitchen by one tick each.

    Args:
        states: ``(T, state_size)``, changed in place.
        kitchen: The kitchen's vector.
        rules: The rules' vector.
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.game.dynamics.step`.
        actions: ``(T, players)`` joint actions.
        rewards: ``(T,)``, written.
    """
    for t in range(states.shape[0]):
        rewards[t], _ = step(states[t], kitchen, rules, weights, actions[t])


@kernel
def begin(
    state: Vector, kitchen: Kitchen, rules: Vector, goals: npt.NDArray[np.bool_], masks: npt.NDArray[np.int8]
) -> None:
    """Start one game and say what each player may reach for and do first.

    Args:
        state: ``(state_size,)``, written.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        goals: ``(P, H*W)``, written.
        masks: ``(P, 6)``, written.
    """
    start(state, kitchen, rules)
    for player in range(rules[NUM_PLAYERS]):
        find_goals(state, kitchen, rules, player, goals[player])
        find_actions(state, kitchen, rules, player, masks[player])


@kernel
def play(
    state: Vector,
    kitchen: Kitchen,
    rules: Vector,
    weights: npt.NDArray[np.float64],
    actions: npt.NDArray[np.int64],
    goals: npt.NDArray[np.bool_],
    masks: npt.NDArray[np.int8],
) -> tuple[float, bool, bool]:
    """Advance one game by one tick; returns ``(reward, over, changed)``.

    Args:
        state: ``(state_size,)``, changed in place.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.game.dynamics.step`.
        actions: ``(P,)`` actions.
        goals: ``(P, H*W)`` goals after the tick before, brought up to date.
        masks: ``(P, 6)``, written.
    """
    reward, changed = step(state, kitchen, rules, weights, actions)
    for player in range(rules[NUM_PLAYERS]):
        if changed:
            find_goals(state, kitchen, rules, player, goals[player])
        find_actions(state, kitchen, rules, player, masks[player])
    return reward, is_over(state, rules), changed


class Batch(NamedTuple):
    """``N`` games under one set of rules, one row each; kernels change all but kitchens and rules.

    Attributes:
        states: ``(N, state_size)``; see ``vectors``.
        kitchens: ``(N, kitchen size)``.
        rules: One vector for all.
        goals: ``(N, P, H*W)`` valid goals of each player after the last tick.
        drawn: ``(N, P)`` cells of the players in the last grid observations where nothing has happened since but moves
            and cooking; -1 where the whole grids have to be drawn anew.
        done: ``(N,)`` whether the last tick ended the game; the next one then starts it anew instead.
    """

    states: Vectors
    kitchens: npt.NDArray[np.int16]
    rules: Vector
    goals: npt.NDArray[np.bool_]
    drawn: npt.NDArray[np.int32]
    done: npt.NDArray[np.bool_]


class Outcome(NamedTuple):
    """What a tick of ``N`` games hands back; arrays for kernels to write.

    Attributes:
        masks: ``(N, P, 6)`` actions that do something.
        rewards: ``(N,)``.
        terminated: ``(N,)``.
        truncated: ``(N,)``.
    """

    masks: npt.NDArray[np.int8]
    rewards: npt.NDArray[np.float64]
    terminated: npt.NDArray[np.bool_]
    truncated: npt.NDArray[np.bool_]


@kernel
def play_all(
    states: Vectors,
    kitchens: npt.NDArray[np.int16],
    rules: Vector,
    goals: npt.NDArray[np.bool_],
    drawn: npt.NDArray[np.int32],
    done: npt.NDArray[np.bool_],
    weights: npt.NDArray[np.float64],
    limit: int,
    actions: npt.NDArray[np.int64],
    masks: npt.NDArray[np.int8],
    rewards: npt.NDArray[np.float64],
    terminated: npt.NDArray[np.bool_],
    truncated: npt.NDArray[np.bool_],
) -> int:
    """Advance ``N`` games by one tick, or start them anew; returns how many ended.

    Called as ``play_all(*games, weights, limit, actions, *outcome)`` with a :class:`Batch` and an :class:`Outcome`:
    the compiler's wrapper takes 2 microseconds longer to look into a named tuple, a twentieth of a tick of 64 games.

    Args:
        states: See :class:`Batch`, as the next five; changed in place.
        kitchens: Not changed.
        rules: Not changed.
        goals: Brought up to date.
        drawn: Set to -1 where more has changed than :func:`refresh_grids` looks for.
        done: Whether to start the game anew instead; then whether it ended.
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.game.dynamics.step`.
        limit: Steps after which a game is truncated; 0 means never.
        actions: ``(N, P)`` actions; ignored where a game starts anew.
        masks: See :class:`Outcome`, as the next three; written.
        rewards: Written.
        terminated: Written.
        truncated: Written.
    """
    ended = 0
    for i in range(states.shape[0]):
        if done[i]:
            begin(states[i], kitchens[i], rules, goals[i], masks[i])
            rewards[i] = 0.0
            terminated[i] = truncated[i] = done[i] = False
            drawn[i, 0] = -1
            continue
        rewards[i], over, changed = play(states[i], kitchens[i], rules, weights, actions[i], goals[i], masks[i])
        if changed:
            drawn[i, 0] = -1
        terminated[i] = over
        truncated[i] = 0 < limit <= states[i, STEPS]
        done[i] = terminated[i] or truncated[i]
        if done[i]:
            ended += 1
    return ended


@kernel
def play_back(
    kitchen: Kitchen,
    rules: Vector,
    actions: npt.NDArray[np.int64],
    states: Vectors,
    goals: npt.NDArray[np.bool_],
) -> None:
    """Write all states of a game, and the valid goals in each, from its actions.

    Args:
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        actions: ``(T, P)``.
        states: ``(T + 1, state_size)``, written.
        goals: ``(T + 1, P, H*W)``, written.
    """
    weights, masks = np.zeros(5), np.empty((rules[NUM_PLAYERS], 6), dtype=np.int8)
    begin(states[0], kitchen, rules, goals[0], masks)
    for t in range(len(actions)):
        states[t + 1] = states[t]
        goals[t + 1] = goals[t]
        play(states[t + 1], kitchen, rules, weights, actions[t], goals[t + 1], masks)


@kernel
def refresh_grids(
    states: Vectors,
    kitchens: npt.NDArray[np.int16],
    rules: Vector,
    drawn: npt.NDArray[np.int32],
    grids: npt.NDArray[np.uint8],
) -> None:
    """Bring the ``(N, P, H, W, C)`` grid observations of one tick ago up to date; see :class:`Batch` for the others."""
    for i in range(states.shape[0]):
        for player in range(rules[NUM_PLAYERS]):
            if drawn[i, 0] < 0:
                grids[i, player] = 0
                grid_observation(states[i], kitchens[i], rules, player, grids[i, player])
            else:
                redraw_motion(states[i], rules, player, drawn[i], grids[i, player])
        for player in range(rules[NUM_PLAYERS]):
            drawn[i, player] = states[i, AT_PLAYERS + 3 * player]


@kernel
def vector_observations(
    states: Vectors,
    kitchens: npt.NDArray[np.int16],
    rules: Vector,
    routes: npt.NDArray[np.int16],
    out: npt.NDArray[np.float32],
) -> None:
    """Write the ``(N, P, D)`` vector observations of ``N`` games; ``routes`` ``(N, 7, 2, H*W)``, ``out`` zeros."""
    for i in range(states.shape[0]):
        observe_game(states[i], kitchens[i], rules, routes[i], out[i])


@kernel
def find_all_actions(
    states: Vectors, kitchens: npt.NDArray[np.int16], rules: Vector, masks: npt.NDArray[np.int8]
) -> None:
    """Write the ``(N, P, 6)`` masks of actions that do something in ``N`` games."""
    for i in range(states.shape[0]):
        for player in range(rules[NUM_PLAYERS]):
            find_actions(states[i], kitchens[i], rules, player, masks[i, player])


@kernel
def all_within(values: npt.NDArray[np.int64], end: int) -> bool:
    """Whether all integers lie in ``0 .. end - 1``."""
    for value in values:
        if value < 0 or value >= end:
            return False
    return True
