"""Person and robot as the agents of PettingZoo: the table's own game, with a robot that somebody steers."""

from __future__ import annotations

import math
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.tabletop import TabletopWorkspace, parallel_env
from legible_envs.tabletop.humans import sample_person
from legible_envs.tabletop.policies import ReachingPlayer

REST = np.zeros(3)


def test_pettingzoos_own_tests_pass() -> None:
    from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, render_test
    from pettingzoo.utils.conversions import parallel_to_aec

    def make() -> Any:
        return parallel_env(max_episode_steps=40)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parallel_api_test(make(), num_cycles=100)
        parallel_seed_test(make)
        api_test(parallel_to_aec(make()), num_cycles=50)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SDL_VIDEODRIVER", "dummy")
        render_test(lambda render_mode=None: parallel_to_aec(parallel_env(render_mode=render_mode)))


def test_beside_a_robot_at_rest_the_person_is_alone() -> None:
    """Every observation is that of the single environment; the gripper's numbers follow."""
    layout = TabletopWorkspace("columns", "both").sample(1, np.random.default_rng(0))[0]
    alone = gym.make("LegibleTabletop-v0", layout=layout)
    both = parallel_env(layout=layout)
    player = ReachingPlayer(alone, sample_person(np.random.default_rng(1)), np.random.default_rng(2))
    observation, info = alone.reset(seed=0)
    observations, _ = both.reset(seed=0)
    same = [i for i, name in enumerate(alone.unwrapped.observation_names) if not name.endswith(": goal")]
    over = False
    while not over:
        assert np.array_equal(observations["human"][same], observation[same])
        action = player(observation, info)
        observation, reward, over, _, info = alone.step(action)
        observations, rewards, terminated, _, infos = both.step({"human": action, "robot": REST})
        assert rewards == {"human": reward, "robot": reward}
        assert set(terminated.values()) == {over}
    assert both.agents == []
    assert infos["human"]["robot_idle"] == 1.0
    assert infos["human"]["completion_time"] == pytest.approx(infos["human"]["time"])


class Fetcher:
    """Fetches the nearest object that the robot may take, from nothing but its own observation."""

    def __init__(self, env: Any) -> None:
        self.at = {name: i for i, name in enumerate(env.observation_names["robot"])}
        self.names = env.table.goal_names.tolist()
        self.count = 0

    def __call__(self, observation: Any) -> Any:
        x, y = (observation[self.at[f"gripper {axis}"]] for axis in "xy")
        if observation[self.at["gripper carries"]]:
            there = [observation[self.at[f"gripper carries to {axis}"]] for axis in "xy"]
            jaws = 1.0 if math.dist(there, (x, y)) > 0.005 else -1.0
        else:
            valid = [name for name in self.names if observation[self.at[f"{name}: valid"]]]
            if not valid:
                return REST
            places = [[observation[self.at[f"{name}: {axis}"]] for axis in "xy"] for name in valid]
            there = min(places, key=lambda place: math.dist(place, (x, y)))
            jaws = 1.0 if math.dist(there, (x, y)) < 0.02 else -1.0
        towards = np.array([there[0] - x, there[1] - y]) * 30
        return np.array([*np.clip(towards, -0.7, 0.7), jaws])


def test_a_robot_builds_from_what_it_observes() -> None:
    env = parallel_env()
    fetch = Fetcher(env)
    observations, infos = env.reset(seed=0)
    paid = 0.0
    while env.agents:
        observations, rewards, terminated, _, infos = env.step(
            {"human": np.zeros(2), "robot": fetch(observations["robot"])}
        )
        assert env.observation_space("robot").contains(observations["robot"])
        assert env.observation_space("human").contains(observations["human"])
        paid += rewards["robot"]
    assert terminated == {"human": True, "robot": True}
    assert infos["robot"]["num_done"] == 8
    assert paid == pytest.approx(8 - 0.05 * infos["robot"]["time"])
    assert infos["robot"]["human_idle"] == 1.0
    assert infos["robot"]["robot_idle"] < 0.2


def test_the_robot_sees_what_it_may_take_and_no_goal_of_the_person() -> None:
    env = parallel_env()
    observations, infos = env.reset(seed=0)
    goal = env.table.goals[0]
    observations, infos = env.reset(seed=0, options={"goal": goal})
    at = {name: i for i, name in enumerate(env.observation_names["human"])}
    assert observations["human"][at[f"{goal}: goal"]] == 1
    assert observations["robot"][at[f"{goal}: goal"]] == 0
    names = env.table.goal_names
    for _ in range(200):
        assert tuple(sorted(names[infos["robot"]["goal_mask"]])) == tuple(sorted(env.table.game.robot_goals))
        valid = [observations["robot"][at[f"{name}: valid"]] for name in names]
        assert np.array_equal(valid, infos["robot"]["goal_mask"])
        same = [i for name, i in at.items() if not name.endswith((": valid", ": goal"))]
        assert np.array_equal(observations["human"][same], observations["robot"][same])
        actions = {agent: env.action_space(agent).sample() for agent in env.agents}
        observations, _, _, _, infos = env.step(actions)


def test_jaws_close_within_reach_alone_and_open_where_told() -> None:
    env = parallel_env()
    env.reset(seed=0)
    _, _, _, _, infos = env.step({"human": np.zeros(2), "robot": [0.0, 0.0, 1.0]})
    assert env.table.game.robot_holding == -1, "nothing is near enough"
    name = env.table.game.robot_goals[0]
    fetch = Fetcher(env)
    observations, _ = env.reset(seed=0)
    while env.table.game.robot_holding < 0:
        observations, *_ = env.step({"human": np.zeros(2), "robot": fetch(observations["robot"])})
    held = env.table.game.robot_holding
    before = env.table.game.positions[held].copy()
    _, rewards, _, _, infos = env.step({"human": np.zeros(2), "robot": [0.0, 0.0, -1.0]})
    assert env.table.game.robot_holding == -1, name
    assert np.allclose(env.table.game.positions[held], before, atol=1e-6), "dropped where it was"
    assert infos["robot"]["num_done"] == 0
    assert rewards["robot"] < 0


def test_bad_input_is_named_and_changes_nothing() -> None:
    with pytest.raises(ValueError, match="needs no partner and no threshold"):
        parallel_env(partner="robot", threshold=0.5)
    env = parallel_env()
    with pytest.raises(ResetNeeded):
        env.step({})
    env.reset(seed=0)
    before = env.state()
    for human, robot in (
        (np.zeros(3), REST),
        (np.zeros(2), np.zeros(2)),
        (np.zeros(2), [0, 0, math.nan]),
        (np.zeros(2), "up!"),
        ([math.inf, 0], REST),
    ):
        with pytest.raises(ValueError, match="finite numbers"):
            env.step({"human": human, "robot": robot})
    with pytest.raises(ValueError, match="an action for each of"):
        env.step({"human": np.zeros(2)})
    with pytest.raises(LayoutError):
        env.reset(options={"layout": "nothing"})
    assert np.array_equal(env.state(), before)
