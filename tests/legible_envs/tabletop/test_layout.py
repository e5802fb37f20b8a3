"""Tables as values: JSON, genomes, rules named, and the task files that come with the package."""

import json
import math
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.errors import LayoutError, TaskError
from legible_envs.tabletop import Table, TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.objects import rectangle, rectangles_overlap
from legible_envs.tabletop.task import task_names

finite = st.floats(-5, 5)
sizes = st.tuples(st.floats(0.001, 2), st.floats(0.001, 2))
points = st.tuples(finite, finite)
obstacles = st.lists(st.builds(VirtualObstacle, points, finite, sizes), max_size=5)
names = st.text("abcdeäß-_ 1", min_size=1, max_size=6)


@st.composite
def layouts(draw):
    chosen = draw(st.lists(names, min_size=1, max_size=6, unique=True))
    things = [
        TableObject(n, draw(points), draw(names), draw(names), draw(sizes), draw(finite), draw(st.booleans()))
        for n in chosen
    ]
    return TabletopLayout(things, draw(obstacles), draw(st.sampled_from([None, Table(hand=0.01, size=(2.0, 1.0))])))


def cubes(*centres, obstacles=()):
    return TabletopLayout([TableObject(f"cube{i}", at) for i, at in enumerate(centres)], obstacles)


@given(layouts())
@settings(max_examples=60, deadline=None)
def test_json_pickle_and_equality(layout):
    again = TabletopLayout.from_json(layout.to_json())
    assert again == layout
    assert hash(again) == hash(layout)
    assert again.layout_id == layout.layout_id
    assert pickle.loads(pickle.dumps(layout)) == layout
    assert layout.with_obstacles([*layout.obstacles, VirtualObstacle((9.0, 9.0))]) != layout


