"""Kernels over many games at once: one row of ``states`` (and of ``kitchens``) per game; see ``dynamics``."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.compiled import kernel
from legible_envs.overcooked.dynamics import Kitchen, Vector, is_over, start, step
from legible_envs.overcooked.goals import find_actions, find_goals
from legible_envs.overcooked.observations import grid_observation, vector_observation

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
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.dynamics.step`.
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
        kitchen: See ``dynamics``.
        rules: See ``dynamics``.
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
) -> tuple[float, bool]:
    """Advance one single-player game by one tick; returns its reward and whether it is over.

    Args:
        state: ``(state_size,)``, changed in place.
        kitchen: See ``dynamics``.
        rules: See ``dynamics``.
        weights: ``(5,)`` rewards; see :func:`~legible_envs.overcooked.dynamics.step`.
        actions: ``(1,)`` action.
        goals: ``(H*W,)`` goals after the tick before, brought up to date.
        mask: ``(6,)``, written.
    """
    reward, changed = step(state, kitchen, rules, weights, actions)
    if changed:
        find_goals(state, kitchen, rules, 0, goals)
    find_actions(state, kitchen, rules, 0, mask)
    return reward, is_over(state, rules)


@kernel
def play_all(
    states: Vectors,
    kitchens: npt.NDArray[np.int16],
    rules: Vector,
    weights: npt.NDArray[np.float64],
    actions: npt.NDArray[np.int64],
    restart: npt.NDArray[np.bool_],
    goals: npt.NDArray[np.bool_],
    masks: npt.NDArray[np.int8],
    rewards: npt.NDArray[np.float64],
    over: npt.NDArray[np.bool_],
) -> None:
    """Advance ``N`` single-player games by one tick, or start them anew.

    Args:
        states: ``(N, state_size)``, changed in place.
        kitchens: ``(N, kitchen size)``.
        rules: One vector for all.
        weights: ``(5,)`` rewards.
        actions: ``(N, 1)`` actions; ignored where a game starts anew.
        restart: ``(N,)`` whether to start the game anew instead.
        goals: ``(N, H*W)`` goals after the tick before, brought up to date.
        masks: ``(N, 6)``, written.
        rewards: ``(N,)``, written.
        over: ``(N,)``, written.
    """
    for i in range(states.shape[0]):
        if restart[i]:
            begin(states[i], kitchens[i], rules, goals[i], masks[i])
            rewards[i] = 0.0
            over[i] = False
        else:
            rewards[i], over[i] = play(states[i], kitchens[i], rules, weights, actions[i], goals[i], masks[i])


@kernel
def grid_observations(
    states: Vectors, kitchens: npt.NDArray[np.int16], rules: Vector, grids: npt.NDArray[np.uint8]
) -> None:
    """Write the ``(N, H, W, C)`` grid observations of ``N`` games; ``grids`` holds zeros."""
    for i in range(states.shape[0]):
        grid_observation(states[i], kitchens[i], rules, grids[i])


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
