"""The design of tables: rules against their readable form, genomes, variation, measures, configuration."""

import itertools
import json
import math
import pickle
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs import LayoutError, TaskError
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.design.genome_kernels import half_turn
from legible_envs.tabletop.design.measures import greatest_spacing, least_distances, order_ranks
from legible_envs.tasks import Subtask, TaskGraph
from legible_envs.workspace import make_workspace
from legible_envs.workspace_checks import check_workspace
from tests.oracles.table_oracle import legibility
from tests.support.plain_python import printed_both_ways

CONDITIONS = ("both", "placement", "obstacles")
TASKS = ("columns", "tea", "bins")


def few_bins(keep=3):
    """`bins` with few pieces: reaches for bins start at pieces, reaches for pieces at bins."""
    whole = TabletopTask.named("bins")
    groups = {f"piece-{i}": (f"take-{i}", f"put-{i}") for i in range(keep)}
    graph = TaskGraph(whole.graph.subtasks[: 2 * keep], "home", groups, max_open=1)
    return TabletopTask("few", TabletopLayout(whole.layout.objects[: 2 + keep], table=whole.layout.table), graph)


TASKS_QUICK = ("columns", "tea", few_bins())


def name_of(value):
    return value if isinstance(value, str) else value.name


def rng(seed=0):
    return np.random.default_rng(seed)


def designed(ws, n, seed=0, rounds=12):
    """Valid genomes with obstacles, by a random walk through all phases."""
    genomes, generator = ws.sample(n, rng(seed)), rng(seed + 1)
    for _ in range(rounds):
        for phase in range(ws.phases):
            genomes = ws.perturb(genomes, 1, generator, phase=phase)
    return genomes


def broken(ws, n, seed):
    """Genomes near valid ones, about half of them invalid, some far off."""
    generator = rng(seed)
    genomes = designed(ws, n, seed, rounds=8)
    first = 2 * len(ws.rules.movable)
    genomes[: n // 3] += generator.normal(0, 0.01, (n // 3, ws.genome_size))
    rows = genomes[n // 3 : 2 * n // 3]
    at = first + 4 * generator.integers(0, ws.rules.max_obstacles, len(rows))
    rows[np.arange(len(rows)), at] = 1.0
    rows[np.arange(len(rows)), at + 1] = generator.uniform(0, 1.2, len(rows))
    rows[np.arange(len(rows)), at + 2] = generator.uniform(0, 0.8, len(rows))
    rows[np.arange(len(rows)), at + 3] = generator.uniform(-1.6, 1.6, len(rows))
    return np.where(generator.random((n, 1)) < 0.7, np.clip(genomes, ws.lower_bounds, ws.upper_bounds), genomes)


def rule_of(build):
    with pytest.raises(LayoutError) as caught:
        build()
    return caught.value.rule


# -- the contract ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TASKS_QUICK, ids=name_of)
@pytest.mark.parametrize("condition", CONDITIONS)
def test_tables_keep_the_contract(task, condition):
    check_workspace(TabletopWorkspace(task, condition))


@pytest.mark.slow
@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_table_of_ten_pieces_keeps_the_contract(condition):
    check_workspace(TabletopWorkspace("bins", condition))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"condition": "obstacles", "max_detour": None},
        {"task": "tea", "condition": "placement", "prefix": (0.5, 0.2), "ties": "strict", "max_obstacles": 0},
        {
            "task": few_bins(),
            "obstacles_apart": False,
            "obstacles_on_table": False,
            "ranked": "all",
            "obstacle_cost": 0.0,
        },
        {"obstacle_size": (0.2, 0.02), "object_spacing": 0.1, "step_sd": 0.03, "beta": 5.0, "c": 2.0, "unit": 0.1},
        {"ranked": ["blue-circle", "yellow-circle"], "start_clearance": 0.2, "object_clearance": 0.05},
    ],
)
def test_configurations_and_pickles_are_the_same_workspace(options):
    ws = TabletopWorkspace(**options)
    config = json.loads(json.dumps(ws.to_config(), allow_nan=False))
    for copy in (make_workspace(config), pickle.loads(pickle.dumps(ws))):
        assert copy == ws
        assert hash(copy) == hash(ws)
        assert copy.to_config() == ws.to_config()
        assert np.array_equal(copy.sample(5, rng()), ws.sample(5, rng()))
        genomes = designed(ws, 5)
        assert np.array_equal(copy.scores(genomes), ws.scores(genomes))
        assert np.array_equal(copy.measures(genomes), ws.measures(genomes))
    assert ws != TabletopWorkspace(**{**options, "beta": 7.0})
    assert "TabletopWorkspace(task=" in repr(ws)


