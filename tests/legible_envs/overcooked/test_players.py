"""Several cooks: the joint environment, single and batched, what each player sees, and the agents of PettingZoo."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

import legible_envs  # noqa: F401
from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout, parallel_env
from legible_envs.overcooked.game.players import player_starts
from legible_envs.overcooked.game.view import GameView
from legible_envs.overcooked.layouts import RandomLayouts
from legible_envs.overcooked.settings import KitchenSettings

ID = "LegibleOvercooked-v0"
FACINGS = 4
HANDS = ("tomato", "onion", "cabbage", "fish", "dish", "soup")
DIVIDED = """\
XXXXXXX
T 1X  P
O  X 2D
C  X  S
F  X  X
X  X  X
XXXXXXX"""


APART = """\
XXXXXXXX
T 1XX  P
O  XX 2D
C  XX  S
F  XX  X
X  XX  X
XXXXXXXX"""


def play(env: Any, steps: int, seed: int) -> Any:
    """Random joint actions; yields what every step returned."""
    rng = np.random.default_rng(seed)
    yield env.reset(seed=seed)
    for _ in range(steps):
        mask = np.atleast_2d(env.unwrapped.action_masks())
        action = np.array([rng.choice(np.flatnonzero(row)) for row in mask])
        yield env.step(action if len(mask) > 1 else int(action[0]))


# -- what each player sees ---------------------------------------------------------------------------------------------


def described(view: GameView, observer: int) -> list[float]:
    """The entries of a vector observation about the other players, in plain words."""
    height, width = view.layout.shape
    me, found = view.players[observer], []
    for number in range(1, len(view.players)):
        other = view.players[(observer + number) % len(view.players)]
        hands = [0.0] * 7
        hands[0 if other.held is None else 1 + HANDS.index(other.held.kind)] = 1.0
        facing = [float(other.facing == direction) for direction in range(FACINGS)]
        found += [(other.cell[0] - me.cell[0]) / (height - 1), (other.cell[1] - me.cell[1]) / (width - 1)]
        found += facing + hands
    return found


@pytest.mark.parametrize("players", [2, 3, 4])
def test_everybody_sees_the_kitchen_as_their_own(players: int) -> None:
    grids = gym.make(ID, num_players=players, layouts="random", max_episode_steps=None)
    vectors = gym.make(ID, num_players=players, layouts="random", obs_type="vector", max_episode_steps=None)
    for seed in range(3):
        for (grid, *_), (vector, *_) in zip(play(grids, 60, seed), play(vectors, 60, seed), strict=True):
            view = grids.unwrapped.view()
            orders = len(view.orders) + len(view.delivered)
            for me, player in enumerate(view.players):
                own, others = np.zeros((2, *view.layout.shape, 5), dtype=np.uint8)
                for number, each in enumerate(view.players):
                    channels = own if number == me else others
                    channels[each.cell][[0, 1 + each.facing]] = 1
                assert np.array_equal(grid[me][..., 9:14], own)
                assert np.array_equal(grid[me][..., 22 + orders :], others)
                assert np.allclose(vector[me][51 + orders :], described(view, me))
                assert np.allclose(vector[me][:2] * (np.array(view.layout.shape) - 1), player.cell)
            shared = np.delete(grid, [*range(9, 14), *range(22 + orders, 27 + orders)], axis=-1)
            assert (shared == shared[0]).all(), "stations, items and orders are the same for all"


def test_one_player_sees_what_they_saw_alone() -> None:
    """The channels and entries of a lone player come first, and the dynamics of one who is not disturbed are alike."""
    alone, joint = gym.make(ID), gym.make(ID, num_players=2, layout=gym.make(ID).unwrapped.layout)
    rng = np.random.default_rng(0)
    (one, info), (two, infos) = alone.reset(seed=0), joint.reset(seed=0)
    for _ in range(200):
        others = two[0][..., 25:]
        shown = two[0][..., :25].copy()
        (row, col) = np.argwhere(others[..., 0])[0]
        shown[row, col, 9:20] = 0
        assert np.array_equal(one, shown)
        assert np.array_equal(info["goal_mask"], infos["goal_mask"][0])
        assert np.array_equal(info["action_mask"], infos["action_mask"][0])
        action = int(rng.integers(6))
        before = joint.unwrapped.view().players[0].cell
        one, _, over, _, info = alone.step(action)
        two, _, _, _, infos = joint.step([action, 4])
        if alone.unwrapped.view().players[0].cell != joint.unwrapped.view().players[0].cell:
            assert joint.unwrapped.view().players[0].cell == before, "stopped by the other one"
            break
        assert not over


@pytest.mark.parametrize("obs_type", ["grid", "vector", "rgb"])
@pytest.mark.parametrize("players", [2, 4])
def test_the_batch_is_the_vector_of_single_ones(players: int, obs_type: str) -> None:
    options: dict[str, Any] = {"num_players": players, "obs_type": obs_type, "layouts": "random"}
    options |= {"recipes": [["onion"]], "shaping": True, "max_episode_steps": 40}
    batch = gym.make_vec(ID, num_envs=3, **options)
    single = gym.make_vec(ID, num_envs=3, vectorization_mode="sync", **options)
    ours, theirs = batch.reset(seed=3), single.reset(seed=3)
    rng = np.random.default_rng(1)
    for _ in range(100):
        for mine, its in zip(ours[:-1], theirs[:-1], strict=True):
            assert np.array_equal(mine, its)
        assert ours[-1].keys() == theirs[-1].keys()
        for key, value in theirs[-1].items():
            assert np.array_equal(ours[-1][key], value), key
        assert batch.observation_space.contains(ours[0])
        assert np.array_equal(batch.action_masks(), ours[-1]["action_mask"].astype(bool))
        actions = rng.integers(6, size=(3, players))
        ours, theirs = batch.step(actions), single.step(actions)


@pytest.mark.parametrize("players", [2, 3])
def test_the_joint_environment_keeps_gymnasiums_contract(players: int) -> None:
    for obs_type in ("grid", "vector"):
        env = gym.make(ID, num_players=players, obs_type=obs_type)
        check_env(env.unwrapped, skip_render_check=True)
        again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
        assert again.observation_space == env.observation_space
        assert again.action_space == gym.spaces.MultiDiscrete([6] * players)


def test_bad_joint_actions_are_named() -> None:
    env = gym.make(ID, num_players=2).unwrapped
    with pytest.raises(ResetNeeded):
        env.step([0, 0])
    env.reset(seed=0)
    for wrong in (3, [0], [0, 1, 2], [0, 6], [0, 1.5], None, "01"):
        with pytest.raises(ValueError, match=r"0\.\.5"):
            env.step(wrong)
    assert env.view().steps == 0
    batch = gym.make_vec(ID, num_envs=3, num_players=2)
    batch.reset(seed=0)
    for wrong in (np.zeros(3, dtype=int), np.zeros((2, 3), dtype=int), np.full((3, 2), 6), np.zeros((3, 2))):
        with pytest.raises(ValueError, match="actions"):
            batch.step(wrong)
    for number in (0, 5, 1.5, "two", True):
        with pytest.raises(ValueError, match="num_players"):
            gym.make(ID, num_players=number)
    with pytest.raises(ValueError, match="rules"):
        gym.make(ID, rules="of 2020")


# -- where players start -----------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), players=st.integers(1, 4), size=st.integers(5, 9))
def test_players_start_apart_on_floor_that_the_first_can_walk_to(seed: int, players: int, size: int) -> None:
    layout = RandomLayouts(shape=(size, size)).sample(np.random.default_rng(seed))
    starts = player_starts(layout, players)
    assert starts[0] == layout.starts[0]
    assert len(set(starts)) == players
    assert starts[: players - 1] == player_starts(layout, max(players - 1, 1))[: players - 1], "one more moves nobody"
    steps = walking_distances(layout, starts[0])
    for number, start in enumerate(starts[1:], 1):
        nearest = {cell: min(walking_distances(layout, other)[cell] for other in starts[:number]) for cell in steps}
        assert nearest[start] == max(nearest.values())


def walking_distances(layout: OvercookedLayout, start: tuple[int, int]) -> dict[tuple[int, int], int]:
    found, ring = {start: 0}, [start]
    while ring:
        (row, col), *ring = ring
        for cell in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
            if cell not in found and layout.cells[cell] == 0:
                found[cell] = found[row, col] + 1
                ring.append(cell)
    return found


def test_divided_kitchens_are_for_two() -> None:
    layout = OvercookedLayout.from_ascii(DIVIDED)
    with pytest.raises(LayoutError, match=r"cannot be reached from the player's start"):
        KitchenSettings(layout=layout).pack(layout)
    env = gym.make(ID, layout=layout, num_players=2)
    env.reset(seed=0)
    assert env.unwrapped.goals_of(0) == ("tomato", "onion", "cabbage", "fish")
    with pytest.raises(LayoutError, match="no counter or pot in common"):
        gym.make(ID, layout=APART, num_players=2)
    with pytest.raises(LayoutError, match=r"the onion station cannot be reached from any player's start"):
        gym.make(ID, layout=DIVIDED.replace("O  X", "X  X").replace("XXXXXXX", "OXXXXXX", 1), num_players=2)
    with pytest.raises(LayoutError, match="2 players need as many floor cells"):
        gym.make(ID, layout="XTX\nP1D\nXSX", recipes=[["tomato"]], num_players=2)


# -- PettingZoo --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("players", [1, 2, 4])
def test_pettingzoos_own_tests_pass(players: int, capsys: pytest.CaptureFixture[str]) -> None:
    from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test
    from pettingzoo.utils.conversions import parallel_to_aec

    def make() -> Any:
        return parallel_env(players, layouts="random", obs_type="vector", max_episode_steps=30)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parallel_api_test(make(), num_cycles=100)
        parallel_seed_test(make)
        api_test(parallel_to_aec(make()), num_cycles=50)


def test_pettingzoos_own_test_of_pictures_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    from pettingzoo.test import render_test
    from pettingzoo.utils.conversions import parallel_to_aec

    def make(render_mode: str | None = None) -> Any:
        return parallel_to_aec(parallel_env(2, render_mode=render_mode))

    render_test(make, custom_tests={"ansi": lambda drawn: isinstance(drawn, str)})
    env = parallel_env(2, render_mode="rgb_array")
    env.reset(seed=0)
    assert env.render().shape[-1] == 3


@pytest.mark.parametrize("players", [1, 2, 3])
def test_agents_get_their_part_of_the_joint_environment(players: int) -> None:
    options: dict[str, Any] = {"recipes": [["onion"]], "layouts": "random", "shaping": True}
    agents = parallel_env(players, max_episode_steps=50, **options)
    joint = gym.make(ID, num_players=players, max_episode_steps=50, **options)
    rng = np.random.default_rng(2)
    for seed in range(3):
        observations, infos = agents.reset(seed=seed)
        observation, info = joint.reset(seed=seed)
        over = False
        while not over:
            assert agents.agents == [f"player_{i}" for i in range(players)]
            assert np.array_equal(agents.state(), observation)
            for i, agent in enumerate(agents.agents):
                own = observation if players == 1 else observation[i]
                assert np.array_equal(observations[agent], own)
                assert agents.observation_space(agent).contains(observations[agent])
                for key in ("goal_mask", "action_mask"):
                    assert np.array_equal(infos[agent][key], info[key] if players == 1 else info[key][i])
                assert np.array_equal(agents.action_masks(agent), infos[agent]["action_mask"].astype(bool))
            moves = rng.integers(6, size=players).tolist()
            observations, rewards, terminated, truncated, infos = agents.step(
                {f"player_{i}": move for i, move in reversed(list(enumerate(moves)))}
            )
            observation, reward, ended, late, info = joint.step(moves if players > 1 else moves[0])
            assert set(rewards.values()) == {reward}
            assert set(terminated.values()) == {ended}
            assert set(truncated.values()) == {late}
            over = ended or late
        assert agents.agents == []
        assert agents.step({}) == ({}, {}, {}, {}, {})


def test_agents_bad_input_is_named() -> None:
    env = parallel_env(2)
    with pytest.raises(ResetNeeded):
        env.step({})
    with pytest.warns(UserWarning, match=r"\['kitchen'\] are ignored; known: \['layout'\]"):
        env.reset(seed=0, options={"kitchen": 1})
    with pytest.raises(ValueError, match="mapping"):
        env.reset(options=[1])
    for wrong in ({"player_0": 1}, {"player_0": 1, "player_1": 2, "player_2": 3}, [1, 2]):
        with pytest.raises(ValueError, match="an action for each of"):
            env.step(wrong)
    with pytest.raises(ValueError, match=r"0\.\.5"):
        env.step({"player_0": 1, "player_1": 9})
    with pytest.raises(LayoutError):
        env.reset(options={"layout": "X"})


@pytest.mark.data
def test_recorded_pairs_play_the_same_game_again() -> None:
    """All 2019 games of two players, from their first state through every recorded transition."""
    from legible_envs.datasets.overcooked_2019 import load_recorded_games

    transitions = 0
    for game in load_recorded_games():
        layout = game.layout.with_starts(game.cells[0].tolist())
        env = parallel_env(2, layout=layout, rules="overcooked-ai-2019", max_episode_steps=None)
        env.reset(seed=0)
        states = np.empty((len(game.actions) + 1, len(env.kitchen.arrays()[0])), dtype=np.int32)
        rewards = np.empty(len(game.actions))
        states[0] = env.kitchen.arrays()[0]
        for tick, (first, second) in enumerate(game.actions.tolist()):
            _, paid, _, _, _ = env.step({"player_0": first, "player_1": second})
            rewards[tick] = paid["player_0"]
            states[tick + 1] = env.kitchen.arrays()[0]
        played = states[:, 5:11].reshape(-1, 2, 3)
        assert np.array_equal(played[..., 0], game.cells[..., 0] * layout.shape[1] + game.cells[..., 1])
        assert np.array_equal(played[..., 1], game.facing)
        assert np.array_equal(played[..., 2], game.held)
        at_items = 5 + 6 + 1
        items = states[:, at_items : at_items + layout.cells.size].reshape(-1, *layout.shape)
        assert np.array_equal(items, game.counters)
        pots = states[:, at_items + layout.cells.size :].reshape(len(states), -1, 7)
        assert np.array_equal(pots[..., 1:6], game.pots)
        assert np.array_equal(rewards, game.rewards)
        transitions += len(game.actions)
    assert transitions > 90_000