@given(layouts(), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_genomes_read_back(layout, spare):
    layout = layout.with_obstacles([replace(o, size=(0.3, 0.01)) for o in layout.obstacles])
    room = len(layout.obstacles) + spare
    genome = layout.to_genome(room)
    assert genome.dtype == np.float64
    assert genome.shape == (2 * sum(o.movable for o in layout.objects) + 4 * room,)
    assert layout.with_genome(genome, room) == layout


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_bad_genomes_name_the_entry(data):
    layout = cubes((0.3, 0.3), (0.6, 0.6))
    genome = layout.to_genome()
    i = data.draw(st.integers(0, len(genome) - 1))
    genome[i] = data.draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    with pytest.raises(LayoutError, match=f"entry {i} ") as caught:
        layout.with_genome(genome)
    assert caught.value.rule == "genome"


@pytest.mark.parametrize("length", [0, 19, 21])
def test_genomes_of_the_wrong_length_are_refused(length):
    with pytest.raises(LayoutError, match=r"expected a genome of shape \(20,\)"):
        cubes((0.3, 0.3), (0.6, 0.6)).with_genome(np.zeros(length))


def test_a_genome_has_room_for_so_many_obstacles_of_one_size():
    layout = cubes((0.3, 0.3), obstacles=[VirtualObstacle((0.6, 0.6))] * 5)
    with pytest.raises(LayoutError, match="has 5 obstacles, the genome holds 4"):
        layout.to_genome()
    odd = cubes((0.3, 0.3), obstacles=[VirtualObstacle((0.6, 0.6), 0.0, (0.2, 0.01))])
    with pytest.raises(LayoutError, match="obstacles of"):
        odd.to_genome()
    assert odd.with_genome(odd.to_genome(2, (0.2, 0.01)), 2, (0.2, 0.01)) == odd


def test_fixed_objects_are_not_in_the_genome():
    bins = TabletopTask.named("bins").layout
    assert len(bins.to_genome(0)) == 4
    moved = bins.with_genome([0.3, 0.3, 0.6, 0.3], 0)
    assert moved.objects[0].at == (0.3, 0.3)
    assert moved.objects[2:] == bins.objects[2:]


BROKEN = {
    "region": (cubes((0.09, 0.3)), "cube0 at .* outside the region"),
    "table": (
        TabletopLayout([TableObject("tray", (0.10, 0.3), size=(0.3, 0.1))]),
        "tray at .* sticks out of the table",
    ),
    "overlap": (cubes((0.3, 0.3), (0.6, 0.3), (0.344, 0.344)), "cube0 .* and cube2 .* overlap"),
    "obstacle": (cubes((0.3, 0.3), obstacles=[VirtualObstacle((0.4, 0.32))]), "obstacle 1 .* lies over cube0"),
    "covered": (cubes((0.3, 0.3), obstacles=[VirtualObstacle((0.3, 0.328))]), "cube0 .* inside an obstacle"),
    "start": (cubes((0.3, 0.3), obstacles=[VirtualObstacle((1.0, 0.45))]), "start 'assembly' .* inside an obstacle"),
    "reachable": (
        cubes((0.3, 0.3), obstacles=[VirtualObstacle((0.5, 0.4), 1.57, (1.0, 0.01))]),
        "cube0 .* cannot be reached from 'home'",
    ),
}


@pytest.mark.parametrize("rule", BROKEN)
def test_validate_names_the_rule(rule):
    layout, message = BROKEN[rule]
    with pytest.raises(LayoutError, match=message) as caught:
        layout.validate()
    assert caught.value.rule == rule
    assert not layout.is_valid()


def test_cubes_may_touch_and_lie_on_the_border_of_the_region():
    cubes((0.10, 0.20), (0.145, 0.20), (0.80, 0.70)).validate()
    turned = [TableObject("a", (0.3, 0.3)), TableObject("b", (0.35, 0.3), angle=math.pi / 4)]
    with pytest.raises(LayoutError, match="overlap"):
        TabletopLayout(turned).validate()


def test_overlap_of_oriented_rectangles_against_shapely():
    rng = np.random.default_rng(0)
    outcomes = []
    for _ in range(500):
        a, b = (rectangle(*rng.uniform(0, 1, 2), rng.uniform(0, 7), *rng.uniform(0.05, 0.6, 2)) for _ in range(2))
        expected = shapely.Polygon(a).intersection(shapely.Polygon(b)).area > 0
        assert rectangles_overlap(a, b) == expected
        outcomes.append(expected)
    assert 100 < sum(outcomes) < 400


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": 2}, "`schema` must be 1, got 2"),
        ({"objects": []}, "`objects` must have at least 1 entry, got 0"),
        ({"objects": None}, "`objects`"),
        ({"colour": "red"}, "colour"),
        ({"objects": [{"name": "a"}]}, r"`objects\[0\]` lacks the key `at`"),
        (
            {"objects": [{"name": "a", "at": [0.1, 0.2], "weight": 3}]},
            r"`objects\[0\]` has the unknown key 'weight'; known: n",
        ),
        ({"objects": [{"name": "a", "at": [0.1, "x"]}]}, r"`objects\[0\].at\[1\]` must be a finite number"),
        ({"objects": [{"name": "a", "at": [0.1, float("nan")]}]}, r"`objects\[0\].at\[1\]` must be a finite number"),
        ({"objects": [{"name": "a", "at": [0.1, 0.2], "size": [0, 1]}]}, r"`objects\[0\].size\[0\]` must be a finite"),
        (
            {"objects": [{"name": "a", "at": [0.1, 0.2], "movable": "no"}]},
            r"`objects\[0\].movable` must be True or False",
        ),
        ({"objects": [{"name": "a", "at": [0.1, 0.2]}] * 2}, r"repeated: \['a'\]"),
        ({"objects": [{"name": "home", "at": [0.1, 0.2]}]}, r"repeated: \['home'\]"),
        ({"obstacles": [{"at": [0.1]}]}, r"`obstacles\[0\].at` must have at least 2 entries, got 1"),
        ({"obstacles": [3]}, r"`obstacles\[0\]` must be a mapping, got 3"),
        ({"table": {"size": [1, -1]}}, r"`table.size\[1\]` must be a finite number from 1e-06"),
        ({"table": {"region": [0.5, 0.1, 0.4, 0.2]}}, "x0 < x1"),
        ({"table": {"starts": {"home": [3, 3]}}}, "off the table"),
        ({"table": {"starts": {}}}, "`table.starts` must have at least 1 entry"),
        ({"table": {"hand": -1}}, "`table.hand` must be a finite number from 0"),
    ],
)
def test_wrong_json_says_where(change, message):
    data = {**cubes((0.3, 0.3)).to_dict(), **change}
    with pytest.raises(LayoutError, match=message):
        TabletopLayout.from_json(json.dumps(data))


@pytest.mark.parametrize("text", ["{", "[]", "3", ""])
def test_text_that_is_no_layout(text):
    with pytest.raises(LayoutError):
        TabletopLayout.from_json(text)


def test_layouts_are_immutable(tmp_path):
    layout = cubes((0.3, 0.3))
    with pytest.raises(AttributeError, match="immutable"):
        layout.objects = ()
    with pytest.raises(ValueError, match="read-only"):
        layout.centres[0] = 0
    layout.to_json(tmp_path / "table.json")
    assert TabletopLayout.from_json(str(tmp_path / "table.json")) == layout
    assert layout.place("home") == (0.60, 0.05)
    assert layout.place("cube0") == (0.3, 0.3)
    with pytest.raises(LayoutError, match="no object 'spoon'"):
        layout.place("spoon")


