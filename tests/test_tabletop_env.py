"""The table as an environment: rules of taking and placing, obstacles, options, robots, copies, replays, bad input."""

from __future__ import annotations

import copy
import json
import math
import os
import pickle
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from table_player import (
    Doubtful,
    Grabber,
    Mute,
    Player,
    digest,
    fetch,
    go_to,
    next_point,
    play,
    ramble,
    towards,
    wander,
)

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError, TaskError
from legible_envs.rollouts import load_trajectories, save_trajectories
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.belief import EqOneBelief
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.recording import RecordReaches
from legible_envs.tabletop.settings import read_layout
from legible_envs.tasks import Subtask, TaskGraph

NAME = "LegibleTabletop-v0"
TASK = TabletopTask.named("columns")
WALL = TASK.layout.with_obstacles([VirtualObstacle((0.55, 0.22), 0.0), VirtualObstacle((0.33, 0.45), 1.5)])
# The sorted cubes are too close to be told apart early, and to be pushed singly.
APART = TASK.layout.with_genome([*(0.45 + (TASK.layout.centres - 0.45) * (1.5, 5 / 3)).ravel(), *[0.0] * 16])
FIRST, SECOND = TASK.layout.goals[:4], TASK.layout.goals[4:]
VARIANTS = [
    {"layout": WALL, "obstacles": "soft", "crossing_cost": 1.0},
    {"layout": WALL, "contact": "always", "max_speed": 0.5},
    {"task": "tea", "contact": "never", "predictor": "eq1"},
    {"task": "bins", "max_obstacles": 0},
    {"layout": WALL, "partner": "robot", "contact": "always", "max_speed": 0.5},
    {"partner": {"max_speed": 0.5}, "threshold": 0.0, "time_cost": 0.0},
]
each = pytest.mark.parametrize("arguments", VARIANTS, ids=[f"table-{i}" for i in range(len(VARIANTS))])


def make(**arguments):
    return gym.make(NAME, **{"max_speed": 2.0, **arguments})


# -- what Gymnasium asks -----------------------------------------------------------------------------------------


@each
def test_gymnasium_finds_nothing_wrong(arguments):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = make(**arguments)
        check_env(env.unwrapped, skip_render_check=True)
        results = wander(env, 0)
    assert all(env.observation_space.contains(result[0]) for result in results)


@each
def test_same_seed_and_actions_same_episode(arguments):
    first, second = (wander(make(**arguments), 5) for _ in range(2))
    assert data_equivalence(first, second, exact=True)