def test_any_task_can_be_designed(tmp_path):
    layout = TabletopLayout(
        [TableObject("cup", (0.3, 0.4)), TableObject("plate", (0.5, 0.5), size=(0.2, 0.2), angle=0.3)]
    )
    task = TabletopTask("lunch", layout, TaskGraph([Subtask("take", ("cup", "plate"))], start="home"))
    ws = TabletopWorkspace(task)
    path = tmp_path / "lunch.yaml"
    task.to_yaml(path)
    for other in (TabletopWorkspace(str(path)), TabletopWorkspace(task.to_dict()), make_workspace(ws.to_config())):
        assert other == ws
        assert other.task == task
    check_workspace(ws)


# -- rules -------------------------------------------------------------------------------------------------------------

MET = {
    "range",
    "object-spacing",
    "obstacle",
    "obstacle-off-table",
    "detour",
    "start-clearance",
    "slot",
    "obstacle-apart",
}


def compare_rules(ws, genomes):
    """Which rules the readable check names; it must agree with the kernel on every genome."""
    found = Counter()
    for genome, is_valid in zip(genomes, ws.valid(genomes), strict=True):
        try:
            ws.decode(genome)
            rule = None
        except LayoutError as error:
            rule = error.rule
        assert (rule is None) == is_valid, (rule, genome.tolist())
        found[rule] += 1
    return found


def test_the_kernel_is_the_readable_rules():
    ws = TabletopWorkspace("columns")
    found = compare_rules(ws, broken(ws, 1000, 0))
    assert found[None] > 100
    assert set(found) >= MET, found


@pytest.mark.parametrize(
    ("task", "options"),
    [
        ("tea", {"object_spacing": 0.0, "object_clearance": 0.0, "start_clearance": 0.0, "max_detour": None}),
        ("bins", {"obstacles_apart": False, "obstacles_on_table": False}),
        ("columns", {"condition": "obstacles", "max_detour": 1.05}),
        ("columns", {"condition": "placement"}),
    ],
)
def test_the_kernel_is_the_readable_rules_in_other_workspaces(task, options):
    ws = TabletopWorkspace(task, **options)
    found = compare_rules(ws, broken(ws, 300, 1))
    assert found[None] > 20
    assert len(found) > 1
    if task == "tea":
        assert {"overlap", "obstacle", "covered"} <= set(found)


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_kernel_is_the_readable_rules_on_many_tables(task, condition):
    ws = TabletopWorkspace(task, condition)
    compare_rules(ws, broken(ws, 1500, 7))


def test_walls_that_close_a_place_are_not_allowed():
    """Without the other rules, only whether a hand gets everywhere counts."""
    free = {"max_detour": None, "start_clearance": 0.0, "object_clearance": 0.0, "obstacles_apart": False}
    ws = TabletopWorkspace("columns", obstacle_size=(0.8, 0.01), **free)
    wall = ws.baseline.with_obstacles([VirtualObstacle((0.85, 0.4), math.pi / 2, (0.8, 0.01))])
    assert rule_of(lambda: ws.encode(wall)) == "reachable"
    genome = wall.to_genome(4, (0.8, 0.01))
    assert not ws.valid(genome[None])[0]
    gap = ws.baseline.with_obstacles([VirtualObstacle((0.85, 0.46), math.pi / 2, (0.8, 0.01))])
    assert rule_of(lambda: ws.encode(gap)) == "obstacle-off-table"
    beyond = TabletopWorkspace("columns", obstacle_size=(0.8, 0.01), obstacles_on_table=False, **free)
    assert beyond.valid(beyond.encode(gap)[None])[0]


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"max_detour": 1.02}, "detour"),
        ({"start_clearance": 0.6}, "start-clearance"),
        ({"object_clearance": 0.12}, "object-clearance"),
        ({"object_spacing": 0.19}, "object-spacing"),
    ],
)
def test_every_number_is_a_rule(change, rule):
    layout = TabletopWorkspace().baseline.with_obstacles([VirtualObstacle((0.45, 0.45), math.pi / 2)])
    assert TabletopWorkspace().encode(layout)[16] == 1
    ws = TabletopWorkspace(**change)
    assert rule_of(lambda: ws.encode(layout)) == rule
    assert not ws.valid(layout.to_genome()[None])[0]


