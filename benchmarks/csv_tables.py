"""Tables as CSV files: every one that is written goes through here, so that no spreadsheet runs a name in it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from legible_envs.support.csv_table import spreadsheet_text, text_of_spreadsheet
from legible_envs.support.files import write_text

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["as_written", "csv_of", "write_table", "write_tables"]


def write_table(path: Path, table: pd.DataFrame) -> Path:
    """Write a table as CSV, all or nothing; folders that are missing are made. See :func:`csv_of`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, csv_of(table))
    return path


def write_tables(folder: Path, tables: Iterable[tuple[str, pd.DataFrame]]) -> list[Path]:
    """Write each table to ``folder/NAME.csv``."""
    return [write_table(folder / f"{name}.csv", table) for name, table in tables]


def csv_of(table: pd.DataFrame) -> str:
    """A table as CSV; a text or heading that spreadsheets would run as a formula has an apostrophe in front."""
    return str(_each_text(table, spreadsheet_text).to_csv(index=False))


def as_written(table: pd.DataFrame) -> pd.DataFrame:
    """A table that was read from such a file, with every text as it was before it was written."""
    return _each_text(table, text_of_spreadsheet)


def _each_text(table: pd.DataFrame, change: Any) -> pd.DataFrame:
    changed = table.copy(deep=False)
    for at, kind in enumerate(table.dtypes):
        if kind.kind == "O":  # texts, also those of categories and of pandas' own kinds of text
            column = table.iloc[:, at]
            found = [change(value) if isinstance(value, str) else value for value in column]
            if any(new is not old for new, old in zip(found, column, strict=True)):
                changed.isetitem(at, found)
    changed.columns = [change(name) if isinstance(name, str) else name for name in table.columns]
    return changed
