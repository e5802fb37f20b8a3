"""Recorded games: where they come from, what is refused, how they are read, and that they replay."""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import subprocess
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.datasets.overcooked_2019 import (
    GAMES_FILE,
    RecordedGame,
    RecordingsError,
    fetch_recordings,
    load_recorded_games,
    recorded_layouts,
    recorded_trajectories,
    recording_stats,
    recordings_folder,
    source,
)
from legible_envs.datasets.overcooked_2019.games import read_games
from legible_envs.datasets.overcooked_2019.source import PipSettings, download_archive, read_archive, read_members
from legible_envs.datasets.overcooked_2019.unpickle import ADMITTED, read_table
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.game.replay import GameArrays, predict_transitions
from legible_envs.rollouts import load_trajectories
from tests.legible_envs.datasets.old_pickles import Call, archive, array, dumps, named, simulated_table, table_pickle

ROOM = OvercookedLayout.from_ascii("XXPXX\nO  2O\nX1  X\nXDXSX")
HALL = OvercookedLayout.from_ascii("XXPPX\nX   S\nD12 X\nXOOXX")


def replayed(game: RecordedGame) -> tuple[int, int]:
    """Ticks whose following state and reward the dynamics predict exactly, and all ticks."""
    states = game.states()
    before = GameArrays(*(None if a is None else a[:-1] for a in states))  # type: ignore[arg-type]
    after, rewards = predict_transitions(game.layout, before, game.actions, "overcooked-ai-2019")
    exact = rewards == game.rewards
    for name in ("cells", "facing", "held", "counters", "pots"):
        exact &= (getattr(after, name) == getattr(states, name)[1:]).reshape(game.num_ticks, -1).all(axis=1)
    return int(exact.sum()), game.num_ticks


# -- a published-looking archive of simulated games ------------------------------------------------------------------


@pytest.fixture(scope="module")
def tables() -> dict[str, dict[str, Any]]:
    first, second = simulated_table(ROOM, "room", [1, 2], 300, 0), simulated_table(HALL, "hall", [2], 400, 1)
    train = {key: first[key] + second[key] for key in first}
    return {"train": train, "test": simulated_table(ROOM, "room", [3], 200, 2)}


