"""What Eq. 1 predicts of simulated participants: the exact score is its mean, and one cell says nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.legibility import From, env_legibility, optimal_costs, prefix_weights
from legible_envs.observer import ObserverModel
from legible_envs.overcooked.humans import (
    BoltzmannWalker,
    simulate_participants,
)
from legible_envs.overcooked.scoring.boltzmann import boltzmann_legibility, boltzmann_trajectories
from legible_envs.overcooked.scoring.explanation import grid_graph
from predictors import BayesianGoalPredictor
from tests.legible_envs.overcooked.kitchens import OPEN, random_kitchen

# -- the exact score ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("prefix", ["mean", "sum", (0.3, 0.6)], ids=str)
def test_exact_score_equals_monte_carlo(prefix):
    rng = np.random.default_rng(7)
    graph, observer = grid_graph(OPEN), ObserverModel(c=0.7)
    goals = ["onion", "tomato", "dish"]
    costs = {goal: optimal_costs(graph, goal) for goal in goals}
    optimal = {goal: costs[goal][From("pot")] for goal in goals}
    for goal in goals:
        walks = boltzmann_trajectories(graph, From("pot"), goal, rationality=0.9, horizon=120, prefix=prefix)
        scores = boltzmann_legibility(graph, From("pot"), goals, walks, observer)
        exact = sum(s.probability * s.weight * s.value for s in scores)
        assert walks.truncated_probability < 1e-9
        values = []
        for walk in BoltzmannWalker(rationality=0.9).sample(OPEN, "pot", goal, 1500, rng):
            cells = [tuple(cell) for cell in walk.states.tolist()][:-1]
            weights = prefix_weights(prefix, len(cells) + 1)
            values.append(
                sum(
                    weight * env_legibility(goal, {g: costs[g][cell] for g in goals}, optimal, t, observer)
                    for t, (cell, weight) in enumerate(zip(cells, weights, strict=True), 1)
                    if weight
                )
            )
        assert abs(np.mean(values) - exact) < 4 * np.std(values) / math.sqrt(len(values))


# -- nothing leaks -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("population", ["boltzmann", "planner", "cloned"])
def test_one_cell_says_no_more_than_the_prior(population):
    rng = np.random.default_rng(0)
    for _ in range(3):
        layout = random_kitchen(rng, (6, 6))
        walks = simulate_participants(layout, 20, rng, population=population)
        predictor = BayesianGoalPredictor().fit(walks)
        for length in (0, 1):
            probabilities = predictor.predict_proba([walk.first(length) for walk in walks])
            for walk, row in zip(walks, probabilities, strict=True):
                assert row.max() == pytest.approx(1 / len(walk.candidates))
        # Nor does the order of the candidates, or the clock.
        several = [walk for walk in walks if len(walk.candidates) > 1]
        for position in (0, -1):
            right = np.mean([walk.goal == walk.candidates[position] for walk in several])
            prior = np.mean([1 / len(walk.candidates) for walk in several])
            assert right < prior + 0.25


@pytest.mark.data
def test_one_cell_of_recorded_play_says_no_more_than_the_prior():
    walks = recorded_trajectories(layouts=["coordination_ring"])
    rows = BayesianGoalPredictor().fit(walks).predict_proba([walk.first(1) for walk in walks])
    assert rows.max(axis=1) == pytest.approx([1 / len(walk.candidates) for walk in walks])
