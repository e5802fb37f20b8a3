"""Learners of Stable-Baselines3 and sb3-contrib take the environments as they are, through the wrappers people use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics, RecordVideo

import legible_envs  # noqa: F401
from legible_envs.overcooked import as_sb3, parallel_env
from tests.legible_envs.environment_cases import KITCHEN_ID, TABLE_ID

stable_baselines3 = pytest.importorskip("stable_baselines3")
sb3_contrib = pytest.importorskip("sb3_contrib")
from stable_baselines3 import PPO, SAC  # noqa: E402
from stable_baselines3.common.monitor import Monitor  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize  # noqa: E402

pytestmark = pytest.mark.slow

SHORT: dict[str, Any] = {"n_steps": 32, "batch_size": 32, "n_epochs": 2, "seed": 0, "device": "cpu"}
KITCHENS: list[dict[str, Any]] = [
    {"obs_type": "vector"},
    {"obs_type": "grid"},
    {"obs_type": "vector", "num_players": 2},
    {"obs_type": "grid", "num_players": 2},
]


def has_learned(model: Any, before: list[np.ndarray]) -> bool:
    """Whether an update changed the weights, and to finite ones."""
    after = [weights.detach().numpy() for weights in model.policy.parameters()]
    assert all(np.isfinite(weights).all() for weights in after)
    return any(not np.array_equal(old, new) for old, new in zip(before, after, strict=True))


def learn(model: Any, steps: int) -> None:
    before = [weights.detach().numpy().copy() for weights in model.policy.parameters()]
    model.learn(steps)
    assert has_learned(model, before)


@pytest.mark.parametrize("kitchen", KITCHENS, ids=lambda kitchen: "-".join(map(str, kitchen.values())))
@pytest.mark.parametrize("learner", [PPO, sb3_contrib.MaskablePPO])
def test_single_kitchens_through_monitor_and_normalisation(learner: Any, kitchen: dict[str, Any]) -> None:
    single = [lambda: Monitor(gym.make(KITCHEN_ID, shaping=True, max_episode_steps=40, **kitchen))] * 2
    envs = VecNormalize(DummyVecEnv(single), gamma=0.99)
    model = learner("MlpPolicy", envs, **SHORT)
    learn(model, 192)
    assert len(model.ep_info_buffer) >= 2, "Monitor reports episodes"


@pytest.mark.parametrize("kitchen", KITCHENS, ids=lambda kitchen: "-".join(map(str, kitchen.values())))
@pytest.mark.parametrize("learner", [PPO, sb3_contrib.MaskablePPO])
def test_the_batched_kitchen(learner: Any, kitchen: dict[str, Any]) -> None:
    batch = gym.make_vec(KITCHEN_ID, num_envs=4, shaping=True, layouts="random", max_episode_steps=40, **kitchen)
    envs = VecNormalize(VecMonitor(as_sb3(batch)))
    model = learner("MlpPolicy", envs, **SHORT)
    learn(model, 4 * 64)
    assert len(model.ep_info_buffer) >= 4


def test_the_table_is_for_learners_of_continuous_actions() -> None:
    env = Monitor(gym.make(TABLE_ID, shaping=True, max_episode_steps=60))
    model = SAC("MlpPolicy", env, learning_starts=64, batch_size=32, seed=0, device="cpu")
    learn(model, 130)
    envs = VecNormalize(DummyVecEnv([lambda: Monitor(gym.make(TABLE_ID, shaping=True, max_episode_steps=60))]))
    learn(PPO("MlpPolicy", envs, **SHORT), 64)


def test_gymnasiums_wrappers_record_what_a_learner_does(tmp_path: Path) -> None:
    pytest.importorskip("moviepy")
    env: gym.Env[Any, Any] = gym.make(KITCHEN_ID, obs_type="vector", render_mode="rgb_array", max_episode_steps=20)
    env = RecordVideo(RecordEpisodeStatistics(env), str(tmp_path), episode_trigger=lambda number: number == 0)
    learn(PPO("MlpPolicy", env, **SHORT), 64)
    env.close()
    assert env.get_wrapper_attr("return_queue")
    assert [path.suffix for path in tmp_path.glob("*.mp4")] == [".mp4"]


@pytest.mark.parametrize("players", [1, 2])
def test_vectors_in_other_processes_give_the_same(players: int) -> None:
    options: dict[str, Any] = {"num_players": players, "layouts": "random", "max_episode_steps": 15}
    ours = gym.make_vec(KITCHEN_ID, num_envs=2, **options)
    theirs = gym.make_vec(KITCHEN_ID, num_envs=2, vectorization_mode="async", **options)
    try:
        assert np.array_equal(ours.reset(seed=1)[0], theirs.reset(seed=1)[0])
        rng = np.random.default_rng(0)
        for _ in range(40):
            actions = rng.integers(6, size=ours.action_space.shape)
            mine, its = ours.step(actions), theirs.step(actions)
            assert all(np.array_equal(a, b) for a, b in zip(mine[:4], its[:4], strict=True))
            assert np.array_equal(mine[4]["action_mask"], its[4]["action_mask"])
    finally:
        theirs.close()


def test_agents_of_pettingzoo_share_a_policy() -> None:
    """Self-play with one policy for all cooks, over the batch and over agents: the same observations and returns."""
    from stable_baselines3.common.policies import ActorCriticPolicy

    agents = parallel_env(2, obs_type="vector", max_episode_steps=30)
    space, actions = agents.observation_space("player_0"), agents.action_space("player_0")
    policy = ActorCriticPolicy(space, actions, lambda _: 1e-3)
    batch = gym.make_vec(KITCHEN_ID, num_envs=1, num_players=2, obs_type="vector", max_episode_steps=30)
    observations, _ = agents.reset(seed=0)
    rows, _ = batch.reset(seed=0)
    while agents.agents:
        both = np.stack([observations[agent] for agent in agents.agents])
        assert np.array_equal(both, rows[0])
        moves, _ = policy.predict(both, deterministic=True)
        observations, rewards, *_ = agents.step(dict(zip(agents.agents, moves.tolist(), strict=True)))
        rows, paid, *_ = batch.step(moves[None])
        assert set(rewards.values()) == {paid[0]}
