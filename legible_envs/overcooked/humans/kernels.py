"""Kernels of simulated people: where they step next, whole walks, and how long these take.

Cells are flat indices of an ``H x W`` grid; directions are actions, 0 N, 1 S, 2 E, 3 W. How a person decides is a kind
and a vector of numbers: ``BOLTZMANN`` ``[rationality]``, ``PLANNER`` ``[depth, turn_cost, recency, fade, slip]``. What
the models mean is said in ``humans``.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import INTERACT, STAY
from legible_envs.overcooked.grid_kernels import neighbour
from legible_envs.support.compiled import kernel

__all__ = [
    "BOLTZMANN",
    "PLANNER",
    "Way",
    "choose_action",
    "choose_step",
    "look_around",
    "sample_times",
    "sample_walk",
    "step_probabilities",
]

BOLTZMANN: Final = 0
PLANNER: Final = 1

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


class Way(NamedTuple):
    """All that a person needs to know of the way to one goal; ``n = H * W``.

    Attributes:
        height: Rows of the grid.
        width: Columns of the grid.
        floor: ``[n]`` where the person may stand.
        costs: ``[n]`` cost of stepping on each cell.
        station: Cell of the goal.
        best: ``[n]`` least cost from each cell into the goal; ``inf`` where there is no way.
    """

    height: int
    width: int
    floor: Flags
    costs: Floats
    station: int
    best: Floats


@kernel
def is_option(after: int, way: Way) -> bool:
    """Whether a person on the way may step there: into the goal, or onto floor from which it can be reached."""
    return after >= 0 and (after == way.station or (way.floor[after] and way.best[after] < np.inf))


@kernel
def draw_direction(weights: Floats, chance: float) -> int:
    """The direction that a number in [0, 1) picks, each in proportion to its weight."""
    left = chance * weights.sum()
    last = -1
    for direction in range(4):
        if weights[direction] > 0.0:
            last = direction
            if left < weights[direction]:
                return direction
            left -= weights[direction]
    return last


@kernel
def boltzmann_weights(cell: int, way: Way, rationality: float, weights: Floats) -> None:
    """Write to ``weights [4]`` the odds of each step of the local softmax."""
    for direction in range(4):
        after = neighbour(cell, direction, way.height, way.width)
        weights[direction] = np.inf
        if is_option(after, way):
            weights[direction] = 1.0 if after == way.station else way.costs[after] + way.best[after]
    least = weights.min()
    for direction in range(4):
        excess = weights[direction] - least
        weights[direction] = np.exp(-rationality * excess) if excess < np.inf else 0.0


@kernel
def plan_cost(cell: int, heading: int, plan: int, way: Way, memory: Floats, numbers: Floats) -> float:
    """Cost of a plan, as a person sees it: the steps looked ahead, then the beeline.

    Args:
        cell: Where the plan begins.
        heading: Direction of the step before, -1 for none.
        plan: Directions of the steps as the digits of a number to base 4, the first one lowest.
        way: The way to the goal.
        memory: ``[n]`` how freshly each cell is remembered.
        numbers: ``[depth, turn_cost, recency, fade, slip]``.

    Returns:
        The cost; ``inf`` where the plan runs into something.
    """
    total = 0.0
    for _ in range(int(numbers[0])):
        direction = plan % 4
        plan //= 4
        cell = neighbour(cell, direction, way.height, way.width)
        if not is_option(cell, way):
            return np.inf
        if heading >= 0 and direction != heading:
            total += numbers[1]
        heading = direction
        if cell == way.station:
            return total + 1.0
        total += way.costs[cell] + numbers[2] * memory[cell]
    rows = abs(cell // way.width - way.station // way.width)
    return total + rows + abs(cell % way.width - way.station % way.width)


@kernel
def planner_weights(cell: int, heading: int, way: Way, memory: Floats, numbers: Floats, weights: Floats) -> None:
    """Write to ``weights [4]`` the odds of each step: the first steps of the best plans, and slips."""
    cheapest = np.full(4, np.inf)
    for plan in range(4 ** int(numbers[0])):
        cost = plan_cost(cell, heading, plan, way, memory, numbers)
        cheapest[plan % 4] = min(cheapest[plan % 4], cost)
    least = cheapest.min()
    options, best = 0, 0
    for direction in range(4):
        options += is_option(neighbour(cell, direction, way.height, way.width), way)
        best += cheapest[direction] <= least + 1e-9
    for direction in range(4):
        weights[direction] = 0.0
        if is_option(neighbour(cell, direction, way.height, way.width), way):
            weights[direction] = numbers[4] / options
            if least == np.inf:
                weights[direction] = 1.0 / options
            elif cheapest[direction] <= least + 1e-9:
                weights[direction] += (1.0 - numbers[4]) / best


@kernel
def choose_step(
    kind: int, numbers: Floats, cell: int, heading: int, way: Way, memory: Floats, chance: float, weights: Floats
) -> int:
    """The direction of the next step.

    Args:
        kind: ``BOLTZMANN`` or ``PLANNER``.
        numbers: The person; see the module.
        cell: A cell from which the goal can be reached.
        heading: Direction of the step before, -1 for none.
        way: The way to the goal.
        memory: ``[n]`` of the planner; it fades, and remembers ``cell``.
        chance: Number in [0, 1).
        weights: ``[4]`` output: probability (up to a factor) of each direction.
    """
    if kind == BOLTZMANN:
        boltzmann_weights(cell, way, numbers[0], weights)
    else:
        memory *= numbers[3]
        memory[cell] += 1.0
        planner_weights(cell, heading, way, memory, numbers, weights)
    return draw_direction(weights, chance)


@kernel
def sample_walk(
    kind: int, numbers: Floats, start: int, way: Way, rng: np.random.Generator, path: npt.NDArray[np.int64]
) -> int:
    """Write a walk to ``path [longest]``: the floor cells from ``start`` on, then the goal's cell.

    Returns:
        Number of cells written; 0 where the walk did not end in time.
    """
    memory, weights = np.zeros(len(way.floor)), np.empty(4)
    cell, heading = start, -1
    path[0] = start
    for length in range(1, len(path)):
        heading = choose_step(kind, numbers, cell, heading, way, memory, rng.random(), weights)
        cell = neighbour(cell, heading, way.height, way.width)
        path[length] = cell
        if cell == way.station:
            return length + 1
    return 0


@kernel
def look_around(cell: int, height: int, width: int, floor: Flags, chance: float) -> int:
    """A direction in which nobody can walk, each equally likely; -1 where there is none."""
    count = 0
    for direction in range(4):
        after = neighbour(cell, direction, height, width)
        count += after < 0 or not floor[after]
    pick = int(chance * count)
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
    chance: float,
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
        chance: Number in [0, 1) that picks one of the equally good steps.
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
    return int(options[int(chance * count)])


@kernel
def dawdle(cell: int, facing: int, way: Way, idle: float, turn: float, rng: np.random.Generator) -> tuple[int, int]:
    """Ticks spent standing and looking around before something is done, and the facing afterwards."""
    ticks = 0
    while True:
        chance = rng.random()
        if chance >= idle + turn:
            return ticks, facing
        ticks += 1
        if chance >= idle:
            towards = look_around(cell, way.height, way.width, way.floor, rng.random())
            facing = facing if towards < 0 else towards


@kernel
def sample_times(
    path: npt.NDArray[np.int64],
    facing: int,
    way: Way,
    idle: float,
    turn: float,
    rng: np.random.Generator,
    ticks: npt.NDArray[np.int64],
) -> None:
    """Write to ``ticks [T]`` when each cell of ``path [T]`` is entered, and when the goal at its end has been used.

    A step takes one tick and turns the person; using the goal takes one, and one more where it is not faced.
    """
    ticks[0] = 0
    for i in range(1, len(path)):
        direction = 0
        while neighbour(path[i - 1], direction, way.height, way.width) != path[i]:
            direction += 1
        waited, facing = dawdle(path[i - 1], facing, way, idle, turn, rng)
        ticks[i] = ticks[i - 1] + waited + 1
        if i == len(path) - 1 and facing != direction:
            ticks[i] += 1 + dawdle(path[i - 1], direction, way, idle, 0.0, rng)[0]
        facing = direction


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
            after = neighbour(cell, direction, way.height, way.width)
            options += is_option(after, way)
            if after == path[i + 1]:
                taken = direction
        heading = taken
        planned[i] = weights[taken] / weights.sum()
        slipped[i] = 1.0 / options
