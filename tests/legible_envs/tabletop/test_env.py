"""The table as an environment: rules of taking and placing, pushing, obstacles, observations."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError, TaskError
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask
from legible_envs.tasks import Subtask, TaskGraph
from tests.legible_envs.tabletop.table_envs import APART, FIRST, NAME, SECOND, TASK, WALL, make
from tests.legible_envs.tabletop.table_player import (
    Grabber,
    Player,
    fetch,
    go_to,
    play,
)

# -- vectors -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("busy", [0, 1])
def test_vectors_of_tables_where_one_has_a_belief_and_the_other_none(busy):
    envs = gym.make_vec(NAME, num_envs=2, vectorization_mode="sync", partner="robot")
    envs.reset(seed=0)
    envs.envs[busy].reset(options={"start": FIRST[0]})
    _, _, _, _, info = envs.step(np.zeros((2, 2), dtype=np.float32))
    assert info["holding"].tolist() == [0 if i == busy else -1 for i in range(2)]
    assert info["belief"].sum(axis=1) == pytest.approx([float(i != busy) for i in range(2)])
    assert [belief is None for belief in envs.get_attr("belief")] == [i == busy for i in range(2)]


def test_partners_are_not_shared_among_environments():
    partner = Grabber(FIRST[0])
    envs = gym.make_vec(NAME, num_envs=2, vectorization_mode="sync", partner=partner)
    envs.reset(seed=0)
    for _ in range(40):
        _, _, _, _, info = envs.step(np.zeros((2, 2), dtype=np.float32))
    assert info["robot_target"].tolist() == [0] * 2
    assert envs.get_attr("robot_target") == (FIRST[0],) * 2
    assert partner.log == []


# -- building ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("task", "done"), [("columns", 8), ("tea", 5), ("bins", 20)])
def test_a_player_finishes_every_task(task, done):
    env = make(task=task)
    results = play(env)
    assert [result[2] for result in results] == [False] * (len(results) - 1) + [True]
    assert results[-1][4]["num_done"] == done
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
        assert info["num_done"] == number
        game = env.unwrapped
        assert set(game.goals) == {*(FIRST if number < 4 else SECOND)} - {*order[:number]}
        stage = stages[info["stage"]]
        assert (stage.start, stage.goals) == (game.start, game.goals)
        assert game.start == game.start_names[info["start"]] == ("home" if number == 0 else "assembly")
        info = fetch(env, name)[4]
    assert game.goals == ()
    assert not info["goal_mask"].any()


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
    assert (info["holding"], info["stage"]) == (0, -1)
    assert (env.unwrapped.holding, env.unwrapped.start) == (FIRST[0], "home")


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
        assert env.step(np.zeros(2))[4]["holding"] == -1


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
        assert env.step(np.zeros(2))[4]["holding"] == env.unwrapped.layout.index(name)


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
        assert env.step(np.zeros(2))[4]["holding"] == 0
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
    env = make(layout=WALL, virtual_obstacles="soft", crossing_cost=0.25, time_cost=0.0)
    env.reset(options={"start": (0.55, 0.15)})
    rewards = [env.step(np.array([0.0, y]))[1] for y in (0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5)]
    assert sum(rewards) == -0.5
    assert env.unwrapped.view().crossings == 2
    assert env.unwrapped.view().virtual_obstacles == "soft"
    env.reset(options={"start": (0.55, 0.15)})
    assert env.step(np.array([0.5, 0.0]))[4]["crossings"] == 0


def test_a_fast_hand_passes_no_thin_obstacle():
    env = make(layout=WALL, max_speed=30.0)
    env.reset(options={"start": (0.55, 0.1)})
    env.step(np.array([0.0, 1.0]))
    assert env.unwrapped.hand[1] < 0.2
    soft = make(layout=WALL, max_speed=30.0, virtual_obstacles="soft")
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
