"""Shortest paths and legibility on a table, slow and obviously right, by shapely and networkx."""

import itertools
import math

import networkx as nx
import numpy as np
import shapely

from legible_envs.legibility import env_legibility
from legible_envs.observer import ObserverModel
from legible_envs.tabletop import TabletopLayout

SHRINK = 1e-9


def grown(obstacle, by):
    length, width = obstacle.size
    half_length, half_width = length / 2 + by, width / 2 + by
    cos, sin = math.cos(obstacle.angle), math.sin(obstacle.angle)
    return [
        (obstacle.at[0] + u * cos - v * sin, obstacle.at[1] + u * sin + v * cos)
        for u, v in (
            (-half_length, -half_width),
            (half_length, -half_width),
            (half_length, half_width),
            (-half_length, half_width),
        )
    ]


class PathOracle:
    """All pairs of points are tried; only corners where a hand cannot be are dropped.

    ``crossings`` also lets paths bend where sides of obstacles meet each other or the edge of the table.
    """

    def __init__(self, layout: TabletopLayout, crossings: bool = False):
        hand = layout.table.hand
        width, depth = layout.table.size
        self.table = shapely.box(-SHRINK, -SHRINK, width + SHRINK, depth + SHRINK)
        solid = [shapely.Polygon(grown(o, hand - SHRINK)) for o in layout.obstacles]
        self.solid = shapely.union_all(solid) if solid else shapely.Polygon()
        self.pieces = solid
        self.corners = [p for o in layout.obstacles for p in grown(o, hand) if self.free(p)]
        if crossings:
            sides = [shapely.Polygon(grown(o, hand)).exterior for o in layout.obstacles]
            sides.append(shapely.box(0, 0, width, depth).exterior)
            for a, b in itertools.combinations(sides, 2):
                met = shapely.get_coordinates(shapely.intersection(a, b))
                self.corners += [tuple(p) for p in met if self.free(p)]
        self.goals = [tuple(at) for at in layout.centres]

    def free(self, p):
        spot = shapely.Point(p)
        return self.table.covers(spot) and not any(piece.intersects(spot) for piece in self.pieces)

    def clear(self, p, q):
        if p == q:
            return self.free(p)
        line = shapely.LineString([p, q])
        return not any(piece.intersects(line) for piece in self.pieces)

    def graph(self, start):
        points = [("start", start), *(("corner", c) for c in self.corners), *(("goal", g) for g in self.goals)]
        points = [(kind, p, i) for i, (kind, p) in enumerate(points) if self.free(p)]
        graph = nx.Graph()
        graph.add_nodes_from(points)
        lines, ends = [], []
        for i, a in enumerate(points):
            for b in points[:i]:
                if a[1] == b[1]:
                    graph.add_edge(a, b, weight=0.0)
                else:
                    lines.append([a[1], b[1]])
                    ends.append((a, b))
        if lines:
            ways = shapely.linestrings(np.array(lines))
            blocked = np.zeros(len(ways), dtype=bool)
            for piece in self.pieces:
                blocked |= shapely.intersects(ways, piece)
            for (a, b), wall in zip(ends, blocked, strict=True):
                if not wall:
                    graph.add_edge(a, b, weight=math.dist(a[1], b[1]))
        return graph, len(self.corners)

    def lengths(self, start):
        start = (float(start[0]), float(start[1]))
        result = np.full(len(self.goals), np.inf)
        if not self.free(start):
            return result
        graph, num_corners = self.graph(start)
        found = nx.single_source_dijkstra_path_length(graph, ("start", start, 0))
        for g, at in enumerate(self.goals):
            result[g] = found.get(("goal", at, 1 + num_corners + g), math.inf)
        return result


def walk(path, distance):
    """The point this far along a polyline."""
    for a, b in itertools.pairwise(path):
        leg = math.dist(a, b)
        if distance <= leg:
            share = distance / leg if leg else 0.0
            return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
        distance -= leg
    return tuple(path[-1])


def reach_points(layout, start, goal, fractions):
    """Points along the shortest path, and its length."""
    path = [tuple(p) for p in layout.paths.polyline(layout.place(start), goal)]
    length = sum(math.dist(a, b) for a, b in itertools.pairwise(path))
    return [walk(path, f * length) for f in fractions], length


def legibility(layout, task, *, beta=20.0, c=1.0, unit=0.05, fractions=None, ties="expected", tie_tolerance=1e-9):
    """Eq. 3 per sequence by its definition: every stage, every goal, every prefix, every cost anew."""
    fractions = [(i + 0.5) / 10 for i in range(10)] if fractions is None else fractions
    observer = ObserverModel(beta=beta, c=c, ties=ties, tie_tolerance=tie_tolerance, unit=unit)
    oracle = PathOracle(layout)
    lengths = {}

    def costs(point):
        point = (float(point[0]), float(point[1]))
        if point not in lengths:
            lengths[point] = dict(zip(layout.goals, oracle.lengths(point), strict=True))
        return lengths[point]

    reaches = {}
    total = []
    for stage in task.stages():
        optimal = {g: costs(layout.place(stage.start))[g] for g in stage.goals}
        for goal in stage.goals:
            if (stage.start, goal) not in reaches:
                reaches[stage.start, goal] = reach_points(layout, stage.start, goal, fractions)
            points, length = reaches[stage.start, goal]
            for f, point in zip(fractions, points, strict=True):
                remaining = {g: costs(point)[g] for g in stage.goals}
                value = env_legibility(goal, remaining, optimal, f * length, observer)
                total.append(stage.weight * value / len(fractions))
    return math.fsum(total)