@each
@pytest.mark.parametrize("copier", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_go_on_alone(arguments, copier):
    env = make(**arguments)
    wander(env, 2, 75)
    twin = copier(env)
    ahead = ramble(env, np.random.default_rng(1), 75)
    assert data_equivalence(ahead, ramble(twin, np.random.default_rng(1), 75), exact=True)
    assert data_equivalence(env.reset(), twin.reset(), exact=True)


@pytest.mark.parametrize(
    "arguments",
    [*VARIANTS[:5], {"layout": WALL.to_json()}, {"layout": WALL.to_genome(), "task": TASK}, {"task": TASK.to_dict()}],
)
def test_spec_goes_through_json(arguments, tmp_path):
    env = make(**arguments)
    text = env.spec.to_json()
    json.loads(text)
    again = gym.make(EnvSpec.from_json(text))
    assert data_equivalence(wander(env, 3, 40), wander(again, 3, 40), exact=True)
    path = TASK.to_yaml(tmp_path / "task.yaml") and tmp_path / "task.yaml"
    assert gym.make(EnvSpec.from_json(make(task=path).spec.to_json())).unwrapped.task == TASK


SCRIPT = """
import sys, gymnasium as gym, legible_envs
sys.path.insert(0, {folder!r})
from table_player import digest
print(digest(gym.make({name!r}, **{arguments!r})))
"""


def test_replays_are_exact_in_a_new_process():
    arguments = {**VARIANTS[4], "layout": WALL.to_json()}
    script = SCRIPT.format(folder=str(Path(__file__).parent), name=NAME, arguments=arguments)
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment, timeout=240, check=False
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == digest(make(**arguments))


def test_vectors_of_tables():
    envs = gym.make_vec(NAME, num_envs=2, vectorization_mode="sync", predictor="eq1")
    envs.reset(seed=0)
    envs.set_attr("layout", [WALL, TASK.layout])
    _, info = envs.reset()
    assert info["layout_id"].tolist() == [WALL.layout_id, TASK.layout.layout_id]
    envs.step(envs.action_space.sample())
    assert envs.get_attr("layout") == (WALL, TASK.layout)


@pytest.mark.parametrize("busy", [0, 1])
def test_vectors_of_tables_where_one_has_a_belief_and_the_other_none(busy):
    envs = gym.make_vec(NAME, num_envs=2, vectorization_mode="sync", partner="robot")
    envs.reset(seed=0)
    envs.envs[busy].reset(options={"start": FIRST[0]})
    _, _, _, _, info = envs.step(np.zeros((2, 2), dtype=np.float32))
    assert info["holding"].tolist() == [FIRST[0] if i == busy else None for i in range(2)]
    for goal in FIRST:
        assert info["belief"]["_" + goal].tolist() == [i != busy for i in range(2)]


def test_partners_are_not_shared_among_environments():
    partner = Grabber(FIRST[0])
    envs = gym.make_vec(NAME, num_envs=2, vectorization_mode="sync", partner=partner)
    envs.reset(seed=0)
    for _ in range(40):
        _, _, _, _, info = envs.step(np.zeros((2, 2), dtype=np.float32))
    assert info["robot_target"].tolist() == [FIRST[0]] * 2
    assert partner.log == []


# -- building ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("task", "done"), [("columns", 8), ("tea", 5), ("bins", 20)])
def test_a_player_finishes_every_task(task, done):
    env = make(task=task)
    results = play(env)
    assert [result[2] for result in results] == [False] * (len(results) - 1) + [True]
    assert results[-1][4]["done"] == done
    assert math.fsum(r[1] for r in results) == pytest.approx(done - 0.05 * len(results) / 30)
    game, layout = env.unwrapped, env.unwrapped.layout
    for name, at in game.task.configuration.items():
        assert tuple(game.positions[layout.index(name)]) == at
        assert game.view().status[layout.index(name)] == "placed"
        assert game.view().angles[layout.index(name)] == 0.0
    if task == "bins":
        bins = game.positions[:2]
        assert (np.abs(game.positions[2:, None] - bins).min(axis=1) <= (0.12, 0.10)).all()
        assert game.view().status == ("free",) * 2 + ("placed",) * 10


def test_a_walled_table_is_built_too():
    results = play(make(layout=WALL), seed=1)
    assert results[-1][2]
    assert results[-1][4]["crossings"] == 0


def test_the_task_says_what_is_valid_when():
    env = make()
    _, info = env.reset()
    stages = TASK.graph.stages()
    order = (*FIRST[::-1], *SECOND)
    for number, name in enumerate(order):
        assert info["done"] == number
        assert info["candidate_set"] == "game"
        assert set(info["goals"]) == {*(FIRST if number < 4 else SECOND)} - {*order[:number]}
        stage = stages[info["stage"]]
        assert (stage.start, stage.goals) == (info["start"], info["goals"])
        assert info["start"] == ("home" if number == 0 else "assembly")
        info = fetch(env, name)[4]
    assert info["goals"] == ()


def test_nothing_is_valid_while_something_is_carried():
    env = make()
    env.reset()
    go_to(env, TASK.layout.place(FIRST[0]), near=0.02)
    assert env.unwrapped.holding == FIRST[0]
    assert env.unwrapped.goals == ()
    assert env.unwrapped.carry_to.tolist() == list(TASK.configuration[FIRST[0]])
    before = env.unwrapped.hand
    _, _, _, _, info = env.step(np.array([0.1, 0.1]))
    assert (env.unwrapped.positions[0] == env.unwrapped.hand).all()
    assert (env.unwrapped.hand > before).all()
    assert (info["holding"], info["stage"], info["start"]) == (FIRST[0], -1, "home")


def test_only_slow_hands_take_and_only_what_is_valid():
    at = np.array(TASK.layout.place(FIRST[0]))
    env = make(slow_speed=0.2)
    env.reset(options={"start": tuple(np.add(at, (0.1, 0.0)))})
    for _ in range(8):  # through the cube at 0.3 m/s
        env.step(np.array([-0.15, 0.0]))
    assert env.unwrapped.holding is None
    assert env.unwrapped.positions[0].tolist() == at.tolist()
    env.reset(options={"start": tuple(np.add(at, (0.1, 0.0)))})
    while env.unwrapped.holding is None:
        env.step(np.array([-0.09, 0.0]))  # 0.18 m/s
    assert env.unwrapped.holding == FIRST[0]
    # taken as soon as its outline is 3 cm away
    assert 0.03 - 0.18 / 30 < env.unwrapped.hand[0] - at[0] - 0.0225 <= 0.03
    env.reset(options={"start": SECOND[0]})
    for _ in range(5):
        assert env.step(np.zeros(2))[4]["holding"] is None


def test_the_nearest_of_several_is_taken():
    layout = TabletopLayout(
        [
            TableObject(o.name, at)
            for o, at in zip(
                TASK.layout.objects, [(0.3, 0.3), (0.36, 0.3), *TASK.layout.centres[2:].tolist()], strict=True
            )
        ]
    )
    env = make(layout=layout)
    for x, name in ((0.329, FIRST[0]), (0.331, FIRST[1])):
        env.reset(options={"start": (x, 0.3)})
        assert env.step(np.zeros(2))[4]["holding"] == name


def test_a_goal_is_all_that_the_hand_takes():
    env = make()
    observation, _ = env.reset(options={"goal": FIRST[1]})
    names = env.unwrapped.observation_names
    shown = names.index(f"{FIRST[1]}: goal")
    assert observation[shown] == 1
    assert env.unwrapped.view().goal == FIRST[1]
    go_to(env, TASK.layout.place(FIRST[0]))
    assert env.unwrapped.holding is None
    result = go_to(env, TASK.layout.place(FIRST[1]), near=0.02)
    assert env.unwrapped.holding == FIRST[1]
    assert env.unwrapped.goal is None
    assert result[0][shown] == 0
    go_to(env, TASK.configuration[FIRST[1]], near=0.01)
    env.unwrapped.goal = FIRST[2]
    with pytest.raises(LayoutError, match="valid now"):
        env.unwrapped.goal = FIRST[1]
    assert env.unwrapped.goal == FIRST[2]
    env.reset()
    assert env.unwrapped.goal is None


def test_places_are_near_and_reached_slowly():
    env = make(release_distance=0.04)
    env.reset(options={"start": FIRST[0]})
    env.step(np.zeros(2))
    slot = np.array(TASK.configuration[FIRST[0]])
    go_to(env, np.add(slot, (0.2, 0.0)))
    go_to(env, np.add(slot, (0.041, 0.0)), near=1e-6)
    for _ in range(3):
        assert env.step(np.zeros(2))[4]["holding"] == FIRST[0]
    result = env.step(np.array([-0.0015 * 30 / 2.0, 0.0]))
    assert result[1] == pytest.approx(1 - 0.05 / 30)
    assert env.unwrapped.positions[0].tolist() == slot.tolist()


def zone_task():
    objects = [TableObject("a", (0.3, 0.3)), TableObject("b", (0.5, 0.3)), TableObject("c", (0.7, 0.3))]
    subtasks = [Subtask("a", ("a",), then=("assembly",)), Subtask("b", ("b",), then=("assembly",))]
    return TabletopTask("zone", TabletopLayout(objects), TaskGraph([*subtasks, Subtask("c", ("c",))], "home"))


def test_without_a_place_an_object_goes_anywhere_in_the_zone_where_there_is_room():
    env = make(task=zone_task())
    env.reset(options={"start": "a"})
    env.step(np.zeros(2))
    assert env.unwrapped.carry_to == pytest.approx([1.0, 0.45])
    go_to(env, (0.92, 0.3), near=0.001)
    at = env.unwrapped.positions[0]
    assert env.unwrapped.holding is None
    go_to(env, (0.5, 0.3), near=0.02)
    go_to(env, at, speed=0.15)
    assert env.unwrapped.holding == "b"  # no room on top of the other
    go_to(env, (1.0, 0.6), speed=0.15)
    assert env.unwrapped.holding is None
    a, b = env.unwrapped.positions[:2]
    assert np.abs(a - b).max() >= 0.045
    assert (b >= (0.90, 0.20)).all()
    result = go_to(env, (0.7, 0.3), near=0.01)  # only touched
    assert result[2]
    assert env.unwrapped.view().status == ("placed", "placed", "free")


def test_a_task_that_no_hand_can_do():
    graph = TaskGraph(
        [Subtask("take", ("a",)), Subtask("put", ("b",), after=("take",), then=("assembly",))],
        "home",
        groups={"g": ("take", "put")},
    )
    layout = TabletopLayout([TableObject("a", (0.3, 0.3)), TableObject("b", (0.5, 0.3))])
    with pytest.raises(TaskError, match=r"'b'.*carried itself"):
        make(task=TabletopTask("odd", layout, graph))


# -- pushing -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contact", "slow", "fast"), [("slow", True, False), ("always", True, True), ("never", False, False)]
)
def test_when_a_hand_pushes(contact, slow, fast):
    name = SECOND[0]  # not valid at first, and nothing that is lies beside it
    at = np.array(TASK.layout.place(name))
    for speed, is_pushed in ((0.15, slow), (0.6, fast)):
        env = make(contact=contact)
        env.reset(options={"start": tuple(np.subtract(at, (0.08, 0.0)))})
        for _ in range(math.ceil(0.1 / speed * 30)):
            result = env.step(np.array([speed / 2.0, 0.0]))
        moved = env.unwrapped.positions[TASK.layout.index(name)] - at
        assert (moved[0] > 0.03) == is_pushed
        assert is_pushed or (moved == 0).all()
        assert result[0][env.unwrapped.observation_names.index("hand is low")] == is_pushed


