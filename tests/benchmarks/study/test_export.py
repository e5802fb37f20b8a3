"""Exports: everything that was recorded, nothing that says who it was, and one bad row costs one row."""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import json
import re
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from benchmarks.study.analysis import export as exporting
from benchmarks.study.analysis.database import PersonRow, needed_screens
from benchmarks.study.analysis.export import export
from benchmarks.study.analysis.export_files import GrowingTable
from benchmarks.study.analysis.export_rows import COLUMNS
from benchmarks.study.analysis.person_data import TABLES_OF_A_PERSON, forget, hand_out, progress_table, worker_table
from benchmarks.study.analysis.redaction import REMOVED, Redaction
from benchmarks.study.analysis.scales import attention, score
from benchmarks.study.design.questionnaires import Questionnaire
from benchmarks.study.design.study import Study
from benchmarks.study.timeline import timeline
from legible_envs.rollouts import load_trajectories, record_episode
from tests.support.recorded_study import (
    Recorder,
    kitchen_study,
    new_database,
    person_of,
    player_of,
    record_study,
    table_study,
)

TOKEN = "P001-token-that-opens-a-session"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path]:
    """Three participants who are complete, and one who timed out in the second condition."""
    codes = {"codes": {"complete": "SECRETCODE1"}, "completion_url": "https://example.org/done?cc=SECRETCODE1"}
    study = kitchen_study(tmp_path_factory.mktemp("study"), recruitment=codes)
    (study.folder / "study.toml").write_text('code = "SECRETCODE1"\nurl = "https://example.org/done?cc=SECRETCODE1"\n')
    path = record_study(study, 3)
    connection = sqlite3.connect(path)
    recorder = Recorder(study, connection)
    recorder.record(4, until=6, state="timed_out", worker="worker-secret-4")
    # What people type and pages report, wherever it lands.
    update = "UPDATE answers SET value = ? WHERE participant = 'P002' AND item = 'note'"
    connection.execute(update, (json.dumps("I am worker-secret-2, =HYPERLINK(1)"),))
    connection.execute("UPDATE participants SET token_sha256 = ? WHERE participant = 'P001'", (_sha256(TOKEN),))
    detail = json.dumps({"text": f"failed at /s/{TOKEN}?PROLIFIC_PID=worker-secret-1"})
    connection.execute(
        "INSERT INTO events (participant, design, at, kind, detail) VALUES ('P001', ?, 1.0, 'error', ?)",
        (study.design_hash, detail),
    )
    connection.commit()
    connection.close()
    return study, path


