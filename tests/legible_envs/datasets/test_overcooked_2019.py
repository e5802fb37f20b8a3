"""Recorded games: how they are read, what is refused, and that they replay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from legible_envs.datasets.overcooked_2019 import (
    GAMES_FILE,
    RecordedGame,
    RecordingsError,
    fetch_recordings,
    load_recorded_games,
    recorded_layouts,
    recorded_trajectories,
    recording_stats,
)
from legible_envs.datasets.overcooked_2019.games import read_games
from legible_envs.overcooked.game.replay import GameArrays, predict_transitions
from legible_envs.rollouts import load_trajectories
from tests.legible_envs.datasets.old_pickles import HALL, ROOM


def replayed(game: RecordedGame) -> tuple[int, int]:
    """Ticks whose following state and reward the dynamics predict exactly, and all ticks."""
    states = game.states()
    before = GameArrays(*(None if a is None else a[:-1] for a in states))  # type: ignore[arg-type]
    after, rewards = predict_transitions(game.layout, before, game.actions, "overcooked-ai-2019")
    exact = rewards == game.rewards
    for name in ("cells", "facing", "held", "counters", "pots"):
        exact &= (getattr(after, name) == getattr(states, name)[1:]).reshape(game.num_ticks, -1).all(axis=1)
    return int(exact.sum()), game.num_ticks


# -- a published-looking archive of simulated games --------------------------------------------------------------------


def test_a_local_copy_becomes_games_that_replay(published: Path, tmp_path: Path, tables: dict[str, Any]) -> None:
    said: list[tuple[str, int, int]] = []
    folder = fetch_recordings(tmp_path / "out", source=published, progress=lambda *what: said.append(what))
    assert folder == tmp_path / "out"
    games = load_recorded_games(folder)
    assert [(g.layout_name, g.pair, g.split, g.num_ticks) for g in games] == [
        ("room", "run-1/1", "train", 300),
        ("room", "run-1/2", "train", 300),
        ("hall", "run-1/2", "train", 400),
        ("room", "run-1/3", "test", 200),
    ]
    assert recorded_layouts(folder) == {"room": ROOM, "hall": HALL}
    for game in games:
        assert replayed(game) == (game.num_ticks, game.num_ticks)
    assert {item for game in games for item in np.unique(game.held)} == {0, 2, 5, 6}
    assert any(game.counters.any() for game in games)
    assert sum(game.rewards.sum() for game in games) == sum(sum(t["reward_norm"]) for t in tables.values()) > 0
    np.testing.assert_allclose(games[0].seconds, 0.15 * np.arange(301), rtol=1e-6)
    assert said[-1] == ("converting", 4, 4)
    assert [g.layout_name for g in load_recorded_games(folder, ["hall"])] == ["hall"]
    assert not games[0].cells.flags.writeable


def test_walks_and_counts_of_a_local_copy(published: Path, tmp_path: Path) -> None:
    folder = fetch_recordings(tmp_path / "out", source=published)
    everything = recorded_trajectories(folder, min_positions=1, min_candidates=1, round_trips=True)
    assert everything
    assert load_trajectories(folder / "overcooked-ai-2019-walks.npz") == everything
    rows = recording_stats(folder)
    assert [row["layout"] for row in rows] == ["room", "hall", "all"]
    assert [row["ticks"] for row in rows] == [800, 400, 1200]
    assert [row["pairs"] for row in rows] == [3, 1, 3]
    assert rows[-1]["trajectories"] == len(everything)
    assert rows[-1]["scored_trajectories"] == len(recorded_trajectories(folder))
    longest = max(walk.num_states for walk in everything)
    assert len(recorded_trajectories(folder, min_positions=longest - 1)) < len(everything)
    assert recorded_trajectories(folder, min_positions=longest) == []
    assert recorded_trajectories(folder, min_candidates=4) == []
    with pytest.raises(ValueError, match="candidate_set"):
        recorded_trajectories(folder, candidate_set="task")  # type: ignore[arg-type]


def test_candidates_of_the_game_are_those_of_the_dynamics(published: Path, tmp_path: Path) -> None:
    from legible_envs.datasets.overcooked_ai.trajectories import _valid_goals
    from legible_envs.overcooked.game.goals import find_goals
    from legible_envs.overcooked.game.replay import _pack
    from legible_envs.overcooked.game.rules import OVERCOOKED_AI_2019, pack_kitchen, pack_rules

    compared = 0
    for game in load_recorded_games(fetch_recordings(tmp_path / "out", source=published)):
        rules = pack_rules(OVERCOOKED_AI_2019, game.layout.shape, 2, len(game.layout.named("pot")))
        vectors = _pack(game.states(), game.layout, OVERCOOKED_AI_2019, rules)
        kitchen, valid = pack_kitchen(game.layout, rules), _valid_goals(game)
        marked = np.zeros(game.layout.cells.size, dtype=np.bool_)
        for tick in range(0, game.num_ticks, 3):
            for player in range(2):
                if game.held[tick, player] == 0:
                    find_goals(vectors[tick], kitchen, rules, player, marked)
                    cells = np.argwhere(marked.reshape(game.layout.shape))
                    stations = {game.layout.station_at(cell) for cell in cells} - {None}
                    assert set(valid(tick, player)) == stations
                    compared += 1
    assert compared > 50


# -- conversion and files ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("joint_action", "[[0, 2], 'INTERACT']", "is not a game of 2019"),
        ("state", "no state", "is not a game of 2019"),
        ("state", "__import__('os').system('false')", "is not a game of 2019"),
        ("layout", "['XX', 'X']", "is not a game of 2019"),
        ("next_state", "{}", "does not begin where the one before ended"),
    ],
)
def test_rows_that_are_no_ticks_are_named(tables: dict[str, Any], column: str, value: str, message: str) -> None:
    from legible_envs.datasets.overcooked_ai.tables_2019 import convert_tables

    table = {key: np.array(values, dtype=object) for key, values in tables["test"].items()}
    table["time_elapsed"] = table["time_elapsed"].astype(float)
    assert len(convert_tables({"test": table})) == 1
    table[column] = table[column].copy()
    table[column][0] = value
    with pytest.raises(RecordingsError, match=rf"test game room of pair run-1/3.*{message}"):
        convert_tables({"test": table})
    del table[column]
    with pytest.raises(RecordingsError, match="lacks the columns"):
        convert_tables({"test": table})


def test_missing_and_damaged_files_say_how_to_get_them(published: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingsError, match=r"legible humans fetch.*--from FILE"):
        load_recorded_games(tmp_path / "none")
    folder = fetch_recordings(tmp_path / "out", source=published)
    path = folder / GAMES_FILE
    with pytest.raises(RecordingsError, match=r"no recordings of \['attic'\]; there are \['room', 'hall'\]"):
        load_recorded_games(folder, ["attic"])
    whole = path.read_bytes()
    with np.load(path) as file:
        arrays = dict(file)
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordingsError, match="damaged"):
        load_recorded_games(folder)
    # A damaged file is fetched again.
    fetch_recordings(folder, source=published)
    assert len(load_recorded_games(folder)) == 4
    for change, message in (
        ({"schema": 9}, "schema 9"),
        ({"kind": "x"}, "does not hold"),
        ({"room/ticks": [1]}, "damaged"),
    ):
        np.savez(path, **{**arrays, **change})  # type: ignore[arg-type]
        with pytest.raises(RecordingsError, match=message):
            read_games(path)


# -- the real ones -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def games() -> list[RecordedGame]:
    return load_recorded_games()


@pytest.mark.data
def test_every_recorded_transition_replays(games: list[RecordedGame]) -> None:
    exact, ticks = np.sum([replayed(game) for game in games], axis=0)
    assert (exact, ticks) == (91_102, 91_102)


@pytest.mark.data
def test_recorded_games_are_all_there(games: list[RecordedGame]) -> None:
    assert len(games) == 76
    assert len({game.pair for game in games}) == 17
    names = ["asymmetric_advantages", "coordination_ring", "cramped_room", "random0", "random3"]
    assert sorted({game.layout_name for game in games}) == names
    rows = {row["layout"]: row for row in recording_stats()}
    assert rows["all"]["ticks"] == 91_102
    assert [rows[name]["scored_trajectories"] for name in names] == [502, 807, 424, 0, 673]
    assert 0.6 < rows["all"]["idle"] < 0.7
    assert recorded_layouts()["cramped_room"] == ROOM


@pytest.mark.data
def test_recorded_walks_go_from_station_to_station(games: list[RecordedGame]) -> None:
    for walk in recorded_trajectories(min_positions=1, min_candidates=1, round_trips=True):
        layout = walk.layout
        assert layout is not None
        assert walk.goal is not None
        cells = [tuple(cell) for cell in walk.states.tolist()]
        assert cells[0] in layout.access(walk.start)
        assert cells[-2] in layout.access(walk.goal)
        assert cells[-1] == layout.stations[walk.goal]
        assert (np.abs(np.diff(walk.states, axis=0)).sum(axis=1) == 1).all()
        assert (np.diff(walk.times) > 0).all()
