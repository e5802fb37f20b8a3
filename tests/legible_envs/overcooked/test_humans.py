"""Simulated participants in kitchens: they walk as defined, take the time stated, and do whole tasks."""

from __future__ import annotations

import itertools
import math
import pickle
from collections import Counter

import numpy as np
import pytest
from scipy.stats import chisquare

import legible_envs  # noqa: F401
from legible_envs import LayoutError
from legible_envs.overcooked import OvercookedLayout, soup_task
from legible_envs.overcooked.humans import (
    BoltzmannWalker,
    PlannerWalker,
    simulate_participants,
)
from legible_envs.tasks import Subtask, TaskGraph
from tests.legible_envs.overcooked.kitchens import OPEN, brisk, random_kitchen, steps_between

DEAD_END = OvercookedLayout.from_ascii("XXXOXXX\nX     X\nX VVV X\nX V V X\nX V V X\nX     X\nXXXSXXX")
"""The way to the onion starts away from it: straight ahead is a dead end."""
WALKERS = [BoltzmannWalker(), PlannerWalker()]

# -- single steps and walks --------------------------------------------------------------------------------------------


def test_first_steps_have_the_softmax_frequencies():
    rng = np.random.default_rng(0)
    walker = BoltzmannWalker(rationality=0.8)
    after = Counter(walker.walk(OPEN, (2, 2), "onion", rng)[1] for _ in range(4000))
    around = [(1, 2), (3, 2), (2, 1), (2, 3)]
    odds = np.exp([-0.8 * steps_between(OPEN, [cell], "onion") for cell in around])
    assert chisquare([after[cell] for cell in around], 4000 * odds / odds.sum()).pvalue > 1e-3


def test_the_goal_itself_is_one_of_the_options():
    rng = np.random.default_rng(0)
    walker = BoltzmannWalker(rationality=0.5)
    first = Counter(walker.walk(OPEN, (1, 1), "onion", rng)[1] for _ in range(4000))
    odds = np.exp([0, -0.5 * 2, -0.5 * 2])
    assert chisquare([first[cell] for cell in ((0, 1), (2, 1), (1, 2))], 4000 * odds / odds.sum()).pvalue > 1e-3


def test_preferences_move_the_walk():
    rng = np.random.default_rng(0)
    costs = np.ones(OPEN.shape)
    costs[1, 2:4] = 5.0
    used = [
        cell for _ in range(200) for cell in brisk(rationality=3, preferences=costs).walk(OPEN, (1, 4), "onion", rng)
    ]
    plain = [cell for _ in range(200) for cell in brisk(rationality=3).walk(OPEN, (1, 4), "onion", rng)]
    assert used.count((1, 3)) < 0.2 * plain.count((1, 3))


@pytest.mark.parametrize("walker", WALKERS, ids=repr)
def test_walks_are_walks(walker):
    rng = np.random.default_rng(3)
    for shape in [(5, 5), (7, 7), (4, 9)]:
        for _ in range(10):
            layout = random_kitchen(rng, shape)
            for walk in walker.sample(layout, "pot", ("onion", "fish", "dish"), 5, rng, participant="p"):
                cells = walk.states.tolist()
                assert tuple(cells[0]) in layout.access("pot")
                assert tuple(cells[-1]) == layout.stations[walk.goal]
                assert all(layout.is_floor(cell) for cell in cells[:-1])
                assert all(abs(a - c) + abs(b - d) == 1 for (a, b), (c, d) in itertools.pairwise(cells))
                assert (np.diff(walk.times) >= 0.15 - 1e-9).all()
                assert (walk.participant, walk.condition, walk.start) == ("p", "simulated", "pot")


def test_same_seed_same_walks():
    for walker in WALKERS:
        first, second = (walker.sample(OPEN, "pot", ("onion", "dish"), 5, np.random.default_rng(4)) for _ in range(2))
        assert first == second
        again = pickle.loads(pickle.dumps(walker))
        assert again.sample(OPEN, "pot", ("onion", "dish"), 5, np.random.default_rng(4)) == first


# -- time --------------------------------------------------------------------------------------------------------------


