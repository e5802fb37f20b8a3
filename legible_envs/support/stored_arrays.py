"""Arrays that a file holds, checked before they are used: there, of the right kind and dimensions, finite."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.support.plain_data import MOST_CHARACTERS, parse_json
from legible_envs.support.validation import LARGEST, integer

__all__ = ["says", "stored_array", "stored_json", "stored_text", "stored_whole"]

_KINDS: Final = {"b": "truth values", "iu": "whole numbers", "f": "floats", "iuf": "numbers", "U": "texts"}
_LONGEST_TEXT: Final = 1_000_000


def stored_array(
    file: Mapping[str, Any],
    name: str,
    kinds: str,
    shape: tuple[int | None, ...],
    *,
    finite: bool = False,
) -> npt.NDArray[Any]:
    """One array of a file.

    Args:
        file: The arrays, such as those of :func:`~legible_envs.support.files.open_npz`.
        name: Which.
        kinds: Kinds of numpy's dtypes: ``"iu"`` whole numbers, ``"f"`` floats, ``"iuf"`` either, ``"b"`` truth values,
            ``"U"`` texts.
        shape: Its shape; None where any length will do.
        finite: Whether NaN and infinities are refused.

    Raises:
        ValueError: It is not there, or another one; says what was expected and what came.

    Example:
        >>> stored_array({"times": np.zeros(())}, "times", "f", (None,))
        Traceback (most recent call last):
        ValueError: `times` must be floats of shape (any), got float64 of shape ()
    """
    if name not in file:
        raise ValueError(f"it lacks the array `{name}`; it has {sorted(map(str, file))[:20]}")
    array: npt.NDArray[Any] = np.asarray(file[name])
    fits = len(shape) == array.ndim and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))
    if array.dtype.kind not in kinds or not fits:
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(
            f"`{name}` must be {_KINDS[kinds]} of shape ({wanted}), got {array.dtype} of shape {array.shape}"
        )
    if array.dtype.kind == "U" and not _is_text(array):
        raise ValueError(f"`{name}` is no text: it holds numbers beyond the last letter of Unicode")
    if finite and array.dtype.kind == "f" and not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"`{name}` must be finite, got {array[place]} at {list(place)}")
    return array


def _is_text(array: npt.NDArray[Any]) -> bool:
    """Whether texts can be made of an array; Python ends in a SystemError where they cannot."""
    native = array.astype(array.dtype.newbyteorder("=")).reshape(-1)
    return not native.dtype.itemsize or not native.size or int(native.view(np.uint32).max()) <= sys.maxunicode


def stored_text(file: Mapping[str, Any], name: str) -> str:
    """A text that a file holds as an array of no dimensions.

    Raises:
        ValueError: It is not there, none, or longer than a million characters.
    """
    array = stored_array(file, name, "U", ())
    if array.dtype.itemsize > 4 * _LONGEST_TEXT:
        raise ValueError(f"`{name}` has room for {array.dtype.itemsize // 4:,} characters; at most {_LONGEST_TEXT:,}")
    return str(array[()])


def says(file: Mapping[str, Any], name: str, text: str) -> bool:
    """Whether a file holds a text under a name; False where it holds anything else.

    Raises:
        ValueError: The array is damaged.
    """
    return name in file and file[name].shape == () and file[name].dtype.kind == "U" and bool(file[name] == text)


def stored_whole(file: Mapping[str, Any], name: str, low: int, high: int = LARGEST) -> int:
    """A whole number that a file holds as an array of no dimensions.

    Raises:
        ValueError: It is not there, none, or out of range.
    """
    return integer(f"`{name}`", stored_array(file, name, "iu", ()).item(), low, high)


def stored_json(file: Mapping[str, Any], name: str, *, most: int = MOST_CHARACTERS) -> Any:
    """Plain data that a file holds as the bytes of JSON in ASCII, of at most ``most`` characters.

    Raises:
        ValueError: They are not there, or no such data.
    """
    array = stored_array(file, name, "iu", (None,))
    if array.dtype != np.uint8:
        raise ValueError(f"`{name}` must be bytes (uint8), got {array.dtype}")
    try:
        text = array.tobytes().decode("ascii")
    except UnicodeDecodeError as error:
        raise ValueError(f"`{name}` is not ASCII: {error}") from error
    try:
        return parse_json(text, most=most)
    except ValueError as error:
        raise ValueError(f"`{name}`: {error}") from error
