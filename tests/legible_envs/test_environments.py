"""The contract of every registered environment in its main variants: one suite, whatever is built in it."""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env, data_equivalence

from legible_envs.rollouts import RecordTrajectories, load_trajectories, save_trajectories
from tests.legible_envs.environment_cases import (
    ALL_IDS,
    CASES,
    DEFAULTS,
    DESIGN_ID,
    EVERY,
    FORMS,
    IDS,
    KINDS,
    KITCHEN_ID,
    TABLE_ID,
    Case,
    digest,
    episode,
    results_of,
    rollout,
)
from tests.legible_envs.tabletop.table_envs import TASK

COPIERS = {"deepcopy": copy.deepcopy, "pickle": lambda env: pickle.loads(pickle.dumps(env))}
PLAYED = [pytest.param(case, policy, id=f"{case}-{policy}") for case in CASES for policy in case.kind.policies]
VECTORS = ["sync", "async", "vector_entry_point"]


def same(first: Any, second: Any) -> bool:
    return data_equivalence(first, second, exact=True)


def number(layout: Any) -> int:
    """What infos call a layout."""
    return int(layout.layout_id, 16)


def in_a_new_process(code: str, **environment: str) -> str:
    command = [sys.executable, "-c", code]
    environ = {**os.environ, **environment}
    result = subprocess.run(command, env=environ, capture_output=True, text=True, timeout=240, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


# -- being registered --------------------------------------------------------------------------------------------------


def test_kitchen_table_and_design_are_registered() -> None:
    assert sorted([KITCHEN_ID, TABLE_ID, DESIGN_ID]) == ALL_IDS == sorted(KINDS)


@pytest.mark.parametrize("name", ALL_IDS)
def test_made_without_importing(name: str) -> None:
    code = f"import gymnasium; print(gymnasium.make('legible_envs:{name}').spec.id)"
    assert in_a_new_process(code) == name


def test_import_is_light() -> None:
    heavy = ["numba", "ribs", "sklearn", "torch", "pymunk", "pygame", "pandas", "scipy", "networkx", "pydantic", "yaml"]
    packages = "legible_envs, legible_envs.overcooked, legible_envs.tabletop"
    code = f"import sys, {packages}; print([m for m in {heavy} if m in sys.modules])"
    assert in_a_new_process(code) == "[]"


# -- what Gymnasium asks -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", EVERY, ids=str)
def test_gymnasium_finds_nothing_wrong(case: Case) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = case.make()
        check_env(env.unwrapped, skip_render_check=True)
        results = rollout(case, env, 0)
    assert all(env.observation_space.contains(result[0]) for result in results)
    assert {len(result) for result in results} == {2, 5}


@pytest.mark.parametrize("case", EVERY, ids=str)
def test_same_seed_same_episode(case: Case) -> None:
    first, second = (rollout(case, case.make(), 5) for _ in range(2))
    assert same(first, second)


@pytest.mark.parametrize("name", ["kitchen-random", "table-robot", "design"])
def test_episodes_are_the_same_in_a_new_process(name: str) -> None:
    code = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from tests.legible_envs.environment_cases import BY_NAME, digest
print(digest(BY_NAME[{name!r}]))
"""
    case = next(case for case in EVERY if case.name == name)
    assert in_a_new_process(code, PYTHONHASHSEED="7") == digest(case)


@pytest.mark.parametrize("case", EVERY, ids=str)
@pytest.mark.parametrize("copier", COPIERS.values(), ids=COPIERS)
def test_copies_made_in_mid_episode_go_on_alone(case: Case, copier: Any) -> None:
    env = case.make()
    last = rollout(case, env, 2, 75)[-1]
    twin = copier(env)
    ahead, after = (results_of(e, case.kind.random(e, 1), last, 75) for e in (env, twin))
    assert same(ahead, after)
    assert same(env.reset(), twin.reset())


@pytest.mark.parametrize("case", [*EVERY, *FORMS], ids=str)
def test_spec_goes_through_json(case: Case) -> None:
    env = case.make()
    assert env.spec is not None
    text = env.spec.to_json()
    json.loads(text)
    again = gym.make(EnvSpec.from_json(text))
    assert same(rollout(case, env, 3, 40), rollout(case, again, 3, 40))


def test_spec_keeps_what_a_task_file_says(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    TASK.to_yaml(path)
    spec = gym.make(TABLE_ID, task=path).spec
    assert spec is not None
    assert gym.make(EnvSpec.from_json(spec.to_json())).unwrapped.task == TASK


def test_nothing_is_played_before_the_first_reset(plain: Case) -> None:
    env = plain.make()
    with pytest.raises(ResetNeeded):
        env.step(plain.kind.still)
    env.reset(seed=0)
    assert plain.make(disable_env_checker=True).reset(seed=0)[1].keys() == env.step(plain.kind.still)[4].keys()


def test_truncated_at_the_limit_of_the_spec(plain: Case) -> None:
    env = plain.make()
    assert env.spec is not None
    limit = env.spec.max_episode_steps
    assert limit == {KITCHEN_ID: 1200, TABLE_ID: 1800}[plain.env_id]
    env.reset(seed=0)
    for step in range(1, limit + 1):
        _, _, terminated, truncated, _ = env.step(plain.kind.still)
        assert not terminated
        assert truncated == (step == limit)


# -- pictures ----------------------------------------------------------------------------------------------------------


def test_pictures_change_and_are_fresh(plain: Case) -> None:
    env = plain.make(render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before.dtype == np.uint8
    assert before.ndim == 3
    env.step(plain.kind.move)
    after = env.render()
    assert after.shape == before.shape
    assert not np.shares_memory(before, after)
    assert not np.array_equal(before, after)


@pytest.mark.usefixtures("no_screen")
def test_every_render_mode_passes_the_check(plain: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = plain.make()
        assert set(env.metadata["render_modes"]) >= {"human", "rgb_array"}
        monkeypatch.setitem(env.unwrapped.metadata, "render_fps", 1000)
        check_env(env.unwrapped)


@pytest.mark.usefixtures("no_screen")
def test_a_window_opens_with_the_episode_and_closes_once(plain: Case) -> None:
    import pygame

    pygame.display.quit()
    env = plain.make(render_mode="human")
    assert not pygame.display.get_init()
    env.reset(seed=0)
    assert pygame.display.get_surface() is not None
    env.step(plain.kind.move)
    assert env.render() is None
    twin = copy.deepcopy(env)
    env.close()
    assert not pygame.display.get_init()
    env.close()
    twin.close()


def test_rendering_without_a_mode_warns(plain: Case) -> None:
    env = plain.make().unwrapped
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_unknown_render_modes_are_named(plain: Case) -> None:
    with pytest.raises(ValueError, match=r"`render_mode` must be None or .*'rgb_array'.*, got 'poem'"):
        type(plain.make().unwrapped)(render_mode="poem")


def test_text_says_where_the_game_stands() -> None:
    env = gym.make(KITCHEN_ID, render_mode="ansi")
    env.reset(seed=0)
    before = env.render()
    env.step(KINDS[KITCHEN_ID].move)
    after = env.render()
    assert isinstance(before, str)
    assert isinstance(after, str)
    assert before != after


# -- layouts and options -----------------------------------------------------------------------------------------------


def test_layouts_are_sticky_until_replaced(plain: Case) -> None:
    env, other, still = plain.make(), plain.kind.other, plain.kind.still
    default = env.get_wrapper_attr("layout")
    assert default != other
    assert env.reset(options={"layout": other})[1]["layout_id"] == number(other)
    assert env.reset()[1]["layout_id"] == number(other)
    env.set_wrapper_attr("layout", default)
    assert env.step(still)[4]["layout_id"] == number(other)
    assert env.get_wrapper_attr("layout") == default
    assert env.reset()[1]["layout_id"] == number(default)
    env.reset(options={"layout": other})
    assert env.reset(options={"layout": None})[1]["layout_id"] == number(default)


@pytest.mark.parametrize("case", EVERY, ids=str)
def test_unknown_options_are_named_and_change_nothing(case: Case) -> None:
    env, twin = case.make(), case.make()
    for e in (env, twin):
        e.reset(seed=0)
        e.step(case.kind.move)
    with pytest.raises(ValueError, match=r"colour.*layout"):
        env.reset(options={"colour": 3})
    assert same(env.step(case.kind.move), twin.step(case.kind.move))
    assert same(env.reset(), twin.reset())


# -- infos -------------------------------------------------------------------------------------------------------------


def test_infos_are_numbers_of_one_structure(case: Case) -> None:
    """So that any wrapper can stack, convert and record them."""
    env = case.make()
    infos = [result[-1] for result in rollout(case, env, 1, 150)]
    for info in infos:
        assert list(info) == list(infos[0])
        assert type(info["num_done"]) is int
        assert info["layout_id"] == number(env.unwrapped.view().layout)
        for name, value in info.items():
            assert type(value) is type(infos[0][name])
            assert isinstance(value, int | float | np.ndarray), name
            if isinstance(value, np.ndarray):
                assert value.dtype.kind in "bif"
                assert (value.shape, value.dtype) == (infos[0][name].shape, infos[0][name].dtype)


@pytest.mark.parametrize("case", EVERY, ids=str)
def test_nothing_returned_is_returned_again(case: Case) -> None:
    results = rollout(case, case.make(), 4, 20)
    arrays = [a for r in results for a in (r[0], *r[-1].values()) if isinstance(a, np.ndarray)]
    assert not any(np.shares_memory(a, b) for i, a in enumerate(arrays) for b in arrays[:i])
    assert len({id(result[-1]) for result in results}) == len(results)


@pytest.mark.parametrize("case", EVERY, ids=str)
def test_what_a_user_does_to_results_changes_no_episode(case: Case) -> None:
    env, twin = case.make(), case.make()
    for e in (env, twin):
        observation, info = e.reset(seed=0)
        for _ in range(5):
            if e is env:
                observation[...] = 0
                for value in info.values():
                    if isinstance(value, np.ndarray):
                        value[...] = 0
                    elif isinstance(value, dict):
                        value.clear()
                info.clear()
            observation, _, _, _, info = e.step(case.kind.move)
    assert same(env.step(case.kind.still), twin.step(case.kind.still))


def test_goals_are_named_as_they_are_marked(case: Case) -> None:
    """Where policies are disturbed by random actions, too."""
    env, rng = case.make(), np.random.default_rng(0)
    policy, random = next(iter(case.kind.policies.values()))(env), case.kind.random(env, 0)
    game: Any = env.unwrapped
    observation, info = env.reset(seed=0)
    for _ in range(600):
        assert game.goals == case.kind.marked(game.view().layout, info["goal_mask"])
        assert sorted(game.goals) == sorted(game.goal_names[info["goal_mask"]].tolist())
        action = (policy if rng.random() < 0.8 else random)(observation, info)
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            observation, info = env.reset()


@pytest.mark.parametrize(("case", "policy"), PLAYED)
def test_policies_finish_an_episode(case: Case, policy: str) -> None:
    env = case.make()
    game: Any = env.unwrapped
    player = case.kind.policies[policy](env)

    def check(observation: Any, info: dict[str, Any]) -> Any:
        assert game.goals == case.kind.marked(game.layout, info["goal_mask"])
        action = player(observation, info)
        assert env.action_space.contains(action) or np.issubdtype(type(action), np.integer)
        return action

    results = episode(env, check)
    done = [result[-1]["num_done"] for result in results]
    assert [result[2] for result in results[1:]] == [False] * (len(results) - 2) + [True]
    assert not any(result[3] for result in results[1:])
    assert done[0] == 0
    assert done == sorted(done)
    assert done[-1] == case.kind.subtasks(game)
    assert game.goals == ()
    assert not results[-1][-1]["goal_mask"].any()


# -- recording ---------------------------------------------------------------------------------------------------------


def test_what_is_played_is_recorded(case: Case, tmp_path: Path) -> None:
    env = RecordTrajectories(case.make(), participant="p1", condition="both")
    policy = next(iter(case.kind.policies.values()))(env)
    steps = len(episode(env, policy, seed=3)) - 1
    played: Any = env.unwrapped
    trajectories = env.trajectories()
    assert trajectories == played.trajectories(participant="p1", condition="both") != []
    for trajectory in trajectories:
        assert (trajectory.participant, trajectory.condition) == ("p1", "both")
        assert trajectory.layout == played.layout
        assert trajectory.goal in trajectory.candidates
    assert load_trajectories(save_trajectories(tmp_path / "played.npz", trajectories)) == trajectories
    assert [len(recorded) for recorded in env.episodes] == [steps]


def test_recorded_actions_play_the_episode_again(case: Case) -> None:
    env = RecordTrajectories(case.make(max_episode_steps=100))
    results = episode(env, case.kind.random(env, 3), seed=3)
    (recorded,) = env.episodes
    twin = case.make()
    again = [twin.reset(seed=recorded.seed, options=dict(recorded.options))]
    again += [twin.step(action) for action in recorded.actions]
    assert same([result[0] for result in again], [result[0] for result in results])
    assert [result[1] for result in again[1:]] == recorded.rewards


def test_minari_collects_infos_too(plain: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whole episodes, so that goals come and go; what is read back is what was returned."""
    minari = pytest.importorskip("minari")
    pytest.importorskip("jax", reason="Minari's collector needs its extra `create`")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    arguments = {"partner": "robot"} if plain.env_id == TABLE_ID else {}
    env = minari.DataCollector(plain.make(**arguments), record_infos=True)
    results = [episode(env, next(iter(plain.kind.policies.values()))(env), seed) for seed in range(2)]
    named = env.create_dataset("legible/test-v0", author="a", code_permalink="b", author_email="c", algorithm_name="d")
    for recorded, played in zip(named.iterate_episodes(), results, strict=True):
        for name, values in recorded.infos.items():
            assert np.array_equal(values, [result[-1][name] for result in played])
        assert set(recorded.infos) == set(played[0][-1])
    env.close()


# -- action masks ------------------------------------------------------------------------------------------------------


def test_masks_allow_what_does_something() -> None:
    """An action that is masked leaves the game as it is; one that is allowed, staying aside, does not."""
    env = gym.make(KITCHEN_ID, layout=KINDS[KITCHEN_ID].other, virtual_obstacles="soft")
    game: Any = env.unwrapped
    policy, random = KINDS[KITCHEN_ID].policies["scripted"](env), np.random.default_rng(0)
    observation, info = env.reset(seed=0)
    for _ in range(60):
        masks = env.get_wrapper_attr("action_masks")()
        assert (masks.shape, masks.dtype) == ((6,), np.bool_)
        assert np.array_equal(masks, info["action_mask"])
        twins: Any = [copy.deepcopy(game) for _ in range(6)]
        views = [(twin.step(action), twin.view())[1] for action, twin in enumerate(twins)]
        assert masks.tolist() == [action == 4 or view != views[4] for action, view in enumerate(views)]
        action = policy(observation, info) if random.random() < 0.8 else int(random.integers(6))
        observation, _, over, _, info = env.step(action)
        if over:
            observation, info = env.reset()


@pytest.mark.parametrize("mode", VECTORS)
def test_masks_of_vectors_are_those_of_their_environments(mode: str) -> None:
    envs = gym.make_vec(KITCHEN_ID, num_envs=3, vectorization_mode=mode, layouts="random")
    try:
        envs.reset(seed=0)
        rng = np.random.default_rng(0)
        for _ in range(30):
            infos = envs.step(rng.integers(6, size=3))[4]
            masks = envs.call("action_masks")
            assert np.array_equal(masks, infos["action_mask"])
            if mode == "vector_entry_point":
                assert np.array_equal(envs.action_masks(), masks)
    finally:
        envs.close()


def test_a_table_offers_no_masks() -> None:
    assert not gym.make(TABLE_ID).has_wrapper_attr("action_masks")


# -- vectors -----------------------------------------------------------------------------------------------------------


def vector_and_singles(case: Case, mode: str, **more: Any) -> tuple[Any, list[Any]]:
    """Two environments in a vector, and the same two by themselves."""
    envs = gym.make_vec(case.env_id, num_envs=2, vectorization_mode=mode, **case.arguments, **more)
    return envs, [case.make(**more) for _ in range(2)]


def assert_infos_agree(infos: dict[str, Any], singles: list[dict[str, Any]]) -> None:
    """A vector's infos are those of its environments."""
    assert infos.keys() == {*singles[0], *(f"_{name}" for name in singles[0])}
    for name in singles[0]:
        for i, info in enumerate(singles):
            assert np.array_equal(infos[name][i], info[name]), name
            assert infos[f"_{name}"][i]


def agree(case: Case, mode: str, steps: int, **more: Any) -> None:
    """Play a vector and its environments by themselves side by side, over the end of episodes."""
    envs, singles = vector_and_singles(case, mode, **more)
    try:
        assert envs.single_observation_space == singles[0].observation_space
        assert envs.single_action_space == singles[0].action_space
        observations, infos = envs.reset(seed=[3, 4])
        results = [env.reset(seed=seed) for env, seed in zip(singles, (3, 4), strict=True)]
        policies = [case.kind.random(env, i) for i, env in enumerate(singles)]
        for _ in range(steps):
            assert all(np.array_equal(observations[i], results[i][0]) for i in range(2))
            assert_infos_agree(infos, [result[-1] for result in results])
            if case.env_id in IDS:
                assert envs.call("goals") == tuple(env.unwrapped.goals for env in singles)
            actions = [policies[i](*results[i][:: len(results[i]) - 1]) for i in range(2)]
            results = [
                (*env.reset(),) if len(result) == 5 and (result[2] or result[3]) else env.step(action)
                for env, result, action in zip(singles, results, actions, strict=True)
            ]
            observations, rewards, terminations, truncations, infos = envs.step(np.array(actions))
            for i, result in enumerate(results):
                expected = result[1:4] if len(result) == 5 else (0.0, False, False)
                assert (rewards[i], terminations[i], truncations[i]) == expected
    finally:
        envs.close()


@pytest.mark.parametrize("case", EVERY, ids=str)
def test_synchronous_vectors_agree_with_the_single_environment(case: Case) -> None:
    agree(case, "sync", 50, max_episode_steps=20)


@pytest.mark.parametrize(
    "case",
    [case for case in CASES if gym.spec(case.env_id).vector_entry_point is not None],
    ids=str,
)
def test_vector_entry_points_agree_with_the_single_environment(case: Case) -> None:
    agree(case, "vector_entry_point", 50, max_episode_steps=20)


@pytest.mark.parametrize("case", [*DEFAULTS, *(c for c in EVERY if c.name in ("table-robot", "design"))], ids=str)
def test_asynchronous_vectors_agree_with_the_single_environment(case: Case) -> None:
    agree(case, "async", 25, max_episode_steps=10)


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_every_environment_of_a_vector_has_its_layout(plain: Case, mode: str) -> None:
    envs, (single, _) = vector_and_singles(plain, mode)
    try:
        layouts = [plain.kind.other, single.get_wrapper_attr("layout")]
        envs.reset(seed=0)
        envs.set_attr("layout", layouts)
        _, infos = envs.reset()
        assert infos["layout_id"].tolist() == [number(layout) for layout in layouts]
        envs.step(np.array([plain.kind.still] * 2))
        assert envs.get_attr("layout") == tuple(layouts)
    finally:
        envs.close()
