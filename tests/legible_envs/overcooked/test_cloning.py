"""People whose steps are learned: their features, the fit, and how they walk."""

from __future__ import annotations

import itertools
import math
import pickle

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.humans import BoltzmannWalker, ClonedWalker, fit_policy, fit_rationality
from legible_envs.overcooked.humans.cloning import FEATURES, RECORDED_WEIGHTS
from legible_envs.overcooked.policies import WalkingPlayer
from legible_envs.rollouts import Trajectory
from tests.legible_envs.overcooked.kitchens import OPEN, random_kitchen, steps_between

STEPS = ((-1, 0), (1, 0), (0, 1), (0, -1))
Cell = tuple[int, int]


def features(layout: OvercookedLayout, cell: Cell, before: Cell | None, goal: str) -> dict[Cell, dict[str, float]]:
    """What each possible step is like, written out from the words of the documentation."""
    station = layout.stations[goal]

    def moved(step: Cell) -> Cell:
        return cell[0] + step[0], cell[1] + step[1]

    def far(place: Cell) -> int:
        return abs(place[0] - station[0]) + abs(place[1] - station[1])

    costs = {}
    for after in map(moved, STEPS):
        if after == station:
            costs[after] = 1.0
        elif layout.is_floor(after):
            costs[after] = 1.0 + steps_between(layout, [after], goal)
    least = min(costs.values())
    rows, cols = abs(station[0] - cell[0]), abs(station[1] - cell[1])
    found = {}
    for after, cost in costs.items():
        nearer = far(after) < far(cell)
        is_vertical = after[1] == cell[1]
        around = [layout.is_floor((after[0] + dr, after[1] + dc)) for dr, dc in STEPS]
        found[after] = {
            "progress": least - cost,
            "far": least - cost if least > 3 else 0.0,
            "straight": before is not None and after == (2 * cell[0] - before[0], 2 * cell[1] - before[1]),
            "back": after == before,
            "beeline": nearer,
            "longer_side": nearer and (rows > cols if is_vertical else cols > rows),
            "arrive": after == station,
            "walls": 0.0 if after == station else 1 - sum(around) / 4,
        }
    return found


def log_likelihood(walks: list[Trajectory], weights: dict[str, float]) -> float:
    """Written out step by step."""
    total = 0.0
    for walk in walks:
        cells: list[Cell] = [(row, col) for row, col in walk.states.tolist()]
        for before, cell, after in zip([None, *cells], cells, cells[1:], strict=False):
            scores = {
                option: sum(weights[name] * value for name, value in like.items())
                for option, like in features(walk.layout, cell, before, walk.goal or "").items()
            }
            total += scores[after] - math.log(sum(map(math.exp, scores.values())))
    return total


@pytest.fixture(scope="module")
def walks() -> list[Trajectory]:
    rng = np.random.default_rng(0)
    found = ClonedWalker().sample(OPEN, "pot", ("onion", "dish"), 30, rng)
    kitchen = random_kitchen(rng, (6, 7))
    return found + BoltzmannWalker(0.8).sample(kitchen, "serving", ("tomato", "fish", "onion"), 30, rng)


def test_the_likelihood_is_that_of_the_documented_features(walks: list[Trajectory]) -> None:
    fit = fit_policy(walks)
    assert fit.log_likelihood == pytest.approx(log_likelihood(walks, fit.weights), abs=1e-9)
    assert fit.num_steps == sum(walk.num_states - 1 for walk in walks)
    assert fit.num_trajectories == 60
    assert list(fit.weights) == list(fit.standard_errors) == list(FEATURES)


def test_the_fit_is_the_maximum_with_its_penalty(walks: list[Trajectory]) -> None:
    l2 = 2.0

    def value(weights: dict[str, float]) -> float:
        return log_likelihood(walks, weights) - l2 / 2 * sum(weight**2 for weight in weights.values())

    fit = fit_policy(walks, l2=l2)
    best = value(fit.weights)
    for name, step in itertools.product(FEATURES, (-0.05, 0.05)):
        assert value({**fit.weights, name: fit.weights[name] + step}) < best
    # The curvature along one weight is one entry of the information, of whose inverse errors are the diagonal.
    alone = fit_policy(walks, l2=l2, features=("back",))
    around = [value({**alone.weights, "back": alone.weights["back"] + d}) for d in (-0.01, 0.0, 0.01)]
    curvature = -(around[0] - 2 * around[1] + around[2]) / 0.01**2
    assert alone.standard_errors["back"] == pytest.approx(curvature**-0.5, rel=1e-3)
    assert {name for name, weight in alone.weights.items() if weight} == {"back"}


