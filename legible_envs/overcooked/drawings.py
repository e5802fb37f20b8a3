"""Kitchens as characters: what each cell is drawn with, and how drawings that people wrote are read.

A margin of blanks is no part of a drawing: blank lines above and below it, blanks before and after its rows. So it may
be indented, and an editor may have left blanks at the ends of lines. Rows are as wide as the longest without blanks at
its end; blanks up to there are floor. A kitchen whose outermost row or column is nothing but floor has it drawn with
dots, which the margin cannot swallow.

JaxMARL draws with other characters, some of which mean something else here: ``X`` is a counter in ours and the place
to deliver in theirs. A drawing is theirs if it has one of ``W A B``, which only they have, and none of ``V T C F D S``,
which only we have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.grid import Cell
from legible_envs.support.text import clean_text
from legible_envs.support.validation import entries, integer, shown

__all__ = [
    "COUNTER",
    "FLOOR",
    "INGREDIENTS",
    "MAX_SIDE",
    "OBSTACLE",
    "STATION_CODES",
    "STATION_TYPES",
    "SYMBOLS",
    "Drawing",
    "draw",
    "is_jaxmarl",
    "read_indices",
    "read_jaxmarl_rows",
    "read_rows",
    "rows_of",
    "trim",
]

MAX_SIDE: Final = 64
FLOOR: Final = 0
COUNTER: Final = 1
OBSTACLE: Final = 2
STATION_TYPES: Final = ("tomato", "onion", "cabbage", "fish", "dish", "pot", "serving")
INGREDIENTS: Final = STATION_TYPES[:4]
STATION_CODES: Final[Mapping[str, int]] = {name: code for code, name in enumerate(STATION_TYPES, 3)}
SYMBOLS: Final = " XVTOCFDPS"
"""ASCII symbol of each cell code: floor, counter, virtual obstacle, then the stations in the order of STATION_TYPES."""

_CODE_OF: Final = {symbol: code for code, symbol in enumerate(SYMBOLS)}
_STRAY: Final = {".": " ", "_": " ", "#": "X", "\t": " ", "\xa0": " "}
_PLAYERS: Final = "123456789"

_JAXMARL: Final[Mapping[str, int]] = {
    " ": FLOOR,
    "A": FLOOR,
    "W": COUNTER,
    "R": COUNTER,
    "L": COUNTER,
    "X": STATION_CODES["serving"],
    "B": STATION_CODES["dish"],
    "P": STATION_CODES["pot"],
    "O": STATION_CODES["onion"],
    "0": STATION_CODES["onion"],
    "1": STATION_CODES["tomato"],
    "2": STATION_CODES["cabbage"],
    "3": STATION_CODES["fish"],
}
"""JaxMARL's symbols. Its second version numbers ingredients and has displays of the recipe (R, L): counters here."""

_THEIRS: Final = frozenset("WAB")
_OURS: Final = frozenset("VTCFDS")

_INDICES: Final[Mapping[str, int]] = {
    "goal_idx": STATION_CODES["serving"],
    "plate_pile_idx": STATION_CODES["dish"],
    "onion_pile_idx": STATION_CODES["onion"],
    "pot_idx": STATION_CODES["pot"],
}


class Drawing(NamedTuple):
    """What a drawing shows.

    Attributes:
        codes: ``(H, W)`` cell codes.
        starts: Where players 1, 2, … start.
    """

    codes: npt.NDArray[np.int8]
    starts: list[Cell]


def rows_of(text: str) -> list[str]:
    """The rows of a drawing in a text; see :func:`trim`."""
    return trim(clean_text(text).split("\n"))


def trim(lines: Sequence[str]) -> list[str]:
    """The rows of a drawing without its margin: blank lines around it, common indentation, blanks beyond its width.

    Rows may still differ in length; :func:`read_rows` says so.
    """
    drawn = [number for number, line in enumerate(lines) if line.strip()]
    if not drawn:
        return []
    rows = lines[drawn[0] : drawn[-1] + 1]
    left = min(len(row) - len(row.lstrip()) for row in rows if row.strip())
    right = max(len(row.rstrip()) for row in rows)
    return [row[left:right] for row in rows]


def is_jaxmarl(rows: Sequence[str]) -> bool:
    """Whether a drawing can only be one of JaxMARL: it has ``W``, ``A`` or ``B``, and nothing that only we draw."""
    symbols = set().union(*rows)
    return bool(symbols & _THEIRS) and not symbols & _OURS


