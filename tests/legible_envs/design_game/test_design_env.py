"""Design as a game: rewards, masks and refusals against the workspace itself; arguments, layouts and pictures."""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.tabletop import TabletopWorkspace
from tests.legible_envs.environment_cases import DESIGN_ID, DESIGNED, RandomDesigner
from tests.support.shelf_workspace import ShelfWorkspace

SETTINGS: dict[str, dict[str, Any]] = {
    "kitchen": {"shape": (5, 5), "prefix": "sum"},
    "efficiency": {"shape": (5, 6), "objective": "legible-efficient", "max_distance": 110.0, "edits": 9},
    "table": {"workspace": "tabletop", "condition": "placement", "max_obstacles": 0, "levels": 5, "edits": 6},
    "continuous": {"workspace": "tabletop", "condition": "placement", "actions": "continuous", "step": 0.3},
    "continuous kitchen": {"shape": (5, 5), "actions": "continuous"},
    "shelf": {"workspace": ShelfWorkspace(), "edits": 7},
}
ENVS = {name: gym.make(DESIGN_ID, **arguments) for name, arguments in SETTINGS.items()}


def narrow(genomes: Any) -> Any:
    """An objective on shelves that does not allow most of them."""
    return np.where(np.asarray(genomes)[:, 0] < 4, -np.asarray(genomes)[:, 0].astype(float), np.nan)


def sample(env: Any, info: dict[str, Any], rng: np.random.Generator) -> Any:
    if "action_mask" in info:
        return RandomDesigner(env, int(rng.integers(2**32)))(None, info)
    return rng.uniform(-1, 1, env.action_space.shape)


@pytest.mark.parametrize("name", SETTINGS)
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rewards_add_up_to_what_the_design_gained(name: str, seed: int) -> None:
    env, rng = ENVS[name], np.random.default_rng(seed)
    game: Any = env.unwrapped
    objective = game.workspace.objective(
        SETTINGS[name].get("objective", "legibility"), max_distance=SETTINGS[name].get("max_distance")
    )
    _, info = env.reset(seed=seed)
    first, genomes, rewards, over = info, [info["genome"]], [], False
    while not over:
        before, action = info, sample(env, info, rng)
        _, reward, over, truncated, info = env.step(action)
        assert not truncated
        assert info["num_done"] == before["num_done"] + 1
        assert reward == info["objective"] - before["objective"]
        if "action_mask" in info and not before["action_mask"][action]:
            assert np.array_equal(info["genome"], before["genome"])
            assert reward == 0.0
            assert info["num_refused"] == before["num_refused"] + 1
        elif "action_mask" in info:
            edited = game.edits.apply(before["genome"][None], np.array([action]))[0]
            assert np.array_equal(info["genome"], edited)
            assert info["num_refused"] == before["num_refused"]
        genomes.append(info["genome"])
        rewards.append(reward)
    scores = objective(np.array(genomes))
    assert game.workspace.valid(np.array(genomes)).all()
    assert info["objective"] == pytest.approx(scores[-1], abs=1e-9)
    assert sum(rewards) == pytest.approx(scores[-1] - scores[0], abs=1e-9)
    assert first["objective"] == pytest.approx(scores[0], abs=1e-9)
    assert info["best"] == pytest.approx(scores.max(), abs=1e-9)
    assert objective(game.best_genome[None])[0] == pytest.approx(scores.max(), abs=1e-9)
    assert len(rewards) == game.num_edits