def test_a_hand_never_comes_down_onto_an_object():
    env = make()
    env.reset(options={"start": SECOND[0]})
    for _ in range(10):
        env.step(np.zeros(2))
    env.step(np.array([0.05, 0.02]))
    assert (env.unwrapped.positions == TASK.layout.centres).all()


def test_carried_objects_pass_over_others():
    env = make(contact="always")
    env.reset(options={"start": FIRST[0]})
    env.step(np.zeros(2))
    go_to(env, (0.9, 0.35), speed=0.5)  # over a row of cubes
    assert (env.unwrapped.positions[1:] == TASK.layout.centres[1:]).all()


def test_a_pushed_cube_can_be_taken_where_it_lies():
    env = make(layout=APART)
    at = np.array(APART.place(SECOND[2]))
    env.reset(options={"start": tuple(np.add(at, (0.0, 0.08)))})
    for _ in range(20):
        env.step(np.array([0.0, -0.08]))
    for _ in range(10):
        env.step(np.zeros(2))
    pushed = env.unwrapped.positions[TASK.layout.index(SECOND[2])]
    assert pushed[1] < at[1] - 0.02
    for name in FIRST:
        fetch(env, name)
    go_to(env, pushed, near=0.02)
    assert env.unwrapped.holding == SECOND[2]
    reach = env.unwrapped.trajectories()[-1]
    assert reach.goal_positions[reach.candidates.index(SECOND[2])] == pytest.approx(pushed, abs=1e-6)