def read_rows(rows: Sequence[str | Sequence[str]]) -> Drawing:
    """Read a drawing: rows of symbols, one a cell.

    Raises:
        LayoutError: Ragged rows, unknown symbols or players, naming row and column.
    """
    lines = _equally_long(rows)
    margin = _dotted(lines)
    codes = np.zeros((len(lines), len(lines[0])), dtype=np.int8)
    starts: dict[int, Cell] = {}
    for r, line in enumerate(lines):
        for c, symbol in enumerate(line):
            if symbol in _CODE_OF:
                codes[r, c] = _CODE_OF[symbol]
            elif len(symbol) == 1 and symbol in _PLAYERS:
                number = int(symbol)
                if number in starts:
                    raise LayoutError(
                        f"row {r}, column {c}: player {number} already starts at row {starts[number][0]}, "
                        f"column {starts[number][1]}",
                        rule="start",
                        cell=(r, c),
                    )
                starts[number] = (r, c)
            elif (r, c) not in margin:
                raise LayoutError(
                    f"row {r}, column {c}: unknown symbol {shown(symbol)}{_hint(symbol, lines)}; "
                    f"expected one of {SYMBOLS!r} or a player's digit",
                    rule="symbol",
                    cell=(r, c),
                )
    if sorted(starts) != list(range(1, len(starts) + 1)):
        raise LayoutError(f"players must be numbered 1, 2, …; the drawing has {sorted(starts)}", rule="start")
    return Drawing(codes, [starts[number] for number in sorted(starts)])


def read_jaxmarl_rows(rows: Sequence[str]) -> Drawing:
    """Read a drawing of JaxMARL: ``W`` counter, ``A`` player, ``X`` delivery, ``B`` dishes, ``O`` onions, ``P`` pot.

    Players are numbered in reading order. In drawings of its second version ``0 1 2 3``, ingredients without names
    there, are onions, tomatoes, cabbages and fish, and what displays recipes (``R L``) is a counter.

    Raises:
        LayoutError: Ragged rows or unknown symbols, naming row and column.
    """
    lines = _equally_long(rows)
    codes = np.zeros((len(lines), len(lines[0])), dtype=np.int8)
    starts = []
    for r, line in enumerate(lines):
        for c, symbol in enumerate(line):
            if symbol not in _JAXMARL:
                raise LayoutError(
                    f"row {r}, column {c}: unknown symbol {shown(symbol)}; expected one of {''.join(_JAXMARL)!r} in a "
                    "drawing of JaxMARL",
                    rule="symbol",
                    cell=(r, c),
                )
            codes[r, c] = _JAXMARL[symbol]
            if symbol == "A":
                starts.append((r, c))
    return Drawing(codes, starts)


