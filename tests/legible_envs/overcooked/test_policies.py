"""The scripted cook finishes every kitchen in which the recipes can be cooked, by shortest paths."""

from __future__ import annotations

from collections import Counter

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.overcooked import PAPER_SOUPS, OvercookedLayout, soup_task
from legible_envs.overcooked.policies import ScriptedPlayer
from tests.legible_envs.overcooked.kitchens import random_kitchen
from tests.oracles.kitchen_oracle import any_kitchen


def finish(env, layout, rng, **arguments):
    """Play one episode; returns its steps and last info."""
    player = ScriptedPlayer(env, rng, **arguments)
    obs, info = env.reset(options={"layout": layout})
    for steps in range(1, 1201):
        obs, _, terminated, truncated, info = env.step(player(obs, info))
        assert not truncated
        if terminated:
            return steps, info
    raise AssertionError("never over")


@pytest.mark.parametrize("shape", [(5, 5), (7, 7), (4, 9), (9, 9)])
def test_finishes_kitchens_of_the_design_rules(shape):
    rng = np.random.default_rng(shape)
    env = gym.make("LegibleOvercooked-v0", shape=shape, disable_env_checker=True)
    for _ in range(40):
        _, info = finish(env, random_kitchen(rng, shape), rng)
        assert info["deliveries"] == len(PAPER_SOUPS)


def test_finishes_any_kitchen():
    rng = np.random.default_rng(0)
    for _ in range(80):
        layout = any_kitchen(rng)
        env = gym.make("LegibleOvercooked-v0", shape=layout.shape, layout=layout, disable_env_checker=True)
        assert finish(env, layout, rng)[1]["deliveries"] == len(PAPER_SOUPS)


def test_finishes_whatever_was_done_before():
    """No state is a dead end: random play first, then the cook takes over."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        layout = any_kitchen(rng)
        env = gym.make("LegibleOvercooked-v0", layout=layout, shape=layout.shape, max_episode_steps=100_000)
        obs, info = env.reset()
        for action in rng.choice([0, 1, 2, 3, 5, 5], size=1500):
            obs, _, over, _, info = env.step(action)
            if over:
                break
        player = ScriptedPlayer(env, rng)
        for _ in range(1500):
            if over:
                break
            obs, _, over, _, info = env.step(player(obs, info))
        assert over


@pytest.mark.parametrize(
    ("recipes", "undecided"),
    [
        (PAPER_SOUPS, {("pot", ("cabbage", "onion", "tomato"))}),
        ((("tomato", "tomato", "onion"), ("cabbage", "cabbage"), ("fish",)), set()),
    ],
)
def test_stages_are_those_of_the_task_with_one_pot(recipes, undecided):
    """The goals of the running game with one pot are those of ``soup_task(pots=1)`` at every stage, but for one thing.

    In the task an onion is fetched for a certain soup; in the pot it may become any soup that still needs one.
    """
    kitchen = OvercookedLayout.from_ascii("XPXXX\nO   T\nX   X\nD  1F\nXCXSX")
    env = gym.make("LegibleOvercooked-v0", shape=(5, 5), layout=kitchen, recipes=recipes, disable_env_checker=True)
    rng = np.random.default_rng(3)
    player = ScriptedPlayer(env, rng)
    seen = Counter()
    for _ in range(200):
        obs, info = env.reset()
        place, over = "serving", False
        while not over:
            view, names = env.unwrapped.view(), env.unwrapped.goals
            held = view.players[0].held
            action = player(obs, info)
            obs, _, over, _, info = env.step(action)
            if action == 5:
                if held is None:
                    seen[place, names] += 1
                after = env.unwrapped.view().players[0].held
                place = {"dish": place, "soup": "pot"}.get(after.kind, place) if after else place
                if held is not None and after is None:
                    place = "serving" if held.kind == "soup" else "pot"
    stages = {(stage.start, tuple(sorted(stage.goals))) for stage in soup_task(recipes, pots=1).stages()}
    assert {(start, tuple(sorted(names))) for start, names in seen} == stages | undecided


def test_walks_are_shortest():
    kitchen = OvercookedLayout.from_ascii("XPXXXXX\nO     T\nX V VVX\nD     F\nX VVV X\nX  1  X\nXCXXXSX")
    env = gym.make("LegibleOvercooked-v0", layout=kitchen, disable_env_checker=True)
    player = ScriptedPlayer(env, np.random.default_rng(0))
    for _ in range(10):
        obs, info = env.reset()
        over, goal, field, left = False, None, None, 0
        while not over:
            action = player(obs, info)
            cell = env.unwrapped.view().players[0].cell
            if player.goal() not in (None, goal):
                goal = player.goal()
                field = kitchen.distances_from(kitchen.access(kitchen.station_at(goal)))
                left = int(field[cell])
            if goal is not None and action < 4:
                assert field[cell] == left
                left -= left > 0
            if action == 5:
                goal = None
            obs, _, over, _, info = env.step(action)


def test_keeps_off_soft_obstacles_where_it_can():
    open_way = OvercookedLayout.from_ascii("XPXSX\nO   T\nX V X\nD  1F\nXCXXX")
    shut_in = OvercookedLayout.from_ascii("XPXSX\nO   T\nXVVVX\nD  1F\nXCXXX")
    env = gym.make("LegibleOvercooked-v0", shape=(5, 5), virtual_obstacles="soft", disable_env_checker=True)
    rng = np.random.default_rng(0)
    assert finish(env, open_way, rng)[1]["crossings"] == 0
    assert finish(env, open_way, rng, avoid_obstacles=False)[1]["crossings"] > 0
    assert finish(env, shut_in, rng)[1]["crossings"] > 0


def test_same_generator_same_play():
    def actions():
        env = gym.make("LegibleOvercooked-v0")
        player = ScriptedPlayer(env, np.random.default_rng(8))
        obs, info = env.reset(seed=0)
        chosen = []
        for _ in range(100):
            chosen.append(player(obs, info))
            obs, _, _, _, info = env.step(chosen[-1])
        return chosen

    assert actions() == actions()


@pytest.mark.parametrize("mode", ["sync", "vector_entry_point"])
def test_plays_in_vector_environments(mode):
    envs = gym.make_vec("LegibleOvercooked-v0", num_envs=5, vectorization_mode=mode)
    player = ScriptedPlayer(envs, np.random.default_rng(0))
    obs, infos = envs.reset(seed=0)
    delivered = np.zeros(5)
    for _ in range(400):
        actions = player(obs, infos)
        assert actions.shape == (5,)
        obs, rewards, _, truncations, infos = envs.step(actions)
        delivered += rewards / 20
        assert not truncations.any()
    assert (delivered >= 3).all()
    envs.close()


def test_an_info_of_another_kitchen_is_refused():
    """Its goal lies outside the arrays of this kitchen, in which kernels look it up."""
    env = gym.make("LegibleOvercooked-v0", disable_env_checker=True)
    player = ScriptedPlayer(env, np.random.default_rng(0))
    obs, info = env.reset(seed=0)
    with pytest.raises(ValueError, match=r"its goal_mask has shape \(9, 9\), the kitchen \(7, 7\)"):
        player(obs, {**info, "goal_mask": np.ones((9, 9), dtype=bool)})
