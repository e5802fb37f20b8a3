"""The table as an environment: layouts, starts and goals in every form; bad input is named and changes nothing."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError, TaskError
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.settings import read_layout
from tests.legible_envs.tabletop.table_envs import FIRST, SECOND, TASK, WALL, make
from tests.legible_envs.tabletop.table_player import (
    Grabber,
)


def test_layouts_in_every_form(tmp_path):
    env = make()
    path = tmp_path / "wall.json"
    WALL.to_json(path)
    genome = WALL.to_genome()
    for form in (WALL, WALL.to_json(), path, str(path), WALL.to_dict(), genome, genome.tolist()):
        assert env.reset(options={"layout": form})[1]["layout_id"] == int(WALL.layout_id, 16)
        assert make(layout=form).unwrapped.layout == WALL


def test_starts():
    env = make(layout=WALL)
    for start, at, name in (
        ("assembly", (1.0, 0.45), "assembly"),
        (FIRST[2], TASK.layout.place(FIRST[2]), FIRST[2]),
        ((0.1, 0.7), (0.1, 0.7), "elsewhere"),
        (np.array([0.1, 0.7]), (0.1, 0.7), "elsewhere"),
        (None, (0.6, 0.05), "home"),
    ):
        observation, info = env.reset(options={"start": start})
        assert observation[[0, 1, 9, 10]] == pytest.approx([*at, *at])
        assert env.unwrapped.start == env.unwrapped.start_names[info["start"]] == name
    env.reset()
    assert env.unwrapped.start == "home"


def moved(name, at):
    data = TASK.layout.to_dict()
    data["objects"][TASK.layout.index(name)]["at"] = at
    return data


NOT_A_NUMBER = TASK.layout.to_genome()
NOT_A_NUMBER[3] = np.nan
BAD_OPTIONS = {
    "nan genome": ({"layout": NOT_A_NUMBER}, "entry 3", "genome"),
    "short genome": ({"layout": [0.5] * 5}, r"shape \(32,\)", "genome"),
    "texts": ({"layout": [0.5, "b"]}, "list of numbers", "genome"),
    "outside": ({"layout": moved(FIRST[0], [0.05, 0.3])}, "outside the region", "region"),
    "overlap": ({"layout": moved(FIRST[0], [0.36, 0.54])}, "overlap", "overlap"),
    "other objects": ({"layout": TabletopTask.named("tea").layout}, "objects", "task"),
    "other sizes": (
        {"layout": TabletopLayout([TableObject(o.name, o.at, size=(0.03, 0.03)) for o in TASK.layout.objects])},
        r"0\.03",
        "task",
    ),
    "obstacles": (
        {
            "layout": TASK.layout.with_obstacles(
                [VirtualObstacle((0.45, 0.1 + 0.01 * i), size=(0.05, 0.001)) for i in range(5)]
            )
        },
        "at most 4",
        "obstacles",
    ),
    "covered": ({"layout": TASK.layout.with_obstacles([VirtualObstacle((0.6, 0.06))])}, "home", "start"),
    "type": ({"layout": 3.5}, "float", "type"),
    "start inside": ({"layout": WALL, "start": (0.55, 0.24)}, "inside an obstacle", "start"),
    "start off": ({"start": (1.3, 0.4)}, "off the table", "start"),
    "start name": ({"start": "kitchen"}, "home", "start"),
    "start nan": ({"start": (float("nan"), 0.4)}, "finite", "number"),
    "goal invalid": ({"goal": SECOND[0]}, "valid now", "goal"),
    "goal unknown": ({"goal": 7}, "valid now", "goal"),
}


@pytest.mark.parametrize("case", BAD_OPTIONS)
@pytest.mark.parametrize("virtual_obstacles", ["hard", "soft"])
def test_bad_options_are_named_and_change_nothing(case, virtual_obstacles):
    options, message, rule = BAD_OPTIONS[case]
    env, twin = make(virtual_obstacles=virtual_obstacles), make(virtual_obstacles=virtual_obstacles)
    for e in (env, twin):
        e.reset(seed=0)
        e.step(np.array([0.2, 0.3]))
    with pytest.raises(LayoutError, match=message) as caught:
        env.reset(options=options)
    assert caught.value.rule == rule
    if set(options) == {"layout"}:
        with pytest.raises(LayoutError, match=message):
            env.unwrapped.layout = options["layout"]
        with pytest.raises(LayoutError, match=message):
            make(layout=options["layout"])
    action = np.array([0.1, 0.3])
    assert data_equivalence(env.step(action), twin.step(action), exact=True)
    assert env.reset()[1]["layout_id"] == twin.reset()[1]["layout_id"]


SCRAPS = st.one_of(st.none(), st.integers(-3, 2**70), st.floats(), st.text('{}[]:,ab"1', max_size=6), st.binary())
NESTED = st.recursive(
    SCRAPS,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["schema", "objects", "obstacles", "table"]) | st.text(max_size=2), inner)
    ),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None)
@given(
    NESTED
    | arrays(np.float64, 32, elements=st.floats(-0.5, 1.5))
    | arrays(np.float64, array_shapes(max_dims=3, max_side=34))
    | arrays(np.int64, 32, elements=st.integers(-1, 2))
)
def test_anything_is_a_layout_or_a_layout_error(value):
    try:
        layout = read_layout(value, TASK, 4)
    except LayoutError:
        return
    layout.validate()
    assert layout.goals == TASK.layout.goals


BAD_ARGUMENTS = [
    {"virtual_obstacles": "firm"},
    {"contact": "push"},
    {"max_obstacles": -1},
    {"max_obstacles": 2.0},
    {"max_speed": 0},
    {"slow_speed": float("nan")},
    {"grasp_distance": -1},
    {"time_cost": "high"},
    {"crossing_cost": float("inf")},
    {"threshold": 1.5},
    {"render_mode": "poem"},
    {"partner": "friend"},
    {"partner": {"colour": 3}},
    {"partner": "nowhere:Robot"},
    {"partner": "builtins:object"},
    {"partner": Grabber(), "predictor": "bayesian"},
    {"partner": "robot", "task": "bins"},
    {"predictor": "nowhere:Predictor"},
    {"predictor": 3},
]


@pytest.mark.parametrize("arguments", BAD_ARGUMENTS, ids=[f"{next(iter(a))}-{i}" for i, a in enumerate(BAD_ARGUMENTS)])
def test_bad_arguments(arguments):
    with pytest.raises((ValueError, TypeError), match=r"`|predictor|partner|robot"):
        TabletopEnv(**arguments)


def test_unknown_tasks():
    for task in ("chess", 5, {"name": "x"}):
        with pytest.raises(TaskError):
            make(task=task)
