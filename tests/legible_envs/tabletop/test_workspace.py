"""The design of tables as a workspace: its contract, genomes, starting layout and arguments."""

import json
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs import LayoutError, TaskError
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.design.genome_kernels import half_turn
from legible_envs.tasks import Subtask, TaskGraph
from legible_envs.workspace import make_workspace
from legible_envs.workspace_checks import check_workspace
from tests.legible_envs.tabletop.design_cases import CONDITIONS, TASKS_QUICK, designed, few_bins, name_of, rng, rule_of

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
        (np.zeros(31), r"expected genomes of shape .*\(32,\), got \(31,\)"),
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