def test_progress_alone_is_the_noisily_rational_walker(walks: list[Trajectory]) -> None:
    alone = fit_policy(walks, l2=1e-9, features=("progress",))
    known = fit_rationality(walks)
    assert alone.weights["progress"] == pytest.approx(known.rationality, abs=1e-6)
    assert alone.standard_errors["progress"] == pytest.approx(known.standard_error, rel=1e-6)
    assert alone.log_likelihood == pytest.approx(known.log_likelihood, abs=1e-6)
    both = [
        walker.walk(OPEN, "pot", "dish", np.random.default_rng(3))
        for walker in (BoltzmannWalker(1.3), ClonedWalker({"progress": 1.3}))
    ]
    assert both[0] == both[1]


def test_the_weights_of_simulated_people_are_found() -> None:
    rng = np.random.default_rng(1)
    kitchen = random_kitchen(rng, (8, 8))
    person = ClonedWalker({"progress": 0.9, "straight": 0.7, "back": -1.2, "beeline": 0.4})
    many = person.sample(kitchen, "pot", ("onion", "dish", "tomato", "fish", "cabbage"), 600, rng)
    fit = fit_policy(many, l2=1e-3)
    for name, weight in zip(FEATURES, person.weights, strict=True):
        assert abs(fit.weights[name] - weight) < 4 * fit.standard_errors[name], name
    assert ClonedWalker.fit(many).weights == pytest.approx(fit.params, abs=0.02)


def test_people_keep_their_direction() -> None:
    """What the noisily rational walker lacks: recorded people turn back half as often as it says."""
    rng = np.random.default_rng(2)
    turned = {}
    for walker in (BoltzmannWalker(1.2), ClonedWalker({"progress": 1.2, "back": -2.0})):
        paths = [walk.states for walk in walker.sample(OPEN, "pot", ("onion", "dish"), 200, rng)]
        backs = [(path[2:] == path[:-2]).all(axis=1) for path in paths]
        turned[type(walker).__name__] = float(np.concatenate(backs).mean())
    assert turned["ClonedWalker"] < 0.5 * turned["BoltzmannWalker"]


def test_a_clone_plays_the_whole_game() -> None:
    rng = np.random.default_rng(0)
    env = gym.make("LegibleOvercooked-v0", layout=random_kitchen(rng, (6, 6)), max_episode_steps=20_000)
    player = WalkingPlayer(env, ClonedWalker(idle=0.2), rng)
    obs, info = env.reset(seed=0)
    over = False
    while not over:
        obs, _, terminated, truncated, info = env.step(player(obs, info))
        over = terminated or truncated
    assert info["deliveries"] == 3


def test_clones_are_values() -> None:
    clone = ClonedWalker([1, 0, 0.5, -1, 0, 0, 0, 0], idle=0.1)
    twin = pickle.loads(pickle.dumps(clone))
    assert (twin.weights == clone.weights).all()
    assert twin.idle == 0.1
    assert repr(clone) == "ClonedWalker(progress=1, straight=0.5, back=-1)"
    assert ClonedWalker().weights.tolist() == list(RECORDED_WEIGHTS)
    rng = np.random.default_rng(0)
    drawn = [ClonedWalker.draw((5, 5), rng) for _ in range(400)]
    factors = np.log([person.weights[0] / RECORDED_WEIGHTS[0] for person in drawn])
    assert abs(factors.mean()) < 4 * 0.35 / 20
    assert 0.28 < factors.std() < 0.42
    shares = np.array(RECORDED_WEIGHTS) / RECORDED_WEIGHTS[0]
    assert all(person.weights / person.weights[0] == pytest.approx(shares) for person in drawn)


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([1.0], "must be 8 finite numbers"),
        ([math.nan] * 8, "must be 8 finite numbers"),
        ({"speed": 1.0}, r"no features \['speed'\]"),
        ("abc", "must be 8 numbers"),
    ],
)
def test_weights_that_are_none(weights: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ClonedWalker(weights)  # type: ignore[arg-type]


def test_what_cannot_be_fitted(walks: list[Trajectory]) -> None:
    for wrong in ((), ("progress", "progress"), ("speed",), "progress"):
        with pytest.raises(ValueError, match="`features` must be some of"):
            fit_policy(walks, features=wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="l2"):
        fit_policy(walks, l2=0)
    with pytest.raises(ValueError, match="no step at which there was a choice"):
        fit_policy([])
    with pytest.raises(ValueError, match="expected trajectories, got 3 at index 0"):
        fit_policy([3])  # type: ignore[list-item]


@pytest.mark.data
def test_the_weights_of_recorded_people_are_those_published_here() -> None:
    recorded = recorded_trajectories()
    fit = fit_policy(recorded)
    assert len(recorded) == 2406
    assert list(fit.weights.values()) == pytest.approx(RECORDED_WEIGHTS, abs=0.006)
    # A step of theirs is far likelier than under the noisily rational walker, with the same penalty.
    rational = fit_policy(recorded, features=("progress",))
    assert fit.log_likelihood / fit.num_steps > -0.30
    assert rational.log_likelihood / fit.num_steps < -0.39
