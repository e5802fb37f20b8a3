"""Kernels of people whose steps are learned: what each step is like, and how likely it is then.

Cells are flat indices of an ``H x W`` grid; directions are actions, 0 N, 1 S, 2 E, 3 W. The features of a step are
explained in ``humans.cloning``, which fits their weights.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.overcooked.humans.field_kernels import GoalField, is_option
from legible_envs.support.compiled import kernel

__all__ = ["NUM_FEATURES", "cloned_weights", "option_features", "path_features", "policy_table"]

NUM_FEATURES: Final = 8
_FAR: Final = 3.0
"""Steps to the goal beyond which a person is far from it."""

Floats = npt.NDArray[np.float64]


@kernel
def option_features(cell: int, heading: int, field: GoalField, features: Floats, weights: Floats) -> None:
    """Write to ``features [4, NUM_FEATURES]`` what each step is like, and to ``weights [4]`` 1 for options, else 0.

    Rows of steps that are no options are 0. The columns are explained in ``humans.cloning``.
    """
    features[:] = 0.0
    row, col = cell // field.width, cell % field.width
    goal_row, goal_col = field.station // field.width, field.station % field.width
    rows, cols = abs(goal_row - row), abs(goal_col - col)
    least = np.inf
    for direction in range(4):
        after = neighbour(cell, direction, field.height, field.width)
        weights[direction] = 0.0
        if is_option(after, field):
            weights[direction] = 1.0
            cost = 1.0 if after == field.station else field.costs[after] + field.cost_to_go[after]
            features[direction, 0] = -cost
            least = min(least, cost)
    for direction in range(4):
        if weights[direction] == 0.0:
            continue
        after = neighbour(cell, direction, field.height, field.width)
        one = features[direction]
        one[0] += least
        one[1] = one[0] if least > _FAR else 0.0
        one[2] = direction == heading
        one[3] = heading >= 0 and direction == heading ^ 1  # N and S, E and W differ in their last bit
        beeline = abs(goal_row - after // field.width) + abs(goal_col - after % field.width)
        one[4] = beeline < rows + cols
        along, across = (rows, cols) if direction < 2 else (cols, rows)
        one[5] = one[4] > 0.0 and along > across
        one[6] = after == field.station
        if after != field.station:
            for beside in range(4):
                there = neighbour(after, beside, field.height, field.width)
                one[7] += 0.25 * (there < 0 or not field.floor[there])


@kernel
def cloned_weights(cell: int, heading: int, field: GoalField, params: Floats, weights: Floats) -> None:
    """Write to ``weights [4]`` the odds of each step of a learned policy: a softmax of weighted features."""
    features = np.empty((4, NUM_FEATURES))
    option_features(cell, heading, field, features, weights)
    greatest = -np.inf
    for direction in range(4):
        if weights[direction] > 0.0:
            features[direction, 0] = (features[direction] * params).sum()
            greatest = max(greatest, features[direction, 0])
    for direction in range(4):
        if weights[direction] > 0.0:
            weights[direction] = np.exp(features[direction, 0] - greatest)


@kernel
def policy_table(field: GoalField, params: Floats, table: Floats) -> None:
    """Write the log-probability of each step of a learned policy, wherever a person may be.

    Args:
        field: Of the goal.
        params: Weights of the features.
        table: ``[n, 5, 4]`` output, by cell, direction of the step before (4 for none) and direction: ``-inf`` for
            steps that are no options; 0 at cells without any.
    """
    features, scores = np.empty((4, NUM_FEATURES)), np.empty(4)
    table[:] = 0.0
    for cell in range(len(field.floor)):
        if not field.floor[cell] or field.cost_to_go[cell] == np.inf:
            continue
        for before in range(5):
            # In logarithms throughout: a step that is hardly ever taken is unlikely, never impossible.
            option_features(cell, before if before < 4 else -1, field, features, scores)
            for direction in range(4):
                scores[direction] = (features[direction] * params).sum() if scores[direction] > 0.0 else -np.inf
            greatest = scores.max()
            table[cell, before] = scores - greatest - np.log(np.exp(scores - greatest).sum())


@kernel
def path_features(
    path: npt.NDArray[np.int64],
    field: GoalField,
    features: Floats,
    options: Floats,
    taken: npt.NDArray[np.int64],
) -> None:
    """Write the choices on a path, given where it began.

    Args:
        path: ``[T]`` cells, the goal's station last; each a step from the one before.
        field: Of the goal.
        features: ``[T - 1, 4, NUM_FEATURES]`` output.
        options: ``[T - 1, 4]`` output: 1 for steps that are possible.
        taken: ``[T - 1]`` output: direction of the step.
    """
    heading = -1
    for i in range(len(path) - 1):
        option_features(path[i], heading, field, features[i], options[i])
        for direction in range(4):
            if neighbour(path[i], direction, field.height, field.width) == path[i + 1]:
                heading = direction
        taken[i] = heading