def test_obstacles_keep_off_the_slots_of_the_desired_configuration():
    ws = TabletopWorkspace()
    over = ws.baseline.with_obstacles([VirtualObstacle((0.95, 0.3), 0.0)])
    assert rule_of(lambda: ws.encode(over)) == "slot"
    assert not ws.valid(over.to_genome()[None])[0]


def test_obstacles_may_neither_cross_nor_touch():
    ws = TabletopWorkspace()
    for x, allowed in ((0.30, False), (0.30 + 0.99e-9, False), (0.301, True)):
        pair = ws.baseline.with_obstacles([VirtualObstacle((0.18, 0.7)), VirtualObstacle((0.18 + x, 0.7))])
        assert ws.valid(pair.to_genome()[None])[0] == allowed
        if not allowed:
            assert rule_of(lambda pair=pair: ws.encode(pair)) == "obstacle-apart"


# -- genomes -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("condition", CONDITIONS)
def test_layouts_and_genomes_convert_both_ways(condition):
    ws = TabletopWorkspace("columns", condition)
    for genome in designed(ws, 20):
        layout = ws.decode(genome)
        assert np.array_equal(ws.encode(layout), genome)
        assert len(layout.obstacles) == ws.num_obstacles(genome[None])[0]
        assert ws.legibility(genome) == ws.legibility(ws.encode(layout))
        again = TabletopLayout.from_json(layout.to_json())
        assert np.array_equal(ws.encode(again), genome)


def test_obstacles_that_look_the_same_have_one_genome():
    ws = TabletopWorkspace()
    angles = (1.4, 1.4 + math.pi, 1.4 - math.pi, 1.4 + 4 * math.pi)
    genomes = [ws.encode(ws.baseline.with_obstacles([VirtualObstacle((0.33, 0.45), a)])) for a in angles]
    np.testing.assert_allclose(genomes[1:], [genomes[0]] * 3, atol=1e-12)


@given(st.floats(-100, 100))
def test_half_turns(angle):
    found = half_turn(angle)
    assert -math.pi / 2 <= found <= math.pi / 2
    assert math.sin(found - angle) == pytest.approx(0, abs=1e-9)


def test_genomes_of_a_condition_are_genomes_of_both():
    both = TabletopWorkspace()
    for condition in ("placement", "obstacles"):
        ws = TabletopWorkspace(condition=condition)
        genomes = designed(ws, 30)
        assert both.valid(genomes).all()
        assert np.array_equal(both.scores(genomes), ws.scores(genomes))
        assert not ws.valid(designed(both, 30)).all()
        fixed = ws.lower_bounds == ws.upper_bounds
        assert (genomes[:, fixed] == ws.lower_bounds[fixed]).all()


@given(st.lists(st.floats(allow_nan=True), min_size=32, max_size=32))
@settings(max_examples=60, deadline=None)
def test_any_numbers_are_a_table_or_an_error(values):
    ws = TabletopWorkspace()
    genome = np.array(values)
    is_valid = ws.valid(genome[None])[0]
    assert np.isfinite(ws.legibility(genome[None])[0]) == is_valid
    if not is_valid:
        assert rule_of(lambda: ws.decode(genome))


@pytest.mark.parametrize(
    ("genome", "message"),
    [
        (np.zeros(31), r"expected one genome of shape \(32,\)"),
        (np.full(32, np.nan), "entry 0 of the genome is nan"),
        (np.r_[0.9, np.zeros(31)], r"gene 0 \(x of 'red-circle'\) is .*0.9.*; expected 0.1 to 0.8"),
    ],
)
def test_wrong_genomes_are_explained(genome, message):
    with pytest.raises(ValueError, match=message):
        TabletopWorkspace().decode(genome)


