"""Recorded games as Minari data sets: the environment goes through the very states that were recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from legible_envs.datasets.overcooked_2019 import (
    GAMES_FILE,
    RecordingsError,
    load_recorded_games,
    recorded_trajectories,
)
from legible_envs.datasets.overcooked_2019.games import write_games
from legible_envs.datasets.overcooked_ai.games import RecordedGame
from legible_envs.datasets.recorded import AUTHORS, make_recorded_dataset
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.game.observations import GRID_CHANNELS
from legible_envs.overcooked.game.replay import GameArrays, predict_transitions
from legible_envs.rollouts import from_minari
from tests.legible_envs.datasets.old_pickles import HALL, ROOM

minari = pytest.importorskip("minari")


def simulated_game(layout: OvercookedLayout, name: str, pair: int, ticks: int) -> RecordedGame:
    """Random play by the rules of 2019, from the start of a game."""
    rng = np.random.default_rng(pair)
    actions = rng.choice(6, size=(ticks, 2), p=[0.15, 0.15, 0.15, 0.15, 0.05, 0.35])
    states = [
        GameArrays(
            np.array([layout.starts[:2]], dtype=np.int16),
            np.zeros((1, 2), dtype=np.int8),
            np.zeros((1, 2), dtype=np.int8),
            np.zeros((1, *layout.shape), dtype=np.int8),
            np.zeros((1, len(layout.named("pot")), 5), dtype=np.int16),
        )
    ]
    rewards = []
    for action in actions:
        after, reward = predict_transitions(layout, states[-1], action[None])
        states.append(after._replace(delivered=None))
        rewards.append(reward[0])
    fields = ("cells", "facing", "held", "counters", "pots")
    arrays: dict[str, Any] = {field: np.concatenate([getattr(state, field) for state in states]) for field in fields}
    return RecordedGame(
        layout_name=name,
        layout=layout,
        pair=f"run-1/{pair}",
        split="train" if pair < 3 else "test",
        **arrays,
        actions=actions.astype(np.int8),
        rewards=np.array(rewards, dtype=np.float32),
        seconds=0.15 * np.arange(ticks + 1, dtype=np.float32),
    )


@pytest.fixture(scope="module")
def games() -> list[RecordedGame]:
    return [
        *(simulated_game(ROOM, "room", pair, 300 - pair) for pair in (1, 2, 3)),
        simulated_game(HALL, "hall", 2, 900),
    ]


@pytest.fixture
def recordings(games: list[RecordedGame], tmp_path: Path) -> Path:
    """A folder with simulated games in the form of the recorded ones."""
    write_games(tmp_path / "recordings" / GAMES_FILE, games)
    return tmp_path / "recordings"


def seen_and_recorded(observations: np.ndarray, game: RecordedGame) -> None:
    """Whether each player's grid observations show what was recorded of both."""
    own, facing = GRID_CHANNELS.index("player"), GRID_CHANNELS.index("facing N")
    for player in range(2):
        other = observations.shape[-1] - 5
        for at, who in ((own, player), (other, 1 - player)):
            ticks, rows, cols = np.nonzero(observations[:, player, :, :, at])
            assert np.array_equal(ticks, np.arange(game.num_ticks + 1)), "one player in each observation"
            assert np.array_equal(np.stack([rows, cols], axis=1), game.cells[:, who])
            there = observations[ticks, player, rows, cols]
            first = facing if at == own else other + 1
            assert np.array_equal(there[:, first : first + 4].argmax(axis=1), game.facing[:, who])


def check(dataset: Any, game: RecordedGame, number: int = 0) -> None:
    """An episode of a data set is a recorded game."""
    episode = dataset[number]
    assert np.array_equal(episode.actions, game.actions)
    assert np.array_equal(episode.rewards, game.rewards)
    assert len(episode.observations) == game.num_ticks + 1
    assert not episode.terminations.any()
    assert np.flatnonzero(episode.truncations).tolist() == [game.num_ticks - 1]
    assert all(dataset.observation_space.contains(observation) for observation in episode.observations)
    seen_and_recorded(episode.observations, game)


