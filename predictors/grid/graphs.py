"""A kitchen's floor as the arrays that kernels work on, and the costs of paths into its stations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.overcooked.layout import OvercookedLayout
from predictors.grid.walk_kernels import cheapest_costs, walk_costs

__all__ = ["WalkGraph", "soft_costs", "station_costs", "walk_graph"]


@dataclass(frozen=True, eq=False)
class WalkGraph:
    """The floor cells from which some of the given stations can be reached, by anybody or by one person.

    Attributes:
        layout: The kitchen.
        goals: ``K`` names of stations.
        cells: ``(n, 2)`` row and column of each cell, in reading order.
        index: ``(H, W)`` number of each cell, -1 for all others.
        neighbours: ``(n, 4)`` numbers of the cells beside each, -1 for none.
        access: ``(n, K)`` 1 beside each station, else 0.
        band: Largest difference of two neighbours' numbers.
    """

    layout: OvercookedLayout
    goals: tuple[str, ...]
    cells: npt.NDArray[np.int64]
    index: npt.NDArray[np.int64]
    neighbours: npt.NDArray[np.int64]
    access: npt.NDArray[np.float64]
    band: int

    @cached_property
    def divergence_cost(self) -> float:
        """Uniform cost per step at and below which the sum over all paths diverges: log of the spectral radius."""
        if not len(self.cells):
            return -np.inf
        adjacency = np.zeros((len(self.cells), len(self.cells)))
        for column in self.neighbours.T:
            adjacency[np.flatnonzero(column >= 0), column[column >= 0]] = 1.0
        radius = float(np.linalg.eigvalsh(adjacency)[-1])
        return float(np.log(radius)) if radius > 0 else -np.inf


@lru_cache(maxsize=256)
def walk_graph(layout: OvercookedLayout, goals: tuple[str, ...], within: tuple[Cell, ...] | None = None) -> WalkGraph:
    """The floor of a kitchen from which some of the goals can be reached.

    Args:
        layout: The kitchen.
        goals: ``K`` names of stations.
        within: Only floor connected with one of these cells, of people who walk there: a divided kitchen has floor that
            is out of their reach (:mod:`legible_envs.overcooked.reach`). None for all floor.

    Raises:
        LayoutError: A goal is not a station of this kitchen.
    """
    reach = layout.distances_from([cell for goal in goals for cell in layout.access(goal)]) >= 0
    if within is not None:
        reach &= layout.distances_from(within) >= 0
    cells = np.argwhere(reach)
    index = np.full(layout.shape, -1, dtype=np.int64)
    index[reach] = np.arange(len(cells))
    padded = np.pad(index, 1, constant_values=-1)
    neighbours = np.stack([padded[cells[:, 0] + 1 + dr, cells[:, 1] + 1 + dc] for dr, dc in NEIGHBOURS], axis=1)
    access = np.zeros((len(cells), len(goals)))
    for column, goal in enumerate(goals):
        for row, col in layout.access(goal):
            if index[row, col] >= 0:
                access[index[row, col], column] = 1.0
    away = np.where(neighbours >= 0, np.abs(neighbours - np.arange(len(cells))[:, None]), 0)
    return WalkGraph(layout, goals, cells, index, neighbours, access, int(away.max(initial=0)))


def station_costs(
    layout: OvercookedLayout, goals: tuple[str, ...], cell_costs: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Cost-to-go of the cheapest path from every cell into each station.

    Args:
        layout: The kitchen.
        goals: ``K`` names of stations.
        cell_costs: ``(H, W)`` of entering each cell; entering the station is free. Negative ones are allowed where no
            cycle has a negative cost.

    Returns:
        ``(H, W, K)``, ``inf`` where there is no path. A station's own cell is 0 from itself.
    """
    graph = walk_graph(layout, goals)
    return _on_grid(graph, cheapest_costs(_of_cells(graph, cell_costs), graph.neighbours, graph.access))


def soft_costs(
    layout: OvercookedLayout,
    goals: tuple[str, ...],
    cell_costs: npt.NDArray[np.float64],
    within: tuple[Cell, ...] | None = None,
) -> npt.NDArray[np.float64]:
    """``-log Z``: the soft minimum of the costs of all paths from every cell into each station.

    Args:
        layout: The kitchen.
        goals: ``K`` names of stations.
        cell_costs: ``(H, W)`` of entering each cell; entering the station is free.
        within: Only from floor connected with one of these cells; None for all floor. Elsewhere the sum may diverge.

    Returns:
        ``(H, W, K)``, ``inf`` where there is no path. A station's own cell is 0 from itself.

    Raises:
        ValueError: The sum over all paths diverges, as steps cost too little.
    """
    graph = walk_graph(layout, goals, within)
    costs = _of_cells(graph, cell_costs)
    values, finite = walk_costs(costs, graph.neighbours, graph.band, graph.access)
    if not finite:
        raise ValueError(
            f"the sum over all paths diverges in this kitchen at costs of {costs.min():.4g} to {costs.max():.4g} per "
            f"step: steps cost too little; uniform costs must be above {graph.divergence_cost:.4g}"
        )
    return _on_grid(graph, values)


def _of_cells(graph: WalkGraph, cell_costs: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    if np.shape(cell_costs) != graph.layout.shape:
        raise ValueError(f"cell costs must have the kitchen's shape {graph.layout.shape}, got {np.shape(cell_costs)}")
    costs = np.asarray(cell_costs, dtype=np.float64)[graph.cells[:, 0], graph.cells[:, 1]]
    if not np.isfinite(costs).all():
        row, col = graph.cells[int(np.flatnonzero(~np.isfinite(costs))[0])]
        raise ValueError(f"cell costs must be finite on the floor; row {row}, column {col} is {cell_costs[row, col]}")
    return costs


def _on_grid(graph: WalkGraph, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    grid = np.full((*graph.layout.shape, len(graph.goals)), np.inf)
    grid[graph.cells[:, 0], graph.cells[:, 1]] = values
    for column, goal in enumerate(graph.goals):
        grid[(*graph.layout.stations[goal], column)] = 0.0
    grid.flags.writeable = False
    return grid
