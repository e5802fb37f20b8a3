"""Kernels over many games at once: one row of ``states`` (and of ``kitchens``) per game; see ``vectors``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.dynamics import is_over, start, step
from legible_envs.overcooked.game.goals import find_actions, find_goals
from legible_envs.overcooked.game.observations import grid_observation, redraw_motion, vector_observation
from legible_envs.overcooked.game.vectors import AT_PLAYERS, STEPS, Kitchen, Vector
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
    state: Vector, kitchen: Kitchen, rules: Vector, goals: npt.NDArray[np.bool_], mask: npt.NDArray[np.int8]
) -> None:
    """Start one single-player game and say what may be reached for and done first.

    Args:
        state: ``(state_size,)``, written.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        goals: ``(H*W,)``, written.
        mask: ``(6,)``, written.
    """
    start(state, kitchen, rules)
    find_goals(state, kitchen, rules, 0, goals)
    find_actions(state, kitchen, rules, 0, mask)


@kernel
def play(
    state: Vector,
    kitchen: Kitchen,
    rules: Vector,
    weights: npt.NDArray[np.float64],
    actions: npt.NDArray[np.int64],
    goals: npt.NDArray[np.bool_],
    mask: npt.NDArray[np.int8],
) -> tuple[float, bool, bool]:
    """Advance one single-player game by one tick; returns ``(reward, over, changed)``.

    Args:
        state: ``(state_size,)``, changed in place.
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.game.dynamics.step`.
        actions: ``(1,)`` action.
        goals: ``(H*W,)`` goals after the tick before, brought up to date.
        mask: ``(6,)``, written.
    """
    reward, changed = step(state, kitchen, rules, weights, actions)
    if changed:
        find_goals(state, kitchen, rules, 0, goals)
    find_actions(state, kitchen, rules, 0, mask)
    return reward, is_over(state, rules), changed


class Batch(NamedTuple):
    """``N`` single-player games under one set of rules, one row each; kernels change all but kitchens and rules.

    Attributes:
        states: ``(N, state_size)``; see ``vectors``.
        kitchens: ``(N, kitchen size)``.
        rules: One vector for all.
        goals: ``(N, H*W)`` valid goals after the last tick.
        drawn: ``(N,)`` cell of the player in the last grid observation where nothing has happened since but moves and
            cooking; -1 where the whole grid has to be drawn anew.
        done: ``(N,)`` whether the last tick ended the game; the next one then starts it anew instead.
    """

    states: Vectors
    kitchens: npt.NDArray[np.int16]
    rules: Vector
    goals: npt.NDArray[np.bool_]
    drawn: Vector
    done: npt.NDArray[np.bool_]


class Outcome(NamedTuple):
    """What a tick of ``N`` games hands back; arrays for kernels to write.

    Attributes:
        masks: ``(N, 6)`` actions that do something.
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
    games: Batch, weights: npt.NDArray[np.float64], limit: int, actions: npt.NDArray[np.int64], outcome: Outcome
) -> int:
    """Advance ``N`` single-player games by one tick, or start them anew; returns how many ended.

    Args:
        games: The games, changed in place.
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.game.dynamics.step`.
        limit: Steps after which a game is truncated; 0 means never.
        actions: ``(N, 1)`` actions; ignored where a game starts anew.
        outcome: Written.
    """
    states, rules, goals, masks = games.states, games.rules, games.goals, outcome.masks
    ended = 0
    for i in range(states.shape[0]):
        if games.done[i]:
            begin(states[i], games.kitchens[i], rules, goals[i], masks[i])
            outcome.rewards[i] = 0.0
            outcome.terminated[i] = outcome.truncated[i] = games.done[i] = False
            games.drawn[i] = -1
            continue
        reward, over, changed = play(states[i], games.kitchens[i], rules, weights, actions[i], goals[i], masks[i])
        if changed:
            games.drawn[i] = -1
        outcome.rewards[i] = reward
        outcome.terminated[i] = over
        outcome.truncated[i] = 0 < limit <= states[i, STEPS]
        games.done[i] = outcome.terminated[i] or outcome.truncated[i]
        if games.done[i]:
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
    """Write all states of a single-player game, and the valid goals in each, from its actions.

    Args:
        kitchen: See ``vectors``.
        rules: See ``vectors``.
        actions: ``(T, 1)``.
        states: ``(T + 1, state_size)``, written.
        goals: ``(T + 1, H*W)``, written.
    """
    weights, mask = np.zeros(5), np.empty(6, dtype=np.int8)
    begin(states[0], kitchen, rules, goals[0], mask)
    for t in range(len(actions)):
        states[t + 1] = states[t]
        goals[t + 1] = goals[t]
        play(states[t + 1], kitchen, rules, weights, actions[t], goals[t + 1], mask)


@kernel
def refresh_grids(games: Batch, grids: npt.NDArray[np.uint8]) -> None:
    """Bring the ``(N, H, W, C)`` grid observations of one tick ago up to date; ``games.drawn`` says how much is new."""
    for i in range(games.states.shape[0]):
        if games.drawn[i] < 0:
            grids[i] = 0
            grid_observation(games.states[i], games.kitchens[i], games.rules, grids[i])
        else:
            redraw_motion(games.states[i], games.rules, games.drawn[i], grids[i])
        games.drawn[i] = games.states[i, AT_PLAYERS]


@kernel
def vector_observations(games: Batch, routes: npt.NDArray[np.int16], out: npt.NDArray[np.float32]) -> None:
    """Write the ``(N, D)`` vector observations of ``N`` games; ``routes`` ``(N, 7, 2, H*W)``, ``out`` zeros."""
    for i in range(games.states.shape[0]):
        vector_observation(games.states[i], games.kitchens[i], games.rules, routes[i], out[i])


@kernel
def all_within(values: npt.NDArray[np.int64], end: int) -> bool:
    """Whether all integers lie in ``0 .. end - 1``."""
    for value in values:
        if value < 0 or value >= end:
            return False
    return True
