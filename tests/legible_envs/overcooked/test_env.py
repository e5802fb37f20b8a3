"""The kitchen as an environment: layouts in every form, arguments, the rules of the game, observations."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError, TaskError
from legible_envs.overcooked import PAPER_SOUPS, OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.env import OvercookedEnv
from legible_envs.overcooked.game.observations import GRID_CHANNELS, NUM_FEATURES
from legible_envs.overcooked.layout import STATION_TYPES
from legible_envs.overcooked.layouts import RandomLayouts, read_layout
from legible_envs.overcooked.policies import ScriptedPlayer
from tests.legible_envs.environment_cases import KITCHEN
from tests.oracles.kitchen_oracle import any_kitchen

NAME = "LegibleOvercooked-v0"


def number_of(layout):
    """What infos call a kitchen."""
    return int(layout.layout_id, 16)


# -- text and keys ----------------------------------------------------------------------------------------


def test_text():
    env = gym.make(NAME, render_mode="ansi", layout=KITCHEN)
    env.reset(seed=0)
    env.step(2)
    lines = env.render().split("\n")
    drawing = KITCHEN.replace("1", " ").split("\n")
    drawing[3] = "F  >  P"
    assert lines[:7] == drawing
    assert "player 1 holds nothing" in lines
    assert "pot (3,6): empty, waiting" in lines
    assert any(line.startswith("step 1,") for line in lines)


def test_keys_reach_every_action():
    keys = gym.make(NAME).get_wrapper_attr("get_keys_to_action")()
    assert set(keys.values()) == {0, 1, 2, 3, 5}
    assert keys[(ord("w"),)] == 0


@pytest.mark.filterwarnings("ignore:.*matplotlib")
@pytest.mark.usefixtures("no_screen")
def test_playable_by_hand():
    """``gymnasium.utils.play`` accepts the environment and its keys."""
    import pygame
    from gymnasium.utils.play import PlayableGame

    env = gym.make(NAME, render_mode="rgb_array")
    env.reset(seed=0)
    game = PlayableGame(env, None)
    assert (pygame.K_UP,) in gym.make(NAME).unwrapped.get_keys_to_action()
    assert pygame.K_SPACE in game.relevant_keys


# -- plain Python ------------------------------------------------------------------------------------------


def in_a_new_process(code: str, **environment: str) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_plays_as_plain_python():
    code = """
import gymnasium as gym, numpy as np, legible_envs
from legible_envs.overcooked.policies import ScriptedPlayer
env = gym.make("LegibleOvercooked-v0", recipes=[["onion"]], cook_time=1)
envs = gym.make_vec("LegibleOvercooked-v0", num_envs=2, obs_type="vector")
player = ScriptedPlayer(env, np.random.default_rng(0))
obs, info = env.reset(seed=0); envs.reset(seed=0)
over = False
while not over:
    obs, _, over, _, info = env.step(player(obs, info))
    envs.step(np.array([0, 5]))
