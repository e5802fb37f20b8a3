"""Who may join: workers of a platform or anybody, once or again, while recruitment is open."""

from __future__ import annotations

import contextlib
import sqlite3
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from benchmarks.study.errors import StudyError
from benchmarks.study.store import open_readonly, rows

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.store import Store

__all__ = [
    "PLATFORMS",
    "RecruitmentState",
    "Worker",
    "complete_count",
    "is_open",
    "other_designs",
    "set_recruitment",
    "worker_of",
]

PLATFORMS: Final[Mapping[str, tuple[str, str, str]]] = {
    "prolific": ("PROLIFIC_PID", "STUDY_ID", "SESSION_ID"),
    "mturk": ("workerId", "hitId", "assignmentId"),
}
"""Parameters of a platform's links: worker, study, session."""

RecruitmentState = Literal["open", "paused", "closed"]

_PREVIEW: Final = "ASSIGNMENT_ID_NOT_AVAILABLE"
_LONGEST: Final = 200


@dataclass(frozen=True, slots=True)
class Worker:
    """A participant as a platform knows them; all empty where there is none.

    Attributes:
        source: ``"prolific"``, ``"mturk"`` or ``"none"``.
        worker, study, session: The platform's ids.
        is_preview: They only look: nobody takes part yet.
    """

    source: str = "none"
    worker: str = ""
    study: str = ""
    session: str = ""
    is_preview: bool = False


def worker_of(study: Study, query: Mapping[str, Any]) -> Worker:
    """Who a link speaks of.

    Args:
        study: Says which platform.
        query: Parameters of the link.
    """
    source = study.content.recruitment.source
    if source not in PLATFORMS:
        return Worker()
    worker, of_study, session = (_id(query.get(name, "")) for name in PLATFORMS[source])
    is_preview = not worker or _PREVIEW in (worker, of_study, session)
    return Worker(source, worker, of_study, session, is_preview)


def _id(value: object) -> str:
    """An id as it is stored: of bounded length, and of characters that can be written."""
    text = str(value)[:_LONGEST].encode("utf-8", "replace").decode()
    return "".join(letter for letter in text if letter.isprintable()).strip()


def is_open(study: Study, store: Store) -> bool:
    """Whether new participants may join: nobody has paused or closed recruitment, and more are wanted."""
    if store.mode == "debug":
        return True
    if store.value("recruitment") != "open":
        return False
    wanted = study.content.recruitment.wanted
    return not wanted or complete_count(study, store) < wanted


def complete_count(study: Study, store: Store) -> int:
    """How many participants of this design are complete."""
    found = store.read(
        "SELECT COUNT(*) FROM participants WHERE state = 'complete' AND design = ?", (study.design_hash,)
    )
    return int(found[0][0])


def other_designs(study: Study, store: Store) -> dict[str, int]:
    """How many participants there are of other designs, by their hashes."""
    found = store.read(
        "SELECT design, COUNT(*) FROM participants WHERE design != ? GROUP BY design", (study.design_hash,)
    )
    return {str(row[0]): int(row[1]) for row in found}


def set_recruitment(path: Path, state: RecruitmentState) -> str:
    """Open, pause or close recruitment, whether a server is running or not.

    Args:
        path: The database.
        state: What it is from now on.

    Returns:
        What it was.

    Raises:
        StudyError: There is no database, or it cannot be written.
    """
    with open_readonly(path) as connection:
        before = str(connection.execute("SELECT value FROM study WHERE key = 'recruitment'").fetchone()[0])
        design = connection.execute("SELECT value FROM study WHERE key = 'design'").fetchone()
    event = rows.event_row("", design[0] if design else "", time.time(), "recruitment", before=before, now=state)
    try:
        with contextlib.closing(sqlite3.connect(path, timeout=30.0)) as writer, writer:
            for sql, values in (rows.study_value("recruitment", state), event):
                writer.execute(sql, values)
    except sqlite3.Error as error:
        raise StudyError(f"{path} cannot be written: {error}") from error
    return before
