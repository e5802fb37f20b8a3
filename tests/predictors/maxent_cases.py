"""Kitchens, costs and walks that the tests of maximum-entropy IRL share."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors.grid.graphs import soft_costs, walk_graph

ROOM = OvercookedLayout.from_ascii("XOXTX\nX   X\nX V D\nX   X\nXXSPX")
GOALS = ("onion", "tomato", "dish")


def neighbours_of(layout: OvercookedLayout, cell: tuple[int, int]) -> list[tuple[int, int]]:
    row, col = cell
    return [c for c in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)) if layout.is_floor(c)]


def random_costs(layout: OvercookedLayout, seed: int, low: float = 1.5, high: float = 3.0) -> Any:
    return np.random.default_rng(seed).uniform(low, high, layout.shape)


def sample_walks(  # steps are looked up, not worked out each time: thousands of walks are drawn
    layout: OvercookedLayout, costs: Any, count: int, rng: np.random.Generator, goals: tuple[str, ...] = GOALS
) -> list[Trajectory]:
    """Walks of the model's own people: each step in proportion to its weight times what is still to come."""
    tables = dict(zip(goals, np.moveaxis(soft_costs(layout, goals, costs), -1, 0), strict=True))
    floor = [tuple(cell) for cell in walk_graph(layout, goals).cells.tolist()]
    steps: dict[Any, Any] = {}
    for goal, cell in itertools.product(goals, floor):
        options: list[Any] = neighbours_of(layout, cell)
        weights = [np.exp(-costs[c] - tables[goal][c]) for c in options]
        if cell in layout.access(goal):
            options, weights = [*options, layout.stations[goal]], [*weights, 1.0]
        steps[goal, cell] = options, np.cumsum(weights) / sum(weights)
    walks = []
    for _ in range(count):
        goal, here = goals[rng.integers(len(goals))], floor[rng.integers(len(floor))]
        cells = [here]
        while True:
            options, shares = steps[goal, here]
            here = options[min(int(np.searchsorted(shares, rng.random(), side="right")), len(options) - 1)]
            cells.append(here)
            if here == layout.stations[goal]:
                break
        walks.append(Trajectory(np.array(cells), goal=goal, candidates=goals, layout=layout))
    return walks