# -- obstacles --------------------------------------------------------------------------------------------------------


def test_hard_obstacles_stop_the_hand_at_its_width():
    env = make(layout=WALL)
    env.reset(options={"start": (0.55, 0.1)})
    for _ in range(30):
        info = env.step(np.array([0.0, 0.25]))[4]
    assert env.unwrapped.hand == pytest.approx((0.55, 0.22 - 0.005 - 0.025), abs=1e-7)
    assert info["path_length"] == pytest.approx(0.09, abs=1e-7)
    assert info["crossings"] == 0


def test_soft_obstacles_count_and_cost():
    env = make(layout=WALL, obstacles="soft", crossing_cost=0.25, time_cost=0.0)
    env.reset(options={"start": (0.55, 0.15)})
    rewards = [env.step(np.array([0.0, y]))[1] for y in (0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5)]
    assert sum(rewards) == -0.5
    assert env.unwrapped.view().crossings == 2
    assert env.unwrapped.view().obstacles_mode == "soft"
    env.reset(options={"start": (0.55, 0.15)})
    assert env.step(np.array([0.5, 0.0]))[4]["crossings"] == 0


def test_a_fast_hand_passes_no_thin_obstacle():
    env = make(layout=WALL, max_speed=30.0)
    env.reset(options={"start": (0.55, 0.1)})
    env.step(np.array([0.0, 1.0]))
    assert env.unwrapped.hand[1] < 0.2
    soft = make(layout=WALL, max_speed=30.0, obstacles="soft")
    soft.reset(options={"start": (0.55, 0.1)})
    assert soft.step(np.array([0.0, 1.0]))[4]["crossings"] == 1


