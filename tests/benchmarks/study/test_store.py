"""The database: rows are acknowledged once they are there, and one bad job hurts no other."""

from __future__ import annotations

import asyncio
import sqlite3
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.study.errors import StudyError
from benchmarks.study.store import Store, open_readonly, rows
from benchmarks.study.store.joining import is_many, joined


def store_at(tmp_path: Path) -> Store:
    return Store(tmp_path / "live.sqlite", mode="live", name="tiny")


def test_an_acknowledged_row_is_there_for_everybody(tmp_path: Path) -> None:
    store = store_at(tmp_path)
    store.write_now(rows.study_value("x", "1"))
    with open_readonly(tmp_path / "live.sqlite") as database:
        assert database.execute("SELECT value FROM study WHERE key = 'x'").fetchone()[0] == "1"
    store.close()


@pytest.mark.parametrize("bad", ["\ud800", 2**70, object()], ids=["surrogate", "huge", "object"])
def test_a_bad_job_takes_back_its_own_rows_alone(tmp_path: Path, bad: object) -> None:
    """Jobs of many participants share a transaction; what cannot be bound fails for its own participant."""
    store = store_at(tmp_path)

    async def write() -> list[object]:
        good = [store.write(rows.study_value(f"good {n}", "1")) for n in range(20)]
        wrong = store.write(rows.study_value("half", "1"), ("INSERT INTO study VALUES ('b', ?)", [bad]))
        return await asyncio.gather(*good[:10], wrong, *good[10:], return_exceptions=True)

    answers = asyncio.run(write())
    assert [n for n, answer in enumerate(answers) if answer is not None] == [10]
    assert len(store.read("SELECT * FROM study WHERE key LIKE 'good%'")) == 20
    assert store.value("half") == ""
    store.close()


def test_a_closed_database_refuses_at_once(tmp_path: Path) -> None:
    store = store_at(tmp_path)
    store.close()
    store.close()
    with pytest.raises(sqlite3.ProgrammingError, match="closed"):
        store.write_now(rows.study_value("x", "1"))


def test_what_is_no_database_of_this_study_is_refused(tmp_path: Path) -> None:
    store_at(tmp_path).close()
    with pytest.raises(StudyError, match="mode 'live'"):
        Store(tmp_path / "live.sqlite", mode="debug", name="tiny")
    with pytest.raises(StudyError, match="study 'tiny'"):
        Store(tmp_path / "live.sqlite", mode="live", name="other")
    (tmp_path / "text.sqlite").write_text("this is a text and not a database, whatever its name says" * 20)
    with pytest.raises(StudyError, match=r"text\.sqlite"):
        Store(tmp_path / "text.sqlite", mode="live", name="tiny")
    with pytest.raises(StudyError, match="nobody has taken part"), open_readonly(tmp_path / "none.sqlite"):
        pass


_KEYS = st.integers(0, 3).map(str)
_STATEMENTS = st.one_of(
    st.lists(st.integers(0, 200).map(lambda n: ["e", n]), min_size=1, max_size=150).map(
        lambda many: ("INSERT INTO e VALUES (?, ?)", many)
    ),
    st.builds(lambda key, value: ("INSERT OR REPLACE INTO s VALUES (?, ?)", [key, value]), _KEYS, st.floats(0, 1)),
    st.builds(lambda key: ("INSERT INTO e VALUES (?, NULL)", [key]), _KEYS),
    st.builds(lambda key: ("UPDATE s SET value = value + 1 WHERE key = ?", [key]), _KEYS),
)


@given(st.lists(_STATEMENTS, max_size=20))
def test_statements_that_are_joined_do_the_same(statements: list[tuple[str, list[object]]]) -> None:
    """Order counts: a key that is replaced and updated ends with the last value."""
    found = []
    for is_joined in (False, True):
        database = sqlite3.connect(":memory:")
        database.executescript("CREATE TABLE e (a, b); CREATE TABLE s (key PRIMARY KEY, value)")
        executions = joined(statements) if is_joined else statements
        for sql, values in executions:
            (database.executemany if is_many(values) else database.execute)(sql, values)  # type: ignore[arg-type]
        found.append([database.execute(f"SELECT rowid, * FROM {table} ORDER BY rowid").fetchall() for table in "es"])
        database.close()
    assert found[0] == found[1]


def test_steps_of_many_participants_are_few_statements() -> None:
    step = [rows.step_rows(n, "P001", "d", [(0, 1, "00", None, None, 0.0)]) for n in range(200)]
    executions = joined(step)
    assert [sql.count("(?") for sql, _ in executions] == [64, 64, 64, 8]
    assert all(len(values) < 999 for _, values in executions)
