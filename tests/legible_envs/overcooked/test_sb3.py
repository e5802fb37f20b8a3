"""The batched kitchen for Stable-Baselines3 behaves as its own vector of single kitchens."""

from __future__ import annotations

import builtins
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace, as_sb3
from legible_envs.overcooked.policies import ScriptedPlayer
from tests.legible_envs.environment_cases import KITCHEN, KITCHEN_ID, TABLE_ID

stable_baselines3 = pytest.importorskip("stable_baselines3")
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor  # noqa: E402

COUNT = 5
SETTINGS = {
    "grid": {},
    "vector": {"obs_type": "vector", "shaping": True, "virtual_obstacles": "soft", "crossing_cost": 0.5},
    "random": {"layouts": "random", "recipes": [["onion"]], "cook_time": 2, "obs_type": "vector"},  # episodes finish
}


def make_both(mode=AutoresetMode.NEXT_STEP, steps=60, **arguments):
    envs = gym.make_vec(KITCHEN_ID, num_envs=COUNT, max_episode_steps=steps, autoreset_mode=mode, **arguments)
    singles = [lambda: gym.make(KITCHEN_ID, max_episode_steps=steps, **arguments)] * COUNT
    return as_sb3(envs), DummyVecEnv(singles)


def assert_same(ours, theirs):
    """Infos have the same types too: learners pickle and log them."""
    assert data_equivalence(ours, theirs, exact=True)


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("setting", SETTINGS)
def test_the_same_as_single_kitchens(mode, setting):
    """Over the ends of episodes, finished and cut off, with observations, infos, masks and reset infos."""
    ours, theirs = make_both(mode, steps=45, **SETTINGS[setting])
    assert (ours.observation_space, ours.action_space) == (theirs.observation_space, theirs.action_space)
    assert ours.seed(3) == theirs.seed(3)
    assert_same(ours.reset(), theirs.reset())
    rng = np.random.default_rng(0)
    cook = ScriptedPlayer(ours.envs, rng)
    told = ours.reset_infos
    cut_off = finished = 0
    for _ in range(220):
        masks = np.stack(theirs.env_method("action_masks"))
        assert_same(np.stack(ours.env_method("action_masks")), masks)
        assert_same(ours.env_method("action_masks", indices=[2, 0]), [masks[2], masks[0]])
        infos = {key: np.array([info[key] for info in told]) for key in ("goal_mask", "action_mask", "layout_id")}
        random = [rng.choice(np.flatnonzero(mask)) for mask in masks]
        actions = np.where(rng.random(COUNT) < 0.2, random, cook(None, infos))
        result, expected = ours.step(actions), theirs.step(actions)
        for a, b in zip(result, expected, strict=True):
            assert_same(a, b)
        assert result[1].dtype == expected[1].dtype
        assert_same(ours.reset_infos, theirs.reset_infos)
        told = [new if over else info for new, info, over in zip(ours.reset_infos, result[3], result[2], strict=True)]
        ended = [info for info, done in zip(result[3], result[2], strict=True) if done]
        assert all("terminal_observation" in info for info in ended)
        cut_off += sum(info["TimeLimit.truncated"] for info in ended)
        finished += sum(not info["TimeLimit.truncated"] for info in ended)
    assert cut_off > 2
    assert (finished > 2) == (setting == "random")
    assert ours.get_attr("layout") == theirs.get_attr("layout")
    assert ours.get_attr("goals", indices=1) == theirs.get_attr("goals", indices=1)


def test_terminal_observations_are_no_views_of_what_comes_after():
    ours, _ = make_both(AutoresetMode.SAME_STEP, steps=2)
    ours.reset()
    for _ in range(2):
        observations, _, dones, infos = ours.step(np.full(COUNT, 1))
    assert dones.all()
    kept = infos[0]["terminal_observation"].copy()
    observations[:] = 9
    ours.step(np.zeros(COUNT, dtype=int))
    assert np.array_equal(infos[0]["terminal_observation"], kept)