def test_actions_are_velocities():
    env = make(max_speed=0.9)
    env.reset()
    env.step(np.array([0.5, 0.25], dtype=np.float32))
    assert env.unwrapped.hand == pytest.approx((0.6 + 0.5 * 0.03, 0.05 + 0.25 * 0.03))
    env.step(np.array([1.0, 1.0], dtype=np.float32))  # no faster on the diagonal
    assert env.unwrapped.hand == pytest.approx((0.615 + 0.03 / math.sqrt(2), 0.0575 + 0.03 / math.sqrt(2)))
    for action in ([np.nan, 0], [0], [0, 0, 0], "up", None, 3.0, [np.inf, 0]):
        with pytest.raises(ValueError, match="two finite numbers"):
            env.unwrapped.step(action)


# -- observations ------------------------------------------------------------------------------------------------------


def expected_observation(env, velocity, is_low, max_obstacles=4):
    """The vector from what can be seen, by name."""
    game, view = env.unwrapped, env.unwrapped.view()
    named = {
        "hand x": view.hand[0],
        "hand y": view.hand[1],
        "hand velocity x": velocity[0] / game.max_speed,
        "hand velocity y": velocity[1] / game.max_speed,
        "hand is low": is_low,
        "hand holds an object": view.holding is not None,
        "reach start x": view.trail[0][0],
        "reach start y": view.trail[0][1],
    }
    at = game.carry_to
    named |= {"carry to x": 0 if at is None else at[0], "carry to y": 0 if at is None else at[1]}
    named["carry to a point"] = at is not None
    for i, name in enumerate(view.layout.goals):
        values = {"x": view.positions[i][0], "y": view.positions[i][1]}
        values |= {"cos": math.cos(view.angles[i]), "sin": math.sin(view.angles[i])}
        for mask, status in (("free", "free"), ("in hand", "hand"), ("in gripper", "robot"), ("placed", "placed")):
            values[mask] = view.status[i] == status
        values |= {"valid": name in view.goals, "goal": name == view.goal}
        named |= {f"{name}: {what}": value for what, value in values.items()}
    for j in range(max_obstacles):
        keys = ("active", "x", "y", "cos", "sin", "length", "width")
        values = [0] * 7
        if j < len(view.layout.obstacles):
            o = view.layout.obstacles[j]
            angle = o.angle % math.pi
            values = [1, *o.at, math.cos(angle), math.sin(angle), *o.size]
        named |= {f"obstacle {j}: {key}": value for key, value in zip(keys, values, strict=True)}
    if view.robot is not None:
        named |= {"gripper x": view.robot[0], "gripper y": view.robot[1]}
    return named


@pytest.mark.parametrize("arguments", [{}, {"partner": Grabber(*FIRST)}])
def test_observations_say_what_the_view_shows(arguments):
    env = make(layout=WALL, **arguments)
    rng = np.random.default_rng(0)
    player = Player(1)
    player.goal = FIRST[3]
    observation, _ = env.reset(options={"goal": FIRST[3]})
    names = env.unwrapped.observation_names
    assert observation.shape == (11 + 80 + 28 + 4 * bool(arguments),) == (len(names),) == (len(set(names)),)
    seen = set()
    for _ in range(250):
        before = env.unwrapped.hand
        robot = env.unwrapped.view().robot
        action = player(env) if rng.random() < 0.8 else rng.uniform(-0.15, 0.15, 2)
        observation, _, over, _, _ = env.step(action)
        expected = expected_observation(env, (env.unwrapped.hand - before) * 30, observation[4])
        if robot is not None:
            velocity = (env.unwrapped.view().robot - robot) * 30
            expected |= {"gripper velocity x": velocity[0], "gripper velocity y": velocity[1]}
        assert observation == pytest.approx([float(expected[name]) for name in names], abs=1e-6)
        seen |= {name.partition(": ")[2] for name, value in zip(names, observation, strict=True) if value == 1}
        if over:
            break
    assert seen >= {"free", "in hand", "placed", "valid", "goal", "active"}
    assert env.unwrapped.view().layout is WALL


def test_the_docstring_counts_right():
    env = make(layout=WALL)
    names = env.unwrapped.observation_names
    at = {name: i for i, name in enumerate(names)}
    assert at["hand velocity x"], at["hand is low"] == (2, 4)
    assert (at["carry to x"], at["reach start x"]) == (6, 9)
    last = FIRST and SECOND[-1]
    for offset, what in ((11, "x"), (13, "cos"), (15, "free"), (17, "in gripper"), (19, "valid"), (20, "goal")):
        assert at[f"{last}: {what}"] == offset + 10 * 7
    for offset, what in ((11, "active"), (12, "x"), (14, "cos"), (17, "width")):
        assert at[f"obstacle 3: {what}"] == offset + 80 + 7 * 3


