"""Trajectories as CSV, a row per state, for spreadsheets and data from elsewhere.

=================  ====================================================================================================
``trajectory``     which trajectory the row belongs to: any text; its rows are in order, one after another
``row``, ``col``   the cell, whole numbers; the last row of a complete trajectory is the goal's own cell
``x``, ``y``, …    or the position (``x``; ``x, y``; or ``x, y, z``), numbers
``time``           seconds (optional; without it states count 0, 1, 2, …)
``goal``           name of the goal reached; empty where it is not known
``candidates``     goals that were possible, ``;`` between them (optional; without it all goals of the file)
``start``          where the person came from (optional, as all that follow)
``participant``    who
``condition``      under which condition
``layout_name``    name of the layout
``layout``         the layout as its kind writes it in one line: a kitchen's drawing, ``/`` between rows; a table's JSON
``candidate_set``  ``task``, ``game`` or ``all``
``positions``      where each of ``candidates`` is: coordinates with blanks, ``;`` between goals
``complete``       ``1``, or ``0`` for a prefix
``layout_kind``    name of the layout's kind (:mod:`legible_envs.layout_kinds`); written only where the layout's text
                   alone does not tell it
=================  ====================================================================================================

Everything from ``goal`` on is the same in all rows of a trajectory. Other columns are ignored. UTF-8, with a header.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.layout_kinds import LayoutKind, kind_named, kind_of, kind_of_line
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.files import write_text

__all__ = ["read_csv", "write_csv"]

_CELLS: Final = ("row", "col")
_AXES: Final = ("x", "y", "z")
_TEXTS: Final = ("start", "participant", "condition", "layout_name")
_SAME: Final = ("goal", "candidates", *_TEXTS, "layout", "candidate_set", "positions", "complete")
_KIND: Final = "layout_kind"


def write_csv(path: str | os.PathLike[str], trajectories: Iterable[Trajectory]) -> Path:
    """Write trajectories as CSV, all or nothing; see the module for the columns.

    Returns:
        The path written.

    Raises:
        ValueError: Cells and positions, or different dimensions, in one file; a trajectory without states, which has
            no row; a goal with ``;`` in its name.
        OSError: The file cannot be written; what was there before is untouched.
    """
    trajectories = list(trajectories)
    axes = _axes_of(trajectories)
    described = _described(trajectories)
    named = any(kind and kind_of_line(line) is not kind for kind, line in described.values())
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["trajectory", "time", *axes, *_SAME, *([_KIND] if named else [])])
    for number, each in enumerate(trajectories):
        if not each.num_states:
            raise ValueError(f"trajectory {number} has no states, and CSV has a row per state; use `save_trajectories`")
        bad = [name for name in each.candidates if ";" in name]
        if bad:
            raise ValueError(f"goals must not have ';' in their names to be written as CSV, got {bad}")
        kind, line = described[each.layout]
        same = [each.goal or "", ";".join(each.candidates), *(getattr(each, name) for name in _TEXTS)]
        places = ";".join(" ".join(map(repr, place)) for place in each.goal_positions or ())
        same += [line, each.candidate_set, places, str(int(each.complete))]
        same += [kind.name if kind else ""] if named else []
        for time, state in zip(each.times.tolist(), each.states.tolist(), strict=True):
            writer.writerow([number, repr(time), *(repr(value) for value in state), *same])
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    write_text(target, text.getvalue())
    return target


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


def read_csv(path: str | os.PathLike[str], *, layout: Any = None) -> list[Trajectory]:
    """Read trajectories from CSV; see the module for the columns.

    Args:
        path: The file.
        layout: The layout of trajectories whose rows name none.

    Raises:
        FileNotFoundError: No such file.
        ValueError: A missing column, or a value that is wrong, with its line.
    """
    name = os.fspath(path)
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            header = [column.strip() for column in reader.fieldnames or ()]
            reader.fieldnames = header
            axes = _axes(header)
            groups = _grouped(reader)
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{name} is not a CSV file of trajectories: {error}") from error
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
    goals = tuple(sorted({rows[0][1].get("goal", "") for rows in groups} - {""}))
    layouts = _Layouts(layout)
    trajectories = []
    for rows in groups:
        try:
            trajectories.append(_trajectory(rows, axes, goals, layouts))
        except ValueError as error:
            raise ValueError(f"{name}, trajectory {rows[0][1]['trajectory']!r}: {error}") from error
    return trajectories


class _Layouts:
    """The layouts of a file, each read once.

    Args:
        default: The layout of rows that name none.
    """

    def __init__(self, default: Any) -> None:
        self._default = default
        self._read: dict[tuple[str, str], Any] = {}

    def of(self, row: dict[str, str]) -> Any:
        """The layout that a row names.

        Raises:
            LayoutError: It is malformed, or of a kind that is not known.
        """
        line, name = row.get("layout", ""), row.get(_KIND, "")
        if not line:
            return self._default
        if (name, line) not in self._read:
            kind = kind_named(name) if name else kind_of_line(line)
            if kind is None:
                raise LayoutError(f"no layout kind recognises {line!r}; name it in a column {_KIND!r}", rule="kind")
            self._read[name, line] = kind.read_line(line)
        return self._read[name, line]


def _axes(header: list[str]) -> tuple[str, ...]:
    if "trajectory" not in header or not {"goal", "candidates"} & set(header):
        raise ValueError(f"expected columns 'trajectory', 'goal' and row, col or x, y; found {header}")
    if all(axis in header for axis in _CELLS):
        return _CELLS
    found = tuple(axis for axis in _AXES if axis in header)
    if not found or found != _AXES[: len(found)]:
        raise ValueError(f"expected the columns row, col (cells) or x, y (positions); found {header}")
    return found


def _grouped(reader: csv.DictReader[str]) -> list[list[tuple[int, dict[str, str]]]]:
    """Rows with their line numbers, those of one trajectory together."""
    groups: list[list[tuple[int, dict[str, str]]]] = []
    seen: set[str] = set()
    for record in reader:
        row = {key: (value or "").strip() for key, value in record.items() if isinstance(key, str)}
        label = row["trajectory"]
        if not groups or groups[-1][0][1]["trajectory"] != label:
            if label in seen:
                raise ValueError(f"line {reader.line_num}: rows of trajectory {label!r} are not together")
            seen.add(label)
            groups.append([])
        groups[-1].append((reader.line_num, row))
    return groups


def _trajectory(
    rows: list[tuple[int, dict[str, str]]], axes: tuple[str, ...], goals: tuple[str, ...], layouts: _Layouts
) -> Trajectory:
    first_line, first = rows[0]
    for line, row in rows[1:]:
        changed = [column for column in (*_SAME, _KIND) if row.get(column, "") != first.get(column, "")]
        if changed:
            raise ValueError(f"line {line}: {changed[0]!r} differs from line {first_line}, in one trajectory")
    kind: type = int if axes == _CELLS else float
    timed = [row.get("time", "") != "" for _, row in rows]
    if any(timed) and not all(timed):
        raise ValueError(f"line {rows[timed.index(False)][0]}: no time, while other rows have one")
    named = tuple(part.strip() for part in first.get("candidates", "").split(";") if part.strip())
    complete = first.get("complete", "") or "1"
    if complete not in ("0", "1"):
        raise ValueError(f"line {first_line}: 'complete' must be 0 or 1, got {complete!r}")
    texts = {name: first.get(name, "") for name in _TEXTS}
    return Trajectory(
        states=np.array([[_number(line, row, axis, kind) for axis in axes] for line, row in rows], dtype=kind),
        times=np.array([_number(line, row, "time", float) for line, row in rows]) if timed[0] else None,  # type: ignore[arg-type]
        goal=first.get("goal", "") or None,
        candidates=named or goals,
        layout=layouts.of(first),
        candidate_set=first.get("candidate_set", "") or "all",  # type: ignore[arg-type]
        complete=complete == "1",
        goal_positions=_places(first_line, first.get("positions", "")),
        **texts,  # type: ignore[arg-type]
    )


def _places(line: int, text: str) -> tuple[tuple[float, ...], ...] | None:
    try:
        return tuple(tuple(float(part) for part in place.split()) for place in text.split(";")) if text else None
    except ValueError as error:
        raise ValueError(f"line {line}: 'positions' must be numbers with ';' between goals, got {text!r}") from error


def _number(line: int, row: dict[str, str], column: str, kind: type) -> Any:
    try:
        return kind(row[column])
    except ValueError as error:
        what = "a whole number" if kind is int else "a number"
        raise ValueError(f"line {line}: {column!r} must be {what}, got {row[column]!r}") from error