def test_kitchens_come_by_attribute_and_by_options():
    ours, theirs = make_both(obs_type="vector")
    other = OvercookedLayout.from_ascii(KITCHEN)
    genomes = OvercookedWorkspace((7, 7)).sample(COUNT, np.random.default_rng(0))
    own = ours.get_attr("layout")[0]
    ours.set_attr("layout", other, indices=[1, 3])
    ours.reset()
    assert ours.get_attr("layout") == [own, other, own, other, own]
    for vectors in (ours, theirs):
        vectors.set_options([{"layout": other}, {}, {"layout": None}, {"layout": KITCHEN}, {}])
        vectors.seed(0)
    ours.reset()
    assert ours.get_attr("layout") == [other, other, own, other, own]
    ours.set_options({"layout": genomes})
    ours.reset()
    expected = [OvercookedWorkspace((7, 7)).decode(genome) for genome in genomes]
    assert ours.get_attr("layout") == expected
    ours.reset()  # options count once, and kitchens stay
    assert ours.get_attr("layout") == expected
    ours.set_options({"colour": 1})
    with pytest.raises(ValueError, match="colour"):
        ours.reset()
    with pytest.raises(AttributeError, match="cook_time"):
        ours.set_attr("cook_time", 3)
    assert ours.has_attr("action_masks")
    assert not ours.has_attr("nonsense")


def test_seeds_differ_and_repeat():
    ours, _ = make_both(**SETTINGS["random"])
    ours.seed(5)
    ours.reset()
    first = ours.get_attr("layout")
    ours.seed(5)
    ours.reset()
    assert ours.get_attr("layout") == first
    state = np.random.get_state()[1].tolist()  # noqa: NPY002
    ours.seed()
    ours.reset()
    assert ours.get_attr("layout") != first
    assert np.random.get_state()[1].tolist() == state  # noqa: NPY002


def test_pictures_are_those_of_the_games():
    ours, theirs = make_both(render_mode="rgb_array")
    ours.reset()
    theirs.reset()
    assert np.array_equal(ours.render(), theirs.render())


def test_what_is_not_the_batched_kitchen_is_refused():
    single = gym.make(KITCHEN_ID)
    wrapped = gym.wrappers.vector.NormalizeReward(gym.make_vec(KITCHEN_ID, num_envs=1))
    for envs in (single, wrapped, gym.make_vec(TABLE_ID, num_envs=1), None):
        with pytest.raises(ValueError, match="batched kitchen"):
            as_sb3(envs)


def test_a_missing_library_is_named(monkeypatch):
    def refuse(name, *args, real=builtins.__import__, **kwargs):
        if name.startswith("stable_baselines3"):
            raise ModuleNotFoundError(name)
        return real(name, *args, **kwargs)

    monkeypatch.delitem(sys.modules, "legible_envs.overcooked.stable_baselines3", raising=False)
    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(ImportError, match=r"pip install \"legible-envs\[rl\]\""):
        as_sb3(gym.make_vec(KITCHEN_ID, num_envs=1))


@pytest.mark.slow
@pytest.mark.parametrize("masked", [False, True])
def test_learners_learn_on_it(masked):
    """Some updates of PPO, with masks and without; a learner that is told nothing would not change its policy."""
    arguments = {"n_steps": 32, "batch_size": 80, "seed": 0, "device": "cpu"}
    envs = VecMonitor(make_both(obs_type="vector", shaping=True)[0])
    if masked:
        learner = pytest.importorskip("sb3_contrib").MaskablePPO("MlpPolicy", envs, **arguments)
    else:
        learner = stable_baselines3.PPO("MlpPolicy", envs, **arguments)
    before = learner.policy.state_dict()["action_net.weight"].clone()
    learner.learn(600)
    assert not (learner.policy.state_dict()["action_net.weight"] == before).all()
    assert len(learner.ep_info_buffer) > 5
