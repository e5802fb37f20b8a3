"""The batched kitchen behaves exactly as ``SyncVectorEnv`` over single kitchens."""

from __future__ import annotations

import copy
import json
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.policies import ScriptedPlayer
from tests.oracles.kitchen_oracle import any_kitchen

NAME = "LegibleOvercooked-v0"
COUNT = 6
TOLD = ("goal_mask", "action_mask", "layout_id")
TWO_POTS = "XXTXOXX\nC     D\nX  V  X\nF 1   P\nX     X\nX     P\nXXXSXXX"
SETTINGS = {
    "grid": {},
    "vector": {"obs_type": "vector", "virtual_obstacles": "soft", "crossing_cost": 0.5, "shaping": True},
    "distribution": {"layouts": "random:train", "recipes": [["onion"], ["fish", "tomato"]], "cook_time": 3},
    "set": {"layouts": [TWO_POTS, TWO_POTS.replace("P", "X", 1)], "obs_type": "vector"},
    "layout": {"layout": TWO_POTS, "shaping": {"soup": 2.0}},
}


def make_both(mode, steps=150, **arguments):
    def one():
        return gym.make(NAME, max_episode_steps=steps, disable_env_checker=True, **arguments)

    batched = gym.make_vec(
        NAME,
        num_envs=COUNT,
        vectorization_mode="vector_entry_point",
        max_episode_steps=steps,
        autoreset_mode=mode,
        **arguments,
    )
    return batched, SyncVectorEnv([one] * COUNT, autoreset_mode=mode)


def assert_same(ours, theirs):
    """Equal in value, type, shape and dtype, nested dictionaries and object arrays included."""
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys()
        for key in ours:
            assert_same(ours[key], theirs[key])
    elif isinstance(ours, np.ndarray) and ours.dtype == object:
        assert ours.shape == theirs.shape
        for a, b in zip(ours, theirs, strict=True):
            assert_same(a, b)
    elif isinstance(ours, np.ndarray):
        assert ours.dtype == theirs.dtype
        np.testing.assert_array_equal(ours, theirs)
    else:
        assert data_equivalence(ours, theirs, exact=True)


def assert_all_same(ours, theirs):
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs, strict=True):
        assert_same(a, b)


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("setting", SETTINGS)
def test_same_trajectories_as_sync(mode, setting):
    ours, theirs = make_both(mode, steps=45 if setting == "distribution" else 150, **SETTINGS[setting])
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata == theirs.metadata
    assert_all_same(ours.reset(seed=7), theirs.reset(seed=7))
    rng = np.random.default_rng(0)
    player = ScriptedPlayer(ours, rng)
    obs, infos = ours.reset(seed=3)
    assert_all_same((obs, infos), theirs.reset(seed=3))
    deliveries = truncated = terminated = 0
    for step in range(460):
        actions = np.where(rng.random(COUNT) < 0.15, rng.integers(6, size=COUNT), player(obs, infos))
        if step == 160 and "layouts" not in SETTINGS[setting]:
            layouts = [[TWO_POTS, None, TWO_POTS.replace("P", "X", 1)][i % 3] for i in range(COUNT)]
            ours.set_attr("layout", layouts)
            theirs.set_attr("layout", layouts)
        obs, rewards, terminations, truncations, infos = result = ours.step(actions)
        assert_all_same(result, theirs.step(actions))
        deliveries += int((rewards >= 20).sum())
        terminated += int(terminations.sum())
        truncated += int(truncations.sum())
        done = terminations | truncations
        if mode == AutoresetMode.DISABLED and done.any():
            obs, infos = again = ours.reset(options={"reset_mask": done.copy()})
            assert_all_same(again, theirs.reset(options={"reset_mask": done.copy()}))
            # A masked reset says nothing of the other games: what the player is told of them is from the step before.
            told = infos, result[-1]
            infos = {key: np.array([told[0 if over else 1][key][i] for i, over in enumerate(done)]) for key in TOLD}
    assert ours.get_attr("layout") == theirs.get_attr("layout")
    assert ours.call("goals") == theirs.call("goals")
    assert ours.call("view") == theirs.call("view")
    assert deliveries > 10
    assert terminated + truncated > 10
    assert truncated > 0
    ours.close()
    theirs.close()


