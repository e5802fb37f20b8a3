"""The kitchen as an immutable value: floor, counters, virtual obstacles and stations on a rectangular grid."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.drawings import (
    COUNTER,
    FLOOR,
    INGREDIENTS,
    MAX_SIDE,
    OBSTACLE,
    STATION_CODES,
    STATION_TYPES,
    SYMBOLS,
    draw,
    read_indices,
    read_jaxmarl_rows,
    read_rows,
    rows_of,
    trim,
)
from legible_envs.overcooked.grid import NEIGHBOURS, Cell
from legible_envs.support.literals import read_literal
from legible_envs.support.text import clean_text
from legible_envs.support.validation import entries, integer, shown

__all__ = [
    "COUNTER",
    "FLOOR",
    "INGREDIENTS",
    "OBSTACLE",
    "STATION_CODES",
    "STATION_TYPES",
    "SYMBOLS",
    "OvercookedLayout",
    "check_shape",
]


def check_shape(shape: object, error: Callable[[str], Exception] = ValueError) -> tuple[int, int]:
    """Rows and columns of a kitchen.

    Raises:
        ValueError: Or what ``error`` makes of the message: not two whole numbers, or a side that no kitchen has.
    """
    sides = entries(shape)
    if len(sides) != 2:
        raise error(f"`shape` must be two integers (rows, columns) from 3 to {MAX_SIDE}, got {shown(shape)}")
    rows, cols = (
        integer("each side of `shape`", side, 3, MAX_SIDE, whole_floats=True, unit="cells", error=error)
        for side in sides
    )
    return rows, cols


def _code_of(symbol: str) -> int:
    return SYMBOLS.find(symbol) if len(symbol) == 1 else -1


def _are_texts(rows: object) -> TypeGuard[Sequence[str]]:
    return isinstance(rows, Sequence) and not isinstance(rows, str) and all(isinstance(row, str) for row in rows)


class OvercookedLayout:
    """A kitchen: any rectangular grid of floor, counters, virtual obstacles and stations.

    A value: immutable, hashable, compared by content. It admits every kitchen that can be drawn (stations may repeat,
    stand inside the room and have several access cells); the design rules of a search belong to
    :class:`~legible_envs.overcooked.design.workspace.OvercookedWorkspace`.

    ASCII: ``X`` counter, space floor, ``V`` virtual obstacle, ``T O C F D P S`` tomato, onion, cabbage, fish, dish, pot
    and serving stations, ``1`` to ``9`` the players' starts (floor underneath). Files of layouts in other forms, and
    with orders, are read by :class:`~legible_envs.overcooked.kitchen_file.KitchenFile`.

    Args:
        cells: ``(H, W)`` cell codes: 0 floor, 1 counter, 2 virtual obstacle, 3.. stations in the order of
            ``STATION_TYPES``.
        starts: ``(row, col)`` floor cells where the players start. Empty: the first access cell of a serving station
            (of any station, or the first floor cell, where there is none).

    Raises:
        LayoutError: Unknown codes, a start that is not a floor cell or is taken twice, no floor, or a side below 3 or
            above 64 cells.

    Example:
        >>> kitchen = OvercookedLayout.from_ascii('''
        ... XPXXX
        ... O   T
        ... X V X
        ... D  1X
        ... XXSXX''')
        >>> kitchen.shape, kitchen.stations["pot"], kitchen.access("pot"), kitchen.starts
        ((5, 5), (0, 1), ((1, 1),), ((3, 3),))
    """

    __slots__ = ("__dict__", "_cells", "_starts")

    def __init__(self, cells: npt.ArrayLike, starts: Iterable[Sequence[int]] = ()) -> None:
        array = np.array(cells)
        if array.ndim != 2:
            raise LayoutError(f"cells must be a 2-D array (rows, columns), got shape {array.shape}", rule="shape")
        if not (3 <= array.shape[0] <= MAX_SIDE and 3 <= array.shape[1] <= MAX_SIDE):
            raise LayoutError(f"both sides must have 3 to {MAX_SIDE} cells, got {array.shape}", rule="shape")
        bad = ~np.isin(array, np.arange(len(SYMBOLS)))
        if bad.any():
            row, col = (int(i) for i in np.argwhere(bad)[0])
            raise LayoutError(
                f"row {row}, column {col}: unknown cell code {shown(array[row, col].item())}; "
                f"expected 0..{len(SYMBOLS) - 1}",
                rule="symbol",
                cell=(row, col),
            )
        self._cells = array.astype(np.int8)
        self._cells.setflags(write=False)
        if not (self._cells == FLOOR).any():
            raise LayoutError("the kitchen has no floor cell to stand on", rule="floor")
        self._starts = self._checked_starts(starts)

    def _checked_starts(self, starts: Iterable[Sequence[int]]) -> tuple[Cell, ...]:
        checked: list[Cell] = []
        for number, start in enumerate(starts, 1):
            row, col = (int(i) for i in start)
            if not (0 <= row < self.shape[0] and 0 <= col < self.shape[1]) or self._cells[row, col] != FLOOR:
                raise LayoutError(
                    f"player {number} starts at row {row}, column {col}, which is not a free floor cell",
                    rule="start",
                    cell=(row, col),
                )
            if (row, col) in checked:
                raise LayoutError(f"two players start at row {row}, column {col}", rule="start", cell=(row, col))
            checked.append((row, col))
        return tuple(checked) or (self._default_start(),)

    def _default_start(self) -> Cell:
        for kind in ("serving", *STATION_TYPES):
            for name in self.named(kind):
                if access := self.access(name):
                    return access[0]
        row, col = np.argwhere(self._cells == FLOOR)[0]
        return int(row), int(col)

    # -- reading and writing -------------------------------------------------------------------------------------------

    @classmethod
    def from_ascii(cls, text: str) -> OvercookedLayout:
        """Read a drawing, one line a row.

        A margin of blanks is no part of it: blank lines around the drawing, common indentation, and blanks beyond the
        width of its longest row. Blanks up to that width are floor.

        Raises:
            LayoutError: Ragged rows or unknown symbols, naming row and column; whatever the constructor rejects.
        """
        if not isinstance(text, str):
            raise LayoutError(f"expected an ASCII drawing as a string, got {type(text).__name__}", rule="type")
        return cls(*read_rows(rows_of(text)))

    @classmethod
    def from_rows(cls, rows: Sequence[str | Sequence[str]]) -> OvercookedLayout:
        """Read a list of row strings, as :meth:`from_ascii` does, or a nested list of one-character symbols."""
        return cls(*read_rows(trim(rows) if _are_texts(rows) else rows))

    @classmethod
    def from_overcooked_ai(cls, source: str | Mapping[str, Any]) -> OvercookedLayout:
        """Read one of Overcooked-AI's layout files: the text of a ``.layout`` file, its dict, or the bare grid.

        Only the grid is read, whatever else the file holds;
        :class:`~legible_envs.overcooked.kitchen_file.KitchenFile` also reads the orders.

        Raises:
            LayoutError: The text is neither a grid nor a Python literal with a ``grid`` entry.
        """
        if isinstance(source, str) and (text := clean_text(source)).lstrip().startswith("{"):
            try:
                source = read_literal(text)
            except ValueError as error:
                raise LayoutError(f"not an Overcooked-AI layout file: {error}", rule="type") from error
        if isinstance(source, Mapping) and "grid" not in source:
            raise LayoutError(
                f"not an Overcooked-AI layout: it has no `grid`; its entries are {shown(sorted(map(str, source)))}",
                rule="type",
            )
        grid = source["grid"] if isinstance(source, Mapping) else source
        if isinstance(grid, str):
            # These files indent every row but the first; no row of a kitchen starts with floor.
            return cls.from_rows([line.strip() for line in clean_text(grid).strip().split("\n")])
        if isinstance(grid, Sequence):
            return cls.from_rows(grid)
        raise LayoutError(f"the `grid` of an Overcooked-AI layout must be text or rows, got {shown(grid)}", rule="type")

    @classmethod
    def from_jaxmarl(cls, source: str | Sequence[str] | Mapping[str, Any]) -> OvercookedLayout:
        r"""Read a kitchen of JaxMARL: a drawing (text or rows), or the dictionary of its cells' numbers.

        In drawings ``W`` is a counter, ``A`` a player, ``X`` the place to deliver, ``B`` dishes, ``O`` onions and ``P``
        a pot. Those of its second version number ingredients: ``0 1 2 3`` are read as onions, tomatoes, cabbages and
        fish; what displays recipes there (``R L``) is a counter. In dictionaries ``wall_idx``, ``agent_idx``,
        ``goal_idx``, ``plate_pile_idx``, ``onion_pile_idx`` and ``pot_idx`` list cells, numbered row by row.

        Raises:
            LayoutError: Unknown symbols or entries; names row and column, or the entry.

        Example:
            >>> print(OvercookedLayout.from_jaxmarl("WWPWW\nOA AO\nW   W\nWBWXW"))
            XXPXX
            O1 2O
            X   X
            XDXSX
        """
        if isinstance(source, Mapping):
            return cls(*read_indices(source))
        if not isinstance(source, str) and not _are_texts(source):
            raise LayoutError(
                f"expected a kitchen of JaxMARL as text, rows or a dict, got {shown(source)}", rule="type"
            )
        return cls(*read_jaxmarl_rows(rows_of(source) if isinstance(source, str) else trim(source)))

    def to_ascii(self) -> str:
        """The drawing that :meth:`from_ascii` reads back to an equal layout.

        Floor is a space; in an outermost row or column of nothing but floor it is a dot, which no editor strips.
        """
        return draw(self._cells, self._starts)

    # -- what is where -------------------------------------------------------------------------------------------------

    @property
    def cells(self) -> npt.NDArray[np.int8]:
        """``(H, W)`` read-only cell codes."""
        return self._cells

    @property
    def starts(self) -> tuple[Cell, ...]:
        """``(row, col)`` where each player starts; never empty."""
        return self._starts

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return self._cells.shape

    @cached_property
    def stations(self) -> Mapping[str, Cell]:
        """Cell of each station by name, in reading order: the plain type where unique, else ``onion@(1,0)``."""
        found = [(int(r), int(c)) for r, c in np.argwhere(self._cells > OBSTACLE)]
        kinds = [STATION_TYPES[self._cells[cell] - 3] for cell in found]
        return {
            kind if kinds.count(kind) == 1 else f"{kind}@({r},{c})": (r, c)
            for kind, (r, c) in zip(kinds, found, strict=True)
        }

    @cached_property
    def goal_names(self) -> tuple[str, ...]:
        """Name of each cell as a goal, in reading order: the station's on it, else ``counter@(row,col)``."""
        height, width = self.shape
        names = [f"counter@({row},{col})" for row in range(height) for col in range(width)]
        for name, (row, col) in self.stations.items():
            names[row * width + col] = name
        return tuple(names)

    def named(self, kind: str) -> tuple[str, ...]:
        """Names of all stations of one type, in reading order."""
        return tuple(name for name in self.stations if name.partition("@")[0] == kind)

    def station_at(self, cell: Sequence[int]) -> str | None:
        """Name of the station on a cell, or None."""
        return self._name_at.get((int(cell[0]), int(cell[1])))

    @cached_property
    def _name_at(self) -> dict[Cell, str]:
        return {cell: name for name, cell in self.stations.items()}

    def access(self, name: str) -> tuple[Cell, ...]:
        """Floor cells from which a station can be used, in the order north, south, east, west of it.

        Raises:
            LayoutError: The kitchen has no station of this name.
        """
        if name not in self.stations:
            raise LayoutError(f"no station {name!r}; this kitchen has {list(self.stations)}", rule="station")
        row, col = self.stations[name]
        return tuple(cell for dr, dc in NEIGHBOURS if self.is_floor(cell := (row + dr, col + dc)))

    def is_floor(self, cell: Sequence[int]) -> bool:
        """Whether a person can stand on the cell; False outside the grid, and for fractions."""
        row, col = cell[0], cell[1]
        if not (0 <= row < self.shape[0] and 0 <= col < self.shape[1]):
            return False
        at = int(row), int(col)
        return at == (row, col) and bool(self._cells[at] == FLOOR)

    @property
    def num_obstacles(self) -> int:
        """Number of virtual obstacles."""
        return int(np.count_nonzero(self._cells == OBSTACLE))

    @cached_property
    def layout_id(self) -> str:
        """Twelve hexadecimal digits that identify the content, the same on every machine and in every version."""
        return hashlib.sha256(draw(self._cells, self._starts, margin=False).encode()).hexdigest()[:12]

    def distances_from(self, cells: Iterable[Sequence[int]]) -> npt.NDArray[np.int32]:
        """``(H, W)`` number of floor moves from the nearest of the given floor cells; -1 where no path leads."""
        from legible_envs.overcooked.grid_kernels import steps_from  # layouts are read and written without numba

        height, width = self.shape
        sources = np.array([cell[0] * width + cell[1] for cell in cells if self.is_floor(cell)], dtype=np.int64)
        distances = np.empty(self.shape, dtype=np.int32)
        steps_from(sources, (self._cells == FLOOR).ravel(), height, width, distances.ravel())
        return distances

    # -- changed copies ------------------------------------------------------------------------------------------------

    def with_cells(self, changes: Mapping[Cell, int | str]) -> OvercookedLayout:
        """A copy with some cells replaced, given as codes, symbols or station types; players' starts stay."""
        cells = self._cells.copy()
        for cell, value in changes.items():
            if isinstance(value, str):
                value = STATION_CODES[value] if value in STATION_CODES else _code_of(value)
            cells[cell] = value
        return OvercookedLayout(cells, self._starts)

    def with_starts(self, starts: Iterable[Sequence[int]]) -> OvercookedLayout:
        """A copy whose players start elsewhere."""
        return OvercookedLayout(self._cells, starts)

    # -- value semantics -----------------------------------------------------------------------------------------------

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OvercookedLayout):
            return NotImplemented
        return self._starts == other._starts and np.array_equal(self._cells, other._cells)

    def __hash__(self) -> int:
        return hash((self._cells.tobytes(), self.shape, self._starts))

    def __str__(self) -> str:
        return self.to_ascii()

    def __repr__(self) -> str:
        return f"OvercookedLayout.from_ascii({self.to_ascii()!r})"

    def __reduce__(self) -> tuple[object, ...]:
        return OvercookedLayout, (self._cells, self._starts)

    def __setattr__(self, name: str, value: object) -> None:
        if name in ("_cells", "_starts") and not hasattr(self, name):
            object.__setattr__(self, name, value)
            return
        raise AttributeError(f"layouts are immutable; cannot set {name!r} (see with_cells and with_starts)")