def test_the_observations_show_what_was_recorded(recordings: Path, tmp_path: Path) -> None:
    made = make_recorded_dataset(tmp_path / "out", "room", recordings=recordings)
    games = load_recorded_games(recordings, ["room"])
    loaded = minari.MinariDataset(tmp_path / "out" / "overcooked" / "recorded-room-v0" / "data")
    assert loaded.total_episodes == made.total_episodes == len(games) == 3
    env = loaded.recover_environment()
    assert (env.observation_space, env.action_space) == (loaded.observation_space, loaded.action_space)
    assert loaded.storage.metadata["author"] == set(AUTHORS)
    for number, game in enumerate(games):
        check(loaded, game, number)
    about = list(loaded.storage.get_episode_metadata(range(3)))
    assert [each["split"] for each in about] == [game.split for game in games]
    assert [each["participants"].split() for each in about] == [[game.participant(p) for p in (0, 1)] for game in games]


def test_its_trajectories_are_those_of_both_people(recordings: Path, tmp_path: Path) -> None:
    made = make_recorded_dataset(tmp_path / "out", "hall", recordings=recordings, obs_type="vector")
    limits: dict[str, Any] = {"min_positions": 1, "min_candidates": 1}
    found = from_minari(made, **limits)
    expected = recorded_trajectories(recordings, ["hall"], **limits, round_trips=True)
    assert found
    assert {trajectory.participant for trajectory in found} == {trajectory.participant for trajectory in expected}
    for one, other in zip(found, expected, strict=True):
        assert replace(one, times=np.arange(one.num_states)) == replace(other, times=np.arange(other.num_states))


def test_a_game_that_plays_otherwise_is_refused(recordings: Path, tmp_path: Path) -> None:
    game = load_recorded_games(recordings, ["room"])[0]
    cells, facing = game.cells.copy(), game.facing.copy()
    facing[7, 1] = (facing[7, 1] + 1) % 4
    write_games(recordings / GAMES_FILE, [replace(game, facing=facing)])
    with pytest.raises(
        RecordingsError, match=r"run-1/1 in room plays otherwise .*: after tick 7 \(cell, facing, held\)"
    ):
        make_recorded_dataset(tmp_path / "out", "room", recordings=recordings)
    cells[0] = cells[0, ::-1]
    write_games(recordings / GAMES_FILE, [replace(game, cells=cells)])
    with pytest.raises(RecordingsError, match="after tick 0"):
        make_recorded_dataset(tmp_path / "out", "room", recordings=recordings)
    rewards = np.array(game.rewards)
    rewards[2] += 20
    write_games(recordings / GAMES_FILE, [replace(game, rewards=rewards)])
    with pytest.raises(RecordingsError, match="after tick 3 a reward of"):
        make_recorded_dataset(tmp_path / "out", "room", recordings=recordings)
    assert list((tmp_path / "out").iterdir()) == []


def test_what_is_refused(recordings: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingsError, match=r"no games are recorded in 'kitchen'; there are \['room', 'hall'\]"):
        make_recorded_dataset(tmp_path / "out", "kitchen", recordings=recordings)
    with pytest.raises(ValueError, match=r"the recordings settle \['num_players', 'rules'\]"):
        make_recorded_dataset(tmp_path / "out", "room", recordings=recordings, rules="legible", num_players=1)
    with pytest.raises(ValueError, match="`max_episode_steps` ends episodes after 5 steps"):
        make_recorded_dataset(tmp_path / "out", "room", recordings=recordings, max_episode_steps=5)
    with pytest.raises(ValueError, match="games"):
        make_recorded_dataset(tmp_path / "out", "room", recordings=recordings, games=0)


@pytest.mark.data
@pytest.mark.parametrize("kitchen", ["cramped_room", "random0"])
def test_games_of_real_people(tmp_path: Path, kitchen: str) -> None:
    made = make_recorded_dataset(tmp_path, kitchen, games=2)
    for number, game in enumerate(load_recorded_games(layouts=[kitchen])[:2]):
        check(made, game, number)


@pytest.mark.data
def test_trajectories_of_real_people(tmp_path: Path) -> None:
    made = make_recorded_dataset(tmp_path, "cramped_room", games=3, obs_type="vector")
    found = from_minari(made, min_positions=3, min_candidates=2)
    people = {trajectory.participant for trajectory in found}
    expected = [each for each in recorded_trajectories(layouts=["cramped_room"]) if each.participant in people]
    assert len(people) == 6
    assert len(found) == len(expected) == 87
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one.states, other.states)
        assert (one.goal, one.candidates, one.participant) == (other.goal, other.candidates, other.participant)
        # Trajectories of the data set count ticks; recordings have clocks, which differ by a tick at most.
        assert np.abs(np.diff(one.times - other.times)).max() < 0.3
