"""Kernels over many games at once: one row of ``states`` (and of ``kitchens``) per game; see ``dynamics``."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.compiled import kernel
from legible_envs.overcooked.dynamics import Kitchen, Vector, step

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
