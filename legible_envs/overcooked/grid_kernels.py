"""Kernels on a kitchen's grid: the neighbours of a cell, the fewest steps and the least costs between cells.

Cells are flat indices ``row * width + col`` of an ``H x W`` grid with ``n = H * W`` cells; directions are actions, 0 N,
1 S, 2 E, 3 W. ``floor [n]`` says where a person can stand.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import EAST, NORTH, SOUTH
from legible_envs.support.compiled import kernel

__all__ = ["costs_to", "neighbour", "steps_from"]

Flags = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]


@kernel
def neighbour(cell: int, direction: int, height: int, width: int) -> int:
    """The cell next to a cell in a direction; -1 outside the grid."""
    if direction == NORTH:
        return cell - width if cell >= width else -1
    if direction == SOUTH:
        return cell + width if cell + width < height * width else -1
    if direction == EAST:
        return cell + 1 if cell % width < width - 1 else -1
    return cell - 1 if cell % width > 0 else -1


@kernel
def steps_from(
    sources: npt.NDArray[np.int64], floor: Flags, height: int, width: int, steps: npt.NDArray[np.int32]
) -> None:
    """Write to ``steps [n]`` the fewest moves over floor from the nearest source (breadth-first search).

    Args:
        sources: Cells the search begins at. They need not be floor: from a station's own cell its access cells are one
            step away.
        floor: ``[n]`` where a person can stand.
        height: Rows of the grid.
        width: Columns of the grid.
        steps: ``[n]``, written; 0 at the sources, -1 where no path leads.
    """
    queue = np.empty(len(floor), dtype=np.int64)
    steps[:] = -1
    head, tail = 0, 0
    for cell in sources:
        if steps[cell] < 0:
            steps[cell] = 0
            queue[tail] = cell
            tail += 1
    while head < tail:
        cell = queue[head]
        head += 1
        for direction in range(4):
            after = neighbour(cell, direction, height, width)
            if after >= 0 and floor[after] and steps[after] < 0:
                steps[after] = steps[cell] + 1
                queue[tail] = after
                tail += 1


@kernel
def costs_to(station: int, floor: Flags, costs: Floats, height: int, width: int, cost_to_go: Floats) -> None:
    """Write to ``cost_to_go [n]`` the least cost from each floor cell into a station (Dijkstra).

    The frontier is searched through instead of kept in a heap: on a grid it has few cells.

    Args:
        station: Cell of the station, which is no floor; the last step into it costs 1.
        floor: ``[n]`` where a person can stand.
        costs: ``[n]`` cost of stepping on each cell; at least 0 on the floor.
        height: Rows of the grid.
        width: Columns of the grid.
        cost_to_go: ``[n]``, written; ``inf`` where no path leads, and off the floor.
    """
    cost_to_go[:] = np.inf
    frontier = np.empty(len(floor), dtype=np.int64)
    waiting = 0
    for direction in range(4):
        cell = neighbour(station, direction, height, width)
        if cell >= 0 and floor[cell]:
            cost_to_go[cell] = 1.0
            frontier[waiting] = cell
            waiting += 1
    while waiting > 0:
        nearest = 0
        for i in range(1, waiting):
            if cost_to_go[frontier[i]] < cost_to_go[frontier[nearest]]:
                nearest = i
        cell = frontier[nearest]
        waiting -= 1
        frontier[nearest] = frontier[waiting]
        cost = costs[cell] + cost_to_go[cell]
        for direction in range(4):
            before = neighbour(cell, direction, height, width)
            if before >= 0 and floor[before] and cost < cost_to_go[before]:
                if cost_to_go[before] == np.inf:
                    frontier[waiting] = before
                    waiting += 1
                cost_to_go[before] = cost