# -- tasks ---------------------------------------------------------------------------------------------------------


def test_the_columns_task_is_the_papers():
    task = TabletopTask.named("columns")
    stages = task.graph.stages()
    assert (task.graph.num_sequences, task.graph.num_states, len(stages)) == (576, 31, 30)
    assert sum(s.weight * len(s.goals) for s in stages) == pytest.approx(20, abs=1e-12)
    assert len(task.configuration) == 8
    assert len({(o.colour, o.shape) for o in task.layout.objects}) == 8
    columns = {x for x, _ in task.configuration.values()}
    assert len(columns) == 2
    left = {name for name, (x, _) in task.configuration.items() if x == min(columns)}
    assert {s.name for s in task.graph.subtasks if not s.after} == left
    x0, y0, x1, y1 = task.layout.table.assembly
    assert all(x0 <= x <= x1 and y0 <= y <= y1 for x, y in task.configuration.values())


def test_tea_has_two_stages_and_bins_stay_movable():
    tea, bins = TabletopTask.named("tea"), TabletopTask.named("bins")
    assert [len(s.after) for s in tea.graph.subtasks] == [0, 0, 2, 2, 2]
    assert tea.graph.num_sequences == 12
    assert [o.name for o in bins.layout.objects if o.movable] == ["left-bin", "right-bin"]
    assert len(bins.layout.objects) == 12
    assert bins.graph.num_sequences == math.factorial(10)


@pytest.mark.parametrize("name", task_names())
def test_task_files_read_back(name, tmp_path):
    task = TabletopTask.named(name)
    task.layout.validate()
    assert TabletopTask.from_yaml(task.to_yaml(tmp_path / "task.yaml")) == task
    assert TabletopTask.from_yaml(tmp_path / "task.yaml") == task
    assert hash(TabletopTask.from_yaml(str(tmp_path / "task.yaml"))) == hash(task)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": {"start": "sofa", "subtasks": [{"name": "a", "goals": ["cup"]}]}}, r"needs \['sofa'\]"),
        ({"task": {"start": "home", "subtasks": [{"name": "a", "goals": ["spoon"]}]}}, r"needs \['spoon'\]"),
        ({"task": {"start": "home", "subtasks": [{"name": "a", "goals": ["home"]}]}}, "which are no objects"),
        ({"configuration": {"spoon": [1, 0.4]}}, "places 'spoon'"),
        ({"configuration": {"cup": [1.19, 0.4]}}, "off the table"),
        ({"configuration": {"cup": [1, 0.4], "milk": [1, 0.41]}}, "'cup' and 'milk' over each other"),
        ({"configuration": [1, 2]}, "`configuration` must be a mapping, got"),
        ({"configuration": {"cup": [1, None]}}, r"`configuration.cup\[1\]` must be a finite"),
        ({"name": ""}, "`name` must be a non-empty text"),
        ({"cups": 3}, "unknown key 'cups'; known: schema, name"),
        ({"schema": 3}, "`schema` must be 1, got 3"),
        ({"table": {"size": [1, 10**400]}}, r"`table.size\[1\]` must be a finite number"),
        ({"obstacles": [{"at": [0.1, 0.1]}] * 65}, "`obstacles` must have at most 64 entries, got 65"),
    ],
)
def test_wrong_tasks_say_what_is_wrong(change, message):
    data = {**TabletopTask.named("tea").to_dict(), **change}
    with pytest.raises((TaskError, LayoutError), match=message):
        TabletopTask.from_dict(data)


def test_a_configuration_may_not_move_what_stays():
    data = TabletopTask.named("bins").to_dict()
    data["configuration"] = {"piece-0": [1.0, 0.4]}
    with pytest.raises(TaskError, match="not movable"):
        TabletopTask.from_dict(data)


@pytest.mark.parametrize("text", ["[", "3", "name: x", ""])
def test_text_that_is_no_task(text):
    with pytest.raises(TaskError):
        TabletopTask.from_yaml(text)


def test_unknown_task_names_list_the_known_ones():
    with pytest.raises(TaskError, match=r"bins.*columns.*tea"):
        TabletopTask.named("coffee")


def test_layouts_load_no_compiler():
    code = (
        "import sys, legible_envs.tabletop as t; t.TabletopTask.named('tea');"
        "print([m for m in ('numba', 'shapely', 'pymunk', 'pygame') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr
