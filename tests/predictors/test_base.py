"""How predictions are scored: ties, fractions observed, and tidy tables."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.base import clone

from legible_envs.rollouts import CUTS, Trajectory
from predictors import BayesianGoalPredictor, ShortestDistance
from predictors.base import correctness
from predictors.checks import example_trajectories
from predictors.evaluation import accuracy_at
from tests.predictors.cases import THREE

ALL = [ShortestDistance(), ShortestDistance("geodesic"), BayesianGoalPredictor(), BayesianGoalPredictor(beta=0.3)]


def test_ties_count_what_they_are_worth() -> None:
    rows = np.array([[0.5, 0.5, 0.0], [0.5, 0.5 - 1e-12, 0.0], [0.2, 0.3, 0.5], [1 / 3, 1 / 3, 1 / 3]])
    goals = np.array([0, 1, 1, 2])
    assert correctness(rows, goals).tolist() == pytest.approx([0.5, 0.5, 0.0, 1 / 3])
    assert correctness(rows, goals, "strict").tolist() == [0.0, 0.0, 0.0, 0.0]
    assert correctness(rows, np.array([0, 0, 2, 0]), "strict").tolist() == [0.0, 0.0, 1.0, 0.0]
    cube = np.stack([rows, rows[::-1]], axis=1)
    assert correctness(cube, goals).shape == (4, 2)
    with pytest.raises(ValueError, match="ties"):
        correctness(rows, goals, "first")  # type: ignore[arg-type]


def test_the_score_is_the_expected_accuracy_of_guessing_among_ties() -> None:
    walks = example_trajectories()
    for predictor in ALL:
        fitted = clone(predictor).fit(walks)
        fractions = (0.2, 0.5, 0.8)
        rng, hits = np.random.default_rng(0), []
        for fraction in fractions:
            rows = fitted.predict_proba([w.prefix(fraction) for w in walks])
            for row, w in zip(rows, walks, strict=True):
                top = fitted.classes_[row >= row.max() - 1e-9]
                hits.append(np.mean(rng.choice(top, 4000) == w.goal))
        assert fitted.score(walks, fractions=fractions) == pytest.approx(np.mean(hits), abs=0.01)
        prefixes = [w.prefix(0.5) for w in walks]
        assert fitted.score(prefixes) == pytest.approx(fitted.score(walks, fractions=(0.5,)))
        assert fitted.score(walks, ties="strict") <= fitted.score(walks)


def test_tables_are_tidy_and_say_what_they_mean() -> None:
    walks = example_trajectories()
    fitted = BayesianGoalPredictor().fit(walks)
    table = accuracy_at(fitted, walks, (0.3, 0.6), cut="cells")
    assert len(table) == 2 * len(walks)
    assert table["correct"].mean() == pytest.approx(fitted.score(walks, fractions=(0.3, 0.6), cut="cells"))
    assert table.attrs == {"cut": "cells", "definition": CUTS["cells"], "ties": "fractional", "candidate_set": "all"}
    row = table.iloc[5]
    assert (row.trajectory, row.fraction, row.goal, row.participant) == (2, 0.6, "tomato", "p2")
    probabilities = fitted.predict_proba([walks[2].prefix(0.6, "cells")])[0]
    assert row.probability == probabilities[fitted.classes_.tolist().index("tomato")]
    assert row.states == walks[2].prefix_length(0.6, "cells")
    other = Trajectory(walks[0].states, goal="onion", candidates=THREE, layout=walks[0].layout, candidate_set="game")
    with pytest.raises(ValueError, match=r"\['all', 'game'\]"):
        accuracy_at(fitted, [*walks, other])
