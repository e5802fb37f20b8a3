"""Kitchens and slow, independent computations that several tests share."""

from __future__ import annotations

import itertools
import math

import numpy as np

from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.humans import BoltzmannWalker
from legible_envs.tasks import TaskGraph

OPEN = OvercookedLayout.from_ascii("XOXXTX\nX    X\nX    X\nD    P\nXXSXXX")


def all_shortest_walks(layout: OvercookedLayout, start: str, goal: str):
    """Every shortest walk from station to station, as a list of floor cells; by depth-first enumeration."""
    field = layout.distances_from(layout.access(goal))

    def extend(walk):
        if field[walk[-1]] == 0:
            yield list(walk)
            return
        row, col = walk[-1]
        for after in ((row - 1, col), (row + 1, col), (row, col + 1), (row, col - 1)):
            if layout.is_floor(after) and field[after] == field[walk[-1]] - 1:
                yield from extend([*walk, after])

    nearest = min(field[cell] for cell in layout.access(start))
    for cell in layout.access(start):
        if field[cell] == nearest:
            yield from extend([cell])


def steps_between(layout: OvercookedLayout, cells, goal: str) -> int:
    """Steps from the nearest of the floor cells into a station."""
    field = layout.distances_from(layout.access(goal))
    return min(int(field[cell]) for cell in cells) + 1


def brute_force_legibility(layout: OvercookedLayout, task: TaskGraph, *, weigh, beta=1.0, c=1.0, strict=False) -> float:
    """Eq. 3 per sequence by listing orderings and walks; ``weigh(L)`` gives the weight of each prefix ``t = 1 … L-1``.

    Only for tasks whose subtasks have one goal and one copy each.
    """
    names = [s.name for s in task.subtasks]
    by_name = {s.name: s for s in task.subtasks}
    sequences = [
        order
        for order in itertools.permutations(names)
        if all(order.index(before) < order.index(name) for name in names for before in by_name[name].after)
    ]
    total = 0.0
    for order in sequences:
        place = task.start
        for i, name in enumerate(order):
            done = set(order[:i])
            goals = {by_name[n].goals[0] for n in names if n not in done and done >= set(by_name[n].after)}
            for goal in goals:
                total += brute_force_reach(layout, place, goal, goals, weigh=weigh, beta=beta, c=c, strict=strict)
            subtask = by_name[name]
            place = subtask.then[-1] if subtask.then else subtask.goals[0]
    return total / len(sequences)


def brute_force_reach(layout, start, goal, goals, *, weigh, beta=1.0, c=1.0, strict=False) -> float:
    """Expected legibility of one reach: Eq. 1 and 2 on every prefix of every shortest walk."""
    walks = list(all_shortest_walks(layout, start, goal))
    best = {g: steps_between(layout, layout.access(start), g) + 1 for g in goals}
    total = 0.0
    for walk in walks:
        length = len(walk) + 1
        for t, weight in zip(range(1, length), weigh(length), strict=True):
            cost = {g: t + steps_between(layout, [walk[t - 1]], g) - best[g] for g in goals}
            scores = {g: math.exp(-beta * cost[g]) for g in goals}
            posterior = {g: scores[g] / sum(scores.values()) for g in goals}
            top = [g for g in goals if cost[g] == min(cost.values())]
            if top == [goal]:
                others = [posterior[g] for g in goals if g != goal]
                value = posterior[goal] - (max(others) if others else 0.0)
            else:
                value = -c * t * (1.0 if strict else (len(top) - 1) / len(top))
            total += weight * value / len(walks)
    return total


def brisk(**arguments) -> BoltzmannWalker:
    """A walker who neither idles nor looks around."""
    return BoltzmannWalker(idle=0.0, turn=0.0, **arguments)


def random_kitchen(rng: np.random.Generator, shape: tuple[int, int]) -> OvercookedLayout:
    """A random valid kitchen of the design rules."""
    ws = OvercookedWorkspace(shape)
    return ws.decode(ws.sample(1, rng)[0])