def test_layouts_of_another_table_are_refused():
    ws = TabletopWorkspace()
    assert rule_of(lambda: ws.encode(TabletopTask.named("tea").layout)) == "object"
    big = [TableObject(o.name, o.at, o.colour, o.shape, (0.05, 0.05)) for o in ws.baseline.objects]
    assert rule_of(lambda: ws.encode(TabletopLayout(big))) == "object"
    thick = ws.baseline.with_obstacles([VirtualObstacle((0.33, 0.45), 0.0, (0.1, 0.1))])
    assert rule_of(lambda: ws.encode(thick)) == "obstacles"


# -- random tables and their children ----------------------------------------------------------------------------------


def test_random_tables_are_uniform_given_that_they_are_valid():
    """Against rejection by the readable rules' spacing alone, which is all that counts without obstacles."""
    ws = TabletopWorkspace()
    genomes = ws.sample(2000, rng(1))
    assert (genomes[:, 16:] == 0).all()
    draws = rng(2).uniform((0.1, 0.2), (0.8, 0.7), (15_000, 8, 2))
    kept = draws[least_distances(draws, np.zeros(8, bool)) >= 0.08]
    assert len(kept) > 1500
    from scipy.stats import ks_2samp

    for column in (0, 7, 15):
        assert ks_2samp(genomes[:, column], kept.reshape(-1, 16)[:, column]).pvalue > 1e-3
    ours = least_distances(genomes[:, :16].reshape(-1, 8, 2), np.zeros(8, bool))
    assert ks_2samp(ours, least_distances(kept, np.zeros(8, bool))).pvalue > 1e-3


def test_random_obstacles_lie_on_the_sorted_arrangement():
    ws = TabletopWorkspace(condition="obstacles")
    genomes = ws.sample(400, rng())
    counts = ws.num_obstacles(genomes)
    assert set(counts) == {0, 1, 2, 3, 4}
    assert (genomes[:, :16] == ws.baseline.centres.ravel()).all()
    assert len(np.unique(genomes[counts > 0], axis=0)) == (counts > 0).sum()


def test_a_crowded_region_is_an_error():
    with pytest.raises(LayoutError, match="leave \\(almost\\) no room") as caught:
        TabletopWorkspace(object_spacing=0.34).sample(1, rng())
    assert caught.value.rule == "room"


def test_children_move_objects_first_and_obstacles_then():
    ws = TabletopWorkspace()
    parents = designed(ws, 60)
    for phase, mine, other in ((0, slice(0, 16), slice(16, 32)), (1, slice(16, 32), slice(0, 16))):
        children = ws.perturb(parents, 30, rng(3), phase=phase)
        assert ws.valid(children).all()
        before = np.repeat(parents, 30, axis=0)
        assert np.array_equal(children[:, other], before[:, other])
        assert (children[:, mine] != before[:, mine]).any(axis=1).mean() > 0.99


def test_moves_are_gaussian_steps_of_one_or_a_few_or_swaps():
    ws = TabletopWorkspace(object_spacing=0.0, step_sd=0.01)
    centre = ws.encode(ws.baseline)
    children = ws.perturb(centre[None], 4000, rng(4))[:, :16].reshape(-1, 8, 2)
    steps = children - ws.baseline.centres
    moved = (steps != 0).any(axis=2)
    swapped = (np.abs(steps).max(axis=(1, 2)) > 0.1) & (moved.sum(axis=1) == 2)
    assert swapped.mean() == pytest.approx(0.2, abs=0.03)
    assert set(map(tuple, np.sort(children[swapped], axis=1).round(9).reshape(-1, 16))) == {
        tuple(np.sort(ws.baseline.centres, axis=0).round(9).ravel())
    }
    counts = Counter(moved[~swapped].sum(axis=1).tolist())
    assert counts[1] > counts[2] > counts[3] > 0
    ones = steps[~swapped & (moved.sum(axis=1) == 1)]
    assert ones[ones != 0].std() == pytest.approx(0.01, rel=0.1)


