"""Simulated participants at play in the environment, compiled and as plain Python."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest

import legible_envs  # noqa: F401
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.humans import (
    BoltzmannWalker,
    PlannerWalker,
    fit_rationality,
)
from legible_envs.overcooked.policies import WalkingPlayer
from legible_envs.rollouts import record_episode
from tests.legible_envs.overcooked.kitchens import random_kitchen
from tests.support.plain_python import printed_both_ways


@pytest.mark.slow
def test_kernels_run_as_plain_python():
    """Numba's generator of random numbers is numpy's, so that even samples are the same."""
    code = (
        "import numpy as np\n"
        "from legible_envs.overcooked import OvercookedWorkspace\n"
        "from legible_envs.overcooked.humans import fit_policy, fit_rationality, simulate_participants\n"
        "ws = OvercookedWorkspace((5, 5), human='boltzmann', rationality=1.1)\n"
        "genome = ws.sample(1, np.random.default_rng(0))[0]\n"
        "people = [simulate_participants(ws.decode(genome), 1, np.random.default_rng(0), population=name)\n"
        "          for name in ('boltzmann', 'planner', 'cloned')]\n"
        "print(ws.legibility(genome), *[walk.states.sum() for walks in people for walk in walks])\n"
        "print(*[round(float(walk.times[-1]), 6) for walks in people for walk in walks])\n"
        "print(fit_rationality(people[0] + people[1]).interval, fit_policy(people[2]).log_likelihood)"
    )
    numbers = [[float(word.strip("(),")) for word in text.split()] for text in printed_both_ways(code)]
    assert len(numbers[0]) == 1 + 36 + 36 + 3
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-9)


def test_players_finish_any_valid_kitchen():
    rng = np.random.default_rng(0)
    for walker in (BoltzmannWalker(1.5, idle=0.2), PlannerWalker(idle=0.2)):
        for _ in range(5):
            layout = random_kitchen(rng, (6, 6))
            env = gym.make("LegibleOvercooked-v0", shape=(6, 6), layout=layout, max_episode_steps=20_000)
            player = WalkingPlayer(env, walker, rng)
            obs, info = env.reset(seed=0)
            over = False
            while not over:
                obs, _, terminated, truncated, info = env.step(player(obs, info))
                over = terminated or truncated
            assert info["deliveries"] == 3


def test_players_keep_off_soft_obstacles():
    layout = OvercookedLayout.from_ascii("XPXXXXX\nO  V  T\nX  V  X\nD     F\nXCXXSXX")
    crossings = {}
    for kind in ("hard", "soft"):
        env = gym.make("LegibleOvercooked-v0", layout=layout, shape=(5, 7), virtual_obstacles=kind)
        player = WalkingPlayer(env.unwrapped, BoltzmannWalker(1.5, idle=0.0), np.random.default_rng(0))
        obs, info = env.reset(seed=0)
        for _ in range(300):
            obs, _, terminated, _, info = env.step(player(obs, info))
            if terminated:
                break
        crossings[kind] = info["crossings"]
        assert info["deliveries"] > 0
    assert crossings == {"hard": 0, "soft": 0}


def test_players_in_vector_environments():
    envs = gym.make_vec("LegibleOvercooked-v0", num_envs=3, vectorization_mode="vector_entry_point", shape=(5, 5))
    player = WalkingPlayer(envs, BoltzmannWalker(2.0), np.random.default_rng(0))
    obs, info = envs.reset(seed=0)
    total = 0.0
    for _ in range(800):
        actions = player(obs, info)
        assert actions.shape == (3,)
        obs, rewards, _, _, info = envs.step(actions)
        total += rewards.sum()
    assert total > 0


def test_play_is_the_walker_that_was_asked_for():
    """Rationality and pace, read off recorded episodes, are those of the person who played."""
    rng = np.random.default_rng(3)
    layout = random_kitchen(rng, (7, 7))
    env = gym.make("LegibleOvercooked-v0", layout=layout, max_episode_steps=20_000)
    walker = BoltzmannWalker(1.3, idle=0.4, turn=0.05)
    walks = []
    for number in range(25):
        walks += record_episode(env, WalkingPlayer(env, walker, rng), seed=number, participant=str(number))
    fit = fit_rationality(walks, confidence=0.999)
    assert fit.interval[0] < 1.3 < fit.interval[1]
    ticks = np.concatenate([np.diff(walk.times[:-1]) / 0.15 for walk in walks])
    expected = 1 / (1 - 0.45)
    assert ticks.mean() == pytest.approx(expected, abs=5 * math.sqrt(expected * (expected - 1) / len(ticks)))
