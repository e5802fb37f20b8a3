"""The export of a study: trajectories, tables and a manifest, in files that need neither the server nor this package.

Participants are read and written one after another: memory does not grow with their number, but for the trajectories,
of which at most :data:`MOST_TRAJECTORIES` are held (and then written to a file of their own).
"""

from __future__ import annotations

import contextlib
import json
import platform
import sqlite3
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.study.analysis.database import PersonRow, check_design, people, read_only
from benchmarks.study.analysis.export_files import GrowingTable, checksums, staging_folder
from benchmarks.study.analysis.export_rows import COLUMNS, PersonRows, moment, rows_of
from benchmarks.study.analysis.redaction import Redaction
from benchmarks.study.design.study import Study
from legible_envs import __version__
from legible_envs.support.files import write_text

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["KIND", "MOST_TRAJECTORIES", "Exported", "export", "mode_of"]

KIND: Final = "legible-envs study export"
SCHEMA: Final = 1
MOST_TRAJECTORIES: Final = 10_000
"""Of one file; further ones are ``trajectories-2.npz``, ``trajectories-2.csv``, …."""

Progress = Callable[[int, int, str], object]
"""Called with how many participants are done, how many there are, and the name of the next."""


@dataclass(frozen=True, slots=True)
class Exported:
    """What an export wrote.

    Attributes:
        folder: Where.
        counts: ``participants, complete, included, rounds, trajectories, steps, answers, problems``.
    """

    folder: Path
    counts: Mapping[str, int]


def export(
    study: Study,
    database: Path,
    out: Path,
    *,
    include_incomplete: bool = False,
    design: str | None = None,
    minari: str | None = None,
    progress: Progress | None = None,
) -> Exported:
    """Write everything about a study's participants but who they are.

    A row or game that cannot be read is left out and listed in ``problems.csv``; nothing of the sort ends an export.
    Files are replaced once all are written; after an error the folder is as before.

    Args:
        study: The design.
        database: Its database.
        out: Folder; made where it is missing.
        include_incomplete: Whether trajectories are written of participants who did not get to the end, too.
        design: The only design to take, by its hash; None where all participants must have met the folder's.
        minari: Id of a Minari data set to make of the rounds, too; all of them are held in memory for it.
        progress: Called before each participant.

    Raises:
        ValueError: The database is none, or holds participants of other designs.
        ImportError: A Minari data set is asked for, and Minari is not installed.
        OSError: The files cannot be written.
    """
    with read_only(database) as connection, staging_folder(out) as staging:
        rows = check_design(study, people(connection), design)
        included = {row.participant for row in rows if include_incomplete or row.state == "complete"}
        counts = _write_rows(study, connection, rows, included, staging, progress)
        _copy_design(study, Redaction.of(study, connection), staging / "study")
        if minari is not None:
            from benchmarks.study.analysis.minari_export import write_minari

            write_minari(study, connection, [row for row in rows if row.participant in included], minari)
        manifest = {
            "kind": KIND,
            "schema": SCHEMA,
            "study": study.content.name,
            "title": study.content.title,
            "domain": study.content.domain,
            "mode": mode_of(connection),
            "design": design or study.design_hash,
            "exported": moment(time.time()),
            "included": "all participants" if include_incomplete else "participants who are complete",
            "versions": {"legible-envs": __version__, "python": platform.python_version(), **_versions()},
            "counts": counts,
            "minari": minari,
            "files": checksums(staging),
        }
        write_text(staging / "manifest.json", json.dumps(manifest, indent=2, ensure_ascii=False) + "\n")
    return Exported(out, counts)


def mode_of(connection: sqlite3.Connection) -> str:
    """``live`` or ``debug``, as the database says."""
    row = connection.execute("SELECT value FROM study WHERE key = 'mode'").fetchone()
    return str(row[0]) if row else ""


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    return {name: version(name) for name in ("gymnasium", "numpy")}


# -- rows -------------------------------------------------------------------------------------------------------------


def _write_rows(
    study: Study,
    connection: sqlite3.Connection,
    persons: Sequence[PersonRow],
    included: set[str],
    folder: Path,
    progress: Progress | None,
) -> dict[str, int]:
    """Every table, and the trajectories; returns what there is."""
    redaction = Redaction.of(study, connection)
    names = [name for name in COLUMNS if name != "pointer" or study.content.domain == "tabletop"]
    with contextlib.ExitStack() as stack:
        tables = {name: stack.enter_context(GrowingTable(folder / f"{name}.csv", COLUMNS[name])) for name in names}
        files = _TrajectoryFiles(folder)
        for number, person in enumerate(persons):
            if progress is not None:
                progress(number, len(persons), person.participant)
            found = _rows_or_problem(study, connection, person, redaction, person.participant in included)
            for name, table in tables.items():
                for row in found.tables[name]:
                    table.add(row)
            files.add(found.trajectories)
        files.close()
        return {
            "participants": len(persons),
            "complete": sum(person.state == "complete" for person in persons),
            "included": len(included),
            "rounds": tables["rounds"].rows,
            "trajectories": files.count,
            "steps": tables["steps"].rows,
            "answers": tables["questionnaires"].rows,
            "problems": tables["problems"].rows,
        }


def _rows_or_problem(
    study: Study, connection: sqlite3.Connection, person: PersonRow, redaction: Redaction, included: bool
) -> PersonRows:
    """A participant's rows; or, whatever is wrong with them, a row that says so."""
    try:
        return rows_of(study, connection, person, redaction, included=included)
    except Exception as error:  # one participant's rows must not cost those of the others
        found = PersonRows()
        message = f"left out, as these rows cannot be read: {type(error).__name__}: {error}"
        found.problem(person.participant, "participants", person.participant, message)
        return found


class _TrajectoryFiles:
    """Trajectories in files of at most :data:`MOST_TRAJECTORIES`."""

    def __init__(self, folder: Path) -> None:
        self.count = 0
        self._folder = folder
        self._held: list[Trajectory] = []
        self._number = 1

    def add(self, trajectories: Sequence[Trajectory]) -> None:
        """Keep trajectories, and write them once they are many."""
        self._held += trajectories
        self.count += len(trajectories)
        if len(self._held) >= MOST_TRAJECTORIES:
            self._write()

    def close(self) -> None:
        """Write what is held; a first file is there even without trajectories."""
        if self._held or self._number == 1:
            self._write()

    def _write(self) -> None:
        from legible_envs.rollouts import save_trajectories, write_csv

        name = "trajectories" if self._number == 1 else f"trajectories-{self._number}"
        save_trajectories(self._folder / f"{name}.npz", self._held)
        write_csv(self._folder / f"{name}.csv", self._held)
        self._held, self._number = [], self._number + 1


# -- the design -------------------------------------------------------------------------------------------------------


def _copy_design(study: Study, redaction: Redaction, folder: Path) -> None:
    """The study's files as they were, without completion codes: nothing else of its folder, and no secret of it."""
    own, content = study.folder, study.content
    wanted = [own / "study.toml", *(own / path for path in study.layouts)]
    if content.table.task.endswith((".yaml", ".yml")):
        wanted.append(own / content.table.task)
    wanted += sorted((own / content.texts).glob("*")) + sorted((own / "questionnaires").glob("*.toml"))
    for path in wanted:
        if not path.is_file():
            continue
        target = folder / path.relative_to(own)
        target.parent.mkdir(parents=True, exist_ok=True)
        write_text(target, redaction(path.read_text(encoding="utf-8", errors="replace")))
