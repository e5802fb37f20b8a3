"""Simulated people: they walk as defined, take the time stated, differ, and can be fitted; recorded ones too."""

from __future__ import annotations

import itertools
import math
import pickle
from collections import Counter

import gymnasium as gym
import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import chisquare

import legible_envs  # noqa: F401
from legible_envs import LayoutError
from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.legibility import From, env_legibility, optimal_costs, prefix_weights
from legible_envs.observer import ObserverModel
from legible_envs.overcooked import OvercookedLayout, soup_task
from legible_envs.overcooked.humans import (
    BoltzmannWalker,
    PlannerWalker,
    fit_rationality,
    rationality_spread,
    simulate_participants,
)
from legible_envs.overcooked.policies import WalkingPlayer
from legible_envs.overcooked.scoring.boltzmann import boltzmann_legibility, boltzmann_trajectories
from legible_envs.overcooked.scoring.explanation import grid_graph
from legible_envs.rollouts import Trajectory, record_episode
from legible_envs.tasks import Subtask, TaskGraph
from predictors import BayesianGoalPredictor
from tests.legible_envs.overcooked.kitchens import random_kitchen, steps_between
from tests.support.plain_python import printed_both_ways

OPEN = OvercookedLayout.from_ascii("XOXXTX\nX    X\nX    X\nD    P\nXXSXXX")
DEAD_END = OvercookedLayout.from_ascii("XXXOXXX\nX     X\nX VVV X\nX V V X\nX V V X\nX     X\nXXXSXXX")
"""The way to the onion starts away from it: straight ahead is a dead end."""

WALKERS = [BoltzmannWalker(), PlannerWalker()]


def brisk(**arguments):
    return BoltzmannWalker(idle=0.0, turn=0.0, **arguments)


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


# -- fitting -----------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("population", ["boltzmann", "planner"])
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
    with pytest.raises(LayoutError, match="no floor"):
        BoltzmannWalker().walk(OPEN, (0, 0), "onion", rng)
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


# -- nothing leaks -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("population", ["boltzmann", "planner"])
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


# -- at play -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_kernels_run_as_plain_python():
    """Numba's generator of random numbers is numpy's, so that even samples are the same."""
    code = (
        "import numpy as np\n"
        "from legible_envs.overcooked import OvercookedWorkspace\n"
        "from legible_envs.overcooked.humans import fit_rationality, simulate_participants\n"
        "ws = OvercookedWorkspace((5, 5), human='boltzmann', rationality=1.1)\n"
        "genome = ws.sample(1, np.random.default_rng(0))[0]\n"
        "people = [simulate_participants(ws.decode(genome), 1, np.random.default_rng(0), population=name)\n"
        "          for name in ('boltzmann', 'planner')]\n"
        "print(ws.legibility(genome), *[walk.states.sum() for walks in people for walk in walks])\n"
        "print(*[round(float(walk.times[-1]), 6) for walks in people for walk in walks])\n"
        "print(fit_rationality(people[0] + people[1]).interval)"
    )
    numbers = [[float(word.strip("(),")) for word in text.split()] for text in printed_both_ways(code)]
    assert len(numbers[0]) == 1 + 24 + 24 + 2
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-9)


def test_players_finish_any_valid_kitchen():
    rng = np.random.default_rng(0)
    for walker in (BoltzmannWalker(1.5, idle=0.2), PlannerWalker(idle=0.2)):
        for _ in range(5):
            layout = random_kitchen(rng, (6, 6))
            env = gym.make("LegibleOvercooked-v0", shape=(6, 6), layout=layout, max_episode_steps=20_000)
            player = WalkingPlayer(env, walker, rng)
            obs, info = env.reset(seed=0)
            over = False
            while not over:
                obs, _, terminated, truncated, info = env.step(player(obs, info))
                over = terminated or truncated
            assert info["deliveries"] == 3


def test_players_keep_off_soft_obstacles():
    layout = OvercookedLayout.from_ascii("XPXXXXX\nO  V  T\nX  V  X\nD     F\nXCXXSXX")
    crossings = {}
    for kind in ("hard", "soft"):
        env = gym.make("LegibleOvercooked-v0", layout=layout, shape=(5, 7), virtual_obstacles=kind)
        player = WalkingPlayer(env.unwrapped, BoltzmannWalker(1.5, idle=0.0), np.random.default_rng(0))
        obs, info = env.reset(seed=0)
        for _ in range(300):
            obs, _, terminated, _, info = env.step(player(obs, info))
            if terminated:
                break
        crossings[kind] = info["crossings"]
        assert info["deliveries"] > 0
    assert crossings == {"hard": 0, "soft": 0}


def test_players_in_vector_environments():
    envs = gym.make_vec("LegibleOvercooked-v0", num_envs=3, vectorization_mode="vector_entry_point", shape=(5, 5))
    player = WalkingPlayer(envs, BoltzmannWalker(2.0), np.random.default_rng(0))
    obs, info = envs.reset(seed=0)
    total = 0.0
    for _ in range(800):
        actions = player(obs, info)
        assert actions.shape == (3,)
        obs, rewards, _, _, info = envs.step(actions)
        total += rewards.sum()
    assert total > 0


def test_play_is_the_walker_that_was_asked_for():
    """Rationality and pace, read off recorded episodes, are those of the person who played."""
    rng = np.random.default_rng(3)
    layout = random_kitchen(rng, (7, 7))
    env = gym.make("LegibleOvercooked-v0", layout=layout, max_episode_steps=20_000)
    walker = BoltzmannWalker(1.3, idle=0.4, turn=0.05)
    walks = []
    for number in range(25):
        walks += record_episode(env, WalkingPlayer(env, walker, rng), seed=number, participant=str(number))
    fit = fit_rationality(walks, confidence=0.999)
    assert fit.interval[0] < 1.3 < fit.interval[1]
    ticks = np.concatenate([np.diff(walk.times[:-1]) / 0.15 for walk in walks])
    expected = 1 / (1 - 0.45)
    assert ticks.mean() == pytest.approx(expected, abs=5 * math.sqrt(expected * (expected - 1) / len(ticks)))