# -- options and bad input --------------------------------------------------------------------------------------------


def test_layouts_in_every_form(tmp_path):
    env = make()
    path = tmp_path / "wall.json"
    WALL.to_json(path)
    genome = WALL.to_genome()
    for form in (WALL, WALL.to_json(), path, str(path), WALL.to_dict(), genome, genome.tolist()):
        assert env.reset(options={"layout": form})[1]["layout_id"] == WALL.layout_id
        assert make(layout=form).unwrapped.layout == WALL


def test_layouts_are_sticky_until_replaced():
    env = make()
    default = env.unwrapped.layout
    assert env.reset(options={"layout": WALL})[1]["layout_id"] == WALL.layout_id
    assert env.reset()[1]["layout_id"] == WALL.layout_id
    env.set_wrapper_attr("layout", default)
    assert env.step(np.zeros(2))[4]["layout_id"] == WALL.layout_id
    assert env.get_wrapper_attr("layout") == default
    assert env.reset()[1]["layout_id"] == default.layout_id
    env.reset(options={"layout": WALL})
    assert env.reset(options={"layout": None})[1]["layout_id"] == default.layout_id


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
        assert info["start"] == name
    assert env.reset()[1]["start"] == "home"


def moved(name, at):
    data = TASK.layout.to_dict()
    data["objects"][TASK.layout.index(name)]["at"] = at
    return data


NOT_A_NUMBER = TASK.layout.to_genome()
NOT_A_NUMBER[3] = np.nan
BAD_OPTIONS = {
    "nan genome": ({"layout": NOT_A_NUMBER}, "entry 3", "genome"),
    "short genome": ({"layout": [0.5] * 5}, r"shape \(32,\)", "genome"),
    "texts": ({"layout": ["a", "b"]}, "list of numbers", "genome"),
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
@pytest.mark.parametrize("obstacles", ["hard", "soft"])
def test_bad_options_are_named_and_change_nothing(case, obstacles):
    options, message, rule = BAD_OPTIONS[case]
    env, twin = make(obstacles=obstacles), make(obstacles=obstacles)
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
    {"obstacles": "firm"},
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
    {"partner": Grabber(), "predictor": "eq1"},
    {"partner": "robot", "task": "bins"},
    {"predictor": "nowhere:Predictor"},
    {"predictor": 3},
]


@pytest.mark.parametrize("arguments", BAD_ARGUMENTS, ids=[f"{next(iter(a))}-{i}" for i, a in enumerate(BAD_ARGUMENTS)])
def test_bad_arguments(arguments):
    with pytest.raises((ValueError, TypeError), match=r"`|predictor|partner|robot"):
        TabletopEnv(**arguments)


def test_unknown_options_and_tasks():
    env = make()
    with pytest.raises(ValueError, match=r"colour.*layout"):
        env.reset(options={"colour": 3})
    for task in ("chess", 5, {"name": "x"}):
        with pytest.raises(TaskError):
            make(task=task)


def test_truncation():
    env = make()
    env.reset(seed=0)
    for step in range(1, 1801):
        assert env.step(np.zeros(2))[3] == (step == 1800)


# -- beliefs and robots ------------------------------------------------------------------------------------------------


def test_beliefs_are_equation_one_along_the_reach():
    env = make(layout=WALL, predictor="eq1")
    _, info = env.reset(seed=0)
    assert info["belief"] == pytest.approx(dict.fromkeys(FIRST, 0.25))
    expected = EqOneBelief(WALL, start="home", goals=sorted(FIRST))
    for _ in range(100):
        info = env.step(towards(env, next_point(env, FIRST[3])))[4]
        if info["holding"]:
            break
        assert info["belief"] == pytest.approx(expected.update(env.unwrapped.hand))
    assert info["holding"] == FIRST[3]
    assert info["belief"] == {}
    fetch(env, FIRST[3])
    assert set(env.unwrapped.view().belief) == set(FIRST[:3])
    assert "belief" not in make().reset()[1]


def test_a_robot_and_a_person_build_together():
    alone, together = play(make(layout=APART)), play(make(layout=APART, partner="robot"))
    info = together[-1][4]
    assert info["done"] == 8
    assert len(together) < len(alone)
    assert math.fsum(r[1] for r in together) == pytest.approx(8 - 0.05 * len(together) / 30)
    assert info["completion_time"] == pytest.approx(len(together) / 30)
    for measure in ("human_idle", "robot_idle", "concurrent_activity"):
        assert 0 <= info[measure] <= 1
    assert info["concurrent_activity"] > 0.2
    assert 0 < info["decision_time"] < 1
    assert 0 < info["decided_rightly"] <= 1
    assert info["conflicts"] >= 0
    assert [r[4]["completion_time"] for r in together[:-1]] == [None] * (len(together) - 1)
    states = {r[4]["robot_state"] for r in together}
    assert states == {"wait", "approach", "grasp", "carry", "place"}