@pytest.fixture(scope="module")
def exported(recorded: tuple[Study, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    study, path = recorded
    return export(study, path, tmp_path_factory.mktemp("out")).folder


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _rows(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / f"{name}.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_trajectories_are_those_of_the_same_people_simulated_directly(
    recorded: tuple[Study, Path], exported: Path
) -> None:
    """An oracle: no game of a study has a part in it, only the environment and the same source of randomness."""
    import gymnasium as gym
    import numpy as np

    import legible_envs  # noqa: F401
    from benchmarks.study.timeline import timeline

    study, _ = recorded
    found = [each for each in load_trajectories(exported / "trajectories.npz") if each.participant == "P002"]
    rounds = [row for row in _rows(exported, "rounds") if row["participant"] == "P002" and row["kind"] == "round"]
    assert [row["condition"] for row in rounds] == ["Legible", "Random", "Efficient"]
    screens = {screen.name: i for i, screen in enumerate(timeline(study, [row["condition"] for row in rounds]))}
    simulated = []
    for row in rounds:
        rng = np.random.default_rng((2, screens[row["screen"]]))
        seed = int(rng.integers(2**31))
        settings = {"recipes": study.content.kitchen.soups, "layout": study.layout_of(row["condition"])}
        env = gym.make("LegibleOvercooked-v0", max_episode_steps=5000, **settings)
        player = player_of(study, env, person_of(study, 2), rng)
        simulated += record_episode(env, player, seed=seed, participant="P002", condition=row["condition"])
    assert len(found) == len(simulated) > 15
    for ours, direct in zip(found, simulated, strict=True):
        assert ours.states.tolist() == direct.states.tolist()
        assert (ours.goal, ours.candidates, ours.start) == (direct.goal, direct.candidates, direct.start)
        assert (ours.condition, ours.participant) == (direct.condition, "P002")


def test_tables_hold_what_the_database_holds(recorded: tuple[Study, Path], exported: Path) -> None:
    _, path = recorded
    with sqlite3.connect(path) as connection:
        counts = {
            name: connection.execute(f"SELECT COUNT(*) FROM {table}").fetchone()[0]
            for name, table in {"steps": "steps", "questionnaires": "answers", "participants": "participants"}.items()
        }
    assert {name: len(_rows(exported, name)) for name in counts} == counts
    assert _rows(exported, "problems") == []
    people = {row["participant"]: row for row in _rows(exported, "participants")}
    assert people["P004"]["state"] == "timed_out"
    assert [row["included"] for row in people.values()] == ["1", "1", "1", "0"]
    assert people["P001"]["attention_passed"] == people["P001"]["attention_checks"] == "3"
    assert {each.participant for each in load_trajectories(exported / "trajectories.npz")} == {"P001", "P002", "P003"}
    assert len(load_trajectories(exported / "trajectories.csv")) == len(
        load_trajectories(exported / "trajectories.npz")
    )
    for name, columns in COLUMNS.items():
        if name != "pointer":
            assert (exported / f"{name}.csv").read_text().splitlines()[0] == ",".join(columns)


def test_the_manifest_has_the_checksum_of_every_file(recorded: tuple[Study, Path], exported: Path) -> None:
    study, _ = recorded
    manifest = json.loads((exported / "manifest.json").read_text())
    there = {p.relative_to(exported).as_posix() for p in exported.rglob("*") if p.is_file()} - {"manifest.json"}
    assert set(manifest["files"]) == there
    for name, about in manifest["files"].items():
        content = (exported / name).read_bytes()
        assert about == {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    assert (manifest["mode"], manifest["design"]) == ("live", study.design_hash)
    assert manifest["counts"]["participants"] == 4
    assert manifest["counts"]["included"] == 3


def test_nothing_says_who_took_part(recorded: tuple[Study, Path], exported: Path) -> None:
    secret = re.compile(rb"worker-secret|PROLIFIC_PID=w|token-that-opens|SECRETCODE|prolific")
    _, path = recorded
    assert secret.search(path.read_bytes() + path.with_name("live.sqlite-wal").read_bytes() if
                         path.with_name("live.sqlite-wal").exists() else path.read_bytes())  # fmt: skip
    for file in exported.rglob("*"):
        if file.is_file():
            assert not secret.search(file.read_bytes()), file
    notes = [row["value"] for row in _rows(exported, "questionnaires") if row["item"] == "note"]
    assert f"I am {REMOVED}, =HYPERLINK(1)" in notes
    assert "'=1+1, fine" in notes  # no spreadsheet runs it
    (error,) = [row for row in _rows(exported, "events") if row["kind"] == "error"]
    assert json.loads(error["detail"]) == {"text": f"failed at /s/{REMOVED}?PROLIFIC_PID={REMOVED}"}


def test_incomplete_participants_are_included_when_asked(recorded: tuple[Study, Path], tmp_path: Path) -> None:
    study, path = recorded
    found = export(study, path, tmp_path / "all", include_incomplete=True)
    assert found.counts["included"] == 4
    names = {each.participant for each in load_trajectories(tmp_path / "all" / "trajectories.npz")}
    assert names == {"P001", "P002", "P003", "P004"}


@pytest.mark.parametrize(
    ("statement", "problem", "kept"),
    [
        ("UPDATE steps SET action = '{' WHERE visit = 5 AND step = 2", "steps", 4),
        ("UPDATE steps SET before = 'zz' WHERE visit = 5 AND step = 2", "visits", 4),
        ("DELETE FROM steps WHERE visit = 5 AND step = 2", "visits", 4),
        ("UPDATE answers SET value = '{' WHERE visit = 6", "answers", 4),
        ("UPDATE events SET detail = '{' WHERE participant = 'P001'", "events", 4),
        ("UPDATE participants SET conditions = '7' WHERE participant = 'P001'", "visits", 4),
        ("UPDATE participants SET joined = 'then' WHERE participant = 'P001'", "participants", 3),
        ("UPDATE visits SET seed = 'x' WHERE visit = 5", "visits", 4),
        ("UPDATE visits SET begun = 1e300 WHERE visit = 5", "participants", 3),
        ("DELETE FROM visits WHERE visit = 3", "visits", 4),
    ],
)
def test_one_bad_row_is_listed_and_costs_no_other(
    recorded: tuple[Study, Path], tmp_path: Path, statement: str, problem: str, kept: int
) -> None:
    study, path = recorded
    bad = tmp_path / "bad.sqlite"
    with sqlite3.connect(path) as source, sqlite3.connect(bad) as target:
        source.backup(target)
        assert target.execute(statement).rowcount > 0
    found = export(study, bad, tmp_path / "out")
    problems = _rows(tmp_path / "out", "problems")
    assert problems
    assert found.counts["problems"] == len(problems)
    assert problem in {row["table"] for row in problems}
    assert {row["participant"] for row in problems} == {"P001"}
    assert len(_rows(tmp_path / "out", "participants")) == kept
    assert {"P002", "P003"} <= {e.participant for e in load_trajectories(tmp_path / "out" / "trajectories.npz")}


def test_many_trajectories_make_several_files(
    recorded: tuple[Study, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from benchmarks.study.analysis.data import read_export

    study, path = recorded
    whole = export(study, path, tmp_path / "one")
    monkeypatch.setattr(exporting, "MOST_TRAJECTORIES", 20)
    parts = export(study, path, tmp_path / "many")
    assert parts.counts == whole.counts
    assert len(list((tmp_path / "many").glob("trajectories*.npz"))) == 3
    assert read_export(tmp_path / "many").trajectories == read_export(tmp_path / "one").trajectories


def test_an_export_that_fails_leaves_the_earlier_one(
    recorded: tuple[Study, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, path = recorded
    export(study, path, tmp_path)
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(GrowingTable, "add", full)
    with pytest.raises(OSError, match="No space left"):
        export(study, path, tmp_path)
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


def test_tables_with_a_robot_have_the_teams_measures_and_the_pointer(tmp_path: Path) -> None:
    study = table_study(tmp_path)
    path = record_study(study, 1)
    with sqlite3.connect(path) as connection:
        samples = [(4, n, "P001", study.design_hash, 16.0 * n, 0.1, 0.2) for n in range(5)]
        connection.executemany("INSERT INTO pointer VALUES (?, ?, ?, ?, ?, ?, ?)", samples)
    export(study, path, tmp_path / "out")
    rounds = _rows(tmp_path / "out", "rounds")
    assert {row["reaches"] for row in rounds} == {"4"}
    assert all(0 < float(row["robot_idle"]) < 1 for row in rounds)
    assert [row["at"] for row in _rows(tmp_path / "out", "pointer")] == ["0.0", "16.0", "32.0", "48.0", "64.0"]
    reaches = load_trajectories(tmp_path / "out" / "trajectories.npz")
    assert len(reaches) == 8
    assert all(abs(b - a - 1 / 30) < 1e-9 for each in reaches for a, b in zip(each.times, each.times[1:], strict=False))


@pytest.mark.slow
@pytest.mark.parametrize("make", [kitchen_study, table_study])
def test_minari_gives_the_same_trajectories(make: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("minari")
    from legible_envs.rollouts import from_minari

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "minari"))
    study = make(tmp_path / "study")
    export(study, record_study(study, 1), tmp_path / "out", minari="study/probe-v0")
    ours, theirs = load_trajectories(tmp_path / "out" / "trajectories.npz"), from_minari("study/probe-v0")
    assert [(e.participant, e.condition, e.goal) for e in ours] == [
        (e.participant, e.condition, e.goal) for e in theirs
    ]
    assert [e.states.tolist() for e in ours] == [e.states.tolist() for e in theirs]


# -- redaction and scales ---------------------------------------------------------------------------------------------


def test_redaction_takes_ids_and_tokens_and_nothing_else() -> None:
    remove = Redaction(["abcd", "abcdef", "x"], [_sha256("token_of-16.chars")])
    assert remove("abcdef abcd xyz") == f"{REMOVED} {REMOVED} xyz"
    assert remove(["see token_of-16.chars."]) == [f"see {REMOVED}"]
    assert remove({"abcd": 1, "k": None}) == {REMOVED: 1, "k": None}
    assert remove("token_of-16.charz") == "token_of-16.charz"


def test_scales_are_means_with_reversed_items_turned_round() -> None:
    items = [
        {"name": "a", "kind": "slider", "text": "A", "scale": "load"},
        {"name": "b", "kind": "slider", "text": "B", "scale": "load", "reverse": True},
        {"name": "m", "kind": "matrix", "text": "M", "rows": ["r", "s"], "points": 5, "scale": "team", "reverse": True},
        {"name": "l", "kind": "likert", "text": "L", "scale": "team", "points": 5},
        {"name": "c", "kind": "attention", "text": "C", "options": ["x", "y"], "expected": "y"},
        {"name": "free", "kind": "text", "text": "F"},
    ]
    asked = Questionnaire.model_validate({"title": "T", "items": items})
    found = {one.scale: one for one in score(asked, {"a": 30, "b": 10, "m/1": 2, "m/2": 4, "l": 5, "c": "y"})}
    assert found["load"] == ("load", 60.0, 2, 2)  # 30 and 100 - 10
    assert found["team"] == ("team", pytest.approx((4 + 2 + 5) / 3), 3, 3)
    half = {one.scale: one for one in score(asked, {"a": 30, "b": None, "l": 5, "m/1": "2", "m/2": 9})}
    assert half["load"][1:] == (30.0, 1, 2)
    assert half["team"].value != half["team"].value  # one of three items is answered by a number of the scale
    assert attention(asked, {"c": "y"}) == (1, 1)
    assert attention(asked, {"c": "x"}) == (0, 1)


# -- one person -------------------------------------------------------------------------------------------------------


def test_forgetting_leaves_nothing_and_nobody_else_changes(tmp_path: Path) -> None:
    study = kitchen_study(tmp_path)
    path = record_study(study, 2)
    server = sqlite3.connect(path)  # somebody has it open, as a server has
    assert server.execute("SELECT COUNT(*) FROM participants").fetchall() == [(2,)]
    of_other = {
        table: server.execute(f"SELECT * FROM {table} WHERE participant = 'P002'").fetchall()
        for table in TABLES_OF_A_PERSON
    }
    note = ("", study.design_hash, 1.0, "monitor", json.dumps({"participant": "P001"}))
    server.execute("INSERT INTO events (participant, design, at, kind, detail) VALUES (?, ?, ?, ?, ?)", note)
    server.commit()
    found = forget(path, "P001")
    assert found["participants"] == found["workers"] == 1
    assert found["steps"] > 300
    assert found.is_log_clear
    for table in TABLES_OF_A_PERSON:
        assert server.execute(f"SELECT COUNT(*) FROM {table} WHERE participant = 'P001'").fetchone() == (0,)
        assert server.execute(f"SELECT * FROM {table} WHERE participant = 'P002'").fetchall() == of_other[table]
    server.close()
    left = b"".join(p.read_bytes() for p in path.parent.glob("live.sqlite*"))
    assert b"worker-secret-2" in left
    assert b"worker-secret-1" not in left
    assert b"P001" not in left
    with pytest.raises(ValueError, match="no participant 'P001'"):
        forget(path, "P001")


def test_everything_about_one_person_is_handed_out(tmp_path: Path) -> None:
    import zipfile

    study = kitchen_study(tmp_path)
    path = record_study(study, 2)
    counts = hand_out(study, path, "P002", tmp_path / "p2.zip")
    with zipfile.ZipFile(tmp_path / "p2.zip") as archive:
        about = json.loads(archive.read("data.json"))
        assert "visits.csv" in archive.namelist()
    assert about["workers"][0]["worker"] == "worker-secret-2"
    assert len(about["steps"]) == counts["steps"] > 300
    assert "P001" not in json.dumps(about)
    assert "token_sha256" not in json.dumps(about)
    assert hand_out(study, path, "P002", tmp_path / "p2") == counts
    assert json.loads((tmp_path / "p2" / "data.json").read_text()) == about
    with pytest.raises(ValueError, match="no participant 'P009'"):
        hand_out(study, path, "P009", tmp_path / "none")


def test_progress_says_how_far_everybody_got(recorded: tuple[Study, Path]) -> None:
    study, path = recorded
    table = progress_table(study, path).set_index("participant")
    assert table["state"].tolist() == ["complete"] * 3 + ["timed_out"]
    assert table["share"].tolist()[:3] == [1.0] * 3
    assert table["share"]["P004"] == pytest.approx(0.6)
    assert "worker" not in table
    assert worker_table(path)["worker"].tolist() == [f"worker-secret-{n}" for n in range(1, 5)]


def test_an_empty_study_exports_empty_tables(tmp_path: Path) -> None:
    study = kitchen_study(tmp_path)
    path = tmp_path / "data" / "live.sqlite"
    new_database(path).close()
    assert export(study, path, tmp_path / "out").counts["participants"] == 0
    assert load_trajectories(tmp_path / "out" / "trajectories.npz") == []


def test_rounds_that_were_passed_over_are_no_screens_to_go_through(tmp_path: Path) -> None:
    study = kitchen_study(tmp_path)
    screens = timeline(study, study.conditions)
    rounds = [i for i, screen in enumerate(screens) if screen.kind == "round"]
    person = PersonRow("P001", "", 0, tuple(study.conditions), 0, 0.0, 0.0, len(screens), "complete", None, "en")
    everything = set(range(len(screens)))
    assert needed_screens(study, person, everything) == len(screens)
    assert needed_screens(study, person, everything - {rounds[0]}) == len(screens) - 1
    at_first = dataclasses.replace(person, screen=0, state="active")  # what lies ahead may be needed
    assert needed_screens(study, at_first, set()) == len(screens)
