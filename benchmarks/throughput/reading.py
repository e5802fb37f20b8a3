"""How fast people are read: the gradient and fit of maximum-entropy IRL, and updates of a belief."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.throughput.measure import Figure, alternate, rate
from benchmarks.throughput.sweep import Settings

if TYPE_CHECKING:
    from legible_envs.rollouts import Trajectory
    from predictors.base import GoalPredictor

__all__ = ["noisy_walks", "reading"]

_KITCHEN = "\n".join(["XOXXTXXDX", *["X       X"] * 7, "XXPXXXCXX"])
_UPDATES = {
    "update Eq. 1": ("bayesian", "a belief by Eq. 1 updated with a step"),
    "update MaxEnt": ("maxent-irl", "a belief by maximum-entropy IRL updated with a step"),
    "update n-gram": ("grid-ngram", "a belief by the n-gram updated with a step"),
    "update k-NN": ("grid-knn", "a belief by nearest neighbours updated with a step"),
    "update logistic": ("grid-logistic", "a belief by logistic regression updated with a step"),
}


def reading(settings: Settings) -> list[Figure]:
    """Seconds per gradient, per fit and per update of a belief, on 200 walks to 5 goals in a kitchen of 9 x 9."""
    from predictors.grid.maxent_irl import MaxEntIRL
    from predictors.grid.walk_likelihood import collect_evidence
    from predictors.registry import make_predictor

    walks = noisy_walks(200, np.random.default_rng(0))
    (evidence,) = collect_evidence(walks).values()
    costs = np.full(len(evidence.visits), 1.8)

    def gradients() -> int:
        for _ in range(50):
            evidence.loss(costs)
        return 50

    def fit() -> int:
        MaxEntIRL().fit(walks)
        return 1

    works: dict[str, Callable[[], int]] = {"maxent gradient": gradients, "maxent fit": fit}
    works |= {key: _updater(make_predictor(name).fit(walks), walks) for key, (name, _) in _UPDATES.items()}
    samplers = {key: lambda work=work: 1 / rate(work, settings.seconds) for key, work in works.items()}  # type: ignore[misc]
    samples = alternate(samplers, settings.rounds)
    what = {
        "maxent gradient": "gradient of maximum-entropy IRL, 9x9, 5 goals, 200 walks",
        "maxent fit": "whole fit of maximum-entropy IRL, 9x9, 5 goals, 200 walks",
        **{key: text for key, (_, text) in _UPDATES.items()},
    }
    return [Figure(key, what[key], "s", values) for key, values in samples.items()]


def _updater(predictor: GoalPredictor, walks: list[Trajectory]) -> Callable[[], int]:
    def watch() -> int:
        steps = 0
        for walk in walks[:20]:
            stream = predictor.stream(walk)
            for cell in walk.states[:-1]:
                stream.update(cell)
                steps += 1
        return steps

    return watch


def noisy_walks(count: int, rng: np.random.Generator, stray: float = 0.2) -> list[Trajectory]:
    """Walks of people who take a step nearer to their goal, or with probability ``stray`` any step."""
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.rollouts import Trajectory
    from predictors.grid.distances import remaining_steps

    layout = OvercookedLayout.from_ascii(_KITCHEN)
    goals = tuple(layout.stations)
    away, floor = remaining_steps(layout, goals), np.argwhere(layout.cells == 0)
    walks = []
    for _ in range(count):
        goal = int(rng.integers(len(goals)))
        row, col = (int(i) for i in rng.choice(floor))
        cells = [(row, col)]
        while away[row, col, goal] > 1:
            beside = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
            steps = [cell for cell in beside if layout.is_floor(cell)]
            nearer = [cell for cell in steps if away[cell][goal] < away[row, col, goal]]
            options = steps if rng.random() < stray else nearer
            row, col = options[rng.integers(len(options))]
            cells.append((row, col))
        states = np.array([*cells, layout.stations[goals[goal]]])
        walks.append(Trajectory(states, start="serving", goal=goals[goal], candidates=goals, layout=layout))
    return walks
