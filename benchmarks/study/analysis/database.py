"""The rows of a study's database as an analysis reads them: one snapshot, never written to."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from benchmarks.study.design.study import Study
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import timeline

__all__ = [
    "Answer",
    "PersonRow",
    "StepRow",
    "VisitRow",
    "answers_of",
    "check_design",
    "database_path",
    "needed_screens",
    "people",
    "read_only",
    "steps_of",
    "visits_of",
]

BUSY: Final = 10.0
"""Seconds to wait for a writer."""


@dataclass(frozen=True, slots=True)
class PersonRow:
    """A participant.

    Attributes:
        participant: ``P001``, …
        design: Hash of the design that they met.
        order_number: Row of the order policy's square.
        conditions: In their order; empty where the database holds no list there.
        seed: Theirs.
        joined: Seconds since 1970.
        seen: Last sign of life.
        screen: Index in the timeline.
        state: ``active``, or the ending.
        ended: When, or None.
        language: Of the page.
    """

    participant: str
    design: str
    order_number: int
    conditions: tuple[str, ...]
    seed: int
    joined: float
    seen: float
    screen: int
    state: str
    ended: float | None
    language: str


@dataclass(frozen=True, slots=True)
class VisitRow:
    """A screen that was begun; see the table ``visits``. ``outcome`` is its text, None before the visit ends."""

    visit: int
    participant: str
    design: str
    screen: int
    name: str
    kind: str
    sitting: int
    condition: str
    round: int
    attempt: int
    layout_id: str
    seed: int
    begun: float
    finished: float | None
    outcome: str | None

    @property
    def result(self) -> dict[str, Any]:
        """The outcome; empty where there is none.

        Raises:
            ValueError: It is no mapping in JSON.
        """
        if self.outcome is None:
            return {}
        found = from_row(self.outcome)
        if not isinstance(found, dict):
            raise ValueError(f"the outcome of visit {self.visit} must be a mapping, got {self.outcome!r:.80}")
        return found


@dataclass(frozen=True, slots=True)
class StepRow:
    """A step of a game; ``action`` is JSON, times as in the table ``steps``."""

    step: int
    action: str
    before: str
    key_down: float | None
    frame_shown: float | None
    received: float


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer; ``value`` is JSON."""

    visit: int
    item: str
    questionnaire: str
    value: str
    answered: float


def database_path(study: Study, *, debug: bool = False) -> Path:
    """The file of a study's participants, or of its debug participants.

    Raises:
        FileNotFoundError: There is none yet.
    """
    path = study.folder / "data" / ("debug.sqlite" if debug else "live.sqlite")
    if not path.is_file():
        how = "legible study simulate" if debug else "legible study serve"
        raise FileNotFoundError(f"{path} is missing: nobody has taken part yet; `{how} {study.folder}` fills it")
    return path


@contextmanager
def read_only(path: Path) -> Iterator[sqlite3.Connection]:
    """One snapshot of a database, also of one that a server is writing to.

    Raises:
        ValueError: It is no database of a study.
    """
    address = f"file:{quote(str(path.absolute()))}?mode=ro"
    with closing(sqlite3.connect(address, uri=True, timeout=BUSY, isolation_level=None)) as connection:
        try:
            connection.execute("BEGIN")
            connection.execute("SELECT value FROM study LIMIT 1").fetchone()
        except sqlite3.DatabaseError as error:
            raise ValueError(f"{path} cannot be read as a study's database: {error}") from error
        yield connection


def people(connection: sqlite3.Connection) -> list[PersonRow]:
    """All participants, in the order of their names."""
    columns = "participant, design, order_number, conditions, seed, joined, seen, screen, state, ended, language"
    rows = connection.execute(f"SELECT {columns} FROM participants ORDER BY length(participant), participant")
    found: list[list[Any]] = [[*row[:3], _names(row[3]), *row[4:]] for row in rows]
    return [PersonRow(*values) for values in found]


def _names(text: object) -> tuple[str, ...]:
    try:
        found = from_row(str(text))
    except ValueError:
        return ()
    return tuple(found) if isinstance(found, list) and all(isinstance(name, str) for name in found) else ()


def visits_of(connection: sqlite3.Connection, participant: str) -> list[VisitRow]:
    """The screens that a participant has begun, in order."""
    columns = ", ".join(VisitRow.__slots__)
    found = connection.execute(f"SELECT {columns} FROM visits WHERE participant = ? ORDER BY visit", (participant,))
    return [VisitRow(*row) for row in found]


def steps_of(connection: sqlite3.Connection, visit: int) -> Iterator[StepRow]:
    """The steps of a visit, in order."""
    columns = ", ".join(StepRow.__slots__)
    for row in connection.execute(f"SELECT {columns} FROM steps WHERE visit = ? ORDER BY step", (visit,)):
        yield StepRow(*row)


def answers_of(connection: sqlite3.Connection, participant: str) -> list[Answer]:
    """A participant's answers, in order."""
    columns = ", ".join(Answer.__slots__)
    found = connection.execute(
        f"SELECT {columns} FROM answers WHERE participant = ? ORDER BY visit, item", (participant,)
    )
    return [Answer(*row) for row in found]


def check_design(study: Study, rows: list[PersonRow], wanted: str | None = None) -> list[PersonRow]:
    """The participants who met the design of the study's folder.

    Args:
        study: The folder.
        rows: All participants.
        wanted: The only design to take; None where all rows are expected to be of one.

    Raises:
        ValueError: There are participants of another design, or the folder holds another than is wanted.
    """
    own = study.design_hash
    designs: dict[str, int] = {}
    for row in rows:
        designs[row.design] = designs.get(row.design, 0) + 1
    counted = ", ".join(f"{design} ({number})" for design, number in sorted(designs.items()))
    if wanted is not None and wanted not in designs:
        raise ValueError(
            f"nobody met the design {wanted!r}; the database holds, with participants: {counted or 'none'}"
        )
    taken = wanted or own
    if taken != own:
        raise ValueError(
            f"participants of design {taken} were asked for, but the files in {study.folder} make design {own}; put "
            "these files back as they were (an earlier export holds a copy in its folder `study`)"
        )
    if wanted is None and designs and set(designs) != {own}:
        raise ValueError(
            f"the database holds participants of other designs than {study.folder} has now ({own}): {counted}; "
            f"--design {own} takes those of the present design only, and for others put the study's files back as "
            "they were"
        )
    return [row for row in rows if row.design == taken]


def needed_screens(study: Study, person: PersonRow, done: Collection[int]) -> int:
    """How many screens a participant has to go through; a round that was passed over, its reaches made, is none.

    Args:
        study: The design.
        person: The participant.
        done: Indices of the screens that they have finished.
    """
    screens = timeline(study, person.conditions)
    return sum(i >= person.screen or i in done or screen.kind != "round" for i, screen in enumerate(screens))
