"""Recordings in Overcooked-AI's formats: what is read, that it replays, and what is refused with its place."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from legible_envs.datasets import overcooked_2019
from legible_envs.datasets.overcooked_ai import (
    RecordedGame,
    RecordingsError,
    check_replay,
    read_recording,
    trajectories_of_games,
)
from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import load_trajectories
from tests.legible_envs.datasets import newer_play
from tests.legible_envs.datasets.newer_play import DINER, NOOK, ROOM
from tests.legible_envs.datasets.old_pickles import HALL, simulated_table, table_pickle

GAMES = [
    ("room", "1", ROOM, newer_play.play(ROOM, 500, 1)),
    ("diner", "2", DINER, newer_play.play(DINER, 700, 2)),
    ("nook", "3", NOOK, newer_play.play(NOOK, 800, 3)),
]


def write(path: Path, columns: dict[str, list[Any]], *, form: str = "csv") -> Path:
    frame = pd.DataFrame(columns)
    if form == "csv":
        frame.to_csv(path, index=False)
    elif form == "2019":
        path.write_bytes(table_pickle({k: v for k, v in columns.items() if not k.endswith("human")}))
    elif form == "objects":
        frame.astype(object).to_pickle(path)
    else:
        frame.to_pickle(path, protocol=int(form))
    return path


def same(one: list[RecordedGame], other: list[RecordedGame], *names: str) -> bool:
    names = names or ("cells", "facing", "held", "counters", "pots", "cook_times", "actions", "rewards", "seconds")
    return len(one) == len(other) and all(
        a.layout == b.layout and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)
        for a, b in zip(one, other, strict=True)
    )


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> list[RecordedGame]:
    return read_recording(write(tmp_path_factory.mktemp("play") / "play.csv", newer_play.table(GAMES)))


def test_a_table_becomes_games_that_replay(read: list[RecordedGame]) -> None:
    assert [(g.layout_name, g.pair, g.num_ticks, g.rules) for g in read] == [
        ("room", "1", 499, "overcooked-ai-2020"),
        ("diner", "2", 699, "overcooked-ai-2020"),
        ("nook", "3", 799, "overcooked-ai-2020"),
    ]
    assert [[g.participant(player) for player in range(2)] for g in read] == [["a1", "b1"], ["a2", "b2"], ["a3", "b3"]]
    for game, (_, _, grid, ticks) in zip(read, GAMES, strict=True):
        check = check_replay(game)
        assert (check.complete, check.positions, check.starts_itself) == (game.num_ticks, game.num_ticks, False)
        assert check.moves_replay
        assert game.rewards.sum() == sum(tick["reward"] for tick in ticks[:-1])
        assert "\n".join(grid) == "".join(" " if cell.isdigit() else cell for cell in game.layout.to_ascii())
        assert [list(start)[::-1] for start in game.layout.starts] == [
            player["position"] for player in ticks[0]["state"]["players"]
        ]
    assert all(any(game.pots[:, :, kind].any() for game in read) for kind in (0, 1))
    assert sum(game.rewards.sum() for game in read) > 0
    assert any(game.counters.any() for game in read)
    assert set(np.unique(np.concatenate([game.held.ravel() for game in read]))) == {0, 1, 2, 5, 6}


@pytest.mark.parametrize("form", ["csv", "2019", "objects", "2", "4", "5"])
def test_every_form_of_a_table_holds_the_same_games(tmp_path: Path, read: list[RecordedGame], form: str) -> None:
    assert same(read_recording(write(tmp_path / "play", newer_play.table(GAMES), form=form)), read)


def test_trajectory_files_hold_the_same_games(tmp_path: Path, read: list[RecordedGame]) -> None:
    path = tmp_path / "play.json"
    content = newer_play.episodes(GAMES)
    path.write_text(json.dumps(content))
    games = read_recording(path)
    assert same(games, read, "cells", "facing", "held", "counters", "pots", "actions", "rewards")
    assert [game.pair for game in games] == ["episode-0", "episode-1", "episode-2"]
    np.testing.assert_allclose(games[0].seconds, 0.15 * np.arange(500), rtol=1e-6)
    for params in content["mdp_params"]:
        del params["terrain"]
    path.write_text(json.dumps(content))
    with pytest.raises(
        RecordingsError, match="episode 0 is in the kitchen 'room', and the file does not hold its grid"
    ):
        read_recording(path)
    layouts = {name: OvercookedLayout.from_rows(grid) for name, _, grid, _ in GAMES}
    assert [game.layout for game in read_recording(path, layouts=layouts)] == [layouts[g.layout_name] for g in read]


def test_trajectories_are_those_of_persons(tmp_path: Path, read: list[RecordedGame]) -> None:
    found = trajectories_of_games(read)
    assert len(found) > 10
    assert {t.participant for t in found} <= {f"{side}{trial}" for side in "ab" for trial in "123"}
    assert {t.candidate_set for t in found} == {"all"}
    path = write(tmp_path / "play.pickle", newer_play.table(GAMES), form="4")
    assert load_trajectories(path) == found
    columns = newer_play.table(GAMES)
    columns["player_1_is_human"] = [False] * len(columns["state"])
    half = load_trajectories(write(tmp_path / "half.csv", columns))
    assert half == [t for t in found if t.participant.startswith("a")] != []
    with pytest.raises(ValueError, match="known by the rules of 2019 alone; the game 1 of room"):
        trajectories_of_games(read, "game")


def test_missing_ticks_part_a_game(tmp_path: Path, read: list[RecordedGame]) -> None:
    columns = newer_play.table(GAMES[:1])
    for values in columns.values():
        del values[100:140], values[200]
    parts = read_recording(write(tmp_path / "play.csv", columns))
    assert [part.num_ticks for part in parts] == [99, 99, 258]
    assert {part.layout for part in parts} == {read[0].layout}
    assert all(check_replay(part).complete == part.num_ticks for part in parts)
    whole = {(t.start, t.goal, t.states.tobytes()) for t in trajectories_of_games(read[:1])}
    assert {(t.start, t.goal, t.states.tobytes()) for t in trajectories_of_games(parts)} <= whole


def test_plays_of_2019_replay_in_either_form(tmp_path: Path) -> None:
    for grid in (ROOM, NOOK):
        newer = [("room", "1", grid, newer_play.play(grid, 900, 5, by_hand=False))]
        (game,) = read_recording(write(tmp_path / "newer.csv", newer_play.table(newer)))
        check = check_replay(game)
        assert (check.complete, check.starts_itself) == (game.num_ticks, True)
    older = simulated_table(HALL, "hall", [1], 500, 0)
    (game,) = read_recording(write(tmp_path / "older.csv", older))
    assert (game.rules, game.pair, game.num_ticks) == ("overcooked-ai-2019", "run-1/1", 500)
    assert check_replay(game).complete == 500
    assert game.rewards.sum() == sum(older["reward_norm"]) > 0
    (tmp_path / "older.pickle").write_bytes(table_pickle(older))
    assert same(read_recording(tmp_path / "older.pickle"), [game], "cells", "pots", "held", "actions")
    assert trajectories_of_games([game], "game")


@pytest.mark.slow
@pytest.mark.data
def test_all_games_of_2019_replay_by_the_readable_rules() -> None:
    checks = [check_replay(game) for game in overcooked_2019.load_recorded_games()]
    assert (sum(check.ticks for check in checks), sum(check.complete for check in checks)) == (91_102, 91_102)


def test_a_difference_from_the_rules_is_found_where_it_is(tmp_path: Path) -> None:
    def changed(change: Callable[[dict[str, Any]], None], tick: int) -> tuple[Path, RecordedGame]:
        ticks = json.loads(json.dumps(GAMES[0][3]))
        change(ticks[tick]["state"])
        path = write(tmp_path / "play.csv", newer_play.table([("room", "1", ROOM, ticks)]))
        return path, read_recording(path)[0]

    def jump(state: dict[str, Any]) -> None:
        taken = [player["position"] for player in state["players"]]
        state["players"][0]["position"] = next(
            [x, y]
            for x in (1, 2, 3)
            for y in (1, 2)
            if abs(x - taken[0][0]) + abs(y - taken[0][1]) > 1 and [x, y] not in taken
        )

    path, game = changed(jump, 50)
    check = check_replay(game)
    assert check.first_difference.startswith("tick 49: cells")
    assert check.ticks - 2 <= check.positions < check.ticks
    with pytest.raises(
        ValueError, match=r"in the game 1 of room, [12] of 499 ticks do not move .*first: tick 49: cells"
    ):
        load_trajectories(path)

    def drop(state: dict[str, Any]) -> None:
        state["objects"].append({"name": "onion", "position": [0, 2]})

    _, game = changed(drop, 0)
    assert check_replay(game).first_difference == "tick 0: counters"
    assert check_replay(game).moves_replay

    def turn(state: dict[str, Any]) -> None:
        state["players"][1]["orientation"] = [-x for x in state["players"][1]["orientation"]]

    _, game = changed(turn, 30)
    assert "tick 29: facing" in check_replay(game).first_difference


BAD_VALUES = [
    ("state", "no state", "no tick of Overcooked-AI"),
    ("state", "{}", "'players' is missing"),
    ("state", "__import__('os').system('false')", "no tick of Overcooked-AI"),
    ("state", '{"players": [], "objects": []}', "expected 2 players, got 0"),
    (
        "joint_action",
        "[[0, 2], [0, 0]]",
        r"expected a direction such as \[0, -1\], \[0, 0\] or 'INTERACT', got '\[0, 2\]'",
    ),
    ("joint_action", "[[0, 0]]", "expected a list of 2 actions"),
    ("reward", "nan", "'reward' must be a finite number, got 'nan'"),
    ("reward", "1_0", "'reward' must be a finite number, got '1_0'"),
    ("time_elapsed", "-5", "'time_elapsed' goes back"),
    ("layout_name", "attic", "'layout_name' changes within trial 1"),
    ("layout", "[]", "'layout' changes within trial 1"),
]


@pytest.mark.parametrize(("column", "value", "message"), BAD_VALUES)
def test_rows_that_are_no_ticks_are_named(tmp_path: Path, column: str, value: str, message: str) -> None:
    columns = {key: [str(each) for each in values] for key, values in newer_play.table(GAMES[:1]).items()}
    columns[column][6] = value
    for form, place in (("csv", "line 8"), ("4", "row 6")):
        path = write(tmp_path / "play", columns, form=form)
        with pytest.raises(RecordingsError, match=rf"{place}: .*{message}"):
            read_recording(path)
        with pytest.raises(ValueError, match=message):
            load_trajectories(path)


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        (("players", 0, "position"), [0, 0], "player 0 stands on .* which is no floor"),
        (("players", 0, "position"), [-1, 1], "is no cell"),
        (("players", 0, "position"), [1.0, 1], "is no cell"),
        (("players", 0, "position"), [1], "no tick of Overcooked-AI"),
        (("players", 1, "orientation"), [1, 1], "no tick of Overcooked-AI"),
        (("players", 1, "held_object"), {"name": "pizza"}, "an item called 'pizza'; known"),
        (("objects",), [{"name": "onion", "position": [99, 0]}], "is no cell"),
        (
            ("objects",),
            [{"name": "soup", "position": [2, 0], "_ingredients": ["egg"], "cooking_tick": 0}],
            "a soup with 'egg'",
        ),
        (
            ("objects",),
            [{"name": "soup", "position": [2, 0], "_ingredients": [], "cooking_tick": 10**9}],
            "a soup of 0",
        ),
        (("objects",), [{"name": "soup", "position": [2, 0], "state": ["onion", -1, 0]}], "a soup whose state is"),
        (("objects",), 5, "no tick of Overcooked-AI"),
    ],
)
def test_states_that_cannot_be_are_refused(tmp_path: Path, part: tuple[Any, ...], value: Any, message: str) -> None:
    ticks = json.loads(json.dumps(GAMES[0][3][:9]))
    place = ticks[6]["state"]
    for key in part[:-1]:
        place = place[key]
    place[part[-1]] = value
    path = tmp_path / "play.json"
    path.write_text(json.dumps(newer_play.episodes([("room", "1", ROOM, ticks)])))
    with pytest.raises(RecordingsError, match=f"episode 0, tick 6: .*{message}"):
        read_recording(path)


def test_broken_tables_and_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "play.csv"
    columns = newer_play.table(GAMES[:1])
    text = write(path, columns).read_text()
    for change, message in (
        (lambda t: t.replace("trial_id,", "trial,", 1), r"the table lacks the columns \['trial_id'\]"),
        (lambda t: t.replace("trial_id,", "reward,", 1), r"line 1: the columns \['reward'\] are there twice"),
        (
            lambda t: t[: len(t) // 2],
            r"line \d+: (a quote is opened here and never closed|the header names 14 columns)",
        ),
        (lambda t: t.replace("True,True\n", "True,maybe\n"), "must be True or False, got 'maybe'"),
        (lambda t: t.replace('""X"", ""X""', '""Q"", ""X""'), "no tick of Overcooked-AI"),
    ):
        path.write_text(change(text))  # type: ignore[no-untyped-call]
        with pytest.raises(RecordingsError, match=message):
            read_recording(path)
    for content, message in (
        ("{}", "looks like JSON, an empty object; expected a recording of Overcooked-AI"),
        ("hello", "text that begins with 'hello'; expected a recording"),
        ('{"ep_states": 1, "ep_actions": []}', "'ep_states' is missing or no list"),
        ('{"ep_states": [], "ep_actions": [], "ep_rewards": [1]}', r"\[0, 0, 1, 0\] entries"),
        ('{"ep_states": [[1]], "ep_actions": [[]], "ep_rewards": [[]]}', "episode 0: expected lists of as many"),
        ('{"ep_states": [[{}]], "ep_actions": [[1]], "ep_rewards": [["a"]]}', "'ep_rewards' must be numbers"),
        ("[" * 100_000, "expected a recording"),
    ):
        path.write_text(content)
        with pytest.raises(RecordingsError, match=message):
            read_recording(path)
    with pytest.raises(FileNotFoundError):
        read_recording(tmp_path / "none")


def test_more_states_than_memory_holds_are_refused_before_any_is_made() -> None:
    from legible_envs.datasets.overcooked_ai.states import StateArrays

    with pytest.raises(ValueError, match="more than a recording has"):
        StateArrays(OvercookedLayout.from_rows(ROOM), 10**9)
