"""The rationality of participants, simulated and recorded, is found by maximum likelihood."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import legible_envs  # noqa: F401
from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.overcooked.humans import (
    BoltzmannWalker,
    fit_rationality,
    rationality_spread,
)
from legible_envs.rollouts import Trajectory
from tests.legible_envs.overcooked.kitchens import OPEN, brisk, steps_between


def negative_log_likelihood(walks, rationality: float) -> float:
    """Written out step by step."""
    total = 0.0
    for walk in walks:
        cells = [tuple(cell) for cell in walk.states.tolist()]
        station = walk.layout.stations[walk.goal]
        for (row, col), after in itertools.pairwise(cells):
            costs = {}
            for cell in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
                if cell == station:
                    costs[cell] = 1
                elif walk.layout.is_floor(cell):
                    costs[cell] = 1 + steps_between(walk.layout, [cell], walk.goal)
            total += rationality * costs[after] + math.log(sum(math.exp(-rationality * c) for c in costs.values()))
    return total


@pytest.mark.slow
def test_fit_is_the_maximum_and_its_interval_the_likelihood_ratios():
    walks = BoltzmannWalker(rationality=1.2).sample(OPEN, "pot", ("onion", "dish"), 40, np.random.default_rng(0))
    fit = fit_rationality(walks)
    best = minimize_scalar(lambda r: negative_log_likelihood(walks, r), bounds=(0.01, 10), method="bounded")
    assert fit.rationality == pytest.approx(best.x, abs=1e-4)
    assert fit.log_likelihood == pytest.approx(-best.fun)
    for end in fit.interval:
        assert negative_log_likelihood(walks, end) - best.fun == pytest.approx(3.8414588 / 2, abs=1e-5)
    h = 1e-3
    curvature = sum(s * negative_log_likelihood(walks, fit.rationality + d) for s, d in ((1, h), (-2, 0), (1, -h)))
    assert fit.standard_error == pytest.approx(h / math.sqrt(curvature), rel=1e-3)
    assert fit.num_steps == sum(walk.num_states - 1 for walk in walks)
    assert math.isnan(fit.clustered_error)


def test_fit_recovers_people():
    rng = np.random.default_rng(1)
    inside = []
    for rationality in (0.3, 1.3, 2.5):
        for _ in range(20):
            walks = BoltzmannWalker(rationality=rationality).sample(OPEN, "pot", ("onion", "dish"), 30, rng)
            low, high = fit_rationality(walks, confidence=0.9).interval
            inside.append(low <= rationality <= high)
    assert 0.8 <= np.mean(inside) <= 0.99  # binomial(60, .9): 4 standard deviations are .15


def test_fit_at_the_ends():
    walks = brisk(rationality=60).sample(OPEN, "pot", ("onion", "dish"), 10, np.random.default_rng(0))
    fit = fit_rationality(walks)
    assert fit.rationality == math.inf
    assert 1 < fit.interval[0] < fit.interval[1] == math.inf
    aimless = [(1, 1), (1, 2), (1, 1), (2, 1), (1, 1), (1, 2), (1, 3), (1, 4), (2, 4), (1, 4)]
    walk = Trajectory(aimless, goal="onion", candidates=("onion",), layout=OPEN, complete=False)
    fit = fit_rationality([walk])
    assert (fit.rationality, fit.interval[0]) == (0.0, 0.0)
    assert 0 < fit.interval[1] < 2


def test_spread_between_people_is_found():
    rng = np.random.default_rng(2)
    walks = []
    for number in range(40):
        person = BoltzmannWalker.draw(OPEN.shape, rng, rationality=1.3, spread=0.35, preference=0.0)
        walks += person.sample(OPEN, "pot", ("onion", "dish", "tomato"), 60, rng, participant=f"p{number}")
    spread = rationality_spread(walks)
    assert spread.sd == pytest.approx(0.35, abs=0.12)
    assert spread.raw_sd > spread.sd
    assert spread.median == pytest.approx(1.3, abs=0.25)
    assert len(spread.fits) == 40
    fit = fit_rationality(walks)
    assert fit.clustered_error > 1.5 * fit.standard_error
    with pytest.raises(ValueError, match="two participants"):
        rationality_spread(walks[:60])


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "published"),
    [("asymmetric_advantages", 1.67), ("coordination_ring", 1.11), ("cramped_room", 1.29), ("random3", 1.12)],
)
def test_recorded_people(name, published):
    walks = recorded_trajectories(layouts=[name])
    fit = fit_rationality(walks)
    assert fit.rationality == pytest.approx(published, abs=0.005)
    assert fit.interval[0] < published < fit.interval[1]
    assert 0.04 < (fit.interval[1] - fit.interval[0]) / 2 < 0.11
    assert fit.num_participants >= 30


def test_bad_walks_are_named():
    good = {"goal": "onion", "candidates": ("onion",), "layout": OPEN}
    with pytest.raises(ValueError, match="row 1, column 4 to row 1, column 2"):
        fit_rationality([Trajectory([(1, 4), (1, 2)], **good)])
    with pytest.raises(ValueError, match="row 1, column 4 to row 0, column 4"):
        fit_rationality([Trajectory([(1, 4), (0, 4)], **good)])
    with pytest.raises(ValueError, match="no kitchen"):
        fit_rationality([Trajectory([(1, 4), (1, 3)], candidates=("onion",))])
    with pytest.raises(ValueError, match="no step"):
        fit_rationality([])
    walk = Trajectory([(1, 2), (1, 1), (0, 1)], **good)
    with pytest.raises(ValueError, match="confidence"):
        fit_rationality([walk], confidence=95)
    with pytest.raises(ValueError, match="shape"):
        fit_rationality([walk], cell_costs=np.ones((2, 2)))
    with pytest.raises(ValueError, match="greater than 0"):
        fit_rationality([walk], cell_costs=np.zeros(OPEN.shape))
