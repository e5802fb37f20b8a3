"""Layouts that a kitchen genome can express (slots on the border, obstacles inside), and the rules of valid designs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.grid_kernels import steps_from
from legible_envs.overcooked.layout import (
    COUNTER,
    FLOOR,
    OBSTACLE,
    STATION_CODES,
    STATION_TYPES,
    OvercookedLayout,
    check_shape,
)
from legible_envs.overcooked.scoring.genome_kernels import Geometry
from legible_envs.support.validation import entries, flag, integer, shown

__all__ = ["DesignRules"]

Genomes = npt.NDArray[np.signedinteger[Any]]
"""Genomes, in the type that :attr:`DesignRules.dtype` names."""


class DesignRules:
    """The rules of :class:`.OvercookedWorkspace`, which documents the arguments.

    Attributes:
        slots: Border cells a station may stand on, clockwise from the top-left, corners left out.
        slot_access: The inner cell in front of each slot.
        inner: Inner cells, row by row.
        dtype: Integers that hold every slot: ``int8`` up to 33 x 33 cells or the same circumference, else ``int16``.
        geometry: The same as tables for the kernels.
    """

    def __init__(
        self,
        shape: Sequence[int],
        stations: Sequence[str],
        *,
        locked: Mapping[str, Cell],
        forbidden: Iterable[Cell],
        distinct_access: bool,
    ) -> None:
        self.shape = check_shape(shape, partial(LayoutError, rule="shape"))
        rows, cols = self.shape
        top = [(0, c) for c in range(1, cols - 1)]
        right = [(r, cols - 1) for r in range(1, rows - 1)]
        bottom = [(rows - 1, c) for c in range(cols - 2, 0, -1)]
        left = [(r, 0) for r in range(rows - 2, 0, -1)]
        self.slots: list[Cell] = [*top, *right, *bottom, *left]
        self.dtype: np.dtype[Any] = np.dtype(np.int8 if len(self.slots) - 1 <= np.iinfo(np.int8).max else np.int16)
        self.slot_access: list[Cell] = [(min(max(r, 1), rows - 2), min(max(c, 1), cols - 2)) for r, c in self.slots]
        self.inner: list[Cell] = [(r, c) for r in range(1, rows - 1) for c in range(1, cols - 1)]
        self.stations = self._checked_stations(stations)
        self.distinct_access = flag("distinct_access", distinct_access)
        self.forbidden = self._checked_forbidden(forbidden)
        self.locked = self._checked_locked(locked)
        self._slot_of = {cell: slot for slot, cell in enumerate(self.slots)}
        self._slot_cells = np.array([row * cols + col for row, col in self.slots], dtype=np.intp)
        self.geometry = self._geometry()

    # -- checking the arguments ------------------------------------------------------------------------------------

    @staticmethod
    def _checked_stations(stations: Sequence[str]) -> tuple[str, ...]:
        names = tuple(entries(stations))
        are_types = all(isinstance(name, str) and name in STATION_TYPES for name in names)
        if not are_types or len(set(names)) != len(names) or len(names) < 2:
            raise LayoutError(
                f"`stations` must be at least two different ones of {list(STATION_TYPES)}, got {shown(stations)}",
                rule="station",
            )
        return names

    def _checked_forbidden(self, forbidden: Iterable[Cell]) -> tuple[Cell, ...]:
        if not isinstance(forbidden, Iterable) or isinstance(forbidden, str | Mapping):
            raise LayoutError(f"`forbidden` must be cells (row, column), got {shown(forbidden)}", rule="forbidden")
        cells = tuple(sorted({_read_cell("forbidden", cell) for cell in forbidden}))
        for cell in cells:
            if cell not in self.slots and cell not in self.inner:
                raise LayoutError(
                    f"forbidden cell {cell} is neither a place for a station nor an inner cell of a "
                    f"{self.shape[0]}x{self.shape[1]} kitchen",
                    rule="forbidden",
                    cell=cell,
                )
        return cells

    def _checked_locked(self, locked: Mapping[str, Cell]) -> dict[str, Cell]:
        checked = {}
        for name, cell in locked.items():
            if name not in self.stations:
                raise LayoutError(f"cannot lock {name!r}; the stations are {list(self.stations)}", rule="locked")
            row, col = _read_cell("locked", cell)
            if (row, col) not in self.slots or (row, col) in self.forbidden:
                raise LayoutError(
                    f"cannot lock {name!r} at row {row}, column {col}: stations stand on border cells that are neither "
                    "corners nor forbidden",
                    rule="locked",
                    cell=(row, col),
                )
            checked[name] = (row, col)
        return checked

    def _geometry(self) -> Geometry:
        rows, cols = self.shape
        slots = np.array(self.slots)
        spread = np.abs(slots[:, None] - slots[None]).sum(-1) >= 2
        if self.distinct_access:
            access = np.array(self.slot_access)
            spread &= (access[:, None] != access[None]).any(-1)
        allowed = np.array(
            [
                [cell not in self.forbidden and self.locked.get(name, cell) == cell for cell in self.slots]
                for name in self.stations
            ]
        )
        return Geometry(
            stride=cols,
            num_cells=rows * cols,
            slot_access=np.array([r * cols + c for r, c in self.slot_access]),
            allowed=allowed,
            compatible=spread,
            inner=np.array([r * cols + c for r, c in self.inner]),
            may_block=np.array([cell not in self.forbidden for cell in self.inner]),
        )

    @property
    def most_stations(self) -> int:
        """How many stations that are at least two apart there is room for, if all may stand anywhere."""
        rows, cols = self.shape
        return 2 * ((rows - 1) // 2) + 2 * ((cols - 1) // 2)  # every other place of a wall, its ends included

    # -- genomes and layouts ---------------------------------------------------------------------------------------

    @property
    def upper_bounds(self) -> Genomes:
        """``(d,)`` greatest value of each gene; the least is 0."""
        return np.array([len(self.slots) - 1] * len(self.stations) + [1] * len(self.inner), dtype=self.dtype)

    def check(self, genome: npt.NDArray[Any]) -> None:
        """Raise a :class:`LayoutError` naming the first broken rule of a ``(d,)`` genome, and its cell."""
        n = len(self.stations)
        bad = np.flatnonzero(~((genome >= 0) & (genome <= self.upper_bounds) & (genome == np.floor(genome))))
        if len(bad):
            i = int(bad[0])
            what = f"slot of {self.stations[i]!r}" if i < n else f"obstacle bit of cell {self.inner[i - n]}"
            raise LayoutError(
                f"gene {i} ({what}) is {genome[i]!r}; expected a whole number from 0 to {self.upper_bounds[i]}",
                rule="range",
            )
        slots = [int(slot) for slot in genome[:n]]
        self._check_stations(slots)
        blocked = {cell for cell, bit in zip(self.inner, genome[n:], strict=True) if bit}
        self._check_obstacles(slots, blocked)

    def _check_stations(self, slots: list[int]) -> None:
        for i, (name, slot) in enumerate(zip(self.stations, slots, strict=True)):
            cell = self.slots[slot]
            where = f"row {cell[0]}, column {cell[1]}"
            if self.locked.get(name, cell) != cell:
                raise LayoutError(
                    f"{name} at {where}, but it is locked at {self.locked[name]}", rule="locked", cell=cell
                )
            if cell in self.forbidden:
                raise LayoutError(f"{name} at {where}, which is a forbidden cell", rule="forbidden", cell=cell)
            for other, other_slot in zip(self.stations[:i], slots[:i], strict=True):
                r, c = self.slots[other_slot]
                if (r, c) == cell:
                    raise LayoutError(f"{other} and {name} both at {where}", rule="distinct", cell=cell)
                if abs(r - cell[0]) + abs(c - cell[1]) < 2:
                    raise LayoutError(
                        f"{other} at row {r}, column {c} and {name} at {where} touch; they must be at least 2 apart",
                        rule="spacing",
                        cell=cell,
                    )
                if self.distinct_access and self.slot_access[other_slot] == self.slot_access[slot]:
                    raise LayoutError(
                        f"{other} and {name} share the access cell {self.slot_access[slot]} (distinct_access=True)",
                        rule="distinct-access",
                        cell=self.slot_access[slot],
                    )

    def _check_obstacles(self, slots: list[int], blocked: set[Cell]) -> None:
        for cell in sorted(blocked):
            if cell in self.forbidden:
                raise LayoutError(
                    f"an obstacle at row {cell[0]}, column {cell[1]}, which is a forbidden cell",
                    rule="forbidden",
                    cell=cell,
                )
        access = [self.slot_access[slot] for slot in slots]
        for name, cell in zip(self.stations, access, strict=True):
            if cell in blocked:
                raise LayoutError(
                    f"an obstacle at row {cell[0]}, column {cell[1]} blocks the access cell of {name}",
                    rule="access",
                    cell=cell,
                )
        steps = self._steps_from(access[0], blocked)
        for name, cell in zip(self.stations, access, strict=True):
            if steps[cell] < 0:
                raise LayoutError(
                    f"{name} (used from row {cell[0]}, column {cell[1]}) cannot be reached from {self.stations[0]}",
                    rule="reachable",
                    cell=cell,
                )

    def _steps_from(self, cell: Cell, blocked: set[Cell]) -> npt.NDArray[np.int32]:
        """``(H, W)`` fewest moves from an inner cell to each other one; -1 where obstacles shut it off."""
        rows, cols = self.shape
        floor = np.zeros(self.shape, dtype=np.bool_)
        floor[1:-1, 1:-1] = True
        for obstacle in blocked:
            floor[obstacle] = False
        steps = np.empty(self.shape, dtype=np.int32)
        steps_from(np.array([cell[0] * cols + cell[1]]), floor.ravel(), rows, cols, steps.ravel())
        return steps

    def decode(self, genome: npt.NDArray[Any]) -> OvercookedLayout:
        """The layout of a ``(d,)`` genome; raises what :meth:`check` raises."""
        self.check(genome)
        n = len(self.stations)
        cells = np.full(self.shape, COUNTER, dtype=np.int8)
        for cell, bit in zip(self.inner, genome[n:], strict=True):
            cells[cell] = OBSTACLE if bit else FLOOR
        for name, slot in zip(self.stations, genome[:n], strict=True):
            cells[self.slots[int(slot)]] = STATION_CODES[name]
        return OvercookedLayout(cells)

    def cells(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.int8]:
        """``(n, H, W)`` cell codes of ``(n, d)`` valid genomes, which are not checked."""
        rows, cols = self.shape
        cells = np.full((len(genomes), rows * cols), COUNTER, dtype=np.int8)
        cells[:, self.geometry.inner] = np.where(genomes[:, len(self.stations) :] != 0, OBSTACLE, FLOOR)
        slots = self._slot_cells[genomes[:, : len(self.stations)].astype(np.intp)]
        codes = np.array([STATION_CODES[name] for name in self.stations], dtype=np.int8)
        np.put_along_axis(cells, slots, codes[None], axis=1)
        return cells.reshape(-1, rows, cols)

    def encode(self, layout: OvercookedLayout) -> Genomes:
        """The ``(d,)`` genome of a layout.

        Raises:
            LayoutError: The layout breaks a rule or cannot be written as a genome; names rule and cell.
        """
        if layout.shape != self.shape:
            raise LayoutError(
                f"the layout is {layout.shape}, the workspace designs {self.shape} kitchens", rule="shape"
            )
        genome = np.zeros(len(self.upper_bounds), dtype=self.dtype)
        found: dict[str, Cell] = {}
        for (row, col), code in np.ndenumerate(layout.cells):
            cell, where = (row, col), f"row {row}, column {col}"
            is_inner = 0 < row < self.shape[0] - 1 and 0 < col < self.shape[1] - 1
            if code > OBSTACLE:
                kind = STATION_TYPES[code - 3]
                if kind not in self.stations:
                    raise LayoutError(
                        f"{where}: a {kind} station; this workspace has {list(self.stations)}",
                        rule="station",
                        cell=cell,
                    )
                if kind in found:
                    raise LayoutError(
                        f"{where}: a second {kind} station (the first is at {found[kind]})", rule="unique", cell=cell
                    )
                if cell not in self._slot_of:
                    place = "inside the room" if is_inner else "in a corner"
                    raise LayoutError(
                        f"{where}: {kind} stands {place}; stations stand on the border", rule="border", cell=cell
                    )
                found[kind] = cell
                genome[self.stations.index(kind)] = self._slot_of[cell]
            elif is_inner and code == COUNTER:
                raise LayoutError(
                    f"{where}: a counter inside the room; only virtual obstacles can stand there",
                    rule="inner",
                    cell=cell,
                )
            elif is_inner:
                genome[len(self.stations) + self.inner.index(cell)] = code == OBSTACLE
            elif code != COUNTER:
                raise LayoutError(f"{where}: the border must be counters and stations", rule="border", cell=cell)
        missing = [name for name in self.stations if name not in found]
        if missing:
            raise LayoutError(f"the layout has no {', '.join(missing)} station", rule="station")
        self.check(genome)
        return genome


def _read_cell(name: str, cell: object) -> Cell:
    """The row and column of a cell in an argument.

    Raises:
        LayoutError: Not two whole numbers; its ``rule`` is the argument's name.
    """
    error = partial(LayoutError, rule=name)
    numbers = entries(cell)
    if len(numbers) != 2:
        raise error(f"each cell in `{name}` must be (row, column), got {shown(cell)}")
    row, col = (integer(f"a row or column in `{name}`", i, whole_floats=True, error=error) for i in numbers)
    return row, col