print(info["deliveries"])
"""
    assert in_a_new_process(code, NUMBA_DISABLE_JIT="1") == "1"


# -- kitchens ---------------------------------------------------------------------------------------------


def test_kitchens_in_every_form():
    layout = OvercookedLayout.from_ascii(KITCHEN)
    workspace = OvercookedWorkspace(shape=(7, 7))
    genome = workspace.sample(1, np.random.default_rng(0))[0]
    env = gym.make(NAME)
    rows = KITCHEN.split("\n")
    forms = [layout, KITCHEN, rows, tuple(rows), [list(row) for row in rows], np.array([list(row) for row in rows])]
    for form in forms:
        assert env.reset(options={"layout": form})[1]["layout_id"] == number_of(layout)
    assert env.reset(options={"layout": layout.cells})[1]["layout_id"] == number_of(OvercookedLayout(layout.cells))
    for form in (genome, genome.tolist(), genome.astype(np.int64)):
        assert env.reset(options={"layout": form})[1]["layout_id"] == number_of(workspace.decode(genome))
        assert gym.make(NAME, layout=form).unwrapped.layout == workspace.decode(genome)


BAD_KITCHENS = {
    "ragged": (KITCHEN.replace("C     D", "C    D"), r"row 1 has 6 cells", (1, 0)),
    "symbol": (KITCHEN.replace("F 1", "Q 1"), "row 3, column 0", (3, 0)),
    "shape": ("XXXXX\nX   X\nXXXXX", r"\(7, 7\)", None),
    "station": (KITCHEN.replace("T", "X"), "no tomato station", None),
    "reachable": (
        KITCHEN.replace("X  V  X\nF 1", "X  V VX\nF 1").replace("C     D", "C    VD"),
        "row 1, column 6",
        (1, 6),
    ),
    "type": (3.5, "got float", None),
    "genome": (np.zeros(5, dtype=np.int8), "genome", None),
}


@pytest.mark.parametrize("case", BAD_KITCHENS)
def test_bad_kitchens_are_named_and_change_nothing(case):
    bad, message, cell = BAD_KITCHENS[case]
    env, twin = gym.make(NAME), gym.make(NAME)
    for e in (env, twin):
        e.reset(seed=0)
        e.step(2)
    with pytest.raises(LayoutError, match=message) as caught:
        env.reset(options={"layout": bad})
    assert caught.value.cell == cell
    with pytest.raises(LayoutError, match=message):
        env.unwrapped.layout = bad
    with pytest.raises(LayoutError, match=message):
        gym.make(NAME, shape=(7, 7), layout=bad)
    assert data_equivalence(env.step(1), twin.step(1), exact=True)
    assert env.reset()[1]["layout_id"] == twin.reset()[1]["layout_id"]


SCRAPS = st.one_of(st.none(), st.integers(-3, 2**70), st.floats(), st.text("XVTOCFDPS12 ?", max_size=3), st.binary())
NESTED = st.recursive(
    SCRAPS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner), max_leaves=12
)


@settings(max_examples=150, deadline=None)
@given(
    st.one_of(
        NESTED,
        st.text("XVTOCFDPS12 \n", max_size=60),
        st.lists(st.text("XTOCFDPS ", min_size=7, max_size=7), min_size=7, max_size=7),
        arrays(np.int8, array_shapes(max_dims=3, max_side=8)),
        arrays(np.int8, 32, elements=st.integers(-1, 20)),
        arrays(np.float64, array_shapes(max_dims=2)),
    )
)
def test_anything_is_a_kitchen_or_a_layout_error(value):
    try:
        layout = read_layout(value, (7, 7))
    except LayoutError:
        return
    assert layout.shape == (7, 7)


def test_overcooked_ai_layouts_can_be_played():
    """Cramped Room, as in Overcooked-AI's layout files: two starts, two onion stations, no tomatoes."""
    layout = OvercookedLayout.from_overcooked_ai("XXPXX\nO  2O\nX1  X\nXDXSX")
    env = gym.make(NAME, shape=layout.shape, layout=layout, recipes=[["onion"] * 3] * 2)
    player = ScriptedPlayer(env, np.random.default_rng(0))
    obs, info = env.reset(seed=0)
    assert env.unwrapped.goals == ("onion@(1,0)", "onion@(1,4)")
    over = False
    while not over:
        obs, _, over, _, info = env.step(player(obs, info))
    assert info["deliveries"] == 2


def test_bad_arguments_and_actions_are_named():
    env = gym.make(NAME)
    for arguments in (
        {"obs_type": "smell"},
        {"virtual_obstacles": "firm"},
        {"crossing_cost": -1},
        {"crossing_cost": float("nan")},
        {"shape": (2, 7)},
        {"shape": (7, 7, 7)},
        {"shaping": {"speed": 1}},
        {"cook_time": -3},
        {"render_mode": "poem"},
        {"layouts": "bad"},
        {"shape": (7, 7), "layouts": {"kind": "random", "shape": (5, 5)}},
        {"layout": KITCHEN, "layouts": "random"},
    ):
        with pytest.raises(ValueError, match=r"`|unknown"):
            OvercookedEnv(**arguments)
    with pytest.raises(TaskError, match="beetroot"):
        gym.make(NAME, recipes=[["beetroot"]])
    env.reset(seed=0)
    for action in (6, -1, 1.5, "north", None, 2**70, float("nan")):
        with pytest.raises(ValueError, match=r"0\.\.5"):
            env.unwrapped.step(action)


def test_default_kitchens_are_valid_and_always_the_same():
    for shape in ((5, 5), (7, 7), (4, 9), (9, 9)):
        layout = gym.make(NAME, shape=shape).unwrapped.layout
        assert layout == gym.make(NAME, shape=shape).unwrapped.layout
        workspace = OvercookedWorkspace(shape=shape)
        assert workspace.valid(workspace.encode(layout)[None]).all()


# -- the game ---------------------------------------------------------------------------------------------


def test_an_episode_delivers_everything_once():
    env = gym.make(NAME)
    player = ScriptedPlayer(env, np.random.default_rng(0))
    obs, info = env.reset(seed=0)
    total, over = 0.0, False
    while not over:
        assert len(env.unwrapped.view().orders) == 3 - info["deliveries"]
        obs, reward, over, truncated, info = env.step(player(obs, info))
        total += reward
        assert not truncated
    assert total == 60.0
    assert sorted(env.unwrapped.view().delivered) == sorted(PAPER_SOUPS)
    assert not info["goal_mask"].any()
    assert env.unwrapped.goals == ()
    assert info["num_done"] == info["deliveries"] == 3


def test_soft_obstacles_count_and_cost():
    layout = KITCHEN.replace("F 1   P", "F 1V  P")
    env = gym.make(NAME, layout=layout, virtual_obstacles="soft", crossing_cost=0.25)
    env.reset()
    assert env.step(2)[1] == -0.25
    assert env.step(4)[1] == 0.0
    _, reward, _, _, info = env.step(0)
    assert reward == -0.25
    assert info["crossings"] == 2
    hard = gym.make(NAME, layout=layout, crossing_cost=0.25)
    hard.reset()
    assert hard.step(2)[1] == 0.0
    assert hard.unwrapped.view().players[0].cell == (3, 2)


def test_shaping_pays_for_each_stage():
    def total(shaping):
        env = gym.make(NAME, shaping=shaping)
        player = ScriptedPlayer(env, np.random.default_rng(0))
        obs, info = env.reset(seed=0)
        over, rewards = False, 0.0
        while not over:
            obs, reward, over, _, info = env.step(player(obs, info))
            rewards += reward
        return rewards

    assert total(True) == 60 + 9 * 3 + 3 * 3 + 3 * 5
    assert total({"dish": 0.5}) == 60 + 9 * 3 + 3 * 0.5 + 3 * 5
    assert total({"ingredient": 0, "dish": 0.5, "soup": 0}) == 60 + 3 * 0.5
    assert total(False) == 60


def test_two_games_with_different_recipes_side_by_side():
    fish, onion = (gym.make(NAME, recipes=[[kind]], layout=KITCHEN) for kind in ("fish", "onion"))
    fish.reset(seed=0)
    onion.reset(seed=0)
    assert fish.unwrapped.goals == ("fish",)
    assert onion.unwrapped.goals == ("onion",)
    fish.step(1)
    assert onion.unwrapped.goals == ("onion",)


def test_grid_shows_what_the_view_says():
    rng = np.random.default_rng(4)
    for _ in range(5):
        layout = any_kitchen(rng)
        env = gym.make(NAME, shape=layout.shape, layout=layout, cook_time=5)
        player = ScriptedPlayer(env, rng)
        obs, info = env.reset()
        for _ in range(150):
            action = player(obs, info) if rng.random() < 0.8 else int(rng.integers(6))
            obs, _, over, _, info = env.step(action)
            np.testing.assert_array_equal(obs, expected_grid(env.unwrapped.view()))
            if over:
                break


def expected_grid(view):
    names = list(GRID_CHANNELS)
    grid = np.zeros((*view.layout.shape, len(names) + len(view.orders) + len(view.delivered)), dtype=np.uint8)

    def show(cell, item):
        if item is not None:
            for kind in item.contents if item.kind == "soup" else [item.kind]:
                grid[(*cell, ["tomato", "onion", "cabbage", "fish", "dish"].index(kind) + 14)] += 1
            if item.kind == "soup":
                grid[(*cell, names.index("dish"))] = 1
                grid[(*cell, names.index("soup"))] = 1

    grid[..., :9] = view.layout.cells[..., None] == np.arange(1, 10)
    for player in view.players:
        grid[(*player.cell, 9)] = grid[(*player.cell, 10 + player.facing)] = 1
        show(player.cell, player.held)
    for cell, item in view.counters.items():
        show(cell, item)
    for cell, pot in view.pots.items():
        for kind in pot.contents:
            grid[(*cell, 14 + ["tomato", "onion", "cabbage", "fish"].index(kind))] += 1
        grid[(*cell, 20)], grid[(*cell, 21)] = pot.ticks, pot.is_ready
    open_orders = list(view.orders)
    for number, recipe in enumerate(PAPER_SOUPS):
        grid[..., 22 + number] = recipe in open_orders
    return grid


def test_vector_says_where_things_are():
    env = gym.make(NAME, layout=KITCHEN, obs_type="vector")
    obs, _ = env.reset()
    assert obs.shape == (NUM_FEATURES + 3,)
    np.testing.assert_allclose(obs[:2], [3 / 6, 2 / 6])
    assert obs[2:6].tolist() == [1, 0, 0, 0]
    assert obs[6:13].tolist() == [1, 0, 0, 0, 0, 0, 0]
    assert obs[13:17].tolist() == [1, 1, 1, 1]
    tomato, pot = obs[17:20], obs[32:35]
    np.testing.assert_allclose(tomato, [-3 / 6, 0, 2 / 49], rtol=1e-6)
    np.testing.assert_allclose(pot, [0, 4 / 6, 3 / 49], rtol=1e-6)
    assert obs[38:51].tolist() == [0] * 13
    assert obs[51:].tolist() == [1, 1, 1]
    player = ScriptedPlayer(env, np.random.default_rng(0))
    info, over, ready = env.reset()[1], False, 0.0
    while not over:
        obs, _, over, _, info = env.step(player(obs, info))
        view = env.unwrapped.view()
        ready += obs[44]
        assert obs[44] == any(p.is_ready for p in view.pots.values())
        assert obs[43] == np.float32(max(p.ticks for p in view.pots.values()) / 20)
        loose = [kind for p in view.pots.values() if not (p.is_cooking or p.is_ready) for kind in p.contents]
        counts = [min(loose.count(kind) / 3, 1) for kind in ("tomato", "onion", "cabbage", "fish")]
        np.testing.assert_allclose(obs[38:42], counts, rtol=1e-6)
        assert obs[51:].sum() == len(view.orders)
    assert ready > 0