def test_time_by_hand():
    rng = np.random.default_rng(0)
    (walk,) = brisk(rationality=50).sample(OPEN, "pot", "dish", 1, rng)
    assert walk.states.tolist() == [[3, 4], [3, 3], [3, 2], [3, 1], [3, 0]]
    assert walk.times == pytest.approx(0.15 * np.arange(5))  # arrives facing the dishes
    (walk,) = brisk(rationality=50).sample(OPEN, "tomato", "tomato", 1, rng)
    assert walk.times == pytest.approx([0, 0.15])  # faces them from the beginning
    corner = OvercookedLayout.from_ascii("XOXX\nT  X\nXXXX")
    (walk,) = brisk(rationality=50).sample(corner, "onion", "tomato", 1, rng)
    assert walk.times == pytest.approx([0, 0.30])  # turns, then takes


def test_half_the_ticks_are_idle():
    rng = np.random.default_rng(1)
    walks = BoltzmannWalker(idle=0.5, turn=0.0, tick=1.0).sample(OPEN, "pot", ("dish", "onion"), 1500, rng)
    ticks = np.concatenate([np.diff(walk.times[:-1]) for walk in walks])
    assert ticks.mean() == pytest.approx(2.0, abs=4 * math.sqrt(2 / len(ticks)))
    assert (ticks == 1).mean() == pytest.approx(0.5, abs=0.02)
    walks = BoltzmannWalker(idle=0.2, turn=0.4, tick=1.0).sample(OPEN, "pot", ("dish", "onion"), 1500, rng)
    ticks = np.concatenate([np.diff(walk.times[:-1]) for walk in walks])
    assert ticks.mean() == pytest.approx(2.5, abs=0.1)


# -- the planner -------------------------------------------------------------------------------------------------------


def test_planner_walks_into_dead_ends_and_out_again():
    rng = np.random.default_rng(0)
    planner = PlannerWalker(depth=2, slip=0.1)
    through = [(3, 3) in planner.walk(DEAD_END, "serving", "onion", rng) for _ in range(100)]
    rational = [(3, 3) in brisk(rationality=5).walk(DEAD_END, "serving", "onion", rng) for _ in range(100)]
    assert np.mean(through) > 0.9
    assert np.mean(rational) < 0.05


def test_planner_dislikes_turning():
    """Of all shortest ways those with one turn are taken: where a step leads depends on where one came from."""
    rng = np.random.default_rng(0)

    def turns(walk):
        steps = [(c - a, d - b) for (a, b), (c, d) in itertools.pairwise(walk[:-1])]
        return sum(x != y for x, y in itertools.pairwise(steps))

    walks = {
        cost: [PlannerWalker(turn_cost=cost, slip=0.0).walk(OPEN, (3, 4), "onion", rng) for _ in range(150)]
        for cost in (0.0, 0.5)
    }
    assert all(len(walk) == 7 for walk in walks[0.5])
    assert max(turns(walk) for walk in walks[0.5]) == 1
    assert np.mean([turns(walk) for walk in walks[0.0]]) > 1.5


def test_planner_that_never_slips_may_be_lost():
    with pytest.raises(RuntimeError, match="did not find the goal"):
        PlannerWalker(depth=1, slip=0.0, recency=0.0, turn_cost=0.0).walk(
            DEAD_END, (3, 3), "onion", np.random.default_rng(0)
        )


# -- whole tasks -------------------------------------------------------------------------------------------------------


def test_random_sequences_are_uniform():
    task = TaskGraph(
        [Subtask("a", ("onion",)), Subtask("b", ("tomato",)), Subtask("c", ("fish",), after=("a",))], "serving"
    )
    rng = np.random.default_rng(0)
    seen = Counter(tuple(step.goal for step in task.sample(rng)) for _ in range(1500))
    assert set(seen) == {("onion", "tomato", "fish"), ("onion", "fish", "tomato"), ("tomato", "onion", "fish")}
    assert chisquare(list(seen.values())).pvalue > 1e-3
    soups = soup_task()
    visits = Counter((step.start, step.goals) for _ in range(400) for step in soups.sample(rng))
    for stage in soups.stages():
        error = 4 * math.sqrt(max(stage.weight, 0.01) / 400)
        assert visits[stage.start, stage.goals] / 400 == pytest.approx(stage.weight, abs=error)


