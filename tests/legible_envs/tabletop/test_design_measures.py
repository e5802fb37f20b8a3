"""Scores, explanations and measures of tables against their definitions."""

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.tabletop import TableObject, TabletopLayout, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.design.measures import greatest_spacing, least_distances, order_ranks
from tests.legible_envs.tabletop.design_cases import CONDITIONS, TASKS_QUICK, designed, few_bins, name_of, rng
from tests.oracles.table_oracle import legibility
from tests.support.plain_python import printed_both_ways


@pytest.mark.parametrize(("task", "n"), [("columns", 4), ("tea", 10)])
def test_scores_are_the_definition(task, n):
    ws = TabletopWorkspace(task)
    genomes = designed(ws, n, seed=3)
    assert ws.num_obstacles(genomes).max() >= 2
    for genome, score in zip(genomes, ws.legibility(genomes), strict=True):
        assert score == pytest.approx(legibility(ws.decode(genome), ws.task.graph), abs=1e-9)


def test_immovable_pieces_are_scored_by_the_definition_too():
    ws = TabletopWorkspace(few_bins(4))
    genomes = designed(ws, 4, seed=1)
    assert ws.num_obstacles(genomes).max() >= 1
    for genome, score in zip(genomes, ws.legibility(genomes), strict=True):
        assert score == pytest.approx(legibility(ws.decode(genome), ws.task.graph), abs=1e-9)


@pytest.mark.slow
def test_ten_pieces_are_scored_by_the_definition():
    ws = TabletopWorkspace("bins", prefix=(0.3, 0.7))
    genome = designed(ws, 3, seed=1)[-1]
    expected = legibility(ws.decode(genome), ws.task.graph, fractions=[0.3, 0.7])
    assert ws.legibility(genome) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("task", TASKS_QUICK, ids=name_of)
@pytest.mark.parametrize("condition", CONDITIONS)
def test_summaries_and_explanations_add_up(task, condition):
    ws = TabletopWorkspace(task, condition, prefix=(0.25, 0.75) if task == "tea" else "mean")
    genome = designed(ws, 3, seed=2)[-1]
    summary, rows = ws.summary(genome), ws.explain(genome)
    assert summary["score"] == pytest.approx(ws.legibility(genome), abs=1e-12)
    assert math.fsum(row["contribution"] for row in rows) == pytest.approx(summary["score"], abs=1e-9)
    assert math.fsum(row["weight"] for row in rows) == pytest.approx(ws.scorer.best_possible)
    assert summary["normalised"] == pytest.approx(summary["score"] / ws.scorer.best_possible)
    single = math.fsum(row["contribution"] for row in rows if len(row["goals"]) == 1)
    assert summary["single_goal_score"] == pytest.approx(single)
    assert summary["max_detour"] == pytest.approx(max(row["detour"] for row in rows))
    assert summary["objective"] == pytest.approx(float(ws.objective()(genome[None])[0]))
    assert summary == ws.summary(ws.decode(genome))
    for row in rows:
        assert row["score"] == pytest.approx(sum(p["value"] * p["weight"] for p in row["prefixes"]))
        assert set(row["ties_with"]) <= set(row["goals"]) - {row["goal"]}
    json.dumps([summary, rows], allow_nan=False)


def test_obstacles_cost_and_useless_ones_are_pruned():
    ws = TabletopWorkspace()
    useless = ws.baseline.with_obstacles([VirtualObstacle((0.16, 0.1)), VirtualObstacle((1.0, 0.7))])
    genome = ws.encode(useless)
    assert ws.penalty(genome[None])[0] == pytest.approx(0.6)
    assert ws.objective()(genome[None])[0] == pytest.approx(ws.legibility(genome) - 0.6)
    assert np.array_equal(ws.prune(genome), ws.encode(ws.baseline))
    simpler = ws.simplifications(genome)
    assert [ws.decode(g).obstacles for g in simpler] == [useless.obstacles[1:], useless.obstacles[:1]]
    for found in designed(ws, 10):
        pruned = ws.prune(found)
        assert ws.objective()(pruned[None])[0] >= ws.objective()(found[None])[0]
        rest = ws.simplifications(pruned)
        assert not len(rest) or (ws.objective()(rest) < ws.objective()(pruned[None])[0]).all()


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=30, deadline=None)
def test_order_ranks_are_positions_in_the_list_of_permutations(seed, has_ties):
    centres = rng(seed).random((20, 6, 2))
    if has_ties:
        centres = centres.round(1)
    ranked = [4, 1, 3, 0]
    every = list(itertools.permutations(range(4)))
    for table, rank in zip(centres, order_ranks(centres, ranked), strict=True):
        order = tuple(sorted(range(4), key=lambda k: (table[ranked[k], 0], table[ranked[k], 1], k)))
        assert every[rank] == order