def test_goals_have_names():
    ours, theirs = make_both(AutoresetMode.NEXT_STEP, layouts="random")
    ours.reset(seed=0)
    theirs.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(200):
        named = tuple(ours.goals(i) for i in range(COUNT))
        assert named == ours.call("goals") == theirs.call("goals")
        assert np.array_equal(ours.call("goal_names"), theirs.call("goal_names"))
        actions = rng.integers(6, size=COUNT)
        infos = ours.step(actions)[4]
        theirs.step(actions)
        masked = zip(ours.call("goal_names"), infos["goal_mask"], strict=True)
        assert ours.call("goals") == tuple(tuple(names[mask].tolist()) for names, mask in masked)


def test_one_game_looks_like_an_environment():
    ours, theirs = make_both(AutoresetMode.NEXT_STEP, layouts="random")
    ours.reset(seed=0)
    theirs.reset(seed=0)
    game, env = ours.game(2), theirs.envs[2].unwrapped
    assert (game.layout, game.goals, game.view()) == (env.layout, env.goals, env.view())
    assert all(np.array_equal(a, b) for a, b in zip(game.arrays(), env.arrays(), strict=True))
    assert game.np_random_seed == env.np_random_seed
    assert game.action_space == env.action_space
    assert game.observation_space == env.observation_space
    assert game.get_keys_to_action() == env.get_keys_to_action()
    with pytest.raises(AttributeError, match="nonsense"):
        _ = game.nonsense


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_random_play_is_the_same_for_long(mode):
    rng = np.random.default_rng(1)
    kitchens = [any_kitchen(rng) for _ in range(40)]
    kitchens = [k for k in kitchens if k.shape == kitchens[0].shape] or kitchens[:1]
    ours, theirs = make_both(mode, steps=37, shape=kitchens[0].shape, layouts=kitchens, cook_time=2)
    assert_all_same(ours.reset(seed=0), theirs.reset(seed=0))
    for _ in range(400):
        actions = rng.integers(6, size=COUNT)
        result = ours.step(actions)
        assert_all_same(result, theirs.step(actions))
        done = result[2] | result[3]
        if mode == AutoresetMode.DISABLED and done.any():
            assert_all_same(
                ours.reset(options={"reset_mask": done.copy()}), theirs.reset(options={"reset_mask": done.copy()})
            )


def test_rgb_observations_are_the_same():
    ours, theirs = make_both(AutoresetMode.SAME_STEP, steps=5, obs_type="rgb")
    assert_all_same(ours.reset(seed=0), theirs.reset(seed=0))
    rng = np.random.default_rng(0)
    for _ in range(12):
        actions = rng.integers(6, size=COUNT)
        assert_all_same(ours.step(actions), theirs.step(actions))


