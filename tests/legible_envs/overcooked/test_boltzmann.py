"""The score of noisily rational people: brute force against the definition, the definition against the kernel."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest

from legible_envs import LayoutError
from legible_envs.legibility import From, prefix_weights
from legible_envs.observer import ObserverModel
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.scoring.boltzmann import (
    DEFAULT_RATIONALITY,
    HumanModel,
    boltzmann_legibility,
    boltzmann_trajectories,
    step_probabilities,
)
from legible_envs.overcooked.scoring.explanation import ambiguity, explain_layout, grid_graph, score_layout
from legible_envs.tasks import Subtask, TaskGraph
from legible_envs.workspace import make_workspace
from legible_envs.workspace_checks import check_workspace
from tests.legible_envs.overcooked.kitchens import all_shortest_walks, random_kitchen, steps_between

TINY = [
    OvercookedLayout.from_ascii("XOXTX\nX   X\nXXSXX"),
    OvercookedLayout.from_ascii("XOXX\nX  T\nS  X\nXXDX"),
    OvercookedLayout.from_ascii("XSXXX\nX  VX\nXV  T\nO   X\nXDXXX"),
    OvercookedLayout.from_ascii("XOXOX\nX   X\nX S X\nX   X\nXTXXX"),
]
"""One-row corridor, open square, detours round obstacles, a station inside with four access cells."""

PREFIXES = ["mean", "sum", (0.2, 0.5, 0.9)]


def walks_by_listing(layout, start, goal, rationality, horizon, cell_costs=None):
    """``(floor cells, probability)`` of every walk of at most ``horizon`` steps, by depth-first enumeration."""
    cost = (lambda cell: 1.0) if cell_costs is None else (lambda cell: float(cell_costs[cell]))
    floor = [tuple(cell) for cell in np.argwhere(layout.cells == 0).tolist()]
    to_go = dict.fromkeys(floor, math.inf) | dict.fromkeys(layout.access(goal), 1.0)

    def around(cell):
        return [(cell[0] + dr, cell[1] + dc) for dr, dc in ((-1, 0), (1, 0), (0, 1), (0, -1))]

    for _ in floor:  # Bellman-Ford
        for cell in floor:
            to_go[cell] = min([to_go[cell]] + [cost(b) + to_go[b] for b in around(cell) if b in to_go])

    def draw(options):
        weights = [math.exp(-rationality * value) for _, value in options]
        return [(option, weight / sum(weights)) for (option, _), weight in zip(options, weights, strict=True)]

    def extend(walk, probability):
        if len(walk) + 1 > horizon:
            return
        options = [(b, cost(b) + to_go[b]) for b in around(walk[-1]) if b in to_go]
        options += [(None, 1.0)] if walk[-1] in layout.access(goal) else []
        for after, share in draw(options):
            if after is None:
                yield walk, probability * share
            else:
                yield from extend([*walk, after], probability * share)

    for cell, share in draw([(cell, cost(cell) + to_go[cell]) for cell in layout.access(start)]):
        yield from extend([cell], share)


def value_of_walk(layout, walk, start, goal, goals, prefix, *, beta=1.0, c=1.0, strict=False):
    """Eq. 1 and 2 on every prefix of one walk, weighed."""
    length, total = len(walk) + 1, 0.0
    best = {g: steps_between(layout, layout.access(start), g) for g in goals}
    for t, weight in zip(range(1, length), prefix_weights(prefix, length), strict=True):
        excess = {g: steps_between(layout, [walk[t - 1]], g) - best[g] for g in goals}
        top = [g for g in goals if excess[g] == min(excess.values())]
        odds = {g: math.exp(-beta * excess[g]) for g in goals}
        ranked = [*sorted(odds.values(), reverse=True), 0.0]
        if goal not in top or (len(top) > 1 and strict):
            total -= weight * c * t
        elif len(top) > 1:
            total -= weight * c * t * (len(top) - 1) / len(top)
        else:
            total += weight * (ranked[0] - ranked[1]) / sum(odds.values())
    return total


@pytest.mark.parametrize("layout", TINY, ids=range(len(TINY)))
@pytest.mark.parametrize("prefix", PREFIXES, ids=str)
def test_definition_equals_listing_every_walk(layout, prefix):
    horizon, graph = 8, grid_graph(layout)
    goals = [name for name in layout.stations if not name.startswith("serving")]
    for goal, rationality, strict in itertools.product(goals, (0.3, 1.4), (False, True)):
        listed = list(walks_by_listing(layout, "serving", goal, rationality, horizon))
        arrived = sum(probability for _, probability in listed)
        settings = {"beta": 0.7, "c": 1.3, "strict": strict}
        expected = sum(p * value_of_walk(layout, w, "serving", goal, goals, prefix, **settings) for w, p in listed)
        walks = boltzmann_trajectories(
            graph, From("serving"), goal, rationality=rationality, horizon=horizon, prefix=prefix
        )
        ties = "strict" if strict else "expected"
        scores = boltzmann_legibility(graph, From("serving"), goals, walks, ObserverModel(0.7, 1.3, ties=ties))
        assert sum(s.probability * s.weight * s.value for s in scores) == pytest.approx(expected / arrived, abs=1e-11)
        assert walks.truncated_probability == pytest.approx(1 - arrived, abs=1e-12)
        assert walks.truncated_probability > 0
        assert walks.mean_length == pytest.approx(sum(p * (len(w) + 1) for w, p in listed) / arrived)


def test_steps_by_hand():
    layout = TINY[0]
    graph = grid_graph(layout)
    steps = step_probabilities(graph, {"onion": 0.0, (1, 1): 1.0, (1, 2): 2.0, (1, 3): 3.0}, 1.5)
    assert steps[1, 1]["onion"] == pytest.approx(1 / (1 + math.exp(-1.5 * 2)))
    assert steps[1, 2] == pytest.approx({(1, 1): 1 / (1 + math.exp(-3)), (1, 3): 1 / (1 + math.exp(3))})
    assert steps[1, 3] == {(1, 2): 1.0}
    assert steps["onion"] == {}


def test_cell_costs_steer_the_walker():
    layout = TINY[1]
    costs = np.ones(layout.shape)
    costs[1, 1] = 3.0
    listed = list(walks_by_listing(layout, "serving", "onion", 0.9, 9, costs))
    walks = boltzmann_trajectories(grid_graph(layout, costs), From("serving"), "onion", rationality=0.9, horizon=9)
    arrived = sum(p for _, p in listed)
    assert walks.truncated_probability == pytest.approx(1 - arrived, abs=1e-12)
    at_second_step = {v.node: v.probability for v in walks.visits if v.step == 2}
    for cell, share in at_second_step.items():
        assert share == pytest.approx(sum(p for w, p in listed if len(w) > 1 and w[1] == cell) / arrived)
    assert len(at_second_step) == 2


def random_settings(rng: np.random.Generator, shape: tuple[int, int]) -> dict:
    longest = (shape[0] - 2) * (shape[1] - 2) + 1
    return {
        "prefix": PREFIXES[rng.integers(3)],
        "ties": ("expected", "strict")[rng.integers(2)],
        "beta": float(rng.choice([0.0, 0.2, 1.0, 3.0, 200.0])),
        "c": float(rng.choice([0.5, 1.0, 2.0])),
        "pots": (None, 1, 2)[rng.integers(3)],
        "tie_tolerance": float(rng.choice([1e-9, 2.0])),
        "rationality": float(rng.choice([0.05, 0.8, 1.67, 20.0, 1000.0])),
        "horizon": int(longest + rng.integers(12)),
    }


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(5, 5), (4, 7), (6, 6)])
def test_kernel_equals_definition(shape):
    rng = np.random.default_rng(shape)
    for number in range(8):
        settings = random_settings(rng, shape)
        if number % 2:
            settings |= {"cell_costs": rng.uniform(0.3, 3.0, size=shape), "tie_tolerance": 1e-9}
            settings["cell_costs"][0] = np.nan  # counters take no part
        ws = OvercookedWorkspace(shape, human="boltzmann", **settings)
        for genome in ws.sample(3, rng, obstacle_rate=rng.uniform(0, 0.4)):
            summary = ws.summary(genome)
            assert ws.legibility(genome) == pytest.approx(summary["score"], abs=1e-9, rel=1e-9)
            assert sum(row["contribution"] for row in ws.explain(genome)) == pytest.approx(summary["score"])


@pytest.mark.slow
def test_invalid_genomes_have_no_score():
    ws = OvercookedWorkspace((5, 5), human="boltzmann")
    genomes = ws.sample(4, np.random.default_rng(0))
    scores = ws.legibility(genomes)
    genomes[1, 0] = genomes[1, 1]
    again = ws.legibility(genomes)
    assert np.isnan(again[1])
    assert (again == scores)[[0, 2, 3]].all()
    assert (ws.distance(genomes)[[0, 2, 3]] == OvercookedWorkspace((5, 5)).distance(genomes)[[0, 2, 3]]).all()


def test_limit_of_perfect_rationality():
    """Every step on a shortest way is then equally likely; where ways do not fork that is ``human="shortest"``."""
    rng = np.random.default_rng(5)
    equal = 0
    for _ in range(12):
        layout = random_kitchen(rng, (5, 5))
        goals = ["tomato", "onion", "dish"]
        for start, goal in itertools.product(("pot", "serving"), goals):
            walks = list(all_shortest_walks(layout, start, goal))
            shares = [_share_of_local_choices(layout, walk, goal) for walk in walks]
            assert sum(shares) == pytest.approx(1)
            expected = sum(
                p * value_of_walk(layout, w, start, goal, goals, "mean") for w, p in zip(walks, shares, strict=True)
            )
            graph = grid_graph(layout)
            ways = boltzmann_trajectories(graph, From(start), goal, rationality=60.0, horizon=20)
            scores = boltzmann_legibility(graph, From(start), goals, ways)
            assert sum(s.probability * s.weight * s.value for s in scores) == pytest.approx(expected, abs=1e-9)
            assert ways.mean_length == pytest.approx(len(walks[0]) + 1)
            equal += len(walks) == 1
    assert equal > 10


def _share_of_local_choices(layout, walk, goal) -> float:
    share, field = 1.0, layout.distances_from(layout.access(goal))
    for row, col in walk[:-1]:
        around = ((row - 1, col), (row + 1, col), (row, col + 1), (row, col - 1))
        share /= sum(layout.is_floor(b) and field[b] == field[row, col] - 1 for b in around)
    return share


@pytest.mark.parametrize("prefix", PREFIXES, ids=str)
def test_limit_is_the_shortest_walker_where_ways_do_not_fork(prefix):
    corridor = OvercookedLayout.from_ascii("XOXXFTX\nX     X\nXXSXXXX")
    task = TaskGraph([Subtask("a", ("onion",)), Subtask("b", ("fish",)), Subtask("c", ("tomato",))], "serving")
    observer = ObserverModel(prefix=prefix)
    shortest = score_layout(corridor, task, observer=observer)["score"]
    near = [
        abs(score_layout(corridor, task, observer=observer, human=HumanModel("boltzmann", r))["score"] - shortest)
        for r in (1.0, 3.0, 9.0, 30.0)
    ]
    assert near == sorted(near, reverse=True)
    assert near[0] > 0.01
    assert near[3] < 1e-9


def test_the_truncated_probability_is_reported_and_falls_with_the_horizon():
    layout = TINY[3]
    task = TaskGraph([Subtask("a", ("tomato",)), Subtask("b", ("onion@(0,1)",))], "serving")
    lost = [score_layout(layout, task, human=HumanModel("boltzmann", 0.2, horizon)) for horizon in (9, 20, 80, 400)]
    masses = [summary["truncated_probability"] for summary in lost]
    assert masses[0] > 0.2
    assert masses == sorted(masses, reverse=True)
    assert masses[-1] < 1e-9
    assert all(s["largest_truncated_probability"] >= s["truncated_probability"] for s in lost)
    assert [s["horizon"] for s in lost] == [9, 20, 80, 400]
    assert abs(lost[2]["score"] - lost[3]["score"]) < abs(lost[0]["score"] - lost[3]["score"])


def test_default_horizon_loses_almost_nobody():
    rng = np.random.default_rng(0)
    ws = OvercookedWorkspace((5, 5), human="boltzmann", rationality=1.1)
    assert max(ws.summary(genome)["truncated_probability"] for genome in ws.sample(20, rng)) < 1e-3
    ws = OvercookedWorkspace((7, 7), human="boltzmann", rationality=1.1)
    assert max(ws.summary(genome)["truncated_probability"] for genome in ws.sample(3, rng)) < 1e-6


def test_margins_only_where_one_goal_is_valid():
    layout = TINY[2]
    task = TaskGraph([Subtask("a", ("onion",)), Subtask("b", ("tomato",), after=("a",))], "serving")
    summary = score_layout(layout, task, human=HumanModel("boltzmann", 0.4))
    assert summary["score"] == pytest.approx(2.0)
    assert summary["normalised"] == pytest.approx(1.0)
    assert summary["single_goal_share"] == pytest.approx(1.0)


def test_explanations_and_doubt():
    layout = OvercookedWorkspace((5, 5)).decode(OvercookedWorkspace((5, 5)).sample(1, np.random.default_rng(2))[0])
    people = {"human": HumanModel("boltzmann", 0.5)}
    rows = explain_layout(layout, **people)
    assert math.fsum(row["contribution"] for row in rows) == pytest.approx(score_layout(layout, **people)["score"])
    longest = max(len(row["prefixes"]) for row in rows)
    assert longest > max(len(row["prefixes"]) for row in explain_layout(layout))
    noisy, clean = ambiguity(layout, **people), ambiguity(layout)
    assert np.nanmin(noisy) >= -1e-12
    assert np.nanmax(noisy) <= 1 + 1e-12
    assert np.isfinite(noisy).sum() >= np.isfinite(clean).sum()
    assert np.nanmean(noisy) > np.nanmean(clean)


def test_settings_are_kept_and_checked():
    ws = OvercookedWorkspace((5, 5), human="boltzmann", horizon=np.int64(15))
    assert (ws.human, ws.rationality, ws.horizon) == ("boltzmann", DEFAULT_RATIONALITY, 15)
    for again in (make_workspace(ws.to_config()), pickle.loads(pickle.dumps(ws))):
        assert again == ws
        assert again.to_config()["rationality"] == DEFAULT_RATIONALITY
    check_workspace(ws)
    assert ws != OvercookedWorkspace((5, 5))
    summary = ws.summary(ws.sample(1, np.random.default_rng(0))[0])
    assert {key: summary[key] for key in ("human", "rationality", "horizon")} == {
        "human": "boltzmann",
        "rationality": DEFAULT_RATIONALITY,
        "horizon": 15,
    }
    assert "rationality" not in OvercookedWorkspace((5, 5)).to_config()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"human": "drunk"}, "`human` must be 'shortest' or 'boltzmann', got 'drunk'"),
        ({"human": "shortest", "rationality": 1.0}, "`rationality` belong"),
        ({"horizon": 30}, "`horizon` belong"),
        ({"human": "boltzmann", "rationality": 0.0}, "`rationality` must be a finite number > 0, got 0.0"),
        ({"human": "boltzmann", "rationality": math.inf}, "`rationality` must be a finite number > 0, got inf"),
        ({"human": "boltzmann", "rationality": True}, "`rationality` must be a finite number > 0, got True"),
        (
            {"human": "boltzmann", "horizon": 9},
            "`horizon` must be None or an integer from 10 to 8192 steps, the length of .* 9 cells, got 9",
        ),
        (
            {"human": "boltzmann", "horizon": 20.0},
            "`horizon` must be None or an integer from 10 to 8192 .*, got 20.0",
        ),
    ],
)
def test_bad_settings(arguments, message):
    with pytest.raises(ValueError, match=message):
        OvercookedWorkspace((5, 5), **arguments)


def test_unreachable_goals_and_short_horizons():
    shut = OvercookedLayout.from_ascii("XOXTX\nX  VX\nXXSXX")
    task = TaskGraph([Subtask("a", ("onion",)), Subtask("b", ("tomato",))], "serving")
    with pytest.raises(LayoutError, match="cannot be done"):
        score_layout(shut, task, human="boltzmann")
    with pytest.raises(ValueError, match="within 2 steps"):
        boltzmann_trajectories(grid_graph(TINY[0]), From("serving"), "onion", rationality=1.0, horizon=2)
    with pytest.raises(ValueError, match="no path"):
        boltzmann_trajectories(grid_graph(shut), From("serving"), "tomato", rationality=1.0, horizon=9)
    assert HumanModel("boltzmann", 2).within(10) == HumanModel("boltzmann", 2.0, 22)
