r"""Trajectories as CSV, a row per state, for spreadsheets and data from elsewhere.

=================  ====================================================================================================
``trajectory``     which trajectory the row belongs to: any text; its rows are in order, one after another
``row``, ``col``   the cell, whole numbers; the last row of a complete trajectory is the goal's own cell
``x``, ``y``, …    or the position (``x``; ``x, y``; or ``x, y, z``), numbers; not read where there are ``row, col``
``time``           seconds (optional; without it states count 0, 1, 2, …)
``goal``           name of the goal reached; empty where it is not known
``candidates``     goals that were possible, ``;`` between them (optional; without it all goals of the file)
``start``          where the person came from (optional, as all that follow)
``participant``    who
``condition``      under which condition
``layout_name``    name of the layout
``layout``         the layout as its kind writes it in one line: a kitchen's drawing, ``/`` between rows; a table's JSON
``candidate_set``  ``task``, ``game`` or ``all`` (the default)
``positions``      where each of ``candidates`` is: coordinates with blanks, ``;`` between goals
``complete``       ``1`` (the default), or ``0`` for a prefix
``layout_kind``    name of the layout's kind (:mod:`legible_envs.layout_kinds`); written only where the layout's text
                   alone does not tell it
=================  ====================================================================================================

A header names the columns, in any order and in upper or lower case, none of them twice; other columns are ignored.
Everything from ``goal`` on is the same in all rows of a trajectory.

Numbers are written with a decimal point and ASCII digits, such as ``-0.5`` or ``2e-3``; no ``nan``, ``inf``, ``1_0``
or ``0x1``. Text is UTF-8, or UTF-16 with a byte-order mark. Commas stand between values, or semicolons or tabs, which
the header tells. Values that hold one, a quote or a line break are quoted, their quotes doubled (RFC 4180); blanks at
the ends of a value count only where it is quoted. The same holds inside ``candidates``: ``"a;b";c`` are two goals.
Rows without any value are skipped; every other row has as many values as the header.

Spreadsheets run what begins like a formula. In the columns from ``goal`` to ``layout`` such a text, ``=1+1``, is
written with an apostrophe in front, ``'=1+1``, and read without it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.layout_kinds import LayoutKind, kind_named, kind_of, kind_of_line
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.csv_table import (
    DELIMITERS,
    CsvRecord,
    CsvSyntaxError,
    join_values,
    read_records,
    split_values,
    spreadsheet_text,
    text_of_spreadsheet,
)
from legible_envs.support.file_kinds import describe_file
from legible_envs.support.files import write_text
from legible_envs.support.text import decode_text
from legible_envs.support.validation import LARGEST, shown

__all__ = ["is_csv_of_trajectories", "read_csv", "write_csv"]

_CELLS: Final = ("row", "col")
_AXES: Final = ("x", "y", "z")
_TEXTS: Final = ("start", "participant", "condition", "layout_name")
_NAMED: Final = ("goal", "candidates", *_TEXTS, "layout")
_SAME: Final = (*_NAMED, "candidate_set", "positions", "complete")
_KIND: Final = "layout_kind"
_COLUMNS: Final = ("trajectory", "time", *_CELLS, *_AXES, *_SAME, _KIND)
_EXPECTED: Final = "expected columns 'trajectory', 'goal' and row, col (cells) or x, y (positions)"

_WHOLE: Final = re.compile(r"[+-]?[0-9]+")
_REAL: Final = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_DECIMAL_COMMA: Final = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")

T = TypeVar("T")


class _Refusal(ValueError):
    """What is wrong; the message begins with the line."""


# -- writing ----------------------------------------------------------------------------------------------------------


def write_csv(path: str | os.PathLike[str], trajectories: Iterable[Trajectory]) -> Path:
    """Write trajectories as CSV, all or nothing; see the module for the columns. :func:`read_csv` gives them back.

    Returns:
        The path written.

    Raises:
        ValueError: Cells and positions, or different dimensions, in one file; a trajectory without states, which has
            no row; a name that no text file can hold (a zero character or half of a surrogate pair).
        OSError: The file cannot be written; what was there before is untouched.
    """
    trajectories = list(trajectories)
    axes = _axes_of(trajectories)
    described = _described(trajectories)
    named = any(kind and kind_of_line(line) is not kind for kind, line in described.values())
    lines = [join_values(["trajectory", "time", *axes, *_SAME, *([_KIND] if named else [])])]
    for number, each in enumerate(trajectories):
        if not each.num_states:
            raise ValueError(f"trajectory {number} has no states, and CSV has a row per state; use `save_trajectories`")
        kind, line = described[each.layout]
        same = [each.goal or "", join_values(each.candidates, ";"), *(getattr(each, name) for name in _TEXTS)]
        places = ";".join(" ".join(map(repr, place)) for place in each.goal_positions or ())
        same += [line, each.candidate_set, places, str(int(each.complete))]
        same += [kind.name if kind else ""] if named else []
        _check_writable(number, same)
        same[: len(_NAMED)] = map(spreadsheet_text, same[: len(_NAMED)])
        tail = join_values(same)
        for time, state in zip(each.times.tolist(), each.states.tolist(), strict=True):
            lines.append(f"{number},{time!r},{','.join(map(repr, state))},{tail}")
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    write_text(target, "\n".join(lines) + "\n")
    return target


def _check_writable(number: int, texts: Sequence[str]) -> None:
    for text in texts:
        if "\0" in text or any("\ud800" <= character <= "\udfff" for character in text):
            raise ValueError(
                f"trajectory {number}: {shown(text)} holds a zero character or half of a surrogate pair, which no text "
                "file can hold; use `save_trajectories`"
            )


def _axes_of(trajectories: Sequence[Trajectory]) -> tuple[str, ...]:
    """The columns of the states."""
    forms = {(each.is_grid, each.states.shape[1]) for each in trajectories} or {(True, 2)}
    if len(forms) > 1:
        raise ValueError("one file holds trajectories of one kind; these are of different dimensions or types")
    is_grid, dimension = forms.pop()
    if (is_grid and dimension != 2) or dimension > len(_AXES):
        raise ValueError(f"CSV holds (row, col) cells or positions in 1 to 3 dimensions, got {dimension}")
    return _CELLS if is_grid else _AXES[:dimension]


def _described(trajectories: Iterable[Trajectory]) -> dict[Any, tuple[LayoutKind | None, str]]:
    """Kind and line of every layout; of none, an empty line."""
    described: dict[Any, tuple[LayoutKind | None, str]] = {None: (None, "")}
    for each in trajectories:
        if each.layout not in described:
            kind = kind_of(each.layout)
            described[each.layout] = kind, kind.line(each.layout)
    return described


# -- reading ----------------------------------------------------------------------------------------------------------


def read_csv(path: str | os.PathLike[str], *, layout: Any = None) -> list[Trajectory]:
    """Read trajectories from CSV; see the module for the columns.

    Args:
        path: The file.
        layout: The layout of trajectories whose rows name none.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not such a table, with what it looks like; a missing or doubled column; or a value that is wrong,
            with its line.
    """
    name = os.fspath(path)
    data = Path(path).read_bytes()
    try:
        text = decode_text(data, name, unify=False)
    except ValueError as error:
        raise ValueError(
            f"{error}. {name} looks like {describe_file(path)}, and is not a CSV of trajectories"
        ) from error
    try:
        table = _Table.of(text)
        return _trajectories(table, _Layouts(layout))
    except (CsvSyntaxError, _Refusal) as error:
        if is_csv_of_trajectories(text):
            raise ValueError(f"{name}, {error}") from error
        raise ValueError(f"{name} looks like {describe_file(path)}; {_EXPECTED} ({error})") from error


def is_csv_of_trajectories(text: str) -> bool:
    """Whether a text, or its beginning, has the header of such a file, right in every part or not."""
    header = _first_line(text)
    return any("trajectory" in _names(header.split(delimiter)) for delimiter in DELIMITERS)


@dataclass(frozen=True)
class _Table:
    """A file: where each known column stands, and its rows in groups of one trajectory each."""

    columns: dict[str, int]
    axes: tuple[str, ...]
    groups: list[list[CsvRecord]]

    @classmethod
    def of(cls, text: str) -> _Table:
        delimiter = _delimiter(text)
        records = read_records(text, delimiter)
        header = next(records, CsvRecord(1, []))
        columns = _checked_header(header)
        width, seen = len(header.values), set[str]()
        groups: list[list[CsvRecord]] = []
        at, present = columns["trajectory"], None
        for record in records:
            if len(record.values) != width:
                _pad(record, width, delimiter)
            label = record.values[at]
            if label != present:
                if not label:
                    raise CsvSyntaxError(f"line {record.line}: 'trajectory' is empty; every row names its trajectory")
                if label in seen:
                    raise CsvSyntaxError(f"line {record.line}: rows of trajectory {label!r} are not together")
                seen.add(label)
                groups.append([])
                present = label
            groups[-1].append(record)
        return cls(columns, _axes(header.line, columns), groups)

    def text(self, record: CsvRecord, column: str) -> str:
        """A value; empty where the file has no such column."""
        at = self.columns.get(column)
        if at is None:
            return ""
        return text_of_spreadsheet(record.values[at]) if column in _NAMED else record.values[at]


def _first_line(text: str) -> str:
    return next((line for line in text[:100_000].splitlines() if line.strip()), "")


def _names(values: Iterable[str]) -> list[str]:
    return [value.strip().strip('"').strip().lower() for value in values]


def _delimiter(text: str) -> str:
    """What stands between the names of the header: the one that makes most known columns of it."""
    header = _first_line(text)
    counts = {delimiter: len(set(_names(header.split(delimiter))) & set(_COLUMNS)) for delimiter in DELIMITERS}
    return max(counts, key=lambda delimiter: counts[delimiter])


def _checked_header(header: CsvRecord) -> dict[str, int]:
    names = _names(header.values)
    columns: dict[str, int] = {}
    for at, name in enumerate(names):
        if name in columns:
            raise CsvSyntaxError(
                f"line {header.line}: the column {name!r} is there twice, as columns {columns[name] + 1} and {at + 1}; "
                "upper and lower case mean the same"
            )
        if name in _COLUMNS:
            columns[name] = at
    if "trajectory" in columns and not {"goal", "candidates"} & set(columns):
        raise _Refusal(f"line {header.line}: {_EXPECTED}; found {shown(header.values)}")
    if "trajectory" not in columns:
        other = next((mark for mark in "|:" if len(names) == 1 and header.values[0].count(mark) > 1), None)
        hint = f" (with {other!r} between values, where commas, semicolons or tabs are read)" if other else ""
        raise _Refusal(f"line {header.line}: found {shown(header.values)}{hint}")
    _axes(header.line, columns)
    return columns


def _axes(line: int, columns: dict[str, int]) -> tuple[str, ...]:
    if all(axis in columns for axis in _CELLS):
        return _CELLS
    found = tuple(axis for axis in _AXES if axis in columns)
    if not found or found != _AXES[: len(found)]:
        known = sorted(columns, key=lambda name: columns[name])
        raise _Refusal(f"line {line}: expected the columns row, col (cells) or x, y (positions); found {known}")
    return found


def _pad(record: CsvRecord, width: int, delimiter: str) -> None:
    """Let a row pass whose values beyond the header are empty, as spreadsheets write them."""
    while len(record.values) > width and not record.values[-1]:
        record.values.pop()
    if len(record.values) != width:
        hint = (
            ". A comma inside a value has to be quoted, and numbers take a decimal point"
            if len(record.values) > width and delimiter == ","
            else ""
        )
        raise CsvSyntaxError(
            f"line {record.line}: the header names {width} columns, this row has {len(record.values)} values, with "
            f"{DELIMITERS[delimiter]} between them{hint}"
        )


class _Layouts:
    """The layouts of a file, each read once.

    Args:
        default: The layout of rows that name none.
    """

    def __init__(self, default: Any) -> None:
        self._default = default
        self._read: dict[tuple[str, str], Any] = {}

    def of(self, line: str, name: str) -> Any:
        """The layout that a row describes by ``line``, and the ``name`` of its kind, where it has one.

        Raises:
            LayoutError: It is malformed, or of a kind that is not known.
        """
        if not line:
            return self._default
        if (name, line) not in self._read:
            kind = kind_named(name) if name else kind_of_line(line)
            if kind is None:
                raise LayoutError(f"no layout kind recognises {line!r}; name it in a column {_KIND!r}", rule="kind")
            self._read[name, line] = kind.read_line(line)
        return self._read[name, line]


def _trajectories(table: _Table, layouts: _Layouts) -> list[Trajectory]:
    goals = tuple(sorted({table.text(rows[0], "goal") for rows in table.groups} - {""}))
    found = []
    for rows in table.groups:
        try:
            found.append(_trajectory(table, rows, goals, layouts))
        except _Refusal:
            raise
        except ValueError as error:  # what the rows say together is wrong
            label = table.text(rows[0], "trajectory")
            raise _Refusal(f"line {rows[0].line}: trajectory {label!r}: {error}") from error
    return found


def _trajectory(table: _Table, rows: list[CsvRecord], goals: tuple[str, ...], layouts: _Layouts) -> Trajectory:
    first = rows[0]
    _check_same(table, rows)
    about = {column: table.text(first, column) for column in (*_SAME, _KIND)}
    complete = about["complete"] or "1"
    if complete not in ("0", "1"):
        raise _Refusal(f"line {first.line}: 'complete' must be 0 or 1, got {complete!r}")
    number: Callable[[CsvRecord, str, str], Any] = _whole if table.axes == _CELLS else _real
    states = [[number(row, axis, row.values[table.columns[axis]]) for axis in table.axes] for row in rows]
    return Trajectory(
        states=np.array(states, dtype=np.int64 if number is _whole else np.float64),
        times=_times(table, rows),
        goal=about["goal"] or None,
        candidates=_candidates(about["candidates"]) or goals,
        layout=layouts.of(about["layout"], about[_KIND]),
        candidate_set=about["candidate_set"] or "all",  # type: ignore[arg-type]
        complete=complete == "1",
        goal_positions=_places(first, about["positions"]),
        **{name: about[name] for name in _TEXTS},  # type: ignore[arg-type]
    )


def _check_same(table: _Table, rows: list[CsvRecord]) -> None:
    first = rows[0]
    for column in (*_SAME, _KIND):
        at = table.columns.get(column)
        if at is None:
            continue
        for row in rows:
            if row.values[at] != first.values[at]:
                raise _Refusal(f"line {row.line}: {column!r} differs from line {first.line}, in one trajectory")


def _times(table: _Table, rows: list[CsvRecord]) -> list[float] | None:
    texts = [table.text(row, "time") for row in rows]
    if not any(texts):
        return None
    if "" in texts:
        raise _Refusal(f"line {rows[texts.index('')].line}: no time, while other rows have one")
    times = [_real(row, "time", text) for row, text in zip(rows, texts, strict=True)]
    for row, before, after in zip(rows[1:], times, times[1:], strict=False):
        if after < before:
            raise _Refusal(f"line {row.line}: times must never decrease; {after!r} follows {before!r}")
    return times


def _candidates(text: str) -> tuple[str, ...]:
    if '"' in text:
        values = split_values(text, ";")
        if values is not None:
            return tuple(name for name in values if name)
    return tuple(part.strip(" \t") for part in text.split(";") if part.strip(" \t"))


def _places(row: CsvRecord, text: str) -> tuple[tuple[float, ...], ...] | None:
    if not text:
        return None
    try:
        return tuple(tuple(_real(row, "positions", part) for part in place.split()) for place in text.split(";"))
    except _Refusal as error:
        raise _Refusal(
            f"line {row.line}: 'positions' must be numbers with ';' between goals, got {shown(text)}"
        ) from error


def _whole(row: CsvRecord, column: str, text: str) -> int:
    if _WHOLE.fullmatch(text) and len(text) <= 25 and -LARGEST - 1 <= int(text) <= LARGEST:
        return int(text)
    raise _Refusal(f"line {row.line}: {column!r} must be a whole number, got {shown(text)}{_hint(text)}")


def _real(row: CsvRecord, column: str, text: str) -> float:
    if _REAL.fullmatch(text):
        number = float(text)
        if abs(number) < float("inf"):
            return number
    raise _Refusal(f"line {row.line}: {column!r} must be a number, got {shown(text)}{_hint(text)}")


def _hint(text: str) -> str:
    if _DECIMAL_COMMA.fullmatch(text):
        return ", with a decimal comma; numbers take a decimal point"
    if "_" in text:
        return "; digits are not grouped"
    if text.strip("+-").lower() in ("nan", "inf", "infinity"):
        return "; numbers must be finite"
    return ""