@pytest.mark.parametrize("name", [name for name in SETTINGS if "continuous" not in name])
def test_masks_are_exact(name: str) -> None:
    """Every edit is tried in a copy: those that are marked change the layout, the others are refused."""
    env: Any = ENVS[name].unwrapped
    _, info = env.reset(seed=3)
    for _ in range(2):
        mask = env.action_masks()
        assert mask.dtype == np.bool_
        assert np.array_equal(mask, info["action_mask"])
        for action in range(0, env.action_space.n, 1 + env.action_space.n // 60):
            twin = copy.copy(env)
            after = twin.step(action)[4]
            assert mask[action] == (action == 0 or not np.array_equal(after["genome"], info["genome"]))
            assert after["num_refused"] - info["num_refused"] == (not mask[action])
        info = env.step(int(np.flatnonzero(mask)[-1]))[4]


def test_layouts_without_a_score_are_not_entered() -> None:
    env: Any = gym.make(DESIGN_ID, workspace=ShelfWorkspace(), objective=narrow, edits=60).unwrapped
    _, info = env.reset(seed=0)
    rng, refused = np.random.default_rng(0), 0
    for _ in range(60):
        before, action = info, int(rng.choice(np.flatnonzero(info["action_mask"])))
        _, reward, _, _, info = env.step(action)
        assert info["genome"][0] < 4
        if info["num_refused"] > before["num_refused"]:
            refused += 1
            assert reward == 0.0
            assert np.array_equal(info["genome"], before["genome"])
    assert refused


def test_nothing_is_edited_after_the_end() -> None:
    env: Any = gym.make(DESIGN_ID, shape=(5, 5), edits=1).unwrapped
    env.reset(seed=0)
    _, _, over, _, info = env.step(0)
    assert over
    _, reward, over, _, again = env.step(int(np.flatnonzero(info["action_mask"])[-1]))
    assert (reward, over, again["num_done"]) == (0.0, True, 1)
    assert np.array_equal(again["genome"], info["genome"])


# -- what is observed --------------------------------------------------------------------------------------------------


def test_a_grid_shows_every_cell_and_how_the_design_stands() -> None:
    env = gym.make(DESIGN_ID, shape=(6, 7), edits=4)
    game: Any = env.unwrapped
    observation, info = env.reset(seed=5)
    rng = np.random.default_rng(5)
    for done in range(1, 5):
        observation, _, _, _, info = env.step(sample(env, info, rng))
        cells = game.workspace.decode(info["genome"]).cells
        assert np.array_equal(observation[..., :10].argmax(axis=-1), cells)
        assert (observation[..., :10].sum(axis=-1) == 1).all()
        assert (observation[..., 10] == np.float32(1 - done / 4)).all()
        mean, sd = game.problem.scale
        assert observation[..., 11] == pytest.approx(np.clip((info["objective"] - mean) / (10 * sd), -1, 1), abs=1e-6)


def test_vectors_tell_layouts_apart_and_line_up_with_the_edits() -> None:
    env = gym.make(DESIGN_ID, shape=(5, 5), obs_type="vector")
    game: Any = env.unwrapped
    observation, info = env.reset(seed=1)
    genome = info["genome"]
    assert observation.shape == (7 * 12 + 9 + 2,)
    for station in range(7):
        assert observation[12 * station : 12 * station + 12].tolist() == np.eye(12)[genome[station]].tolist()
    assert observation[84:93].tolist() == genome[7:].tolist()
    # The edit that would set a gene to the value it has is masked: the one-hot numbers are where the mask has zeros.
    held = np.flatnonzero(observation[:84])
    assert not game.action_masks()[1 + held].any()


def test_kitchens_know_their_cells() -> None:
    stations = ("onion", "dish", "pot", "serving")
    workspace = OvercookedWorkspace(shape=(6, 5), stations=stations, recipes=[["onion"]])
    genomes = workspace.sample(30, np.random.default_rng(0))
    cells = workspace.cells(genomes)
    assert cells.dtype == np.int8
    assert all(np.array_equal(cells[i], workspace.decode(genome).cells) for i, genome in enumerate(genomes))
    assert cells.max() < workspace.num_cell_codes


# -- layouts -----------------------------------------------------------------------------------------------------------


def test_start_layouts_are_sticky_in_every_form() -> None:
    env, workspace = gym.make(DESIGN_ID), OvercookedWorkspace()
    wanted = workspace.encode(DESIGNED)
    for form in (DESIGNED, OvercookedLayout.from_ascii(DESIGNED), wanted, wanted.tolist(), wanted.astype(float)):
        assert np.array_equal(env.reset(seed=0, options={"layout": form})[1]["genome"], wanted)
        assert np.array_equal(env.reset()[1]["genome"], wanted)
        assert env.unwrapped.layout == OvercookedLayout.from_ascii(DESIGNED)
        assert not np.array_equal(env.reset(options={"layout": None})[1]["genome"], wanted)
    env.unwrapped.layout = DESIGNED
    assert np.array_equal(env.reset()[1]["genome"], wanted)
    own = gym.make(DESIGN_ID, layout=DESIGNED)
    other = workspace.sample(1, np.random.default_rng(0))[0]
    assert np.array_equal(own.reset(options={"layout": other})[1]["genome"], other)
    assert np.array_equal(own.reset(options={"layout": None})[1]["genome"], wanted)


def test_a_workspace_that_starts_from_a_layout_starts_there() -> None:
    env = gym.make(DESIGN_ID, start_from=DESIGNED)
    assert np.array_equal(env.reset(seed=1)[1]["genome"], OvercookedWorkspace().encode(DESIGNED))


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_every_environment_of_a_vector_starts_from_its_layout(mode: str) -> None:
    workspace = OvercookedWorkspace(shape=(5, 5))
    genomes = workspace.sample(2, np.random.default_rng(0))
    envs = gym.make_vec(DESIGN_ID, num_envs=2, vectorization_mode=mode, shape=(5, 5))
    try:
        assert np.array_equal(envs.reset(seed=0, options={"layout": genomes})[1]["genome"], genomes)
        layouts = [workspace.decode(genome) for genome in genomes[::-1]]
        assert np.array_equal(envs.reset(options={"layout": layouts})[1]["genome"], genomes[::-1])
        envs.set_attr("layout", list(genomes))
        assert np.array_equal(envs.reset(options={"layout": [None, genomes[0]]})[1]["genome"], genomes[[0, 0]])
    finally:
        envs.close()


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ("XXX", "expected|cells|rows"),
        (3.5, r"`layout` must be a layout of workspace 'overcooked', its text, or a genome of 32 numbers, got 3.5"),
        (np.zeros(5), r"expected a genome of shape \(32,\), got \(5,\)"),
        (np.zeros(32), "tomato and onion both at"),
        ({"a": 1}, "`layout` must be a layout"),
    ],
)
def test_bad_layouts_are_refused_and_change_nothing(layout: Any, message: str) -> None:
    env = gym.make(DESIGN_ID)
    before = env.reset(seed=0)[1]
    with pytest.raises(LayoutError, match=message):
        env.reset(seed=1, options={"layout": layout})
    assert np.array_equal(env.step(0)[4]["genome"], before["genome"])


