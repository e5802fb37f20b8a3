"""The grid that kitchens lie on: what a cell is, and its four neighbours in the order of the actions.

Numba is not needed here, so that layouts are read without it; the compiled searches on the same grid are in
:mod:`legible_envs.overcooked.grid_kernels`.
"""

from __future__ import annotations

from typing import Final

__all__ = ["EAST", "NEIGHBOURS", "NORTH", "SOUTH", "WEST", "Cell"]

Cell = tuple[int, int]
"""``(row, col)``; row 0 is the northernmost, column 0 the westernmost."""

NORTH: Final = 0
SOUTH: Final = 1
EAST: Final = 2
WEST: Final = 3
NEIGHBOURS: Final = ((-1, 0), (1, 0), (0, 1), (0, -1))
"""Offsets ``(rows, columns)`` to the cells north, south, east and west: action ``d`` leads along ``NEIGHBOURS[d]``."""