def test_robots_take_only_what_is_valid_and_move_no_faster_than_they_can():
    env = make(partner=Grabber(*SECOND[:1], *FIRST[:1], speed=5.0))
    env.reset(seed=0)
    before = env.unwrapped.view().robot
    assert before == pytest.approx((0.6, 0.75))
    for _ in range(120):
        env.step(np.zeros(2))
        view = env.unwrapped.view()
        assert math.dist(before, view.robot) <= 1.0 / 30 + 1e-9
        before = view.robot
        if view.robot_holding:
            assert (view.positions[0] == view.robot).all()
            assert view.status[0] == "robot"
    assert env.unwrapped.view().status == ("placed",) + ("free",) * 7
    assert env.unwrapped.positions[0].tolist() == list(TASK.configuration[FIRST[0]])


def test_who_takes_an_object_first_has_it():
    env = make(partner=Grabber(FIRST[2], speed=1.0))
    env.reset(seed=0)
    target = TASK.layout.place(FIRST[2])
    for _ in range(60):
        info = env.step(towards(env, target, 2.0))[4]
    # the gripper was faster to the same cube, or the hand: never both
    view = env.unwrapped.view()
    assert (view.holding is None) != (view.status[2] == "hand")
    slow = make(partner=Grabber(FIRST[2], speed=0.05))
    slow.reset(seed=0)
    go_to(slow, target, near=0.02)
    for _ in range(10):
        info = slow.step(np.zeros(2))[4]
    assert info["holding"] == FIRST[2]
    assert FIRST[2] not in slow.unwrapped.goals
    assert slow.unwrapped.view().robot_holding is None


def test_what_a_robot_holds_is_not_valid_for_the_person_until_it_is_dropped():
    env = make(partner=Grabber(FIRST[1], drop_after=5))
    env.reset(seed=0)
    status = []
    for _ in range(90):
        info = env.step(np.zeros(2))[4]
        status.append(env.unwrapped.view().status[1])
        assert (FIRST[1] in info["goals"]) == (status[-1] == "free")
    assert [s for s, before in zip(status, ["", *status], strict=False) if s != before] == ["free", "robot", "free"]
    assert info["done"] == 0
    dropped = env.unwrapped.positions[1]
    assert math.dist(dropped, TASK.layout.place(FIRST[1])) > 0.05
    for name in (*FIRST, *SECOND):
        result = fetch(env, name)
    assert result[2]


def test_second_things_wait_for_first_ones_in_the_gripper():
    env = make(partner=Grabber(FIRST[0], speed=0.3))
    env.reset(seed=0)
    for name in FIRST[1:]:
        result = fetch(env, name)
    while env.unwrapped.view().status[0] != "placed":
        assert result[4]["goals"] == ()
        result = env.step(np.zeros(2))
    assert set(result[4]["goals"]) == set(SECOND)


@pytest.mark.parametrize("predictor", [Mute(), "table_player:Doubtful"])
def test_a_predictor_that_fails_is_reported_once_and_the_episode_goes_on(predictor):
    env = make(partner="robot", predictor=predictor)
    with pytest.warns(RuntimeWarning, match="robot waits") as caught:
        results = play(env)
    assert len(caught) == 1
    assert all(result[4]["belief"] == {} for result in results)
    info = results[-1][4]
    assert info["done"] == 8
    assert info["completion_time"] is not None
    with pytest.warns(RuntimeWarning, match="Doubtful"):
        assert make(predictor=Doubtful()).reset()[1]["belief"] == {}


class Confident:
    """Sure from the beginning that the person goes for the first candidate by name."""

    classes_ = ()

    def stream(self, context):
        self.goals = context.candidates
        return self

    def update(self, point, time=None):
        return {goal: float(i == 0) for i, goal in enumerate(self.goals)}