# -- arguments ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"workspace": "garden"}, "no workspace named 'garden'"),
        ({"workspace": 3}, "`workspace` must be a name"),
        ({"colour": "red"}, r"unknown settings \['colour'\] of workspace 'overcooked'"),
        ({"workspace": ShelfWorkspace(), "shape": (5, 5)}, r"settings \['shape'\] are for a workspace given by name"),
        ({"objective": "beauty"}, "unknown objective 'beauty'"),
        ({"objective": "no.such:function"}, "objective 'no.such:function' cannot be imported"),
        ({"objective": 3}, "`objective` must be one of"),
        ({"max_distance": 0}, "`max_distance`"),
        ({"edits": 0}, "`edits` must be"),
        ({"actions": "clicks"}, "`actions` must be 'discrete' or 'continuous'"),
        ({"actions": "continuous", "step": 2}, "`step` must be"),
        ({"levels": 1}, "`levels` must be"),
        ({"obs_type": "rgb"}, "`obs_type` must be"),
        ({"workspace": "tabletop", "obs_type": "grid"}, "'grid' needs a workspace with `cells`"),
        ({"render_mode": "poem"}, "`render_mode` must be"),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gym.make(DESIGN_ID, **arguments)


@pytest.mark.parametrize("action", [-1, 187, 1.5, "left", None, True, np.zeros(2)])
def test_actions_that_are_none_are_refused(action: Any) -> None:
    env: Any = gym.make(DESIGN_ID).unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match="an action must be an integer from 0 to 186"):
        env.step(action)


@pytest.mark.parametrize("action", [0, np.zeros(3), np.full(32, np.nan), "left"])
def test_steps_that_are_none_are_refused(action: Any) -> None:
    env: Any = gym.make(DESIGN_ID, **SETTINGS["continuous"]).unwrapped
    env.reset(seed=0)
    assert not hasattr(env, "action_masks")
    with pytest.raises(ValueError, match=r"an action must be finite numbers of shape \(\d+,\)"):
        env.step(action)


def test_an_objective_that_breaks_its_contract_is_named() -> None:
    for wrong, message in (
        (lambda g: np.zeros(3), "one number per genome"),
        (lambda g: np.full(len(g), np.inf), "inf"),
    ):
        with pytest.raises(ValueError, match=message):
            gym.make(DESIGN_ID, workspace=ShelfWorkspace(), objective=wrong).reset(seed=0)
    with pytest.raises(LayoutError, match="none of 1,000 random layouts has a score"):
        gym.make(DESIGN_ID, max_distance=1e-6).reset(seed=0)


