"""The score of noisily rational people, ``human="boltzmann"``: the readable definition, and models of motion.

At every node of its trajectory a *Boltzmann walker* draws the next step from a local softmax,

    ``P(a -> b | G) ∝ exp(-rationality * (cost(a, b) + C*(b -> G)))``,

over the steps from which the goal can be reached: to a free neighbouring cell (back where it came from, too), or into
the goal station, where the trajectory ends. :func:`~legible_envs.overcooked.humans.fit_rationality` estimates the
rationality of this walker from recorded play.

The observer is the same as for shortest paths: Eq. 1 with optimal costs, which depends on start and current cell alone.
Off the shortest paths its most probable goal may be wrong, which costs ``c`` per step observed (Eq. 2).

**Horizon.** Trajectories have no greatest length, so they are followed for ``horizon`` steps (the first one enters the
start's access cell, the last one the goal station). The score is the expectation over trajectories that arrive within
the horizon, ``E[value | arrived]``. The probability not to have arrived, ``truncated_probability``, is left out of the
score and reported beside it.

**Limit.** As ``rationality`` grows the walker takes, at every cell, each step along a shortest path equally often.
``human="shortest"`` draws each shortest *path* equally often. The two are the same where shortest paths do not fork
unevenly (in corridors, for example) and differ a little elsewhere, because the walker prefers paths with few forks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, get_args

import numpy as np

from legible_envs.legibility import (
    Graph,
    Node,
    PrefixScore,
    costs_to_goals,
    env_legibility,
    in_words,
    optimal_costs,
    posterior,
    prefix_weights,
    tied_goals,
)
from legible_envs.observer import ObserverModel, PrefixSpec
from legible_envs.support.validation import choice, integer, real

__all__ = [
    "DEFAULT_RATIONALITY",
    "BoltzmannTrajectories",
    "HumanModel",
    "HumanName",
    "PrefixVisit",
    "boltzmann_legibility",
    "boltzmann_trajectories",
    "step_probabilities",
]

HumanName = Literal["shortest", "boltzmann"]

LONGEST_HORIZON: Final = 8_192
"""Steps; the default in the largest kitchen without a counter inside is shorter."""
DEFAULT_RATIONALITY: Final = 1.3
"""Mean of the four recorded kitchens (1.67, 1.11, 1.29, 1.12 per step)."""


@dataclass(frozen=True)
class HumanModel:
    """How people are assumed to move through a kitchen.

    Attributes:
        name: ``"shortest"``, uniformly over all shortest paths, or ``"boltzmann"``, noisily rational.
        rationality: Of ``"boltzmann"``, per unit of path cost, greater than 0; :data:`DEFAULT_RATIONALITY` if None.
        horizon: Of ``"boltzmann"``: steps after which a trajectory is truncated; None for twice the length of the
            longest conceivable shortest path.

    Raises:
        ValueError: An unknown name, a number out of range, or settings of another model.
    """

    name: HumanName = "shortest"
    rationality: float | None = None
    horizon: int | None = None

    def __post_init__(self) -> None:
        choice("human", self.name, get_args(HumanName))
        if self.name == "shortest":
            given = [f"`{key}`" for key in ("rationality", "horizon") if getattr(self, key) is not None]
            if given:
                raise ValueError(f"{' and '.join(given)} belong to human='boltzmann', got human='shortest'")
            return
        rationality = DEFAULT_RATIONALITY if self.rationality is None else self.rationality
        object.__setattr__(self, "rationality", real("rationality", rationality, 0, closed="neither"))

    def within(self, num_floor: int) -> HumanModel:
        """The same model with a horizon that suits kitchens of at most ``num_floor`` floor cells.

        A shortest trajectory there has at most ``num_floor + 1`` steps. No horizon may be shorter, so that some
        trajectory always arrives.

        Raises:
            ValueError: The horizon is no integer, or too short.
        """
        if self.name == "shortest":
            return self
        longest = num_floor + 1
        horizon = 2 * longest if self.horizon is None else self.horizon
        unit = f"steps, the length of the longest conceivable shortest trajectory through {num_floor} cells"
        return HumanModel(
            self.name, self.rationality, integer("horizon", horizon, longest, LONGEST_HORIZON, also="None", unit=unit)
        )


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
    """Where trajectories are after some steps.

    Attributes:
        step: Steps observed, ``t``.
        node: Where the person is then.
        probability: Share of the arriving trajectories that are here after ``step`` steps.
        weight: Mean weight of this prefix in the score of these trajectories, which differ in length.
    """

    step: int
    node: Node
    probability: float
    weight: float


class BoltzmannTrajectories(NamedTuple):
    """All trajectories from a start to a goal within the horizon.

    Attributes:
        goal: Where they end.
        visits: Where they are, step by step, given that they arrive.
        truncated_probability: Probability not to arrive within the horizon.
        mean_length: Expected steps of those that arrive.
    """

    goal: Node
    visits: list[PrefixVisit]
    truncated_probability: float
    mean_length: float


def boltzmann_trajectories(
    graph: Graph, start: Node, goal: Node, *, rationality: float, horizon: int, prefix: PrefixSpec = "mean"
) -> BoltzmannTrajectories:
    """Follow the walker forwards, step by step, and weigh each prefix by the trajectories it may become.

    Args:
        graph: Step costs. No edge leads to the start, none leaves a goal.
        start: Where trajectories begin (step 0).
        goal: Where it ends.
        rationality: Per unit of cost.
        horizon: Length of the longest trajectory, in steps.
        prefix: Which prefixes count, see :func:`~legible_envs.legibility.prefix_weights`.

    Raises:
        ValueError: The goal cannot be reached from the start, or not within the horizon.
    """
    to_goal = optimal_costs(graph, goal)
    if start not in to_goal:
        raise ValueError(f"no path from {in_words(start)} to {in_words(goal)}")
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
        raise ValueError(f"no trajectory from {in_words(start)} to {in_words(goal)} arrives within {horizon} steps")
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
    return BoltzmannTrajectories(goal, visits, max(0.0, 1.0 - arrived), mean_length)


def boltzmann_legibility(
    graph: Graph,
    start: Node,
    goals: Sequence[Node],
    trajectories: BoltzmannTrajectories,
    observer: ObserverModel = ObserverModel(),
) -> list[PrefixScore]:
    """Every prefix of the trajectories of a Boltzmann walker, its probability, and its Eq. 2.

    The counterpart of :func:`~legible_envs.legibility.goal_legibility`: the expected legibility of these trajectories
    is ``sum(s.probability * s.weight * s.value)``. Trajectories of all lengths are taken together (``length`` is 0).

    Args:
        graph: Step costs. No edge leads to the start, none leaves a goal.
        start: Where trajectories begin (step 0).
        goals: All valid goals, that of the trajectories among them.
        trajectories: Those of this start and the true goal; prefixes are weighted as :func:`boltzmann_trajectories`
            was told.
        observer: How the observer infers goals, and what errors cost.

    Raises:
        ValueError: A goal cannot be reached from the start.
    """
    costs = costs_to_goals(graph, start, goals)
    optimal = {g: costs[g][start] for g in goals}
    seen = {}
    for node in {visit.node for visit in trajectories.visits}:
        remaining = {g: costs[g].get(node, math.inf) for g in goals}
        value = env_legibility(trajectories.goal, remaining, optimal, 1, observer)
        belief = posterior(remaining, optimal, observer.beta)
        seen[node] = tuple(tied_goals(remaining, optimal, observer.tie_tolerance)), value, belief
    scores = []
    for step, node, probability, weight in trajectories.visits:
        top, value, belief = seen[node]
        # A margin is the same at any step; an error costs in proportion to the steps, so that of one step says it all.
        value = value if top == (trajectories.goal,) else step * value
        scores.append(PrefixScore(step, node, 0, probability, weight, top, value, belief))
    return scores
