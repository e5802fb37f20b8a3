"""The score: brute force against the readable definition, the readable definition against the kernels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs import LayoutError, TaskError
from legible_envs.legibility import (
    From,
    env_legibility,
    goal_legibility,
    posterior,
    prefix_weights,
    task_legibility,
    tied_goals,
)
from legible_envs.observer import ObserverModel, check_prefix
from legible_envs.overcooked import OvercookedLayout, OvercookedScorer, OvercookedWorkspace
from legible_envs.overcooked.scoring.explanation import (
    ambiguity,
    explain_layout,
    grid_graph,
    layout_distance,
    score_layout,
)
from legible_envs.tabletop import TabletopWorkspace
from legible_envs.tasks import Subtask, TaskGraph
from tests.legible_envs.overcooked.kitchens import brute_force_legibility, brute_force_reach, random_kitchen
from tests.support.plain_python import printed_both_ways

SHAPES = [(5, 5), (4, 9), (5, 8), (6, 6), (7, 7), (8, 5), (9, 9), (10, 11), (12, 12)]
PREFIXES = ["mean", "sum", (0.1, 0.25, 0.5, 0.9)]

small_task = TaskGraph(
    [
        Subtask("tomato", ("tomato",), then=("pot",)),
        Subtask("onion", ("onion",), then=("pot",)),
        Subtask("fish", ("fish",)),
        Subtask("serve", ("dish",), after=("tomato", "onion"), then=("pot", "serving")),
    ],
    "serving",
)


def test_posterior_by_hand():
    probabilities = posterior({"a": 2.0, "b": 5.0}, {"a": 4.0, "b": 5.0}, beta=1.0)
    assert probabilities["a"] == pytest.approx(1 / (1 + math.exp(-2)))
    assert sum(probabilities.values()) == pytest.approx(1)
    assert posterior({"a": 1.0, "b": math.inf}, {"a": 1.0, "b": 3.0})["b"] == 0
    shifted = posterior({"a": 2.0, "b": 5.0}, {"a": 4.0, "b": 5.0}, prior={"a": 0.1, "b": 0.9})
    assert shifted["a"] == pytest.approx(0.1 / (0.1 + 0.9 * math.exp(-2)))


def test_env_legibility_by_hand():
    optimal = {"a": 4.0, "b": 4.0, "c": 6.0}
    remaining = {"a": 2.0, "b": 2.0, "c": 6.0}
    assert tied_goals(remaining, optimal) == ["a", "b"]
    assert env_legibility("a", remaining, optimal, observed=2) == -1.0
    assert env_legibility("a", remaining, optimal, 2, ObserverModel(ties="strict", c=3.0)) == -6.0
    assert env_legibility("c", remaining, optimal, observed=2) == -2.0
    assert env_legibility("a", {"a": 2.0}, {"a": 4.0}, observed=2) == 1.0
    clear = env_legibility("a", {"a": 2.0, "b": 4.0}, {"a": 4.0, "b": 4.0}, observed=2)
    assert clear == pytest.approx(math.tanh(1.0))
    assert env_legibility("c", remaining, optimal, 2, ObserverModel(unit=0.5, c=3.0)) == -12.0


def test_observers_check_their_settings():
    observer = ObserverModel(beta=2, prefix=[0.5, 1])
    assert observer == ObserverModel(2.0, prefix=(0.5, 1.0))
    assert hash(observer) == hash(ObserverModel(2.0, prefix=(0.5, 1.0)))
    table = ObserverModel.in_metres()
    assert (table.beta, table.c, table.unit, table.prefix) == (20.0, 1.0, 0.05, "mean")
    for settings_, message in (
        ({"beta": -1}, "`beta` must be a finite number >= 0"),
        ({"c": math.nan}, "`c` must be a finite number >= 0"),
        ({"c": True}, "`c` must be a finite number >= 0, got True"),
        ({"tie_tolerance": math.inf}, "`tie_tolerance` must be a finite number >= 0"),
        ({"unit": 0}, "`unit` must be a finite number > 0 steps or metres, got 0"),
        ({"unit": -1}, "`unit` must be a finite number > 0 steps or metres, got -1"),
        ({"ties": "first"}, "`ties` must be 'expected' or 'strict'"),
        ({"prefix": "median"}, "`prefix` must be"),
    ):
        with pytest.raises(ValueError, match=message):
            ObserverModel(**settings_)
        with pytest.raises(ValueError, match=message):
            ObserverModel.in_metres(**settings_)


def test_prefix_weights():
    assert prefix_weights("mean", 5) == [0.25] * 4
    assert prefix_weights("sum", 3) == [1.0, 1.0]
    assert prefix_weights((0.2, 0.5), 10) == [0, 0.5, 0, 0, 0.5, 0, 0, 0, 0]
    assert prefix_weights((0.01, 1.0), 4) == [0.5, 0, 0.5]
    assert sum(prefix_weights((0.3, 0.31, 0.5), 2)) == pytest.approx(1)
    for bad in ("median", (), (0.0,), (1.5,), 2.0):
        with pytest.raises(ValueError, match="`prefix` must be"):
            check_prefix(bad)


@pytest.mark.parametrize("prefix", PREFIXES, ids=str)
@pytest.mark.parametrize("ties", ["expected", "strict"])
def test_definition_equals_listing_every_ordering_and_every_walk(prefix, ties):
    rng = np.random.default_rng(1)
    for shape in [(5, 5), (4, 7), (6, 6)]:
        layout = random_kitchen(rng, shape)
        expected = brute_force_legibility(
            layout, small_task, weigh=lambda n: prefix_weights(prefix, n), beta=0.7, c=1.3, strict=ties == "strict"
        )
        value = task_legibility(grid_graph(layout), small_task, ObserverModel(0.7, 1.3, prefix, ties))
        assert value == pytest.approx(expected, abs=1e-10)


def test_definition_on_kitchens_no_genome_can_express():
    layout = OvercookedLayout.from_ascii("XXPXXX\nO    T\nX XX X\nX DX X\nX    X\nXXSXOX")
    names = ("onion@(1,0)", "onion@(5,4)", "tomato", "dish")
    for start in ("pot", "serving"):
        for goal in names:
            for goals in (names, (goal, "dish"), (goal,)):
                scores = goal_legibility(grid_graph(layout), From(start), goal, tuple(dict.fromkeys(goals)))
                value = sum(s.probability * s.weight * s.value for s in scores)
                expected = brute_force_reach(layout, start, goal, set(goals), weigh=lambda n: prefix_weights("mean", n))
                assert value == pytest.approx(expected, abs=1e-12)
                by_step: dict[int, float] = {}
                for s in scores:
                    by_step[s.step] = by_step.get(s.step, 0.0) + s.probability
                assert all(total == pytest.approx(1) for total in by_step.values())


def random_settings(rng: np.random.Generator) -> dict:
    return {
        "prefix": PREFIXES[rng.integers(3)],
        "ties": ("expected", "strict")[rng.integers(2)],
        "beta": float(rng.choice([0.2, 1.0, 3.0])),
        "c": float(rng.choice([0.5, 1.0, 2.0])),
        "pots": (None, 1, 2)[rng.integers(3)],
        "tie_tolerance": float(rng.choice([1e-9, 2.0])),
    }


def agree(shape, settings_, count, rng) -> None:
    ws = OvercookedWorkspace(shape, **settings_)
    genomes = ws.sample(count, rng, obstacle_rate=rng.uniform(0, 0.4))
    legibility, distance = ws.scores(genomes)
    for genome, score, moves in zip(genomes, legibility, distance, strict=True):
        layout = ws.decode(genome)
        slow = task_legibility(grid_graph(layout), ws.task, ws.observer)
        assert abs(slow - score) <= 1e-9
        assert abs(layout_distance(layout, ws.task) - moves) <= 1e-9


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_kernel_equals_definition(shape):
    rng = np.random.default_rng(shape)
    for _ in range(3):
        agree(shape, random_settings(rng) | {"tie_tolerance": 1e-9}, 4, rng)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_kernel_equals_definition_on_thousands(shape, repeats):
    """2,000 random layouts together, half of them with the default task; 5,000 with ``--thorough``."""
    rng = np.random.default_rng([7, *shape])
    big = shape[0] * shape[1] > 80
    for _ in range(2 if big else repeats(4, 10)):
        agree(shape, random_settings(rng) | {"tie_tolerance": 1e-9, "pots": 1}, 40, rng)
    agree(shape, {}, 100 if big else repeats(120, 320), rng)


def test_kernel_equals_brute_force_on_a_custom_task():
    rng = np.random.default_rng(3)
    ws = OvercookedWorkspace((5, 6), task=small_task, prefix="sum", beta=0.5)
    genomes = ws.sample(12, rng)
    for genome, score in zip(genomes, ws.legibility(genomes), strict=True):
        expected = brute_force_legibility(ws.decode(genome), small_task, weigh=lambda n: [1.0] * (n - 1), beta=0.5)
        assert score == pytest.approx(expected, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ones", "continuous", "halves"])
@pytest.mark.parametrize("ties", ["expected", "strict"])
def test_weighted_kernel_equals_definition(kind, ties):
    rng = np.random.default_rng(5)
    for shape in [(5, 5), (5, 8), (8, 8)]:
        costs = {
            "ones": np.ones(shape),
            "continuous": rng.uniform(0.5, 2.0, shape),
            "halves": rng.integers(1, 4, shape) / 2,
        }[kind]
        prefix = PREFIXES[rng.integers(3)]
        ws = OvercookedWorkspace(shape, prefix=prefix, ties=ties, cell_costs=costs, pots=1)
        genomes = ws.sample(6, rng)
        for genome, score in zip(genomes, ws.legibility(genomes), strict=True):
            graph = grid_graph(ws.decode(genome), costs)
            slow = task_legibility(graph, ws.task, ObserverModel(prefix=prefix, ties=ties))
            assert abs(slow - score) <= 1e-9
        if kind == "ones":
            plain = OvercookedWorkspace(shape, prefix=prefix, ties=ties, pots=1).legibility(genomes)
            np.testing.assert_allclose(ws.legibility(genomes), plain, atol=1e-9)


def test_sampled_walks_agree_with_the_exact_score():
    """Monte Carlo: draw sequences and walks, score one random prefix of each, as the paper does."""
    rng = np.random.default_rng(11)
    layout = random_kitchen(rng, (6, 6))
    ws = OvercookedWorkspace((6, 6), task=small_task)
    exact = ws.legibility(ws.encode(layout))
    stages = small_task.stages()
    samples = []
    for _ in range(4000):
        total = 0.0
        for stage in stages:
            if rng.random() < stage.weight:
                for goal in stage.goals:
                    scores = goal_legibility_cached(layout, stage.start, goal, stage.goals)
                    p = np.array([s.probability * s.weight for s in scores])
                    total += scores[rng.choice(len(scores), p=p / p.sum())].value
        samples.append(total)
    standard_error = np.std(samples) / math.sqrt(len(samples))
    assert abs(np.mean(samples) - exact) < 4 * standard_error


_cache: dict = {}


def goal_legibility_cached(layout, start, goal, goals):
    key = (start, goal, goals)
    if key not in _cache:
        _cache[key] = goal_legibility(grid_graph(layout), From(start), goal, goals)
    return _cache[key]


def test_explanation_adds_up_to_the_score():
    ws = OvercookedWorkspace((7, 7), prefix="mean")
    genome = ws.sample(1, np.random.default_rng(2))[0]
    rows = ws.explain(genome)
    summary = ws.summary(genome)
    assert sum(row["contribution"] for row in rows) == pytest.approx(ws.legibility(genome))
    assert summary["score"] == pytest.approx(ws.legibility(genome))
    assert summary["distance"] == pytest.approx(ws.distance(genome))
    assert summary["normalised"] == pytest.approx(summary["score"] / 33.526887926887916)
    assert summary["candidate_set"] == "task"
    single = [row for row in rows if len(row["goals"]) == 1]
    assert summary["single_goal_score"] == pytest.approx(sum(row["contribution"] for row in single))
    assert rows == sorted(rows, key=lambda row: row["contribution"])
    for row in rows:
        weighted = sum(p["weight"] * p["value"] for p in row["prefixes"])
        assert weighted == pytest.approx(row["score"])
        first = row["prefixes"][0]["ties_with"]
        assert set(first) == set(row["goals"]) - {row["goal"]}  # every goal ties at t = 1
    heat = ws.ambiguity(genome)
    assert np.nanmin(heat) >= 0
    assert np.nanmax(heat) < 1
    assert np.isnan(heat[0, 0])


def test_score_of_any_kitchen():
    layout = OvercookedLayout.from_ascii("XXPXX\nO  2O\nX1  X\nXDXSX")
    task = TaskGraph(
        [Subtask("onion", ("onion",), then=("pot",), count=3), Subtask("d", ("dish",), ("onion",), ("pot", "serving"))],
        "serving",
    )
    observer = ObserverModel(prefix="sum")
    result = score_layout(layout, task, observer=observer)
    assert result["num_stages"] == len(task.stages()) == 3
    assert result["distance"] == pytest.approx(layout_distance(layout, task))
    rows = explain_layout(layout, task, observer=observer)
    scorer = OvercookedScorer(task, observer=observer)
    assert scorer.score_layout(layout) == result
    assert scorer.explain_layout(layout) == rows
    np.testing.assert_array_equal(scorer.ambiguity(layout), ambiguity(layout, task, observer=observer))
    assert result["score"] == pytest.approx(sum(row["contribution"] for row in rows))
    assert {row["goal"] for row in rows} == {"onion@(1,0)", "onion@(1,4)", "dish"}
    assert np.isfinite(ambiguity(layout, task)[1, 1])
    with pytest.raises(LayoutError, match=r"needs a (tomato|cabbage|fish) station"):
        score_layout(layout)
    walled = OvercookedLayout.from_ascii("XXPXX\nO X O\nX X X\nXDXSX")
    with pytest.raises(LayoutError, match="cannot be done"):
        score_layout(walled, task)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_mirrored_kitchens_score_the_same(seed):
    ws = OvercookedWorkspace((6, 8), prefix="sum")
    genome = ws.sample(1, np.random.default_rng(seed))[0]
    layout = ws.decode(genome)
    mirrored = ws.encode(OvercookedLayout(layout.cells[:, ::-1]))
    turned = ws.encode(OvercookedLayout(layout.cells[::-1, ::-1]))
    values, distances = ws.scores(np.array([genome, mirrored, turned]))
    np.testing.assert_allclose(values, values[0], atol=1e-9)
    np.testing.assert_allclose(distances, distances[0], atol=1e-9)


@pytest.mark.slow
def test_the_proven_optimum_of_5x5():
    """Exhaustive search over every valid 5x5 kitchen (DESIGN gives the value)."""
    import itertools

    ws = OvercookedWorkspace((5, 5), prefix="sum")
    compatible = ws.rules.geometry.compatible
    seatings = np.array(
        [
            order
            for chosen in itertools.combinations(range(12), 7)
            if all(compatible[a, b] for a, b in itertools.combinations(chosen, 2))
            for order in itertools.permutations(chosen)
        ],
        dtype=np.int8,
    )
    bits = (np.arange(512)[:, None] >> np.arange(9) & 1).astype(np.int8)
    best, valid = -np.inf, 0
    for part in np.array_split(seatings, 60):
        genomes = np.concatenate([np.repeat(part, 512, 0), np.tile(bits, (len(part), 1))], axis=1)
        scores = ws.legibility(genomes)
        best, valid = max(best, np.nanmax(scores)), valid + np.isfinite(scores).sum()
    assert best == pytest.approx(-11.684924681147868, abs=1e-10)
    assert valid == 665_280


def test_kernels_run_as_plain_python():
    script = """
