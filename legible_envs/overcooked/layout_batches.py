"""One kitchen for all environments of a vector, or one for each: told apart by their form."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import STATION_TYPES, OvercookedLayout

__all__ = ["layout_entries"]


def layout_entries(value: Any, shape: tuple[int, int]) -> list[Any] | None:
    """The kitchens of a list or array with one for each environment; None where the value describes one kitchen.

    A row of a kitchen is a text without a line break, or as many symbols or cell codes as the kitchen has columns. A
    genome has ``7 + (H-2)(W-2)`` numbers, which is more than ``W`` in every shape. So the two are never confused, and:

    ====================================================  ======================================================
    one kitchen                                           one for each environment
    ====================================================  ======================================================
    a layout, a drawing, a flat list or array of numbers  a list (tuple, array of objects) with a layout, a
    (a genome)                                            drawing, a genome or None among its entries
    a list of rows; an array ``(H, W)``                   a list of lists of rows; an array ``(n, d)`` of
                                                          genomes or ``(n, H, W)`` of cells
    ====================================================  ======================================================

    Args:
        value: What a user gave; the entries are not read.
        shape: Rows and columns of the kitchens.

    Raises:
        LayoutError: An array of numbers that is neither.
    """
    array = _numeric(value)
    if array is not None:
        return _of_numbers(array, shape)
    if not isinstance(value, list | tuple) and not (isinstance(value, np.ndarray) and value.ndim):
        return None
    entries = list(value)
    return entries if any(_is_kitchen(entry, shape) for entry in entries) else None


def _numeric(value: Any) -> npt.NDArray[Any] | None:
    """An array of numbers, or a list of such that are equally long; None for anything else."""
    if isinstance(value, list | tuple) and any(isinstance(entry, list | tuple | np.ndarray) for entry in value):
        try:
            value = np.asarray(value)
        except ValueError:  # rows that differ in length
            return None
    return value if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" else None


def _of_numbers(array: npt.NDArray[Any], shape: tuple[int, int]) -> list[Any] | None:
    genome = _genome_size(shape)
    if array.ndim == 3 or (array.ndim == 2 and array.shape[1] == genome):
        return list(array)
    if array.ndim == 2 and array.shape != shape:
        raise LayoutError(
            f"expected the cells of a kitchen of shape {shape}, or a genome of {genome} numbers for each environment, "
            f"got an array of shape {array.shape}; genomes of a workspace with other stations are read by its `decode`",
            rule="shape",
        )
    return None


def _is_kitchen(entry: Any, shape: tuple[int, int]) -> bool:
    """Whether an entry of a list is a whole kitchen (or None), not a row or a number."""
    if entry is None or isinstance(entry, OvercookedLayout):
        return True
    if isinstance(entry, str):
        return "\n" in entry.strip("\n")
    if not isinstance(entry, list | tuple | np.ndarray) or (isinstance(entry, np.ndarray) and not entry.ndim):
        return False
    return len(entry) == _genome_size(shape) or any(_is_row(part) for part in entry)


def _is_row(part: Any) -> bool:
    """Whether a part of an entry is a row of a kitchen, so that the entry is all of it."""
    return len(part) > 1 if isinstance(part, str) else isinstance(part, list | tuple | np.ndarray)


def _genome_size(shape: tuple[int, int]) -> int:
    """Numbers in a genome of ``OvercookedWorkspace(shape)``."""
    return len(STATION_TYPES) + (shape[0] - 2) * (shape[1] - 2)
