"""Whose completion code it is: computed again for every participant and ending, since no code is stored."""

from __future__ import annotations

import contextlib
from pathlib import Path

from benchmarks.study.errors import StudyError
from benchmarks.study.server.secrets import Secrets
from benchmarks.study.store import Mode, database_path, open_readonly
from benchmarks.study.timeline import ENDINGS

__all__ = ["find_code"]

_MODES: tuple[Mode, ...] = ("live", "debug")


def find_code(folder: Path, code: str) -> list[str]:
    """Whose code it is, a sentence for each participant that it fits; none where it is nobody's.

    Args:
        folder: Of the study.
        code: As the participant gives it; capitals and blanks around it do not matter.

    Raises:
        StudyError: Nobody has taken part yet, or the study's secret is damaged.
    """
    if not any(database_path(folder, mode).is_file() for mode in _MODES):
        raise StudyError(f"nobody has taken part in {folder} yet")
    secrets = Secrets.of(folder)
    found = []
    for mode in _MODES:
        with contextlib.ExitStack() as stack:
            if not database_path(folder, mode).is_file():
                continue
            database = stack.enter_context(open_readonly(database_path(folder, mode)))
            created = database.execute("SELECT value FROM study WHERE key = 'created'").fetchone()[0]
            own = secrets.of_database(mode, created)
            for row in database.execute("SELECT participant, state FROM participants ORDER BY participant"):
                for ending in ENDINGS:
                    if own.is_code(code, row["participant"], ending):
                        is_so = "as the database says" if row["state"] == ending else f"the database: {row['state']}"
                        found.append(f"{row['participant']}: {ending} ({is_so})")
    return found
