"""Reward shaping on the table: potential-based, so nothing is gained but by getting on with the task."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest

from legible_envs.tabletop.game.shaping import SHAPING
from tests.legible_envs.tabletop.table_envs import APART, FIRST, TASK, WALL, make
from tests.legible_envs.tabletop.table_player import fetch, go_to, next_point, play, towards

TABLES = {
    "columns": {},
    "apart": {"layout": APART, "contact": "always", "max_speed": 0.5},
    "wall": {"layout": WALL, "contact": "always", "max_speed": 0.5},
    "soft": {"layout": WALL, "virtual_obstacles": "soft", "crossing_cost": 0.5},
    "robot": {"layout": APART, "partner": "robot"},
    "tea": {"task": "tea"},
    "bins": {"task": "bins"},
}


def potential(env) -> float:
    return env.unwrapped._shaping.potential()


def way_ahead(env) -> float:
    return env.unwrapped._shaping.way_ahead()


def random_actions(env, seed):
    """Directions kept for a while, so that the hand gets about; some slow enough to take and to place."""
    rng = np.random.default_rng(seed)
    while True:
        action = (rng.normal(size=2) * rng.choice([0.02, 0.3, 1.0])).astype(np.float32)
        for _ in range(int(rng.integers(1, 20))):
            yield action.clip(-1, 1)


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("discount", [1.0, 0.9])
def test_the_discounted_sum_is_the_difference_of_potentials(name, discount):
    arguments = TABLES[name]
    plain = make(**arguments)
    shaped = make(**arguments, shaping={"discount": discount})
    for seed in range(3):
        plain.reset(seed=seed), shaped.reset(seed=seed)
        first, total = potential(shaped), 0.0
        for t, action in zip(range(400), random_actions(shaped, seed), strict=False):
            without, with_it = plain.step(action), shaped.step(action)
            np.testing.assert_array_equal(without[0], with_it[0])
            total += discount**t * (with_it[1] - without[1])
        assert total == pytest.approx(discount**400 * potential(shaped) - first, abs=1e-9)


def test_every_finished_episode_gains_the_same():
    orders = [lambda goals: goals[0], lambda goals: goals[-1]]
    gains = []
    for choose in orders:
        env, reward, steps = make(shaping={"discount": 1.0}), 0.0, 0
        _, info = env.reset(seed=0)
        before = -potential(env)
        while info["num_done"] < 8:
            goal = choose(env.unwrapped.goals)
            env.unwrapped.goal = goal
            while info["num_done"] < 8 and (env.unwrapped.goal == goal or env.unwrapped.holding == goal):
                target = next_point(env, goal) if env.unwrapped.holding is None else env.unwrapped.carry_to
                result = env.step(towards(env, target))
                reward, steps, info = reward + result[1], steps + 1, result[4]
        assert result[2]
        assert potential(env) == 0.0
        gains.append(reward - (8 - 0.05 * steps / 30))
    assert gains == pytest.approx([before, before])


def test_going_to_and_fro_gains_nothing():
    env = make(shaping={"discount": 1.0}, time_cost=0.0)
    env.reset(seed=0)
    there, back = np.array([-0.5, 0.6], np.float32), np.array([0.5, -0.6], np.float32)
    total = 0.0
    for _ in range(20):
        total += sum(env.step(action)[1] for action in [there] * 3 + [back] * 3)
    assert total == pytest.approx(0, abs=1e-6)


def test_the_way_leads_round_hard_obstacles_and_through_soft_ones():
    rng = np.random.default_rng(0)
    hard, soft = make(layout=WALL, shaping=True), make(layout=WALL, shaping=True, virtual_obstacles="soft")
    longer = 0
    for _ in range(200):
        point = rng.uniform((0, 0), (1.2, 0.8))
        if not WALL.paths.is_free([point])[0]:
            continue
        for env in (hard, soft):
            env.reset(options={"start": tuple(point)})
        lines = [path for path, name in zip(WALL.paths.polylines(point), WALL.goals, strict=True) if name in FIRST]
        lengths = [np.hypot(*np.diff(line, axis=0).T).sum() for line in lines]
        assert way_ahead(hard) == pytest.approx(min(lengths))
        straight = min(math.dist(point, WALL.place(name)) for name in FIRST)
        assert way_ahead(soft) == pytest.approx(straight)
        longer += way_ahead(hard) > straight + 1e-6
    assert longer > 20


def test_taking_carrying_and_placing_each_bring_it_nearer():
    env = make(shaping=True)
    env.reset(seed=0)
    assert potential(env) == pytest.approx(-2.0 * 8 - 2.0 * way_ahead(env))
    values = [potential(env)]
    held = False
    while env.unwrapped.holding is not None or not held:
        held = held or env.unwrapped.holding is not None
        target = env.unwrapped.carry_to if env.unwrapped.holding else next_point(env, FIRST[0])
        env.step(towards(env, target))
        values.append(potential(env))
    falls = np.diff(values) < -1e-3
    # The way to the place is longer than the one to the cube, and the next cube is some way off again.
    assert falls.sum() <= 1
    assert values[-1] == pytest.approx(-2.0 * 7 - 2.0 * way_ahead(env))


def test_the_goal_that_was_set_is_the_way_ahead():
    env = make(shaping=True)
    for goal in FIRST:
        env.reset(options={"goal": goal})
        assert way_ahead(env) == pytest.approx(math.dist(env.unwrapped.hand, TASK.layout.place(goal)))


def test_objects_that_were_pushed_are_looked_for_where_they_lie():
    env = make(layout=APART, contact="always", max_speed=0.5, shaping=True, grasp_distance=0.0)
    env.reset(seed=0)
    name = FIRST[0]
    env.unwrapped.goal = name
    there = np.array(APART.place(name))
    go_to(env, there + np.array([0.0, 0.06]), speed=0.4)
    for _ in range(20):
        env.step(np.array([0.0, -0.2], np.float32))
        assert env.unwrapped.holding is None
        assert way_ahead(env) == pytest.approx(math.dist(env.unwrapped.hand, env.unwrapped.positions[0]))
    assert math.dist(env.unwrapped.positions[0], there) > 0.01


def test_an_object_in_a_grown_obstacle_still_has_a_way():
    env = make(layout=WALL, contact="always", max_speed=0.5, shaping=True)
    env.reset(seed=0)
    obstacle = WALL.obstacles[0]
    game = env.unwrapped._game
    for i in range(len(game.names)):
        game.positions[i] = obstacle.at
    assert 0 < way_ahead(env) < 1.5
    assert math.isfinite(env.step(np.zeros(2, np.float32))[1])


def test_tasks_without_places_finish_with_potential_zero():
    for task in ("tea", "bins"):
        env = make(task=task, shaping={"discount": 1.0}, time_cost=0.0)
        results = play(env)
        assert results[-1][2]
        assert potential(env) == 0.0


def test_an_abandoned_episode_leaves_nothing_behind():
    env = make(shaping={"discount": 0.9}, time_cost=0.0)
    env.reset(seed=0)
    first = potential(env)
    fetch(env, FIRST[0])
    env.reset(seed=0)
    assert potential(env) == first
    assert env.step(np.zeros(2, np.float32))[1] == pytest.approx((0.9 - 1) * first)


def test_weights_are_checked_and_kept_in_the_spec():
    env = gym.make("LegibleTabletop-v0", shaping={"taking": 0})
    assert env.unwrapped.settings.shaping == {**SHAPING, "taking": 0.0}
    assert gym.spec(env.spec.to_json() and env.spec.id).id == "LegibleTabletop-v0"
    assert type(env.spec).from_json(env.spec.to_json()).kwargs["shaping"] == {"taking": 0}
    assert gym.make("LegibleTabletop-v0").unwrapped.settings.shaping is None
    for bad, message in [
        ({"speed": 1}, r"unknown weights \['speed'\] in `shaping`; known: \['distance', 'taking', 'placing'"),
        ({"distance": math.nan}, r"weight 'distance' of `shaping` must be a finite number, got nan"),
        ({"discount": 1.5}, r"weight 'discount' of `shaping` must be a finite number from 0 to 1, got 1\.5"),
        ("yes", r"`shaping` must be a mapping of weights, or True or False, got 'yes'"),
    ]:
        with pytest.raises(ValueError, match=message):
            gym.make("LegibleTabletop-v0", shaping=bad)
