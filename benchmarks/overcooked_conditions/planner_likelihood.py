"""Kernels: how likely the steps of a recorded walk are for the planner of :mod:`legible_envs.overcooked.walkers`."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.compiled import kernel
from legible_envs.overcooked.walkers import Way, beside, is_option, planner_weights

__all__ = ["step_probabilities"]

Floats = npt.NDArray[np.float64]


@kernel
def step_probabilities(
    path: npt.NDArray[np.int64], way: Way, numbers: Floats, planned: Floats, slipped: Floats
) -> None:
    """Write the probability of each step of a walk, given where it began.

    A planner who slips with probability ``s`` takes the step with ``(1 - s) * planned + s * slipped``.

    Args:
        path: ``[T]`` cells, the goal's station last; each a step from the one before.
        way: The way to the goal.
        numbers: ``[depth, turn_cost, recency, fade, 0]``.
        planned: ``[T - 1]`` output: probability of the step for who never slips.
        slipped: ``[T - 1]`` output: probability of the step for who steps anywhere.
    """
    memory, weights = np.zeros(len(way.floor)), np.empty(4)
    heading = -1
    for i in range(len(path) - 1):
        cell = path[i]
        memory *= numbers[3]
        memory[cell] += 1.0
        planner_weights(cell, heading, way, memory, numbers, weights)
        options, taken = 0, 0
        for direction in range(4):
            after = beside(cell, direction, way.height, way.width)
            options += is_option(after, way)
            if after == path[i + 1]:
                taken = direction
        heading = taken
        planned[i] = weights[taken] / weights.sum()
        slipped[i] = 1.0 / options
