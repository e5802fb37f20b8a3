"""The legibility of a workspace, in plain Python: the definition every fast kernel is tested against.

Equations are those of Tung, Luebbers, Roncone and Hayes, *Workspace Optimization Techniques to Improve Prediction of
Human Motion During Human-Robot Collaboration* (HRI 2024). A person moves from a start to a goal along an optimal path,
each optimal path equally likely. After every step an observer infers the posterior over the valid goals (Eq. 1). The
trajectory is legible where the true goal leads by a margin, and costs the more the longer the observer was wrong or
undecided (Eq. 2). Eq. 3 adds this up over all stages of a task.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

from legible_envs.observer import ObserverModel, PrefixSpec
from legible_envs.tasks import TaskGraph

__all__ = [
    "From",
    "Graph",
    "PrefixScore",
    "costs_to_goals",
    "env_legibility",
    "goal_legibility",
    "in_words",
    "optimal_costs",
    "posterior",
    "prefix_weights",
    "task_legibility",
    "tied_goals",
]

Node = Hashable
Graph = Mapping[Node, Mapping[Node, float]]
"""A directed graph: ``graph[a][b]`` is the cost of the step from ``a`` to ``b`` (> 0)."""


class From(NamedTuple):
    """The node of a place as somewhere to leave: people never pass through the station they left."""

    place: str


Goal = TypeVar("Goal", bound=Hashable)


def posterior(
    remaining: Mapping[Goal, float],
    optimal: Mapping[Goal, float],
    beta: float = 1.0,
    prior: Mapping[Goal, float] | None = None,
) -> dict[Goal, float]:
    """Eq. 1: the probability of each goal given a prefix ``S -> Q``.

    ``P(G | S->Q) ∝ P(G) exp(-beta (C(S->Q) + C*(Q->G) - C*(S->G)))``; the cost so far, ``C(S->Q)``, is the same for
    every goal and cancels.

    Args:
        remaining: ``C*(Q->G)`` for every candidate goal; ``inf`` where there is no path.
        optimal: ``C*(S->G)`` for the same goals.
        beta: Rationality, per unit of cost.
        prior: Prior probability of each goal; uniform if None.

    Returns:
        Probabilities in the order of ``remaining``; they sum to one.
    """
    excess = {goal: remaining[goal] - optimal[goal] for goal in remaining}
    least = min(excess.values())
    weights = {
        goal: (1.0 if prior is None else prior[goal]) * math.exp(-beta * (value - least))
        for goal, value in excess.items()
    }
    total = math.fsum(weights.values())
    return {goal: weight / total for goal, weight in weights.items()}


def tied_goals(
    remaining: Mapping[Goal, float], optimal: Mapping[Goal, float], tie_tolerance: float = 1e-9
) -> list[Goal]:
    """Goals that share the top of the posterior: their excess cost is within ``tie_tolerance`` of the least."""
    excess = {goal: remaining[goal] - optimal[goal] for goal in remaining}
    least = min(excess.values())
    return [goal for goal, value in excess.items() if value - least <= tie_tolerance]


def env_legibility(
    goal: Goal,
    remaining: Mapping[Goal, float],
    optimal: Mapping[Goal, float],
    observed: float,
    observer: ObserverModel = ObserverModel(),
) -> float:
    """Eq. 2: how legible one prefix of a trajectory to ``goal`` is.

    The margin ``p(1) - p(2)`` if the most probable goal is the true one, else ``-c * t``, where ``t`` is what was
    observed in the observer's units. Where ``k`` goals tie at the top, the true one among them, the value is the
    expectation under uniform tie-breaking, ``-(k-1)/k * c * t`` (a tie has no margin), or ``-c * t`` with
    ``ties="strict"``. With one candidate ``p(2) = 0``.

    Args:
        goal: The true goal.
        remaining: ``C*(Q->G)`` for every valid goal.
        optimal: ``C*(S->G)`` for every valid goal.
        observed: How much of the trajectory was observed, in steps or metres.
        observer: How the observer infers goals, and what errors cost.
    """
    t = observed / observer.unit
    top = tied_goals(remaining, optimal, observer.tie_tolerance)
    if goal not in top:
        return -observer.c * t
    if len(top) > 1:
        return -observer.c * t * (1.0 if observer.ties == "strict" else (len(top) - 1) / len(top))
    probabilities = posterior(remaining, optimal, observer.beta)
    return probabilities[goal] - max((p for g, p in probabilities.items() if g != goal), default=0.0)


def prefix_weights(prefix: PrefixSpec, length: int) -> list[float]:
    """Weight of each prefix ``t = 1 … length-1`` of a trajectory of ``length`` steps.

    ``"mean"`` weighs all equally (sum 1), ``"sum"`` gives each weight 1, and fractions ``f`` share weight 1 equally
    among the prefixes ``t = clip(round(f * length), 1, length-1)``.
    """
    steps = length - 1
    if prefix == "mean":
        return [1.0 / steps] * steps
    if prefix == "sum":
        return [1.0] * steps
    weights = [0.0] * steps
    for fraction in prefix:
        weights[min(max(round(float(fraction) * length), 1), steps) - 1] += 1.0 / len(prefix)
    return weights


def optimal_costs(graph: Graph, goal: Node) -> dict[Node, float]:
    """Cost-to-go from every node to ``goal``, ``C*`` (Dijkstra); nodes without a path to it are absent."""
    reverse: dict[Node, list[tuple[Node, float]]] = defaultdict(list)
    for a, edges in graph.items():
        for b, cost in edges.items():
            reverse[b].append((a, cost))
    best: dict[Node, float] = {}
    queue: list[tuple[float, int, Node]] = [(0.0, 0, goal)]
    pushed = 0
    while queue:
        cost, _, node = heapq.heappop(queue)
        if node in best:
            continue
        best[node] = cost
        for before, step in reverse[node]:
            if before not in best:
                pushed += 1
                heapq.heappush(queue, (cost + step, pushed, before))
    return best


def costs_to_goals(graph: Graph, start: Node, goals: Sequence[Node]) -> dict[Node, dict[Node, float]]:
    """:func:`optimal_costs` to each of the goals, all of which can be reached from the start.

    Raises:
        ValueError: A goal cannot be reached from the start.
    """
    costs = {goal: optimal_costs(graph, goal) for goal in goals}
    unreachable = [goal for goal in goals if start not in costs[goal]]
    if unreachable:
        raise ValueError(f"no path from {in_words(start)} to {', '.join(map(in_words, unreachable))}")
    return costs


def in_words(node: Node) -> str:
    """A node as messages name it: a place by its name, whether it is left or arrived at."""
    return repr(node.place if isinstance(node, From) else node)


@dataclass(frozen=True, slots=True)
class PrefixScore:
    """One prefix that an observer may see of trajectories to a goal.

    Attributes:
        step: Steps observed, ``t``.
        node: Where the person is then.
        length: Steps of the whole trajectory; 0 where trajectories of all lengths are taken together.
        probability: Share of all optimal trajectories that are here after ``step`` steps and have this length.
        weight: Weight of this prefix in the trajectory's score.
        tied: Goals at the top of the posterior.
        value: Eq. 2.
        belief: Eq. 1, the probability of each goal.
    """

    step: int
    node: Node
    length: int
    probability: float
    weight: float
    tied: tuple[Hashable, ...]
    value: float
    belief: Mapping[Hashable, float] = field(default_factory=dict)


def goal_legibility(
    graph: Graph,
    start: Node,
    goal: Node,
    goals: Sequence[Node],
    observer: ObserverModel = ObserverModel(),
) -> list[PrefixScore]:
    """Every prefix of every optimal trajectory ``start -> goal``, its probability under uniform choice, and its Eq. 2.

    The expected legibility of these trajectories is ``sum(s.probability * s.weight * s.value)``. They may differ in
    length where step costs differ, so probabilities are resolved by step and by length.

    Args:
        graph: Step costs. No edge leads to the start, none leaves a goal.
        start: Where trajectories begin (step 0).
        goal: The true goal.
        goals: All valid goals.
        observer: Who infers the goals. ``tie_tolerance`` also decides which paths count as equally short.

    Raises:
        ValueError: A goal cannot be reached from the start.
    """
    costs = costs_to_goals(graph, start, goals)
    optimal = {g: costs[g][start] for g in goals}
    onward = {
        node: [
            after
            for after, step in graph[node].items()
            if after in costs[goal] and step + costs[goal][after] - best <= observer.tie_tolerance
        ]
        for node, best in costs[goal].items()
    }
    departing, arriving = _count_trajectories(onward, start, goal)
    lengths = [length for length, layer in enumerate(departing) if goal in layer]
    total = sum(departing[length][goal] for length in lengths)
    scores = []
    for length in lengths:
        weights = prefix_weights(observer.prefix, length)
        for step in range(1, length):
            for node in departing[step].keys() & arriving[length - step].keys():
                probability = departing[step][node] * arriving[length - step][node] / total
                remaining = {g: costs[g].get(node, math.inf) for g in goals}
                value = env_legibility(goal, remaining, optimal, step, observer)
                tied = tuple(tied_goals(remaining, optimal, observer.tie_tolerance))
                belief = posterior(remaining, optimal, observer.beta)
                scores.append(PrefixScore(step, node, length, probability, weights[step - 1], tied, value, belief))
    return scores


_Layers = list[dict[Node, int]]


def _count_trajectories(onward: Mapping[Node, Sequence[Node]], start: Node, goal: Node) -> tuple[_Layers, _Layers]:
    """Number of trajectories ``start -> node`` by steps taken, ``node -> goal`` by steps left (exact integers)."""
    before: dict[Node, list[Node]] = defaultdict(list)
    for node, following in onward.items():
        for after in following:
            before[after].append(node)
    return _layers(onward, start), _layers(before, goal)


def _layers(edges: Mapping[Node, Sequence[Node]], origin: Node) -> _Layers:
    layers: _Layers = [{origin: 1}]
    while layers[-1]:
        following: dict[Node, int] = defaultdict(int)
        for node, count in layers[-1].items():
            for after in edges.get(node, ()):
                following[after] += count
        layers.append(dict(following))
    return layers


def task_legibility(graph: Graph, task: TaskGraph, observer: ObserverModel = ObserverModel()) -> float:
    """Eq. 3 per sequence: ``sum over stages (S, V) of w(S, V) * sum over G in V of E[EnvLegibility]``.

    Args:
        graph: Step costs, with a node ``name`` for every goal of the task and a node ``From(name)`` for every place
            where the person may stand when choosing the next.
        task: The task, whose stage weights ``w`` are exact.
        observer: How the observer infers goals, which prefixes count, and what errors cost.
    """
    total = []
    for stage in task.stages():
        for goal in stage.goals:
            scores = goal_legibility(graph, From(stage.start), goal, stage.goals, observer)
            total += [stage.weight * s.probability * s.weight * s.value for s in scores]
    return math.fsum(total)
