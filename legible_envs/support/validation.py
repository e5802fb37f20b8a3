"""Checks of single arguments: numbers in a range, whole numbers, one of several options, and yes or no.

Every refusal has one form: which argument, what was expected, what came. For example "`beta` must be a finite number
> 0, got 'a'". Each check returns the value as a plain Python number, so that it can be written as JSON.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt

__all__ = [
    "LARGEST",
    "as_array",
    "choice",
    "entries",
    "flag",
    "integer",
    "integers",
    "is_integer",
    "is_masked",
    "is_real",
    "real",
    "shown",
    "switched_weights",
]

T = TypeVar("T")
Closed = Literal["both", "left", "right", "neither"]
MakeError = Callable[[str], Exception]

LARGEST = 2**63 - 1
"""The largest whole number that a numpy array of integers can hold."""

_SHOWN = 160


def is_real(value: object) -> bool:
    """Whether a value is a finite real number: an int, float or numpy scalar; no bool, text or array.

    Example:
        >>> is_real(2), is_real(np.float32(0.5)), is_real(True), is_real("2"), is_real(math.nan), is_real(10**400)
        (True, True, False, False, False, False)
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number beyond every float
        return False


def is_integer(value: object) -> bool:
    """Whether a value is an int or a numpy integer; no bool, and no float even if it is whole."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def is_masked(value: object) -> bool:
    """Whether numbers are masked, that is marked as missing, in a numpy array or in a list of such.

    Example:
        >>> is_masked(np.ma.array([1, 2], mask=[True, False])), is_masked([0, np.ma.masked]), is_masked(np.zeros(2))
        (True, True, False)
    """
    if isinstance(value, list | tuple):
        return any(isinstance(entry, np.ma.MaskedArray) and is_masked(entry) for entry in value)
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(value))


def as_array(value: object) -> npt.NDArray[Any]:
    """A value as an array; an empty one of objects for masked numbers and what numpy makes no array of.

    Example:
        >>> as_array([1, 2]).tolist(), as_array([[1], [2, 3]]).shape
        ([1, 2], (0,))
    """
    if not is_masked(value):
        with suppress(TypeError, ValueError, OverflowError):
            return np.asarray(value)
    return np.empty(0, dtype=object)


def real(
    name: str,
    value: object,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    closed: Closed = "both",
    also: str = "",
    unit: str = "",
    error: MakeError = ValueError,
) -> float:
    """Return a finite number in a range as a float.

    Args:
        name: Of the argument; or a phrase that holds it in backticks, such as "the robot's `rate`".
        value: What the caller was given.
        low: Least value.
        high: Greatest value.
        closed: Which finite ends belong to the range: ``"both"``, the ``"left"`` one, the ``"right"`` one or
            ``"neither"``.
        also: What else the argument may be, such as ``"None"``, for the message; the caller lets it pass.
        unit: What is counted, for the message.
        error: Makes the exception of a message.

    Raises:
        ValueError: Or what ``error`` makes: the value is no number, not finite, or out of range.

    Example:
        >>> real("beta", 2, 0, closed="neither")
        2.0
        >>> real("share", "a", 0, 1, closed="right")
        Traceback (most recent call last):
        ValueError: `share` must be a finite number > 0 and <= 1, got 'a'
    """
    if is_real(value):
        number = float(value)  # type: ignore[arg-type]
        above = number > low or (number == low and closed in ("both", "left"))
        below = number < high or (number == high and closed in ("both", "right"))
        if above and below:
            return number
    raise error(_refusal(name, f"a finite number{_range(low, high, closed)}", value, also, unit))


def integer(
    name: str,
    value: object,
    low: float = -math.inf,
    high: float = LARGEST,
    *,
    whole_floats: bool = False,
    also: str = "",
    unit: str = "",
    error: MakeError = ValueError,
) -> int:
    """Return a whole number from ``low`` to ``high`` as an int.

    Args:
        name: Of the argument; or a phrase that holds it in backticks.
        value: What the caller was given.
        low: Least value.
        high: Greatest value; by default what an array can hold.
        whole_floats: Whether floats without a fraction, such as 2.0, are accepted.
        also: What else the argument may be, for the message; the caller lets it pass.
        unit: What is counted, for the message.
        error: Makes the exception of a message.

    Raises:
        ValueError: Or what ``error`` makes: the value is no whole number, or out of range.

    Example:
        >>> integer("count", np.int8(3), 1)
        3
        >>> integer("count", 2.5, 1, 6, unit="steps")
        Traceback (most recent call last):
        ValueError: `count` must be an integer from 1 to 6 steps, got 2.5
    """
    accepted = is_integer(value) or (whole_floats and is_real(value) and float(value).is_integer())  # type: ignore[arg-type]
    if accepted and low <= value <= high:  # type: ignore[operator]
        return int(value)  # type: ignore[call-overload,no-any-return]
    # a limit set by arrays is said only to those who exceed it
    limit = math.inf if high == LARGEST and not (accepted and value > high) else high  # type: ignore[operator]
    raise error(_refusal(name, f"an integer{_range(low, limit, 'both')}", value, also, unit))


def integers(low: int, high: float = LARGEST, /, **values: object) -> None:
    """Check whole numbers given by name; None stands for a default and passes.

    Raises:
        ValueError: One is no whole number, below ``low`` or above ``high``; the message names it.

    Example:
        >>> integers(1, batch_size=36, initial=None)
        >>> integers(1, batch_size=36, initial=0)
        Traceback (most recent call last):
        ValueError: `initial` must be an integer >= 1, got 0
    """
    for name, value in values.items():
        if value is not None:
            integer(name, value, low, high)


def choice(name: str, value: object, options: Iterable[T], *, also: str = "", error: MakeError = ValueError) -> T:
    """Return a value that is one of several options.

    Args:
        name: Of the argument; or a phrase that holds it in backticks.
        value: What the caller was given.
        options: What it may be.
        also: What else the argument may be, for the message; the caller lets it pass.
        error: Makes the exception of a message.

    Raises:
        ValueError: Or what ``error`` makes: the value is none of the options.

    Example:
        >>> choice("contact", "fast", ("slow", "always", "never"))
        Traceback (most recent call last):
        ValueError: `contact` must be one of ['slow', 'always', 'never'], got 'fast'
    """
    known = list(options)
    for option in known:
        if _is_same(value, option):
            return option
    wanted = " or ".join(map(repr, known)) if len(known) <= 2 else f"one of {known}"
    raise error(_refusal(name, wanted, value, also, ""))


def flag(name: str, value: object, *, also: str = "", error: MakeError = ValueError) -> bool:
    """Return True or False.

    Raises:
        ValueError: Or what ``error`` makes: the value is neither; numpy's booleans are accepted.
    """
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise error(_refusal(name, "True or False", value, also, ""))


def switched_weights(name: str, value: object, defaults: Mapping[str, float]) -> dict[str, float] | None:
    """Weights that are off, on, or set one by one.

    Args:
        name: Of the argument.
        value: False or True, or a mapping from names to numbers; names left out keep their default.
        defaults: Every name with its number.

    Returns:
        A number for every name; None for False.

    Raises:
        ValueError: Neither; an unknown name; or no finite number.

    Example:
        >>> switched_weights("shaping", {"dish": 1}, {"dish": 3.0, "soup": 5.0})
        {'dish': 1.0, 'soup': 5.0}
    """
    if not isinstance(value, Mapping):
        return dict(defaults) if flag(name, value, also="a mapping of weights,") else None
    unknown = sorted(str(key) for key in value if key not in defaults)
    if unknown:
        raise ValueError(f"unknown weights {unknown} in `{name}`; known: {list(defaults)}")
    return {key: real(f"weight {key!r} of `{name}`", value.get(key, default)) for key, default in defaults.items()}


def entries(value: object) -> list[Any]:
    """The entries of a list, tuple, array or other iterable; none where a value is a text, a mapping or no iterable.

    Example:
        >>> entries((7, 7)), entries(np.arange(2)), entries("ab"), entries(None)
        ([7, 7], [0, 1], [], [])
    """
    if isinstance(value, np.ndarray):
        return list(value.tolist()) if value.ndim else []
    return list(value) if isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping) else []


def shown(value: object) -> str:
    """A value as messages show it: its ``repr``, cut where that is long."""
    try:
        text = repr(value)
    except Exception:  # such as that of a whole number of more than 4,300 digits
        text = f"an object of type {type(value).__name__} that cannot be shown"
    return text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"


def _is_same(value: Any, option: object) -> bool:
    if value is option:
        return True
    if isinstance(value, np.ndarray) or isinstance(value, bool | np.bool_) != isinstance(option, bool):
        return False
    try:
        return bool(value == option)
    except Exception:  # whatever a stranger's comparison may raise
        return False


def _range(low: float, high: float, closed: Closed) -> str:
    if math.isfinite(low) and math.isfinite(high) and closed == "both":
        return f" from {_bound(low)} to {_bound(high)}"
    bounds = []
    if math.isfinite(low):
        bounds.append(f"{'>=' if closed in ('both', 'left') else '>'} {_bound(low)}")
    if math.isfinite(high):
        bounds.append(f"{'<=' if closed in ('both', 'right') else '<'} {_bound(high)}")
    return f" {' and '.join(bounds)}" if bounds else ""


def _bound(bound: float) -> str:
    return str(bound) if isinstance(bound, int) else f"{bound:g}"


def _refusal(name: str, wanted: str, value: object, also: str, unit: str) -> str:
    argument = name if "`" in name else f"`{name}`"
    expected = f"{also} or {wanted}" if also else wanted
    return f"{argument} must be {expected}{' ' + unit if unit else ''}, got {shown(value)}"
