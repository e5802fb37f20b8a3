"""The files of an export as they grow: rows go to the disk as they come, and take their names once all are there."""

from __future__ import annotations

import contextlib
import csv
import hashlib
import math
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final, TextIO

from legible_envs.support.csv_table import spreadsheet_text

__all__ = ["GrowingTable", "checksums", "staging_folder"]

_BLOCK: Final = 1 << 20


class GrowingTable:
    """A CSV that is written row by row; no spreadsheet runs a text in it.

    Args:
        path: The file.
        columns: Its header; a row has these and no others.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.columns = tuple(columns)
        self.rows = 0
        self._stream: TextIO = path.open("w", encoding="utf-8", errors="backslashreplace", newline="")
        self._writer = csv.writer(self._stream, lineterminator="\n")
        self._writer.writerow(self.columns)

    def add(self, row: Mapping[str, Any]) -> None:
        """Write a row; columns that it lacks are empty."""
        self._writer.writerow([_cell(row.get(name)) for name in self.columns])
        self.rows += 1

    def __enter__(self) -> GrowingTable:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stream.close()


def _cell(value: Any) -> Any:
    """A value as it stands in a CSV: texts guarded, truth as 0 and 1, nothing for what is not known."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str):
        # A carriage return alone is not quoted by every writer, and ends a line for some readers.
        return spreadsheet_text(value.replace("\0", "\ufffd").replace("\r\n", "\n").replace("\r", "\n"))
    return value


@contextlib.contextmanager
def staging_folder(out: Path) -> Iterator[Path]:
    """A folder whose files move to ``out`` once all of them are written; after an error ``out`` is as before.

    Files of the same names are replaced, other files stay.
    """
    out.mkdir(parents=True, exist_ok=True)
    staging = out / f".export.part-{os.getpid()}"
    shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir()
    try:
        yield staging
        for path in sorted(staging.rglob("*")):
            target = out / path.relative_to(staging)
            if path.is_dir():
                target.mkdir(exist_ok=True)
            else:
                os.replace(path, target)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def checksums(folder: Path) -> dict[str, dict[str, Any]]:
    """Size and SHA-256 of every file in a folder, by path."""
    found = {}
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        digest = hashlib.sha256()
        with path.open("rb") as stream:
            while block := stream.read(_BLOCK):
                digest.update(block)
        found[path.relative_to(folder).as_posix()] = {"bytes": path.stat().st_size, "sha256": digest.hexdigest()}
    return found
