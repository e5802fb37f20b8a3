"""Kernels of simulated participants: their next step, whole paths, and how long these take.

Cells are flat indices of an ``H x W`` grid; directions are actions, 0 N, 1 S, 2 E, 3 W. How a person decides is a kind
and a vector of parameters: ``BOLTZMANN`` ``[rationality]``, ``PLANNER`` ``[depth, turn_cost, recency, fade, slip]``,
``CLONED`` the weights of the features in ``policy_kernels``. The models are explained in ``humans``.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import INTERACT, STAY
from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.overcooked.humans.field_kernels import GoalField, is_option
from legible_envs.overcooked.humans.policy_kernels import cloned_weights
from legible_envs.support.compiled import kernel
from legible_envs.support.random_kernels import Bits, random

__all__ = [
    "BOLTZMANN",
    "CLONED",
    "PLANNER",
    "GoalField",
    "choose_action",
    "choose_step",
    "look_around",
    "sample_times",
    "sample_walk",
    "step_probabilities",
]

BOLTZMANN: Final = 0
PLANNER: Final = 1
CLONED: Final = 2

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@kernel
def draw_direction(weights: Floats, u: float) -> int:
    """The direction that a number in [0, 1) picks, each in proportion to its weight."""
    left = u * weights.sum()
    last = -1
    for direction in range(4):
        if weights[direction] > 0.0:
            last = direction
            if left < weights[direction]:
                return direction
            left -= weights[direction]
    return last


@kernel
def boltzmann_weights(cell: int, field: GoalField, rationality: float, weights: Floats) -> None:
    """Write to ``weights [4]`` the odds of each step of the local softmax."""
    for direction in range(4):
        after = neighbour(cell, direction, field.height, field.width)
        weights[direction] = np.inf
        if is_option(after, field):
            weights[direction] = 1.0 if after == field.station else field.costs[after] + field.cost_to_go[after]
    least = weights.min()
    for direction in range(4):
        excess = weights[direction] - least
        weights[direction] = np.exp(-rationality * excess) if excess < np.inf else 0.0


@kernel
def plan_cost(cell: int, heading: int, plan: int, field: GoalField, memory: Floats, params: Floats) -> float:
    """Cost of a plan, as a person sees it: the steps looked ahead, then the beeline.

    Args:
        cell: Where the plan begins.
        heading: Direction of the step before, -1 for none.
        plan: Directions of the steps as the digits of a number to base 4, the first one lowest.
        field: Of the goal.
        memory: ``[n]`` how freshly each cell is remembered.
        params: ``[depth, turn_cost, recency, fade, slip]``.

    Returns:
        The cost; ``inf`` where the plan runs into something.
    """
    total = 0.0
    for _ in range(int(params[0])):
        direction = plan % 4
        plan //= 4
        cell = neighbour(cell, direction, field.height, field.width)
        if not is_option(cell, field):
            return np.inf
        if heading >= 0 and direction != heading:
            total += params[1]
        heading = direction
        if cell == field.station:
            return total + 1.0
        total += field.costs[cell] + params[2] * memory[cell]
    rows = abs(cell // field.width - field.station // field.width)
    return total + rows + abs(cell % field.width - field.station % field.width)


@kernel
def planner_weights(cell: int, heading: int, field: GoalField, memory: Floats, params: Floats, weights: Floats) -> None:
    """Write to ``weights [4]`` the odds of each step: the first steps of the best plans, and slips."""
    cheapest = np.full(4, np.inf)
    for plan in range(4 ** int(params[0])):
        cost = plan_cost(cell, heading, plan, field, memory, params)
        cheapest[plan % 4] = min(cheapest[plan % 4], cost)
    least = cheapest.min()
    options, best = 0, 0
    for direction in range(4):
        options += is_option(neighbour(cell, direction, field.height, field.width), field)
        best += cheapest[direction] <= least + 1e-9
    for direction in range(4):
        weights[direction] = 0.0
        if is_option(neighbour(cell, direction, field.height, field.width), field):
            weights[direction] = params[4] / options
            if least == np.inf:
                weights[direction] = 1.0 / options
            elif cheapest[direction] <= least + 1e-9:
                weights[direction] += (1.0 - params[4]) / best


@kernel
def choose_step(
    kind: int, params: Floats, cell: int, heading: int, field: GoalField, memory: Floats, u: float, weights: Floats
) -> int:
    """The direction of the next step.

    Args:
        kind: ``BOLTZMANN``, ``PLANNER`` or ``CLONED``.
        params: The person; see the module.
        cell: A cell from which the goal can be reached.
        heading: Direction of the step before, -1 for none.
        field: Of the goal.
        memory: ``[n]`` of the planner; it fades, and remembers ``cell``.
        u: Number in [0, 1).
        weights: ``[4]`` output: probability (up to a factor) of each direction.
    """
    if kind == BOLTZMANN:
        boltzmann_weights(cell, field, params[0], weights)
    elif kind == CLONED:
        cloned_weights(cell, heading, field, params, weights)
    else:
        memory *= params[3]
        memory[cell] += 1.0
        planner_weights(cell, heading, field, memory, params, weights)
    return draw_direction(weights, u)


@kernel
def sample_walk(
    bits: Bits, kind: int, params: Floats, start: int, field: GoalField, path: npt.NDArray[np.int64]
) -> int:
    """Write a person's cells to ``path [longest]``: the floor cells from ``start`` on, then the goal's cell.

    Returns:
        Number of cells written; 0 where the person did not find the goal in time.
    """
    memory, weights = np.zeros(len(field.floor)), np.empty(4)
    cell, heading = start, -1
    path[0] = start
    for length in range(1, len(path)):
        heading = choose_step(kind, params, cell, heading, field, memory, random(bits), weights)
        cell = neighbour(cell, heading, field.height, field.width)
        path[length] = cell
        if cell == field.station:
            return length + 1
    return 0


@kernel
def look_around(cell: int, height: int, width: int, floor: Flags, u: float) -> int:
    """A direction in which no step is possible, each equally likely; -1 where there is none."""
    count = 0
    for direction in range(4):
        after = neighbour(cell, direction, height, width)
        count += after < 0 or not floor[after]
    pick = int(u * count)
    for direction in range(4):
        after = neighbour(cell, direction, height, width)
        if after < 0 or not floor[after]:
            if pick == 0:
                return direction
            pick -= 1
    return -1


@kernel
def choose_action(
    cell: int,
    facing: int,
    goal: int,
    steps: npt.NDArray[np.int32],
    height: int,
    width: int,
    can_interact: bool,
    u: float,
) -> int:
    """Next action on a shortest path to a goal; STAY beside a pot that is not ready yet, and where no path leads.

    Args:
        cell: Where the player stands.
        facing: Direction faced.
        goal: Cell of the goal.
        steps: ``[n]`` fewest moves from the goal's cell; -1 where no path leads.
        height: Rows of the grid.
        width: Columns of the grid.
        can_interact: Whether INTERACT would do something now.
        u: Number in [0, 1) that picks one of the equally good steps.
    """
    options = np.empty(4, dtype=np.int64)
    count = 0
    for direction in range(4):
        after = neighbour(cell, direction, height, width)
        if steps[cell] == 1:
            if after == goal:
                if facing != direction:
                    return direction
                return INTERACT if can_interact else STAY
        elif after >= 0 and 0 <= steps[after] < steps[cell]:
            options[count] = direction
            count += 1
    if count == 0:
        return STAY
    return int(options[int(u * count)])


@kernel
def dawdle(bits: Bits, cell: int, facing: int, field: GoalField, idle: float, turn: float) -> tuple[int, int]:
    """Ticks spent standing and looking around before something is done, and the facing afterwards."""
    ticks = 0
    while True:
        u = random(bits)
        if u >= idle + turn:
            return ticks, facing
        ticks += 1
        if u >= idle:
            towards = look_around(cell, field.height, field.width, field.floor, random(bits))
            facing = facing if towards < 0 else towards


@kernel
def sample_times(
    bits: Bits,
    path: npt.NDArray[np.int64],
    facing: int,
    field: GoalField,
    idle: float,
    turn: float,
    ticks: npt.NDArray[np.int64],
) -> None:
    """Write to ``ticks [T]`` when each cell of ``path [T]`` is entered, and when the goal at its end has been used.

    A step takes one tick and turns the person; using the goal takes one, and one more where it is not faced.
    """
    ticks[0] = 0
    for i in range(1, len(path)):
        direction = 0
        while neighbour(path[i - 1], direction, field.height, field.width) != path[i]:
            direction += 1
        waited, facing = dawdle(bits, path[i - 1], facing, field, idle, turn)
        ticks[i] = ticks[i - 1] + waited + 1
        if i == len(path) - 1 and facing != direction:
            ticks[i] += 1 + dawdle(bits, path[i - 1], direction, field, idle, 0.0)[0]
        facing = direction


@kernel
def step_probabilities(
    path: npt.NDArray[np.int64], field: GoalField, params: Floats, planned: Floats, slipped: Floats
) -> None:
    """Write the probability of each step of a trajectory, given where it began.

    A planner who slips with probability ``s`` takes the step with ``(1 - s) * planned + s * slipped``.

    Args:
        path: ``[T]`` cells, the goal's station last; each a step from the one before.
        field: Of the goal.
        params: ``[depth, turn_cost, recency, fade, 0]``.
        planned: ``[T - 1]`` output: probability of the step without slips.
        slipped: ``[T - 1]`` output: probability of the step where every step is a slip.
    """
    memory, weights = np.zeros(len(field.floor)), np.empty(4)
    heading = -1
    for i in range(len(path) - 1):
        cell = path[i]
        memory *= params[3]
        memory[cell] += 1.0
        planner_weights(cell, heading, field, memory, params, weights)
        options, taken = 0, 0
        for direction in range(4):
            after = neighbour(cell, direction, field.height, field.width)
            options += is_option(after, field)
            if after == path[i + 1]:
                taken = direction
        heading = taken
        planned[i] = weights[taken] / weights.sum()
        slipped[i] = 1.0 / options
