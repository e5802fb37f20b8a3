"""One person's data: handed out as they asked for, forgotten as they asked for; and how far everybody got."""

from __future__ import annotations

import io
import json
import os
import sqlite3
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.csv_tables import csv_of
from benchmarks.study.analysis.database import BUSY, PersonRow, needed_screens, people, read_only, visits_of
from benchmarks.study.analysis.export_rows import moment
from benchmarks.study.design.study import Study
from benchmarks.study.timeline import timeline
from legible_envs.support.files import write_atomically, write_text

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TABLES_OF_A_PERSON", "Forgotten", "forget", "hand_out", "progress_table", "worker_table"]

TABLES_OF_A_PERSON: Final = ("participants", "workers", "visits", "steps", "pointer", "answers", "events")
"""Every table that has rows of a participant."""

_README: Final = """\
Everything that the study "{title}" has stored about participant {participant}.

data.json holds all of it; each table lies beside it as CSV. Times are seconds since 1970 (UTC), but for times of
the browser, which are milliseconds of its own clock.

participants   how far you got, and the order in which you met the conditions
workers        who you are on the platform that sent you, if one did
visits         the screens you were shown, and what each came to
steps          what you did in each game, step by step
pointer        where your pointer was, in games at a table
answers        what you answered; the consent is one of the answers
events         when the page was connected, left, hidden or reported an error
texts          the text that you consented to
"""


class Forgotten(dict[str, int]):
    """Deleted rows by table.

    Attributes:
        is_log_clear: Whether the database's log of writes was emptied, too; a server that reads at this moment
            prevents it, and empties it later.
    """

    is_log_clear: bool = True


def forget(database: Path, participant: str) -> Forgotten:
    """Delete a participant from every table; works while a server runs.

    The deleted rows are overwritten in the file (``secure_delete``), and the log of writes is emptied.

    Raises:
        ValueError: There is no row of such a participant.
        sqlite3.OperationalError: The database stays locked.
    """
    with closing(sqlite3.connect(database, timeout=BUSY, isolation_level=None)) as connection:
        connection.execute("PRAGMA secure_delete = ON")
        connection.execute("BEGIN IMMEDIATE")
        try:
            found = Forgotten()
            for table in TABLES_OF_A_PERSON:
                cursor = connection.execute(f"DELETE FROM {table} WHERE participant = ?", (participant,))
                found[table] = cursor.rowcount
            # What the server noted of somebody by their name.
            named = f'%"{_like(participant)}"%'
            cursor = connection.execute(
                "DELETE FROM events WHERE participant = '' AND detail LIKE ? ESCAPE '\\'", (named,)
            )
            found["events"] += cursor.rowcount
            if not any(found.values()):
                raise ValueError(f"there is no participant {participant!r} in {database}")
            connection.execute("COMMIT")
        except BaseException:
            connection.execute("ROLLBACK")
            raise
        busy, *_ = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        found.is_log_clear = not busy
        return found


def _like(text: str) -> str:
    return text.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")


# -- hand out ---------------------------------------------------------------------------------------------------------


def hand_out(study: Study, database: Path, participant: str, out: Path) -> dict[str, int]:
    """Write everything that is stored about one person, their worker row among it.

    Args:
        study: The design.
        database: Its database.
        participant: Who.
        out: A ``.zip``, or a folder.

    Returns:
        Rows by table.

    Raises:
        ValueError: There is no such participant.
        OSError: The files cannot be written.
    """
    with read_only(database) as connection:
        connection.row_factory = sqlite3.Row
        tables = {name: _rows(connection, name, participant) for name in TABLES_OF_A_PERSON}
        if not any(tables.values()):
            raise ValueError(f"there is no participant {participant!r} in {database}")
        consented = [str(row["value"]).strip('"') for row in tables["answers"] if row["item"] == "consent"]
        marks = ", ".join("?" * len(consented))
        texts = connection.execute(f"SELECT * FROM texts WHERE sha256 IN ({marks})", consented)
        tables["texts"] = [dict(row) for row in texts]
    files = _files(study, participant, tables)
    if out.suffix.lower() == ".zip":
        _write_zip(out, files)
    else:
        out.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            write_text(out / name, text)
    return {name: len(rows) for name, rows in tables.items()}