def read_indices(data: Mapping[Any, Any]) -> Drawing:
    """Read a kitchen of JaxMARL that is given by numbers of cells, counted row by row from 0.

    Args:
        data: ``height``, ``width``, and the cells of each kind: ``wall_idx``, ``agent_idx``, ``goal_idx``,
            ``plate_pile_idx``, ``onion_pile_idx``, ``pot_idx``. Any of these may be absent but the walls.

    Raises:
        LayoutError: An entry is missing, is no list of cells of the grid, or two stations share a cell.
    """
    missing = [key for key in ("height", "width", "wall_idx") if key not in data]
    if missing:
        raise LayoutError(f"a kitchen of JaxMARL lacks {missing}; it has {shown(sorted(map(str, data)))}", rule="type")
    rows, cols = (
        integer(f"`{key}`", _number(data[key]), 3, MAX_SIDE, whole_floats=True, unit="cells", error=_shape_error)
        for key in ("height", "width")
    )
    codes = np.full(rows * cols, FLOOR, dtype=np.int8)
    codes[_cells_in(data, "wall_idx", rows * cols)] = COUNTER
    for key, code in _INDICES.items():
        for cell in _cells_in(data, key, rows * cols):
            if codes[cell] > OBSTACLE:
                taken = STATION_TYPES[codes[cell] - 3]
                raise LayoutError(
                    f"cell {cell} (row {cell // cols}, column {cell % cols}) in `{key}` already is a {taken} station",
                    rule="distinct",
                    cell=(cell // cols, cell % cols),
                )
            codes[cell] = code
    starts = [(cell // cols, cell % cols) for cell in _cells_in(data, "agent_idx", rows * cols)]
    return Drawing(codes.reshape(rows, cols), starts)


def draw(codes: npt.NDArray[np.int8], starts: Sequence[Cell], *, margin: bool = True) -> str:
    """The drawing of cell codes and players' starts.

    Args:
        codes: ``(H, W)``.
        starts: Where players 1, 2, … start.
        margin: Whether an outermost row or column of nothing but floor is drawn with dots, so that it can be told from
            blanks around a drawing.
    """
    rows = [[SYMBOLS[code] for code in row] for row in codes]
    for number, (r, c) in enumerate(starts, 1):
        rows[r][c] = str(number)
    height, width = codes.shape
    if margin:
        blank_rows = [r for r in (0, height - 1) if set(rows[r]) == {" "}]
        blank_cols = [c for c in (0, width - 1) if {row[c] for row in rows} == {" "}]
        for r in blank_rows:
            rows[r] = ["."] * width
        for c in blank_cols:
            for row in rows:
                row[c] = "."
    return "\n".join("".join(row) for row in rows)


def _equally_long(rows: Sequence[str | Sequence[str]]) -> list[list[str]]:
    """Rows of equally many symbols.

    Raises:
        LayoutError: No rows, more than a kitchen can have, rows of different lengths, or what is no text.
    """
    for r, row in enumerate(rows):
        if not isinstance(row, Sequence | np.ndarray) or isinstance(row, bytes):
            raise LayoutError(f"row {r} must be a text or a list of symbols, got {shown(row)}", rule="type")
    lines = [list(row) for row in rows]
    if not lines or not any(lines):
        raise LayoutError("the drawing is empty", rule="shape")
    longest = max(map(len, lines))
    if len(lines) > MAX_SIDE or longest > MAX_SIDE:
        raise LayoutError(
            f"both sides must have 3 to {MAX_SIDE} cells, got {len(lines)} rows of up to {longest}", rule="shape"
        )
    for r, line in enumerate(lines):
        if len(line) != len(lines[0]):
            widest = next(i for i, other in enumerate(lines) if len(other) == longest)
            raise LayoutError(
                f"ragged drawing: row {r} has {len(line)} cells, row 0 has {len(lines[0])}; every row needs the "
                f"{longest} of row {widest}, and floor at its end too is drawn, with spaces",
                rule="ragged",
                cell=(r, 0),
            )
        for c, symbol in enumerate(line):
            if not isinstance(symbol, str):
                raise LayoutError(
                    f"row {r}, column {c}: expected a one-character symbol, got {shown(symbol)}",
                    rule="symbol",
                    cell=(r, c),
                )
    return lines


def _dotted(lines: Sequence[Sequence[str]]) -> set[Cell]:
    """Cells of the outermost rows and columns that are drawn with nothing but dots."""
    height, width = len(lines), len(lines[0])
    rows = {r for r in (0, height - 1) if set(lines[r]) == {"."}}
    cols = {c for c in (0, width - 1) if {line[c] for line in lines} == {"."}}
    return {(r, c) for r in range(height) for c in range(width) if r in rows or c in cols}


def _hint(symbol: str, lines: Sequence[Sequence[str]]) -> str:
    if symbol in _STRAY:
        return f" (did you mean {_STRAY[symbol]!r}?)"
    if symbol in _THEIRS:
        ours = sorted(_OURS & set().union(*lines))
        mixed = f"JaxMARL's, but the drawing also has {', '.join(map(repr, ours))}, which JaxMARL has not"
        return f" ({mixed})" if ours else " (a drawing of JaxMARL? `OvercookedLayout.from_jaxmarl` reads them)"
    if len(symbol) == 1 and symbol.upper() in _CODE_OF:
        return f" (did you mean {symbol.upper()!r}?)"
    return ""


def _shape_error(message: str) -> LayoutError:
    return LayoutError(message, rule="shape")


def _number(value: Any) -> Any:
    """A number, also where it is an array of no dimensions, of whichever library."""
    return value.item() if getattr(value, "ndim", None) == 0 else value


def _cells_in(data: Mapping[Any, Any], key: str, count: int) -> list[int]:
    """The cells that an entry lists; none where it is absent.

    Raises:
        LayoutError: It is no list of cell numbers.
    """
    listed = data.get(key, ())
    if hasattr(listed, "tolist"):  # an array of whichever library
        listed = np.asarray(listed)
    if not isinstance(listed, Sequence | np.ndarray) or isinstance(listed, str | bytes):
        raise LayoutError(f"`{key}` must be a list of cell numbers, got {shown(listed)}", rule="type")

    def error(message: str) -> LayoutError:
        return LayoutError(message, rule="range")

    return [
        integer(f"a cell in `{key}`", cell, 0, count - 1, whole_floats=True, error=error) for cell in entries(listed)
    ]
