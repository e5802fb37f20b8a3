"""The searches on a kitchen's grid, against plain ones and networkx's on random floors."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest

from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.grid import EAST, NEIGHBOURS, NORTH, SOUTH, WEST
from legible_envs.overcooked.grid_kernels import costs_to, neighbour, steps_from


def random_floor(rng, shape):
    return rng.random(shape) < rng.choice([0.4, 0.6, 0.8, 0.95])


def graph_of(floor, station=None):
    """Directed moves between floor cells, and into the station."""
    graph = nx.DiGraph()
    for cell in map(tuple, np.argwhere(floor).tolist()):
        graph.add_node(cell)
        for dr, dc in NEIGHBOURS:
            after = (cell[0] + dr, cell[1] + dc)
            inside = 0 <= after[0] < floor.shape[0] and 0 <= after[1] < floor.shape[1]
            if inside and (floor[after] or after == station):
                graph.add_edge(cell, after)
    return graph


def test_directions_are_actions():
    assert (NORTH, SOUTH, EAST, WEST) == (0, 1, 2, 3)
    assert NEIGHBOURS == ((-1, 0), (1, 0), (0, 1), (0, -1))
    for height, width in [(3, 3), (4, 7), (64, 5)]:
        for cell in range(height * width):
            for direction, (dr, dc) in enumerate(NEIGHBOURS):
                row, col = cell // width + dr, cell % width + dc
                inside = 0 <= row < height and 0 <= col < width
                assert neighbour(cell, direction, height, width) == (row * width + col if inside else -1)


def test_steps_are_the_fewest():
    rng = np.random.default_rng(0)
    for _ in range(200):
        shape = tuple(rng.integers(3, 10, 2).tolist())
        floor = random_floor(rng, shape)
        sources = rng.integers(floor.size, size=rng.integers(1, 4))  # repeated ones and counters, too
        steps = np.empty(shape, dtype=np.int32)
        steps_from(sources, floor.ravel(), *shape, steps.ravel())
        expected = np.full(shape, -1)
        for source in sources:
            start = divmod(int(source), shape[1])
            within = floor.copy()
            within[start] = True
            moves = graph_of(within)
            moves.remove_edges_from([(a, b) for a, b in moves.edges if b == start])
            for cell, length in nx.single_source_shortest_path_length(moves, start).items():
                if floor[cell] or cell == start:
                    expected[cell] = length if expected[cell] < 0 else min(expected[cell], length)
        assert steps.tolist() == expected.tolist()


@pytest.mark.parametrize("kind", ["ones", "lognormal", "small", "ties"])
def test_costs_are_the_least(kind):
    """Equal to the last bit to sweeping until nothing changes (Bellman and Ford), and nearly to networkx's Dijkstra."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        shape = tuple(rng.integers(3, 10, 2).tolist())
        floor = random_floor(rng, shape)
        station = tuple(rng.integers(shape).tolist())
        floor[station] = False
        costs = {
            "ones": np.ones(shape),
            "lognormal": np.exp(2 * rng.normal(size=shape)),
            "small": 1e-3 * rng.random(shape),
            "ties": 0.1 * rng.integers(1, 4, shape),
        }[kind]
        found = np.empty(shape)
        costs_to(station[0] * shape[1] + station[1], floor.ravel(), costs.ravel(), *shape, found.ravel())
        assert found.tolist() == swept(floor, costs, station).tolist()
        moves = graph_of(floor, station).reverse()
        for a, b in moves.edges:
            moves.edges[a, b]["cost"] = 1.0 if a == station else float(costs[a])
        moves.add_node(station)
        expected = nx.single_source_dijkstra_path_length(moves, station, weight="cost")
        del expected[station]
        assert {cell: found[cell] for cell in map(tuple, np.argwhere(found < np.inf).tolist())} == pytest.approx(
            expected, rel=1e-12
        )


def swept(floor, costs, station):
    best, changed = np.full(floor.shape, np.inf), True
    while changed:
        changed = False
        for cell, after in graph_of(floor, station).edges:
            cost = 1.0 if after == station else costs[after] + best[after]
            if cost < best[cell]:
                best[cell], changed = cost, True
    return best


def test_layouts_count_their_moves():
    kitchen = OvercookedLayout.from_ascii("XOXXX\nX V X\nX   X\nXXXSX")
    assert kitchen.distances_from([(1, 1), (0, 0)]).tolist() == [
        [-1, -1, -1, -1, -1],
        [-1, 0, -1, 4, -1],
        [-1, 1, 2, 3, -1],
        [-1, -1, -1, -1, -1],
    ]
    assert (kitchen.distances_from([]) == -1).all()