@pytest.mark.parametrize("population", ["boltzmann", "planner", "cloned"])
def test_participants_do_the_whole_task(population):
    layout = random_kitchen(np.random.default_rng(5), (7, 7))
    walks = simulate_participants(
        layout, 4, np.random.default_rng(0), population=population, executions=2, layout_name="k"
    )
    assert len(walks) == 4 * 2 * 12
    for number in range(4):
        mine = [walk for walk in walks if walk.participant == f"person/{number}"]
        for half in (mine[:12], mine[12:]):
            assert Counter(walk.goal for walk in half) == {"onion": 3, "tomato": 2, "fish": 3, "cabbage": 1, "dish": 3}
            assert half[0].start == "serving"
            for before, walk in itertools.pairwise(half):
                assert walk.start == ("serving" if before.goal == "dish" else "pot")
        # Nobody is in two places at once, and the way back takes time.
        assert all(b.times[0] > a.times[-1] for a, b in itertools.pairwise(mine[:12]))
        assert mine[12].times[0] > mine[11].times[-1]
    stages = {(stage.start, stage.goals) for stage in soup_task().stages()}
    assert {(walk.start, walk.candidates) for walk in walks} <= stages
    assert {(walk.candidate_set, walk.condition, walk.layout_name) for walk in walks} == {("task", "simulated", "k")}


def test_kitchens_with_many_stations_of_a_kind():
    layout = OvercookedLayout.from_ascii("XOXPXOX\nX     X\nS     D\nX     X\nXXXPXXX")
    task = TaskGraph([Subtask("onions", ("onion",), then=("pot",), count=6)], "serving")
    walks = simulate_participants(layout, 10, np.random.default_rng(0), task=task)
    assert {walk.goal for walk in walks} == {"onion@(0,1)", "onion@(0,5)"}
    assert {walk.start for walk in walks} == {"serving", "pot@(0,3)"}  # the near pot
    assert all(set(walk.candidates) == {"onion@(0,1)", "onion@(0,5)"} for walk in walks)


def test_impossible_tasks():
    rng = np.random.default_rng(0)
    with pytest.raises(LayoutError, match=r"no (tomato|cabbage|fish) station"):
        simulate_participants(OPEN, 1, rng)
    shut = OvercookedLayout.from_ascii("XOXTX\nX  VX\nXXSXX")
    task = TaskGraph([Subtask("a", ("tomato",))], "serving")
    with pytest.raises(LayoutError, match="tomato"):
        simulate_participants(shut, 1, rng, task=task)
    with pytest.raises(LayoutError, match="no path to 'tomato' from 'serving'"):
        BoltzmannWalker().walk(shut, "serving", "tomato", rng)
    with pytest.raises(LayoutError, match="no station"):
        BoltzmannWalker().walk(OPEN, "pot", "fish", rng)
    for start in [(0, 0), (1.5, 1), (-1, 1), (10**20, 1), (math.inf, 1), (math.nan, 1)]:
        with pytest.raises(LayoutError, match="no floor"):
            BoltzmannWalker().walk(OPEN, start, "onion", rng)
        assert not OPEN.is_floor(start)
        assert (OPEN.distances_from([start]) == -1).all()
    with pytest.raises(ValueError, match="`population` must be"):
        simulate_participants(OPEN, 1, rng, population="ghost")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BoltzmannWalker(rationality=-1), "rationality"),
        (lambda: BoltzmannWalker(rationality=math.inf), "rationality"),
        (lambda: BoltzmannWalker(idle=0.9, turn=0.1), "less than 1"),
        (lambda: BoltzmannWalker(tick=-1), "tick"),
        (lambda: BoltzmannWalker(preferences=[[1.0, 0.0]]), "greater than 0"),
        (lambda: BoltzmannWalker(preferences=[[1.0, math.nan]]), "greater than 0"),
        (lambda: PlannerWalker(depth=0), "depth"),
        (lambda: PlannerWalker(depth=2.0), "depth"),  # type: ignore[arg-type]
        (lambda: PlannerWalker(fade=1.0), "fade"),
        (lambda: PlannerWalker(slip=1.5), "slip"),
        (lambda: BoltzmannWalker(preferences=np.ones((2, 2))).walk(OPEN, "pot", "onion", np.random.default_rng()), "2"),
    ],
)
def test_bad_people(make, message):
    with pytest.raises(ValueError, match=message):
        make()