@pytest.mark.parametrize("render_mode", ["rgb_array", "ansi"])
def test_rendering_is_the_same(render_mode):
    ours, theirs = make_both(AutoresetMode.NEXT_STEP, render_mode=render_mode)
    ours.reset(seed=0)
    theirs.reset(seed=0)
    for a, b in zip(ours.render(), theirs.render(), strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(ours.call("render"), theirs.call("render"), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.usefixtures("no_screen")
def test_a_window_shows_all_games():
    envs = gym.make_vec(NAME, num_envs=3, vectorization_mode="vector_entry_point", render_mode="human")
    envs.metadata["render_fps"] = 1000
    envs.reset(seed=0)
    envs.step(np.zeros(3, dtype=int))
    assert envs.render() is None
    envs.close()
    envs.close()


def test_make_vec_warns_of_nothing_and_has_the_limit_of_the_spec():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = gym.make_vec(NAME, num_envs=2)
    assert type(envs.unwrapped).__name__ == "OvercookedVectorEnv"
    assert envs.max_episode_steps == 1200
    envs.reset(seed=0)
    for step in range(1, 1201):
        _, _, _, truncations, _ = envs.step(np.full(2, 4))
        assert truncations.all() == (step == 1200)
    endless = gym.make_vec(NAME, num_envs=1, max_episode_steps=-1)
    endless.reset()
    for _ in range(1300):
        assert not endless.step(np.array([4]))[3].any()


def test_layouts_are_sticky():
    kitchen = OvercookedLayout.from_ascii(TWO_POTS)
    envs = gym.make_vec(NAME, num_envs=2, max_episode_steps=3)
    before = envs.get_attr("layout")[0]
    _, infos = envs.reset(options={"layout": kitchen})
    assert list(infos["layout_id"]) == [int(kitchen.layout_id, 16)] * 2
    for _ in range(8):
        infos = envs.step(np.full(2, 4))[4]
    assert list(infos["layout_id"]) == [int(kitchen.layout_id, 16)] * 2
    envs.set_attr("layout", [None, kitchen])
    _, infos = envs.reset()
    assert list(infos["layout_id"]) == [int(before.layout_id, 16), int(kitchen.layout_id, 16)]
    _, infos = envs.reset(options={"layout": None})
    assert list(infos["layout_id"]) == [int(before.layout_id, 16)] * 2


def test_nothing_returned_is_returned_again():
    envs = gym.make_vec(NAME, num_envs=2)
    results = [envs.reset(seed=0)] + [(r[0], r[4]) for r in (envs.step(np.array([0, 1])) for _ in range(3))]
    kept = copy.deepcopy(results)
    for obs, infos in results:
        obs[:] = 9
        for value in infos.values():
            value[:] = 0
    again = gym.make_vec(NAME, num_envs=2)
    again.reset(seed=0)
    for _ in range(3):
        again.step(np.array([0, 1]))
    assert_all_same(envs.step(np.array([2, 3])), again.step(np.array([2, 3])))
    assert not np.array_equal(kept[0][0], results[0][0])


def test_bad_input_is_named():
    envs = gym.make_vec(NAME, num_envs=3, autoreset_mode=AutoresetMode.DISABLED, max_episode_steps=1)
    with pytest.raises(ResetNeeded):
        envs.step(np.zeros(3, dtype=int))
    envs.reset(seed=0)
    for actions in (np.zeros(2, dtype=int), np.array([0, 1, 6]), np.array([0, -1, 2]), np.zeros(3)):
        with pytest.raises(ValueError, match="action"):
            envs.step(actions)
    envs.step([0, 1, 2])
    with pytest.raises(ResetNeeded, match=r"\[0, 1, 2\]"):
        envs.step([0, 1, 2])
    with pytest.raises(ValueError, match="colour"):
        envs.reset(options={"colour": "red"})
    with pytest.raises(ValueError, match=r"`seed` must be .* each of 3 environments, got \[1, 2\]"):
        envs.reset(seed=[1, 2])
    for mask in (np.zeros(3, dtype=bool), np.ones(2, dtype=bool), [True] * 3):
        with pytest.raises(ValueError, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})
    before = envs.get_attr("layout")
    with pytest.raises(LayoutError, match="shape"):
        envs.set_attr("layout", [TWO_POTS, "XXX\nX X\nXXX", None])
    with pytest.raises(LayoutError, match="row 3, column 0"):
        envs.reset(options={"layout": TWO_POTS.replace("F", "?")})
    assert envs.get_attr("layout") == before
    with pytest.raises(ValueError, match="got 2"):
        envs.set_attr("layout", [TWO_POTS] * 2)
    with pytest.raises(AttributeError, match="layout"):
        envs.set_attr("cook_time", 3)
    with pytest.raises(AttributeError, match="nonsense"):
        envs.get_attr("nonsense")
    for arguments in ({"render_mode": "poem"}, {"obs_type": "smell"}, {"max_episode_steps": 0}):
        with pytest.raises(ValueError, match="must"):
            gym.make_vec(NAME, num_envs=1, vectorization_mode="vector_entry_point", **arguments)


def test_spec_is_json_and_makes_the_same():
    layout = OvercookedLayout.from_ascii(TWO_POTS)
    envs = gym.make_vec(NAME, num_envs=2, layout=layout, autoreset_mode=AutoresetMode.SAME_STEP, recipes=(("fish",),))
    text = envs.spec.to_json()
    json.loads(text)
    again = gym.make_vec(EnvSpec.from_json(text))
    assert again.num_envs == 2
    assert again.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    assert_all_same(envs.reset(seed=0), again.reset(seed=0))


@pytest.mark.parametrize("copier", [copy.deepcopy, lambda envs: pickle.loads(pickle.dumps(envs))])
def test_copies_go_on_alone(copier):
    envs = gym.make_vec(NAME, num_envs=2, layouts="random", max_episode_steps=5)
    envs.reset(seed=0)
    envs.step(np.array([0, 1]))
    twin = copier(envs)
    rng = np.random.default_rng(0)
    for actions in rng.integers(6, size=(20, 2)):
        assert_all_same(envs.step(actions), twin.step(actions))


def test_random_generators_are_those_of_sync():
    ours, theirs = make_both(AutoresetMode.NEXT_STEP, layouts="random")
    ours.reset(seed=4)
    theirs.reset(seed=4)
    assert ours.np_random_seed == theirs.np_random_seed
    for a, b in zip(ours.np_random, theirs.np_random, strict=True):
        assert a.bit_generator.state == b.bit_generator.state