def test_the_shape_is_that_of_the_layout_where_none_is_given():
    rows = ["XTXOXCXFX", "D       X", "X       P", "X   1   X", "XXXXXSXXX"]

    class Always:
        def sample(self, rng):
            return OvercookedLayout.from_rows(rows)

    for arguments in (
        {"layout": rows},
        {"layout": "\n".join(rows), "shape": None},
        {"layout": OvercookedLayout.from_rows(rows).cells},
        {"layouts": [rows, rows[::-1]]},
        {"layouts": {"kind": "random", "shape": (5, 9)}},
        {"layouts": RandomLayouts((5, 9))},
        {"layouts": Always()},
    ):
        env = gym.make(NAME, **arguments)
        assert env.unwrapped.shape == (5, 9)
        assert env.observation_space.shape == (5, 9, 25)
        env.reset(seed=0)
        if not isinstance(arguments.get("layouts"), Always):
            again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
            assert again.unwrapped.shape == (5, 9)
            assert pickle.loads(pickle.dumps(env.unwrapped)).shape == (5, 9)
    for mode in ("sync", "async", "vector_entry_point"):
        envs = gym.make_vec(NAME, num_envs=2, vectorization_mode=mode, layout=rows)
        assert envs.reset(seed=0)[0].shape == (2, 5, 9, 25)
        assert envs.get_attr("shape") == ((5, 9), (5, 9))
        again = gym.make_vec(gym.envs.registration.EnvSpec.from_json(envs.spec.to_json()), 2, mode)
        assert again.reset(seed=0)[0].shape == (2, 5, 9, 25)
        envs.close()
        again.close()
    assert gym.make(NAME).unwrapped.shape == gym.make(NAME, layouts="random").unwrapped.shape == (7, 7)
    with pytest.raises(LayoutError, match=r"made for kitchens of shape \(7, 7\), got one of shape \(5, 9\)"):
        gym.make(NAME, shape=(7, 7), layout=rows)
    with pytest.raises(LayoutError, match="genomes of others need their `shape=`"):
        gym.make(NAME, layout=np.zeros(22, dtype=np.int8))


@pytest.mark.parametrize("shape", [(3, 5), (5, 3), (4, 4), (4, 5), (6, 4), (3, 7), (64, 64), (34, 33), (3, 64)])
def test_every_shape_with_room_for_the_stations_has_a_default_kitchen(shape):
    env = gym.make(NAME, shape=shape)
    assert env.unwrapped.layout.shape == shape
    assert env.unwrapped.layout == gym.make(NAME, shape=shape).unwrapped.layout
    assert set(env.unwrapped.layout.stations) == set(STATION_TYPES)
    obs, info = env.reset(seed=0)
    cook = ScriptedPlayer(env, np.random.default_rng(0))
    for _ in range(4000):
        obs, _, over, _, info = env.unwrapped.step(cook(obs, info))
        if over:
            break
    assert info["deliveries"] == 3


@pytest.mark.parametrize("shape", [(3, 3), (3, 4), (4, 3)])
def test_shapes_without_that_room_hold_what_fewer_recipes_need_or_say_what_to_give(shape):
    with pytest.raises(LayoutError, match=r"along its walls, and the recipes need 7 .*; give a larger `shape=`"):
        gym.make(NAME, shape=shape)
    with pytest.raises(LayoutError, match=r"no valid layout: .* has room for 4 stations at least 2 apart, not for 7"):
        gym.make(NAME, shape=shape, layouts="random")
    env = gym.make(NAME, shape=shape, recipes=[["onion"]])
    assert set(env.unwrapped.layout.stations) == {"onion", "dish", "pot", "serving"}
    env.reset(seed=0)


@pytest.mark.parametrize(
    ("workspace", "message"), [({"a": 1}, r"unknown arguments \['a'\]"), ({"shape": (5, 5)}, "unknown"), (5, "mapping")]
)
def test_a_bad_workspace_in_a_distribution_is_named(workspace, message):
    with pytest.raises(ValueError, match=f"`workspace`.*{message}"):
        gym.make(NAME, layouts={"kind": "random", "workspace": workspace})