def test_continuous_actions_move_keys_of_valid_layouts() -> None:
    env = gym.make(DESIGN_ID, **SETTINGS["continuous"])
    game: Any = env.unwrapped
    check_env(game, skip_render_check=True)
    keys, _ = env.reset(seed=2)
    action = np.linspace(-1, 1, 32)
    after, _, _, _, info = env.step(action)
    assert after[:-2] == pytest.approx(np.clip(keys[:-2] + 0.3 * action, 0, 1), abs=1e-6)
    assert np.allclose(game.workspace.continuous().decode(after[:-2].astype(float)), info["genome"], atol=1e-4)


@pytest.mark.parametrize(
    "arguments",
    [
        {"workspace": OvercookedWorkspace(shape=(5, 6), prefix="sum"), "layout": None},
        {"layout": OvercookedLayout.from_ascii(DESIGNED)},
        {"workspace": TabletopWorkspace(), "layout": TabletopWorkspace().baseline, "levels": 3},
        {"workspace": f"{ShelfWorkspace.__module__}:ShelfWorkspace", "objective": narrow},
        {**SETTINGS["continuous"], "edits": 3},
    ],
)
def test_specs_go_through_json(arguments: dict[str, Any]) -> None:
    env = gym.make(DESIGN_ID, **arguments)
    assert env.spec is not None
    text = env.spec.to_json()
    json.loads(text)
    twin = gym.make(EnvSpec.from_json(text))
    rng = np.random.default_rng(0)
    (first, info), (second, again) = env.reset(seed=4), twin.reset(seed=4)
    for _ in range(3):
        assert np.array_equal(first, second)
        assert all(np.array_equal(info[key], again[key]) for key in info)
        action = sample(env, info, rng)
        (first, *_, info), (second, *_, again) = env.step(action), twin.step(action)


def test_it_pickles_in_mid_episode() -> None:
    env: Any = gym.make(DESIGN_ID, **SETTINGS["continuous"]).unwrapped
    env.reset(seed=0)
    env.step(np.full(32, 0.5))
    twin = pickle.loads(pickle.dumps(env))
    assert np.array_equal(env.step(np.full(32, -0.25))[0], twin.step(np.full(32, -0.25))[0])


# -- pictures ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["kitchen", "table", "shelf"])
def test_pictures_show_the_design(name: str) -> None:
    env = gym.make(DESIGN_ID, render_mode="rgb_array", **SETTINGS[name])
    _, info = env.reset(seed=0)
    before = env.render()
    assert before.dtype == np.uint8
    env.step(int(np.flatnonzero(info["action_mask"])[-1]))
    after = env.render()
    assert after.shape == before.shape
    assert not np.array_equal(before[40:], after[40:])  # below the line of text, too


@pytest.mark.parametrize("name", ["kitchen", "table", "shelf"])
def test_text_shows_the_design(name: str) -> None:
    env = gym.make(DESIGN_ID, render_mode="ansi", **SETTINGS[name])
    _, info = env.reset(seed=0)
    before = env.render()
    layout = env.unwrapped.workspace.decode(info["genome"])
    assert before.endswith(f"edit 0 of {env.unwrapped.num_edits}, legibility {info['objective']:.2f}")
    if name == "kitchen":
        assert before.startswith(layout.to_ascii())
    env.step(int(np.flatnonzero(info["action_mask"])[-1]))
    assert env.render() != before


@pytest.mark.usefixtures("no_screen")
def test_a_window_shows_every_edit() -> None:
    env = gym.make(DESIGN_ID, shape=(5, 5), render_mode="human")
    env.reset(seed=0)
    env.step(0)
    assert env.render() is None
    env.close()


# -- learners ----------------------------------------------------------------------------------------------------------


def test_maskable_ppo_takes_it_as_it_is() -> None:
    contrib = pytest.importorskip("sb3_contrib")
    env = gym.make(DESIGN_ID, shape=(5, 5), obs_type="vector", edits=8)
    model = contrib.MaskablePPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0).learn(64)
    observation, info = env.reset(seed=1)
    for _ in range(8):
        action, _ = model.predict(observation, action_masks=info["action_mask"])
        assert info["action_mask"][action]
        observation, _, _, _, info = env.step(action)
    assert info["num_refused"] == 0
