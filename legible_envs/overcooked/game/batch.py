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
    states: Vectors,
    kitchens: npt.NDArray[np.int16],
    rules: Vector,
    goals: npt.NDArray[np.bool_],
    drawn: Vector,
    done: npt.NDArray[np.bool_],
    weights: npt.NDArray[np.float64],
    limit: int,
    actions: npt.NDArray[np.int64],
    masks: npt.NDArray[np.int8],
    rewards: npt.NDArray[np.float64],
    terminated: npt.NDArray[np.bool_],
    truncated: npt.NDArray[np.bool_],
) -> int:
    """Advance ``N`` single-player games by one tick, or start them anew; returns how many ended.

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
        actions: ``(N, 1)`` actions; ignored where a game starts anew.
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
            drawn[i] = -1
            continue
        rewards[i], over, changed = play(states[i], kitchens[i], rules, weights, actions[i], goals[i], masks[i])
        if changed:
            drawn[i] = -1
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
def refresh_grids(
    states: Vectors, kitchens: npt.NDArray[np.int16], rules: Vector, drawn: Vector, grids: npt.NDArray[np.uint8]
) -> None:
    """Bring the ``(N, H, W, C)`` grid observations of one tick ago up to date; see :class:`Batch` for the others."""
    for i in range(states.shape[0]):
        if drawn[i] < 0:
            grids[i] = 0
            grid_observation(states[i], kitchens[i], rules, grids[i])
        else:
            redraw_motion(states[i], rules, drawn[i], grids[i])
        drawn[i] = states[i, AT_PLAYERS]


@kernel
def vector_observations(
    states: Vectors,
    kitchens: npt.NDArray[np.int16],
    rules: Vector,
    routes: npt.NDArray[np.int16],
    out: npt.NDArray[np.float32],
) -> None:
    """Write the ``(N, D)`` vector observations of ``N`` games; ``routes`` ``(N, 7, 2, H*W)``, ``out`` zeros."""
    for i in range(states.shape[0]):
        vector_observation(states[i], kitchens[i], rules, routes[i], out[i])


@kernel
def find_all_actions(
    states: Vectors, kitchens: npt.NDArray[np.int16], rules: Vector, masks: npt.NDArray[np.int8]
) -> None:
    """Write the ``(N, 6)`` masks of actions that do something in ``N`` games."""
    for i in range(states.shape[0]):
        find_actions(states[i], kitchens[i], rules, 0, masks[i])


@kernel
def all_within(values: npt.NDArray[np.int64], end: int) -> bool:
    """Whether all integers lie in ``0 .. end - 1``."""
    for value in values:
        if value < 0 or value >= end:
            return False
    return True