@pytest.fixture
def published(tables: dict[str, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that the code takes for the published one."""
    pickles = {split: table_pickle(table) for split, table in tables.items()}
    members = {split: (f"overcooked/{split}.pickle", len(data)) for split, data in pickles.items()}
    content = archive({"overcooked/setup.py": b"raise SystemExit", **{members[s][0]: pickles[s] for s in pickles}})
    path = tmp_path / "index" / "overcooked-ai" / source.FILE_NAME
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    monkeypatch.setattr(source, "SHA256", hashlib.sha256(content).hexdigest())
    monkeypatch.setattr(source, "SIZE", len(content))
    monkeypatch.setattr(source, "MEMBERS", members)
    return path


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
    from legible_envs.datasets.overcooked_2019.trajectories import _valid_goals
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


def test_fetching_again_does_nothing_unless_forced(published: Path, tmp_path: Path) -> None:
    folder = fetch_recordings(tmp_path / "out", source=published)
    assert fetch_recordings(folder, index_urls=["file:///nowhere/"]) == folder
    with pytest.raises(RecordingsError, match="--from FILE"):
        fetch_recordings(folder, index_urls=["file:///nowhere/"], force=True)
    assert len(load_recorded_games(folder)) == 4


# -- package indexes -------------------------------------------------------------------------------------------------


def write_index(published: Path, *, digest: str | None = None) -> str:
    """A folder that is served as a package index with one file; returns its address."""
    root = published.parent.parent
    fragment = f"#sha256={digest}" if digest else ""
    link = f'<a href="{published.as_uri()}{fragment}">{published.name}</a>'
    (published.parent / "index.html").write_text(f"<!DOCTYPE html><html><body>{link}</body></html>")
    return root.as_uri() + "/"


def test_the_archive_is_found_on_an_index(published: Path) -> None:
    said: list[tuple[str, int, int]] = []
    url = write_index(published, digest=source.SHA256)
    content = download_archive([url], lambda *what: said.append(what))
    assert content == published.read_bytes()
    assert said[-1] == ("downloading", source.SIZE, source.SIZE)
    # Without a hash on the page, and with another index down before it.
    assert download_archive(["file:///nowhere/", write_index(published)]) == content


def test_another_file_of_the_same_name_is_refused(published: Path, tmp_path: Path) -> None:
    published.write_bytes(published.read_bytes()[:-1] + b"x")
    with pytest.raises(RecordingsError, match=r"not the recorded games.*sha256") as caught:
        download_archive([write_index(published)])
    assert "--from FILE" in str(caught.value)
    with pytest.raises(RecordingsError, match="nothing was read from it"):
        fetch_recordings(tmp_path / "out", source=published)
    assert not (tmp_path / "out").exists()
    published.write_bytes(b"0" * 10_000_000)
    with pytest.raises(RecordingsError, match="more than"):
        download_archive([write_index(published)])
    with pytest.raises(RecordingsError, match="more than"):
        read_archive(published)
    with pytest.raises(RecordingsError, match="cannot read"):
        read_archive(tmp_path)


def test_no_network_is_said_in_words() -> None:
    # Port 9 of this machine answers nobody.
    with pytest.raises(RecordingsError, match=r"could not get overcooked_ai-1\.1\.0\.tar\.gz.*--from FILE") as caught:
        download_archive(["http://user:secret@127.0.0.1:9/simple/"])
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("status", [404, 503])
def test_an_index_without_the_package_is_named(status: int) -> None:
    class Refusing(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_error(status)

        def log_message(self, *args: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Refusing) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        with pytest.raises(RecordingsError, match=rf"127\.0\.0\.1:{server.server_port}.*{status}.*--from FILE"):
            download_archive([f"http://127.0.0.1:{server.server_port}/simple/"])
        server.shutdown()


def test_settings_are_those_of_pip(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    config = tmp_path / "pip.conf"
    config.write_text(
        "[global]\nindex-url = https://main.invalid/simple\nextra-index-url =\n  https://a.invalid/\n  https://b.invalid/\n"
        "trusted-host = a.invalid\ntimeout = 7\n[install]\nfind-links = /some/folder\n"
    )
    monkeypatch.setenv("PIP_CONFIG_FILE", str(config))
    monkeypatch.setenv("XDG_CONFIG_DIRS", str(tmp_path))
    found = PipSettings.from_pip()
    assert found.index_urls[:1] == ("https://main.invalid/simple",)
    assert {"https://a.invalid/", "https://b.invalid/"} <= set(found.index_urls)
    assert found.find_links == ("/some/folder",)
    assert (found.trusted_hosts, found.timeout) == (("a.invalid",), 7.0)
    monkeypatch.setenv("PIP_INDEX_URL", "https://env.invalid/simple")
    monkeypatch.setenv("PIP_TIMEOUT", "soon")
    assert PipSettings.from_pip().index_urls[0] == "https://env.invalid/simple"
    assert PipSettings.from_pip().timeout == 15.0
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    assert PipSettings.from_pip().index_urls == ()


def test_settings_without_pip_are_those_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_pip(*args: Any, **more: Any) -> None:
        raise subprocess.CalledProcessError(1, "pip")

    monkeypatch.setattr(subprocess, "run", no_pip)
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    assert len(PipSettings.from_pip().index_urls) == 1
    monkeypatch.setenv("PIP_INDEX_URL", "https://env.invalid/simple")
    monkeypatch.setenv("PIP_EXTRA_INDEX_URL", "https://more.invalid/")
    assert PipSettings.from_pip().index_urls == ("https://env.invalid/simple", "https://more.invalid/")


# -- archives --------------------------------------------------------------------------------------------------------


def test_archives_are_read_by_exact_name_and_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "MEMBERS", {"train": ("d/a.pickle", 3), "test": ("d/b.pickle", 2)})
    good = {"d/a.pickle": b"abc", "d/b.pickle": b"de"}
    assert read_members(archive({"../../evil": b"x", **good, "d/c.py": b"y"})) == {"train": b"abc", "test": b"de"}
    with pytest.raises(RecordingsError, match="4 bytes in the archive, expected 3"):
        read_members(archive({**good, "d/a.pickle": b"abcd"}))
    with pytest.raises(RecordingsError, match="lacks"):
        read_members(archive({"d/a.pickle": b"abc"}))
    for damaged in (b"", b"not an archive", archive(good)[:60]):
        with pytest.raises(RecordingsError, match=r"damaged|lacks"):
            read_members(damaged)


# -- pickles ---------------------------------------------------------------------------------------------------------


def test_tables_are_rebuilt_without_their_libraries() -> None:
    columns = {
        "text": ["a", "b", "ä"],
        "x": [0.5, 1.5, -2.0],
        "more": ["1", "2", "3"],
        "y": [1.0, 2.0, 3.0],
        "n": [1, 2, 3],
    }
    table = read_table(table_pickle(columns))
    assert list(table) == ["x", "y", "n", "text", "more"]
    for name, values in columns.items():
        assert table[name].tolist() == values
    fortran = Call(
        named("numpy.core.multiarray", "_reconstruct"),
        named("numpy", "ndarray"),
        (0,),
        b"b",
        state=(1, (2, 2), Call(named("numpy", "dtype"), "i8", 0, 1, state=(3, "<")), True, np.arange(4).tobytes()),
    )
    from legible_envs.datasets.overcooked_2019.unpickle import _array, _Reader

    assert _array(_Reader(dumps(fortran)).load()).tolist() == [[0, 2], [1, 3]]
    assert _array(_Reader(dumps(array([[True], [False]], "b1"))).load()).tolist() == [[True], [False]]


class Evil:
    """A pickle that runs a command when it is read by ``pickle``."""

    def __init__(self, function: Any, *args: Any) -> None:
        self.call = function, args

    def __reduce__(self) -> Any:
        return self.call


def test_hostile_pickles_are_refused_and_nothing_runs(tmp_path: Path) -> None:
    mark = tmp_path / "it-ran"
    pickles = {
        "system": pickle.dumps(Evil(os.system, f"touch {mark}")),
        "eval": pickle.dumps(Evil(eval, f"open({str(mark)!r}, 'w')")),
        "open": pickle.dumps(Evil(open, str(mark), "w")),
        "in a table": table_pickle({"a": ["x"]}, index=Call(named("os", "system"), f"touch {mark}")),
        "dotted": dumps(Call(named("numpy", "ndarray.tofile"), str(mark))),
        "other numpy": dumps(Call(named("numpy", "save"), str(mark), 1)),
        "other pandas": dumps(Call(named("pandas.io.pickle", "read_pickle"), str(mark))),
        "persistent": b"\x80\x04\x8c\x04nameQ.",
        "class state": dumps([named("numpy", "ndarray")])[:-1] + b"}b.",
        "not a pickle": b"hello",
        "empty": b"",
        "wrong value": pickle.dumps({"a": 1}),
    }
    pickle.loads(pickles["open"]).close()
    assert mark.exists(), "the test's pickles must be dangerous to be worth refusing"
    mark.unlink()
    for name, data in pickles.items():
        with pytest.raises(RecordingsError) as caught:
            read_table(data)
        assert not mark.exists(), name
        if name in ("system", "in a table", "other numpy", "other pandas"):
            assert "nothing was run" in str(caught.value)


def test_admitted_names_are_never_imported() -> None:
    program = (
        "import sys\n"
        "from legible_envs.datasets.overcooked_2019.unpickle import ADMITTED, _Reader\n"
        "reader = _Reader(b'')\n"
        "found = [reader.find_class(*name) for name in ADMITTED]\n"
        "assert all(type(f.__new__(f)).__mro__[1].__name__ == '_Record' for f in found)\n"
        "assert 'pandas' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
    assert len(ADMITTED) == 8


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_damaged_pickles_never_do_anything_but_fail(data: st.DataObject) -> None:
    whole = table_pickle({"a": ["x", "y"], "b": [1.0, 2.0]})
    broken = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        broken[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    with contextlib.suppress(RecordingsError):
        read_table(bytes(broken))


# -- conversion and files --------------------------------------------------------------------------------------------


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
    from legible_envs.datasets.overcooked_2019.convert import convert_tables

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


def test_the_folder_is_the_users_choice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert recordings_folder(tmp_path) == tmp_path
    monkeypatch.setenv("LEGIBLE_DATA", str(tmp_path))
    assert recordings_folder() == tmp_path / "recordings"
    monkeypatch.delenv("LEGIBLE_DATA")
    assert recordings_folder().parts[-2:] == ("legible-envs", "recordings")


# -- the real ones ---------------------------------------------------------------------------------------------------


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