def test_measures():
    ws = TabletopWorkspace("columns")
    genomes = designed(ws, 50)
    found = ws.measures(genomes)
    for genome, (least, rank) in zip(genomes, found, strict=True):
        layout = ws.decode(genome)
        assert least == min(math.dist(a.at, b.at) for a, b in itertools.combinations(layout.objects, 2))
        summary = ws.summary(genome)
        assert summary["least_distance"] == pytest.approx(least)
        initials = [name[0] + name.split("-")[1][0] for name in summary["order"]]
        assert ws.order_names[int(rank)] == " ".join(initials)
    assert ws.archive_dims == (27, 24)
    fixed = TabletopWorkspace("columns", "obstacles")
    genomes = fixed.sample(60, rng())
    found = fixed.measures(genomes)
    assert np.array_equal(found[:, 0], fixed.num_obstacles(genomes))
    np.testing.assert_allclose(found[:, 1], fixed.table_scores(genomes).mean_detour, atol=1e-12)
    assert fixed.archive_dims == (5, 30)
    assert TabletopWorkspace("columns", ranked="all").archive_dims[1] == math.factorial(8)


@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_no_arrangement_is_wider_than_the_greatest_spacing(seed, n, stay):
    generator = rng(seed)
    centres = generator.uniform((0.1, 0.2), (0.8, 0.7), (n, 2))
    moves = np.arange(n) >= min(stay, n - 1)
    names = [TableObject(str(i), tuple(c)) for i, c in enumerate(centres)]
    limit = greatest_spacing(TabletopLayout(names), moves)
    for _ in range(60):  # push the nearest pair apart
        assert least_distances(centres[None], ~moves)[0] <= limit
        gaps = np.linalg.norm(centres[:, None] - centres, axis=-1) + 9 * np.eye(n)
        i, j = np.unravel_index(gaps.argmin(), gaps.shape)
        step = 0.3 * (centres[i] - centres[j] + 1e-6)
        if moves[i]:
            centres[i] += step
        if moves[j]:
            centres[j] -= step
        centres = np.clip(centres, (0.1, 0.2), (0.8, 0.7))


def test_the_greatest_spacing_is_that_of_a_triangular_lattice():
    at = [(0.1 + 0.1 * i + 0.05 * (j % 2), 0.2 + 0.1 * j * math.sqrt(3) / 2) for j in range(6) for i in range(7)]
    names = [TableObject(str(i), p) for i, p in enumerate(at)]
    assert 0.1 <= greatest_spacing(TabletopLayout(names), np.ones(len(at), bool)) < 0.115


@pytest.mark.slow
def test_genomes_vary_and_score_alike_as_plain_python():
    code = (
        "import numpy as np;"
        "from legible_envs.tabletop import TabletopWorkspace;"
        "ws = TabletopWorkspace('tea');"
        "g = ws.sample(3, np.random.default_rng(0));"
        "g = ws.perturb(ws.perturb(g, 1, np.random.default_rng(1)), 1, np.random.default_rng(2), phase=1);"
        "print(*g.ravel(), *ws.legibility(g), *ws.measures(g).ravel(), ws.valid(g).all())"
    )
    outcomes = []
    for text in printed_both_ways(code):
        *words, is_valid = text.split()
        assert is_valid == "True"
        outcomes.append([float(word) for word in words])
    assert outcomes[0] == pytest.approx(outcomes[1], abs=1e-12)