def test_obstacles_are_added_removed_nudged_and_turned():
    ws = TabletopWorkspace()
    two = [VirtualObstacle((0.33, 0.45), math.pi / 2), VirtualObstacle((0.57, 0.45), math.pi / 2)]
    parent = ws.encode(ws.baseline.with_obstacles(two))
    children = ws.perturb(parent[None], 600, rng(5), phase=1)
    rows, before = children[:, 16:].reshape(-1, 4, 4), parent[16:].reshape(4, 4)
    count = rows[:, :, 0].sum(axis=1)
    changed = (rows != before).any(axis=2).sum(axis=1)
    turned = (rows[:, :, 1:3] == before[:, 1:3]).all(axis=(1, 2)) & (count == 2)
    kinds = {"added": count == 3, "removed": count == 1, "turned": turned, "nudged": (count == 2) & ~turned}
    for kind, mask in kinds.items():
        assert 0.15 < mask.mean() < 0.35, kind
    assert (changed[kinds["nudged"] | kinds["turned"]] == 1).all()
    assert (rows[kinds["removed"]][:, 1:] == 0).all()
    for new in rows[kinds["added"]][:, 2]:
        across = np.array([math.cos(new[3]), math.sin(new[3])])
        assert any(
            abs((b - a) @ across) < 1e-9
            and abs((new[1:3] - a) @ [-across[1], across[0]]) < math.dist(a, b)
            and abs((new[1:3] - a) @ [b[1] - a[1], a[0] - b[0]]) < 1e-9
            for a, b in itertools.combinations(ws.baseline.centres, 2)
        )


def test_parents_without_a_child_repeat_themselves():
    layout = TabletopLayout([TableObject("only", (0.3, 0.4))])
    ws = TabletopWorkspace(TabletopTask("one", layout, TaskGraph([Subtask("take", ("only",))], start="home")))
    parent = ws.encode(layout)
    assert (ws.perturb(parent[None], 3, rng(), phase=1) == parent).all()
    assert (ws.perturb(parent[None], 3, rng(), phase=0) != parent).any(axis=1).all()


def test_wrong_parents_and_phases_are_refused():
    ws = TabletopWorkspace(condition="placement")
    with pytest.raises(LayoutError):
        ws.perturb(np.zeros((1, 32)), 2, rng())
    with pytest.raises(ValueError, match="phase"):
        ws.perturb(ws.sample(1, rng()), 2, rng(), phase=1)


# -- scores and measures -----------------------------------------------------------------------------------------------


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


# -- starting from a table ---------------------------------------------------------------------------------------------


def test_a_search_may_start_from_a_table():
    mine = TabletopWorkspace().decode(designed(TabletopWorkspace(), 1, seed=9)[0])
    for ws in (TabletopWorkspace(start_from=mine), TabletopWorkspace(start_from=mine.to_dict())):
        genomes = ws.sample(5, rng())
        assert ws.decode(genomes[0]) == mine
        assert np.array_equal(genomes[1:], TabletopWorkspace().sample(4, rng()))
    fixed = TabletopWorkspace(condition="obstacles", start_from=mine)
    assert all(np.array_equal(fixed.decode(g).centres, mine.centres) for g in fixed.sample(5, rng()))
    assert fixed.baseline == TabletopTask.named("columns").layout


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"condition": "all"}, ValueError, "`condition` must be one of"),
        ({"task": "soup"}, TaskError, "no task 'soup'"),
        ({"max_obstacles": 0}, ValueError, "needs max_obstacles >= 1"),
        ({"max_obstacles": -1}, ValueError, "max_obstacles"),
        ({"max_detour": 0.9}, ValueError, "max_detour"),
        ({"start_clearance": -0.1}, ValueError, "start_clearance"),
        ({"object_clearance": math.nan}, ValueError, "object_clearance"),
        ({"object_spacing": math.inf}, ValueError, "object_spacing"),
        ({"obstacle_cost": "much"}, ValueError, "obstacle_cost"),
        ({"step_sd": 0.0}, ValueError, "step_sd"),
        ({"prefix": "sum"}, ValueError, "prefix"),
        ({"ties": "first"}, ValueError, "ties"),
        ({"ranked": ["red-circle", "red-circle"]}, ValueError, "ranked"),
        ({"ranked": ["cup"]}, ValueError, "ranked"),
        ({"obstacle_size": (0.3,)}, ValueError, "obstacle_size"),
        ({"start_from": TabletopTask.named("tea").layout}, LayoutError, "is about"),
        ({"start_from": 3}, LayoutError, "start_from"),
    ],
)
def test_wrong_arguments_are_named(options, error, message):
    with pytest.raises(error, match=message):
        TabletopWorkspace(**options)


def test_a_baseline_against_the_rules_is_named():
    with pytest.raises(LayoutError, match="object_spacing"):
        TabletopWorkspace(start_from=TabletopTask.named("columns").layout, object_spacing=0.3)
