"""Games of a study, played again: bit by bit what was recorded, and whatever was changed is found."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.study.analysis.database import StepRow, check_design, people, read_only, visits_of
from benchmarks.study.analysis.played import key_times, played
from benchmarks.study.analysis.replaying import game_visits, replay, verify
from benchmarks.study.analysis.watching import chosen_visits, frames_of, save_frames
from benchmarks.study.design.study import Study
from benchmarks.study.timeline import timeline
from tests.support.recorded_study import Recorder, kitchen_study, new_database, record_study, table_study

Recorded = tuple[Study, Path]
unhurried = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
"""The first example may wait for a busy machine, and for Hypothesis to read the loaded sources."""


@pytest.fixture(scope="module")
def kitchens(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    study = kitchen_study(tmp_path_factory.mktemp("kitchens"))
    return study, record_study(study, 2)


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    study = table_study(tmp_path_factory.mktemp("tables"))
    return study, record_study(study, 2)


@pytest.mark.parametrize("recorded", ["kitchens", "tables"])
def test_every_state_is_as_it_was_recorded(recorded: str, request: pytest.FixtureRequest) -> None:
    study, path = request.getfixturevalue(recorded)
    with read_only(path) as connection:
        found = verify(study, connection, people(connection))
        steps = connection.execute("SELECT COUNT(*) FROM steps").fetchone()[0]
    assert found.mismatches == ()
    assert found.states == steps > 500
    assert found.participants == 2


def _changed(path: Path, tmp_path: Path, statement: str) -> Path:
    """A copy of a database in which something is changed."""
    copy = tmp_path / "changed.sqlite"
    with sqlite3.connect(path) as source, sqlite3.connect(copy) as target:
        source.backup(target)
        assert target.execute(statement).rowcount > 0
    return copy


MOVE = """SELECT MIN(a.step) FROM steps a JOIN steps b ON b.visit = a.visit AND b.step = a.step + 1
          WHERE a.visit = 5 AND a.action < '4' AND a.before <> b.before"""


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        (f"UPDATE steps SET action = '4' WHERE visit = 5 AND step = ({MOVE})", "the state before it is"),
        ("UPDATE steps SET before = 'x' WHERE visit = 5 AND step = 7", "step 7: the state before it is"),
        ("DELETE FROM steps WHERE visit = 5 AND step = 9", "step 9 is missing"),
        ("UPDATE steps SET action = '17' WHERE visit = 5 AND step = 2", "step 2 cannot be taken"),
        ("UPDATE steps SET action = '{' WHERE visit = 5 AND step = 2", "step 2 cannot be taken"),
        ("UPDATE visits SET outcome = '{\"steps\": 1}' WHERE visit = 5", "the outcome differs"),
        ("UPDATE visits SET outcome = '[]' WHERE visit = 5", "must be a mapping"),
        ("UPDATE visits SET name = 'round#Other#1' WHERE visit = 5", "of the timeline is"),
        ("UPDATE participants SET conditions = '[' WHERE participant = 'P001'", "timeline"),
    ],
)
def test_whatever_was_changed_is_found(kitchens: Recorded, tmp_path: Path, statement: str, told: str) -> None:
    study, path = kitchens
    with read_only(_changed(path, tmp_path, statement)) as connection:
        found = verify(study, connection, people(connection))
    assert any(told in str(mismatch) for mismatch in found.mismatches), found.mismatches
    assert {mismatch.participant for mismatch in found.mismatches} == {"P001"}


def test_a_visit_is_replayed_to_its_last_step(tables: Recorded) -> None:
    study, path = tables
    with read_only(path) as connection:
        visit = game_visits(visits_of(connection, "P002"))[-1]
        game = replay(study, connection, visit.visit)
    assert json.loads(json.dumps(game.outcome())) == visit.result
    game.close()


def test_reaches_of_earlier_rounds_count(tables: Recorded) -> None:
    study, path = tables
    with read_only(path) as connection:
        rounds = [visit for visit in visits_of(connection, "P001") if visit.kind == "round"]
    made: dict[str, int] = {}
    for visit in rounds:
        made[visit.condition] = made.get(visit.condition, 0) + int(visit.result["reaches"])
    assert set(made.values()) == {study.content.rounds.reaches}


def test_a_round_that_was_begun_again_is_as_recorded(kitchens: Recorded, tmp_path: Path) -> None:
    study, path = kitchens
    note = "UPDATE visits SET outcome = json_set(outcome, '$.restarted', json('true')) WHERE visit = 5"
    with read_only(_changed(path, tmp_path, note)) as connection:
        assert verify(study, connection, people(connection)).mismatches == ()


def test_reaches_of_a_round_that_was_begun_again_do_not_count(tmp_path: Path) -> None:
    study = table_study(tmp_path)
    path = tmp_path / "data" / "live.sqlite"
    connection = new_database(path)
    first = next(screen.name for screen in timeline(study, study.conditions[::-1]) if screen.kind == "round")
    Recorder(study, connection).record(1, begun_again=[first])
    connection.close()
    with read_only(path) as connection:
        found = verify(study, connection, people(connection))
        visits = game_visits(visits_of(connection, "P001"))
    left, *others = [visit for visit in visits if visit.name.rsplit("#", 1)[0] == first.rsplit("#", 1)[0]]
    assert left.result["restarted"]
    assert left.result["reaches"] > 0
    assert sum(visit.result["reaches"] for visit in others) == study.content.rounds.reaches
    assert found.mismatches == ()
    assert found.games == len(visits)


def test_another_design_is_refused_with_what_to_do(kitchens: Recorded, tmp_path: Path) -> None:
    study, path = kitchens
    changed = _changed(path, tmp_path, "UPDATE participants SET design = 'other' WHERE participant = 'P002'")
    with read_only(changed) as connection:
        rows = people(connection)
    with pytest.raises(ValueError, match=rf"--design {study.design_hash}"):
        check_design(study, rows)
    assert [row.participant for row in check_design(study, rows, study.design_hash)] == ["P001"]
    with pytest.raises(ValueError, match="put these files back"):
        check_design(study, rows, "other")
    with pytest.raises(ValueError, match="nobody met the design 'none'"):
        check_design(study, rows, "none")


def test_what_is_no_database_is_refused(tmp_path: Path) -> None:
    (tmp_path / "no.sqlite").write_text("no")
    with pytest.raises(ValueError, match="cannot be read as a study's database"), read_only(tmp_path / "no.sqlite"):
        pass


# -- times ------------------------------------------------------------------------------------------------------------


@unhurried
@given(
    gaps=st.lists(st.floats(0, 5000), min_size=1, max_size=40),
    delays=st.lists(st.floats(0, 0.5), min_size=40, max_size=40),
)
def test_times_are_those_of_the_keys_whatever_the_network(gaps: list[float], delays: list[float]) -> None:
    downs = np.cumsum(gaps)
    rows = [
        StepRow(i, "4", "", float(down), None, 1000 + down / 1000 + delay)
        for i, (down, delay) in enumerate(zip(downs, delays, strict=False))
    ]
    seconds = key_times(rows, begun=1000.0)
    assert len(seconds) == len(gaps) + 1
    assert seconds[0] == 0
    np.testing.assert_allclose(np.diff(seconds)[1:], np.diff(downs) / 1000, atol=1e-6)


@unhurried
@given(
    downs=st.lists(st.one_of(st.none(), st.floats(0, 1e6)), max_size=30),
    delays=st.lists(st.floats(0, 60), min_size=30, max_size=30),
)
def test_times_never_decrease_even_where_pages_are_reloaded_or_tell_none(
    downs: list[float | None], delays: list[float]
) -> None:
    rows = [StepRow(i, "4", "", down, None, 1000.0 + sum(delays[: i + 1])) for i, down in enumerate(downs)]
    seconds = key_times(rows, begun=1000.0)
    assert len(seconds) == len(downs) + 1
    assert seconds[0] == 0
    assert (np.diff(seconds) >= 0).all()
    assert np.isfinite(seconds).all()


def test_a_reload_keeps_the_time_in_between() -> None:
    first = [StepRow(i, "4", "", 1000.0 * i, None, 500.0 + i) for i in range(3)]
    second = [StepRow(3 + i, "4", "", 200.0 + 1000 * i, None, 560.2 + i) for i in range(2)]
    seconds = key_times([*first, *second], begun=499.0)
    np.testing.assert_allclose(seconds, [0, 1, 2, 3, 61.2, 62.2])


def test_trajectories_have_the_times_of_the_keys(kitchens: Recorded) -> None:
    study, path = kitchens
    with read_only(path) as connection:
        person, visits = people(connection)[0], visits_of(connection, "P001")
        visit = next(visit for visit in visits if visit.kind == "round")
        found = played(study, connection, person, visits, visit)
        query = "SELECT key_down FROM steps WHERE visit = ? ORDER BY step"
        downs = [row[0] for row in connection.execute(query, (visit.visit,))]
    known = np.array([downs[0] - 50, *downs]) / 1000  # the first state was shown 50 ms before the first key
    known -= known[0]
    assert len(found.trajectories) > 3
    for trajectory in found.trajectories:
        assert all(np.abs(known - time).min() < 1e-6 for time in trajectory.times)
    assert found.measures["seconds"] == pytest.approx(known[-1])


# -- watching ---------------------------------------------------------------------------------------------------------


def test_a_gif_takes_as_long_as_the_game_at_its_speed(kitchens: Recorded, tmp_path: Path) -> None:
    from PIL import Image

    study, path = kitchens
    with read_only(path) as connection:
        person, visits = people(connection)[0], visits_of(connection, "P001")
        (visit,) = chosen_visits(connection, person, 2)
        seconds = played(study, connection, person, visits, visit).seconds[-1]
        count = save_frames(frames_of(study, connection, person, visit, speed=4.0), tmp_path / "game.gif")
        with pytest.raises(ValueError, match="no game 9; there are 1 practice"):
            chosen_visits(connection, person, 9)
    lasts = 0.0
    with Image.open(tmp_path / "game.gif") as gif:
        for frame in range(gif.n_frames):
            gif.seek(frame)
            lasts += gif.info["duration"] / 1000
    assert count > 20
    assert lasts == pytest.approx(seconds / 4 + 1.5, abs=0.005 * count + 0.1)  # a GIF counts hundredths of a second
