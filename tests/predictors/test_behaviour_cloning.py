"""Behaviour cloning as a predictor: Bayes' rule over the steps of a learned policy."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.humans import BoltzmannWalker, ClonedWalker, simulate_participants
from legible_envs.overcooked.humans.cloning import FEATURES
from legible_envs.rollouts import Trajectory
from predictors import BehaviourCloning, MaxEntIRL
from predictors.evaluation import evaluate
from tests.predictors.cases import ROOM, THREE, people, walk

WIDE = OvercookedLayout.from_ascii("XXOXXXTXX\nX       X\nX       X\nX       X\nXXXXSXXPX")
STEPS = ((-1, 0), (1, 0), (0, 1), (0, -1))


def frequencies(walker: ClonedWalker, path: list[tuple[int, int]], goal: str, n: int) -> list[float]:
    """How often a walker takes the next step of a path in each of its places: by simulation, not by formula."""
    rng = np.random.default_rng(0)
    sampled = [walker.walk(WIDE, path[0], goal, rng) for _ in range(n)]
    tries = [sum(walk[:count] == path[:count] for walk in sampled) for count in range(1, len(path) + 1)]
    return [hits / max(before, 1) for before, hits in pairwise(tries)]


def fitted(**parameters: object) -> BehaviourCloning:
    rng = np.random.default_rng(0)
    X = ClonedWalker().sample(WIDE, "serving", ("onion", "tomato"), 60, rng)
    return BehaviourCloning(**parameters).fit(X)  # type: ignore[arg-type]


def test_steps_are_as_likely_as_the_walker_takes_them() -> None:
    predictor = fitted()
    path = [(3, 4), (2, 4), (2, 3)]
    for goal in ("onion", "tomato"):
        table = predictor.step_log_probabilities(WIDE, goal)
        first = math.exp(table[3 * 9 + 4, 4, 0])  # north, without a heading
        second = math.exp(table[2 * 9 + 4, 0, 3])  # then west
        shares = frequencies(predictor.walker(), path, goal, 3000)
        assert shares == pytest.approx([first, second], abs=0.05)  # four standard errors
    assert np.exp(table).reshape(45, 5, 4)[3 * 9 + 4].sum(axis=1) == pytest.approx(np.ones(5))


def test_the_belief_is_bayes_rule_over_steps() -> None:
    predictor = fitted(prior="empirical")
    cells = [(3, 4), (2, 4), (2, 5), (1, 5)]
    asked = Trajectory(cells, start="serving", candidates=("tomato", "onion"), layout=WIDE, complete=False)
    logs = np.log(predictor.predict_proba([asked.first(0)])[0])
    for column, goal in enumerate(predictor.classes_):
        table, heading = predictor.step_log_probabilities(WIDE, str(goal)), 4
        for (row, col), after in pairwise(cells):
            direction = STEPS.index((after[0] - row, after[1] - col))
            logs[column] += table[row * 9 + col, heading, direction]
            heading = direction
    expected = np.exp(logs) / np.exp(logs).sum()
    assert predictor.predict_proba([asked])[0] == pytest.approx(expected)


def test_progress_alone_is_the_posterior_of_the_noisily_rational_walker() -> None:
    rng = np.random.default_rng(1)
    X = BoltzmannWalker(1.3).sample(WIDE, "serving", ("onion", "tomato"), 200, rng)
    predictor = BehaviourCloning(l2=1e-6, features=("progress",)).fit(X)
    rationality = predictor.policy_.weights["progress"]
    assert rationality == pytest.approx(1.3, abs=0.2)
    # By the definition of the walker: odds of a step are e^(-rationality * cost), over all steps that are possible.
    cells = [(3, 4), (2, 4), (2, 3)]
    likelihood = dict.fromkeys(("onion", "tomato"), 1.0)
    for goal in likelihood:
        row, col = WIDE.stations[goal]
        for (r, c), after in pairwise(cells):
            around = [(r + dr, c + dc) for dr, dc in STEPS if WIDE.is_floor((r + dr, c + dc))]
            odds = {place: math.exp(-rationality * (abs(place[0] - row) + abs(place[1] - col))) for place in around}
            likelihood[goal] *= odds[after] / sum(odds.values())
    asked = Trajectory(cells, start="serving", candidates=("onion", "tomato"), layout=WIDE, complete=False)
    expected = np.array([likelihood["onion"], likelihood["tomato"]])
    assert predictor.predict_proba([asked])[0] == pytest.approx(expected / expected.sum())


def test_trust_makes_the_goals_of_training_most_likely() -> None:
    rng = np.random.default_rng(5)
    X = BoltzmannWalker(1.0).sample(WIDE, "serving", ("onion", "tomato"), 60, rng)
    predictor = BehaviourCloning(trust="fit").fit(X)

    def loss(trust: float) -> float:
        """Over prefixes of two cells or more; by the public answers."""
        other = BehaviourCloning(trust=trust).fit(X)
        total = 0.0
        for each in X:
            rows = other.predict_proba([each.first(count) for count in range(2, each.num_states)])
            total -= float(np.log(rows[:, other.classes_.tolist().index(each.goal)]).sum())
        return total

    around = [loss(predictor.trust_ + step) for step in (-0.1, 0.0, 0.1)]
    assert around[1] < min(around[0], around[2])
    # Where the policy is the very one that people follow, Bayes' rule needs no correction: 1 within chance.
    many = BoltzmannWalker(1.0).sample(WIDE, "serving", ("onion", "tomato"), 800, rng)
    assert BehaviourCloning(trust="fit", features=("progress",)).fit(many).trust_ == pytest.approx(1.0, abs=0.2)
    blind = BehaviourCloning(trust=0.0).fit(X)
    assert (blind.predict_proba([each.first(4) for each in X]) == 0.5).all()


def test_unlike_models_of_whole_paths_the_belief_depends_on_the_path() -> None:
    """Two paths with the same ends: all of a path but its ends cancels in MaxEnt, here going straight on counts."""
    X = ClonedWalker().sample(WIDE, "serving", ("onion", "tomato"), 60, np.random.default_rng(0))
    ways = [[(3, 4), (3, 3), (2, 3), (2, 4)], [(3, 4), (2, 4)]]
    asked = [
        Trajectory(way, start="serving", candidates=("onion", "tomato"), layout=WIDE, complete=False) for way in ways
    ]
    for predictor, same in ((MaxEntIRL(), True), (BehaviourCloning(), False)):
        rows = predictor.fit(X).predict_proba(asked)
        assert (rows[0] == pytest.approx(rows[1], abs=1e-9)) is same


def test_what_was_learned_in_one_kitchen_holds_in_another() -> None:
    rng = np.random.default_rng(3)
    here = ClonedWalker().sample(WIDE, "serving", ("onion", "tomato"), 400, rng)
    other = OvercookedLayout.from_ascii("XXXTXXX\nX     X\nO     X\nX     X\nXSXXPXX")
    there = ClonedWalker().sample(other, "pot", ("onion", "tomato"), 100, rng)
    predictor = BehaviourCloning().fit(here)
    assert predictor.score(there) == pytest.approx(BehaviourCloning().fit(there).score(there), abs=0.06)
    assert predictor.score(there) > 0.65


def test_a_step_that_is_none_tells_nothing_and_a_station_everything() -> None:
    predictor = BehaviourCloning().fit(people())
    jump = walk([(3, 2), (1, 1)], None, complete=False)
    assert (predictor.predict_proba([jump])[0] == 1 / 3).all()
    arrived = walk([(1, 1), (0, 1)], "onion", start="", complete=False)
    assert predictor.predict_proba([arrived])[0].tolist() == [0.0, 1.0, 0.0]


def test_steps_that_nobody_takes_are_unlikely_and_not_impossible() -> None:
    """Learned from flawless people, hardly pulled to 0: a detour has odds that no float can hold."""
    flawless = BoltzmannWalker(50.0).sample(WIDE, "serving", ("onion", "tomato"), 40, np.random.default_rng(0))
    predictor = BehaviourCloning(l2=1e-12).fit(flawless)
    predictor.policy_.weights["progress"] = 1000.0
    cells = [(3, 4), (3, 3), (3, 4), (3, 5), (3, 4), (2, 4)]
    asked = Trajectory(cells, start="serving", candidates=("onion", "tomato"), layout=WIDE, complete=False)
    (row,) = predictor.predict_proba([asked])
    assert np.isfinite(row).all()
    assert row.sum() == pytest.approx(1)


def test_the_walker_walks_as_was_learned() -> None:
    predictor = BehaviourCloning().fit(people())
    walker = predictor.walker(idle=0.3)
    assert walker.idle == 0.3
    assert dict(zip(FEATURES, walker.weights, strict=True)) == predictor.policy_.weights
    found = simulate_participants(
        OvercookedLayout.from_ascii("XOXXCXX\nX     X\nX     X\nF     T\nX     X\nXDXPXSX"),
        1,
        np.random.default_rng(0),
        population=lambda shape, rng: walker,
    )
    assert len(found) == 12


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="l2"):
        BehaviourCloning(l2=-1).fit(people())
    with pytest.raises(ValueError, match="`features` must be some of"):
        BehaviourCloning(features=("position",)).fit(people())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="prior"):
        BehaviourCloning(prior="mine").fit(people())  # type: ignore[arg-type]
    for wrong in (-1, 4, "some", True):
        with pytest.raises(ValueError, match="trust"):
            BehaviourCloning(trust=wrong).fit(people())  # type: ignore[arg-type]
    predictor = BehaviourCloning().fit(people())
    with pytest.raises(LayoutError, match="'fish' is no station"):
        predictor.step_log_probabilities(ROOM, "fish")
    with pytest.raises(ValueError, match="learning needs complete trajectories"):
        predictor.fit([walk([(3, 2)], None, THREE, complete=False)])


@pytest.mark.data
def test_it_predicts_recorded_people_better_than_models_of_whole_paths() -> None:
    """In the kitchen with a ring of floor, where people seldom turn back."""
    X = recorded_trajectories(layouts=["coordination_ring"])
    found = evaluate(
        {"steps": BehaviourCloning(), "paths": MaxEntIRL()}, X, cv=4, repeats=1, cut="cells", rare="keep", seed=0
    )
    accuracy = found.summary().set_index("predictor")["accuracy"]
    assert accuracy["steps"] == pytest.approx(0.418, abs=0.015)
    assert accuracy["steps"] > accuracy["paths"] + 0.06