def test_partners_and_predictors_of_ones_own():
    env = make(partner="robot", predictor=Confident())
    _, info = env.reset(seed=0)
    assert max(info["belief"], key=info["belief"].get) == info["goals"][0]
    assert info["robot_target"] is not None
    assert env.unwrapped.view().threshold == 0.8
    assert make(partner="table_player:Grabber").reset()[1]["robot_target"] is None
    assert make(partner={"threshold": 0.3}).unwrapped.view().threshold == 0.3


@pytest.mark.filterwarnings("ignore:.*matplotlib")
def test_playable_by_hand(monkeypatch):
    """``gymnasium.utils.play`` accepts the environment and its keys; with them a cube is fetched."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    import pygame
    from gymnasium.utils.play import PlayableGame

    env = make(render_mode="rgb_array")
    env.reset(options={"start": np.add(TASK.layout.place(FIRST[0]), (0.05, -0.1))})
    assert {pygame.K_UP, pygame.K_a} < PlayableGame(env, None).relevant_keys
    keys = env.unwrapped.get_keys_to_action()
    assert len(keys) == 16
    assert all(env.action_space.contains(action) for action in keys.values())
    for pressed in ([pygame.K_UP], [pygame.K_a], [pygame.K_s], [pygame.K_DOWN, pygame.K_RIGHT]):
        before = env.unwrapped.hand
        for _ in range(6):
            env.step(keys[tuple(sorted(pressed))])
        x, y = env.unwrapped.hand - before
        expected = {pygame.K_UP: (0, 0.1), pygame.K_a: (-0.1, 0), pygame.K_s: (0, -0.1)}
        assert (x, y) == pytest.approx(expected.get(pressed[0], (0.1 / math.sqrt(2), -0.1 / math.sqrt(2))), abs=1e-6)
    env.reset(options={"start": np.add(TASK.layout.place(FIRST[0]), (0.0, -0.1))})
    for _ in range(6):
        assert env.step(keys[(pygame.K_w,)])[4]["holding"] is None
    assert env.step(np.zeros(2))[4]["holding"] == FIRST[0]


# -- what is recorded -------------------------------------------------------------------------------------------------


def test_reaches_become_trajectories():
    env = make(layout=WALL)
    results = play(env, seed=3)
    reaches = env.unwrapped.trajectories(participant="p1", condition="both")
    assert [r.start for r in reaches] == ["home"] + ["assembly"] * 7
    assert {r.goal for r in reaches[:4]} == set(FIRST)
    assert [len(r.candidates) for r in reaches] == [4, 3, 2, 1] * 2
    for reach in reaches:
        assert (reach.layout, reach.participant, reach.condition) == (WALL, "p1", "both")
        assert reach.states.dtype == np.float64
        assert np.diff(reach.times) == pytest.approx(1 / 30)
        assert reach.goal_positions == tuple(WALL.place(name) for name in reach.candidates)
        away = np.abs(reach.states[-1] - WALL.place(reach.goal)) - 0.0225
        assert math.hypot(*np.maximum(away, 0)) <= 0.03
    assert tuple(reaches[0].states[0]) == (0.6, 0.05)
    total = sum(np.hypot(*np.diff(r.states, axis=0).T).sum() for r in reaches)
    assert total < results[-1][4]["path_length"]
    env.reset()
    assert env.unwrapped.trajectories() == []


def test_reaches_of_many_episodes_are_kept(tmp_path):
    env = RecordReaches(make(partner="robot"), participant="p2", condition="robot")
    counts = [len(env.trajectories())]
    for seed in range(2):
        info = play(env, seed)[-1][4]
        counts.append(len(env.trajectories()))
    assert counts[0] == 0 < counts[1] < counts[2] < 16  # the robot takes some
    assert info["done"] == 8
    with pytest.raises(LayoutError):
        env.reset(options={"layout": 3})
    assert len(env.trajectories()) == counts[2]
    env.reset()
    assert len(env.trajectories()) == counts[2]
    assert {(r.participant, r.condition) for r in env.trajectories()} == {("p2", "robot")}
    path = save_trajectories(tmp_path / "reaches.npz", env.trajectories())
    assert load_trajectories(path) == env.trajectories()
    with pytest.raises(LayoutError, match="LegibleTabletop"):
        RecordReaches(gym.make("LegibleOvercooked-v0"))


def test_playing_on_after_the_end_changes_nothing():
    env = make(partner="robot")
    last = play(env)[-1]
    after = env.unwrapped.step(np.array([0.1, 0.0]))
    assert after[2]
    assert after[1] < 0
    assert after[4]["completion_time"] == pytest.approx(last[4]["completion_time"], abs=0.05)
