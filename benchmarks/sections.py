"""What an experiment hands to a report: pieces of a title, words, tables and figures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from legible_envs.files import write_atomically

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Section", "write_table", "write_tables"]


@dataclass(frozen=True, eq=False)
class Section:
    """One piece of a report.

    Attributes:
        title: Its heading.
        text: What its tables and figures say; paragraphs are separated by an empty line.
        tables: By the caption that stands above each.
        figures: Files, ``.svg`` or ``.png``, in the order to be shown.
    """

    title: str
    text: str = ""
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    figures: list[Path] = field(default_factory=list)


def write_table(path: Path, table: pd.DataFrame) -> Path:
    """Write a table as CSV, all or nothing; folders that are missing are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda stream: stream.write(table.to_csv(index=False).encode()))
    return path


def write_tables(folder: Path, tables: Iterable[tuple[str, pd.DataFrame]]) -> list[Path]:
    """Write each table to ``folder/NAME.csv``."""
    return [write_table(folder / f"{name}.csv", table) for name, table in tables]