import numpy as np
from legible_envs.overcooked import OvercookedWorkspace
for kwargs in ({}, {"cell_costs": np.ones((5, 5))}):
    ws = OvercookedWorkspace((5, 5), pots=1, **kwargs)
    g = np.array([[0, 2, 4, 6, 8, 10, 11, 0, 0, 0, 0, 1, 0, 0, 0, 0]], dtype=np.int8)
    g[0, 6] = 10; g[0, 5] = 1
    g = ws.sample(1, np.random.default_rng(0)) if not ws.valid(g)[0] else g
    children = ws.perturb(g, 3, np.random.default_rng(1))
    print(repr(ws.legibility(children).tolist()), children.tolist())
"""
    outputs = [
        [eval(part) for part in text.replace("] [", "]\n[").split("\n") if part] for text in printed_both_ways(script)
    ]
    for compiled, plain in zip(*outputs, strict=True):
        np.testing.assert_allclose(compiled, plain, atol=1e-12)


def test_tasks_that_do_not_fit_the_kitchen():
    with pytest.raises(TaskError, match="which the kitchen lacks"):
        OvercookedWorkspace((7, 7), stations=("onion", "dish", "pot", "serving"))
    ws = OvercookedWorkspace((5, 5), stations=("onion", "dish", "pot", "serving"), recipes=[("onion",) * 3])
    assert np.isfinite(ws.legibility(ws.sample(3, np.random.default_rng(0)))).all()


def test_workspaces_show_the_observer_their_keywords_describe():
    ws = OvercookedWorkspace((5, 5), prefix=0.5, beta=2, c=3, ties="strict", tie_tolerance=0.1)
    assert ws.observer == ws.scorer.observer == ObserverModel(2.0, 3.0, (0.5,), "strict", 0.1)
    with pytest.raises(AttributeError):
        ws.observer = ObserverModel()
    table = TabletopWorkspace(prefix=(0.9, 0.1), beta=2, c=3, ties="strict", tie_tolerance=0.1, unit=0.2)
    assert table.observer == ObserverModel.in_metres(2.0, 3.0, (0.9, 0.1), "strict", 0.1, 0.2)
    assert TabletopWorkspace().observer == ObserverModel.in_metres()
    with pytest.raises(AttributeError):
        table.observer = ObserverModel()