def _rows(connection: sqlite3.Connection, table: str, participant: str) -> list[dict[str, Any]]:
    found = connection.execute(f"SELECT * FROM {table} WHERE participant = ?", (participant,))
    # The hash of the link's token says nothing about a person, and is nobody's to have.
    return [{key: row[key] for key in row.keys() if key != "token_sha256"} for row in found]  # noqa: SIM118


def _files(study: Study, participant: str, tables: dict[str, list[dict[str, Any]]]) -> dict[str, str]:
    import pandas as pd

    about = {"study": study.content.title, "participant": participant, **tables}
    files = {
        "README.txt": _README.format(title=study.content.title, participant=participant),
        "data.json": json.dumps(about, indent=1, ensure_ascii=False, default=str) + "\n",
    }
    return files | {f"{name}.csv": csv_of(pd.DataFrame(rows)) for name, rows in tables.items() if rows}


def _write_zip(path: Path, files: dict[str, str]) -> None:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name, text.encode(errors="backslashreplace"))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda stream: stream.write(content.getvalue()))
    os.chmod(path, 0o600)  # one person's data are for one person's eyes


# -- progress ---------------------------------------------------------------------------------------------------------


def progress_table(study: Study, database: Path, *, told: Callable[[str], object] | None = None) -> pd.DataFrame:
    """Who got how far and why it ended: for partial pay.

    Args:
        study: The design.
        database: Its database.
        told: Called with what cannot be read.

    Returns:
        ``participant, state, screens_done, screens, share, rounds_done, minutes, joined, ended, at`` (the screen they
        are at, or ended at).
    """
    import pandas as pd

    rows = []
    with read_only(database) as connection:
        for person in people(connection):
            try:
                rows.append(_progress(study, connection, person))
            except (ValueError, TypeError, KeyError) as error:
                if told is not None:
                    told(f"{person.participant}: cannot be read: {error}")
    columns = [
        "participant",
        "state",
        "screens_done",
        "screens",
        "share",
        "rounds_done",
        "minutes",
        "joined",
        "ended",
        "at",
    ]
    return pd.DataFrame(rows, columns=columns)


def _progress(study: Study, connection: sqlite3.Connection, person: PersonRow) -> dict[str, Any]:
    screens, visits = timeline(study, person.conditions), visits_of(connection, person.participant)
    done = {visit.screen for visit in visits if visit.finished is not None}
    until = person.ended if person.ended is not None else person.seen
    complete = person.state == "complete"
    return {
        "participant": person.participant,
        "state": person.state,
        "screens_done": len(done),
        "screens": needed_screens(study, person, done),
        # Rounds that were not needed are screens that nobody saw.
        "share": 1.0 if complete else round(min(person.screen, len(screens)) / len(screens), 3),
        "rounds_done": sum(screen.kind == "round" for i, screen in enumerate(screens) if i in done),
        "minutes": round((until - person.joined) / 60, 1),
        "joined": moment(person.joined),
        "ended": moment(person.ended),
        "at": screens[person.screen].name if 0 <= person.screen < len(screens) else "end",
    }


def worker_table(database: Path) -> pd.DataFrame:
    """Who participants are on their platform: ``participant, source, worker, study, session``."""
    import pandas as pd

    columns = ["participant", "source", "worker", "study", "session"]
    with read_only(database) as connection:
        found = connection.execute(
            f"SELECT {', '.join(columns)} FROM workers ORDER BY length(participant), participant"
        )
        return pd.DataFrame(found.fetchall(), columns=columns)
