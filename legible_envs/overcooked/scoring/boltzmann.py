"""The score of noisily rational people, ``human="boltzmann"``: the readable definition, and how people are described.

At every node of the way to its goal a *Boltzmann walker* draws the next step from a local softmax,

    ``P(a -> b | G) ∝ exp(-rationality * (cost(a, b) + C*(b -> G)))``,

over the steps from which the goal can be reached: to a free neighbouring cell (back where it came from, too), or into
the goal station, where the walk ends. This is the walker whose rationality
:func:`~legible_envs.overcooked.humans.fit_rationality` estimates from recorded play.

The observer is the same as ever: Eq. 1 with optimal costs, which depends on start and current cell alone. Off the
shortest ways its most probable goal may be wrong, which costs ``c`` per step observed (Eq. 2).

**Horizon.** Walks have no longest length, so they are followed for ``horizon`` steps (the first one enters the start's
access cell, the last one the goal station). The score is the expectation over walks that arrive within the horizon,
``E[value | arrived]``; the probability not to have arrived, ``lost_mass``, is left out, and reported beside the score.

**Limit.** As ``rationality`` grows the walker takes, at every cell, each of the steps that lead on by a shortest way
equally often. ``human="shortest"`` draws each shortest *way* equally often. The two are the same where shortest ways do
not fork unevenly (in corridors, for example) and differ a little elsewhere, for ways with few forks are then likelier.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from legible_envs.legibility import (
    Graph,
    Node,
    PrefixScore,
    PrefixSpec,
    Ties,
    env_legibility,
    optimal_costs,
    prefix_weights,
    tied_goals,
)

__all__ = [
    "DEFAULT_RATIONALITY",
    "BoltzmannWalks",
    "HumanModel",
    "PrefixVisit",
    "boltzmann_legibility",
    "boltzmann_walks",
    "check_human",
    "step_probabilities",
]

HumanName = Literal["shortest", "boltzmann"]

DEFAULT_RATIONALITY: Final = 1.3
"""Mean of the four recorded kitchens (1.67, 1.11, 1.29, 1.12 per step)."""


@dataclass(frozen=True)
class HumanModel:
    """How people are assumed to walk.

    Attributes:
        name: ``"shortest"`` or ``"boltzmann"``.
        rationality: Per unit of path cost; None for ``"shortest"``.
        horizon: Steps after which a walk is given up; None for ``"shortest"``.
    """

    name: HumanName = "shortest"
    rationality: float | None = None
    horizon: int | None = None


def check_human(human: str, rationality: float | None, horizon: int | None, num_floor: int) -> HumanModel:
    """The model of people that three settings describe.

    Args:
        human: ``"shortest"`` or ``"boltzmann"``.
        rationality: Per unit of path cost, greater than 0; :data:`DEFAULT_RATIONALITY` if None.
        horizon: Longest walk, in steps; twice the longest conceivable shortest walk if None.
        num_floor: Greatest number of floor cells. A shortest walk has at most ``num_floor + 1`` steps, and no horizon
            may be shorter, so that some walk always arrives.

    Raises:
        ValueError: An unknown name, a number out of range, or settings of another model.
    """
    longest = num_floor + 1
    if human == "shortest":
        given = [key for key, value in (("rationality", rationality), ("horizon", horizon)) if value is not None]
        if given:
            raise ValueError(f"{' and '.join(given)} belong to human='boltzmann', got human='shortest'")
        return HumanModel()
    if human != "boltzmann":
        raise ValueError(f"human must be one of ['shortest', 'boltzmann'], got {human!r}")
    rationality = DEFAULT_RATIONALITY if rationality is None else rationality
    number = isinstance(rationality, int | float | np.number) and not isinstance(rationality, bool)
    if not number or not 0 < rationality < math.inf:
        raise ValueError(f"rationality must be a finite number > 0, got {rationality!r}")
    horizon = 2 * longest if horizon is None else horizon
    if isinstance(horizon, bool) or not isinstance(horizon, int | np.integer) or horizon < longest:
        raise ValueError(
            f"horizon must be an integer of at least {longest} steps, which the longest of all shortest walks in "
            f"{num_floor} cells may take; got {horizon!r}"
        )
    return HumanModel("boltzmann", float(rationality), int(horizon))


def step_probabilities(
    graph: Graph, to_goal: Mapping[Node, float], rationality: float
) -> dict[Node, dict[Node, float]]:
    """Probability of every step of the walker, by the node it leaves; nothing leaves the goal.

    Args:
        graph: Step costs; no edge leaves a goal.
        to_goal: ``C*(node -> G)`` of every node from which the goal can be reached.
        rationality: Per unit of cost.
    """
    probabilities: dict[Node, dict[Node, float]] = {}
    for node in to_goal:
        costs = {after: step + to_goal[after] for after, step in graph[node].items() if after in to_goal}
        weights = {after: math.exp(-rationality * (cost - min(costs.values()))) for after, cost in costs.items()}
        probabilities[node] = {after: weight / sum(weights.values()) for after, weight in weights.items()}
    return probabilities


class PrefixVisit(NamedTuple):
    """Where walks are after some steps.

    Attributes:
        step: Steps observed, ``t``.
        node: Where the person is then.
        probability: Share of the arriving walks that are here after ``step`` steps.
        weight: Mean weight of this prefix in the score of these walks, which differ in length.
    """

    step: int
    node: Node
    probability: float
    weight: float


class BoltzmannWalks(NamedTuple):
    """All walks from a start to a goal within the horizon.

    Attributes:
        goal: Where they end.
        visits: Where they are, step by step, given that they arrive.
        lost_mass: Probability not to arrive within the horizon.
        mean_length: Expected steps of those that arrive.
    """

    goal: Node
    visits: list[PrefixVisit]
    lost_mass: float
    mean_length: float


def boltzmann_walks(
    graph: Graph, start: Node, goal: Node, *, rationality: float, horizon: int, prefix: PrefixSpec = "mean"
) -> BoltzmannWalks:
    """Follow the walker forwards, step by step, and weigh each prefix by the walks it may become.

    Args:
        graph: Step costs. No edge leads to the start, none leaves a goal.
        start: Where the walk begins (step 0).
        goal: Where it ends.
        rationality: Per unit of cost.
        horizon: Longest walk, in steps.
        prefix: Which prefixes count, see :func:`~legible_envs.legibility.prefix_weights`.

    Raises:
        ValueError: The goal cannot be reached from the start, or not within the horizon.
    """
    to_goal = optimal_costs(graph, goal)
    if start not in to_goal:
        raise ValueError(f"no way from {start!r} to {goal!r}")
    nodes = list(to_goal)
    index = {node: i for i, node in enumerate(nodes)}
    steps = np.zeros((len(nodes), len(nodes)))
    for node, following in step_probabilities(graph, to_goal, rationality).items():
        for after, probability in following.items():
            steps[index[node], index[after]] = probability

    # here[t]: where the walker is after t steps; arrives[r]: probability to enter the goal with exactly r more steps.
    here, arrives = np.zeros((horizon + 1, len(nodes))), np.zeros((horizon + 1, len(nodes)))
    here[0, index[start]] = arrives[0, index[goal]] = 1.0
    for t in range(horizon):
        here[t + 1] = here[t] @ steps
        arrives[t + 1] = steps @ arrives[t]

    by_length = arrives[:, index[start]]
    arrived = math.fsum(by_length)
    if arrived == 0.0:
        raise ValueError(f"no walk from {start!r} to {goal!r} arrives within {horizon} steps")
    weights = np.zeros((horizon + 1, horizon + 1))
    for length in range(2, horizon + 1):
        weights[length, 1:length] = prefix_weights(prefix, length)

    visits = []
    for t in range(1, horizon):
        passed = here[t] * arrives[1 : horizon + 1 - t].sum(axis=0)
        weighed = here[t] * (weights[t + 1 :, t] @ arrives[1 : horizon + 1 - t])
        visits += [
            PrefixVisit(t, nodes[i], float(passed[i] / arrived), float(weighed[i] / passed[i]))
            for i in np.flatnonzero(passed)
        ]
    mean_length = float(np.arange(horizon + 1) @ by_length) / arrived
    return BoltzmannWalks(goal, visits, max(0.0, 1.0 - arrived), mean_length)


def boltzmann_legibility(
    graph: Graph,
    start: Node,
    goals: Sequence[Node],
    walks: BoltzmannWalks,
    *,
    beta: float = 1.0,
    c: float = 1.0,
    ties: Ties = "expected",
    tie_tolerance: float = 1e-9,
) -> list[PrefixScore]:
    """Every prefix of the walks of a Boltzmann walker, its probability, and its Eq. 2.

    The counterpart of :func:`~legible_envs.legibility.goal_legibility`: the expected legibility of the reach is
    ``sum(s.probability * s.weight * s.value)``. Walks of all lengths are taken together (``length`` is 0).

    Args:
        graph: Step costs. No edge leads to the start, none leaves a goal.
        start: Where the walk begins (step 0).
        goals: All valid goals, that of the walks among them.
        walks: What :func:`boltzmann_walks` says of this start and the true goal.
        beta: See :func:`~legible_envs.legibility.env_legibility`, also for the rest.
        c: Cost per step in doubt.
        ties: ``"expected"`` or ``"strict"``.
        tie_tolerance: Costs this close count as equal.

    Raises:
        ValueError: A goal cannot be reached from the start.
    """
    costs = {g: optimal_costs(graph, g) for g in goals}
    unreachable = [g for g in goals if start not in costs[g]]
    if unreachable:
        raise ValueError(f"no way from {start!r} to {unreachable}")
    optimal = {g: costs[g][start] for g in goals}
    seen = {}
    for node in {visit.node for visit in walks.visits}:
        remaining = {g: costs[g].get(node, math.inf) for g in goals}
        value = env_legibility(
            walks.goal, remaining, optimal, 1, beta=beta, c=c, ties=ties, tie_tolerance=tie_tolerance
        )
        seen[node] = tuple(tied_goals(remaining, optimal, tie_tolerance)), value
    scores = []
    for step, node, probability, weight in walks.visits:
        top, value = seen[node]
        # A margin is a margin at any step; doubt costs in proportion to the steps, so its first step says it all.
        scores.append(
            PrefixScore(step, node, 0, probability, weight, top, value if top == (walks.goal,) else step * value)
        )
    return scores
