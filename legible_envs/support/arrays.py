"""Checks of arrays that callers hand over: rows of numbers of a known width."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["number_rows"]


def number_rows(what: str, values: npt.ArrayLike, size: int, *, or_one: bool = False) -> npt.NDArray[Any]:
    """Return values as an array of numbers of shape ``(n, size)``, in the type they came in.

    Args:
        what: What a row is, in the plural, for messages: ``"genomes"``.
        values: What the caller was given: an array, or lists.
        size: Numbers in a row.
        or_one: Whether a single row of shape ``(size,)`` is accepted too; it stays one.

    Raises:
        ValueError: Another shape, rows of different lengths, masked entries, or data that are no real numbers; the
            message says what was expected and what came.

    Example:
        >>> number_rows("genomes", [[1, 2], [3, 4]], 2)
        array([[1, 2],
               [3, 4]])
        >>> number_rows("genomes", [[1, 2], [3]], 2)
        Traceback (most recent call last):
        ValueError: expected genomes of shape (n, 2), got rows of different lengths
    """
    expected = f"expected {what} of shape (n, {size})" + (f" or ({size},)" if or_one else "")
    if np.ma.is_masked(values):
        raise ValueError(f"expected {what} without masked entries, got a masked array")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{expected}, got rows of different lengths") from error
    if array.dtype.kind not in "biuf":
        raise ValueError(f"expected numeric {what}, got dtype {array.dtype}")
    if array.shape[-1:] != (size,) or array.ndim not in ((1, 2) if or_one else (2,)):
        raise ValueError(f"{expected}, got {array.shape}")
    return array
