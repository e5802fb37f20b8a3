"""Numbers on pages: rounded as on the terminal, set with a true minus sign and thin spaces."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any, Final

from benchmarks.console import number

__all__ = ["DASH", "fixed", "p_value", "scale_of", "significant", "with_minus"]

DASH: Final = "–"
"""Stands where there is no number."""
_MINUS, _THIN, _TIMES = "\u2212", "\u202f", "\u00d7"
_NEGATIVE: Final = re.compile(r"(?<![\w.,)-])-(?=\.?\d)")
_NOTHING: Final = 1e-12
"""What is smaller than this, or than a billionth of the largest in its column, is a rounding error, not a result."""


def fixed(value: float | None, digits: int = 2) -> str:
    """A number with so many decimals, a dash where there is none."""
    if value is None or not math.isfinite(value):
        return DASH if value is None or math.isnan(value) else _infinite(value)
    return number(value, digits).replace("-", _MINUS).replace(",", _THIN)


def significant(value: float, digits: int = 4, *, scale: float = 0.0) -> str:
    """A number with so many digits that count, and none of those that are rounding errors.

    Args:
        value: The number; NaN gives a dash.
        digits: Digits that count.
        scale: The largest magnitude of what it stands among; a billionth of that is shown as 0.

    Example:
        >>> significant(8.882e-15), significant(0.125), significant(-12345.6), significant(2.345e-9)
        ('0', '0.125', '−12\u202f346', '2.345 × 10⁻⁹')
    """
    if not math.isfinite(value):
        return DASH if math.isnan(value) else _infinite(value)
    if abs(value) < max(_NOTHING, 1e-9 * scale):
        return "0"
    if abs(value) >= 10 ** (digits - 1):
        return fixed(value, 0)
    if abs(value) < 1e-4:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{_trimmed(mantissa)} {_TIMES} 10{_raised(int(exponent))}"
    return f"{value:.{digits}g}".replace("-", _MINUS)


def p_value(value: float) -> str:
    """A probability as papers print it: three decimals, or that it is smaller."""
    if math.isnan(value):
        return DASH
    return "< 0.001" if value < 0.001 else fixed(value, 3)


def scale_of(values: Iterable[Any]) -> float:
    """The largest finite magnitude of a column; 0 where there is none."""
    return max((abs(v) for v in values if isinstance(v, int | float) and math.isfinite(v)), default=0.0)


def with_minus(text: str) -> str:
    """A text whose negative numbers have a true minus sign; hyphens and ranges stay."""
    return _NEGATIVE.sub(_MINUS, text)


def _infinite(value: float) -> str:
    return "∞" if value > 0 else f"{_MINUS}∞"


def _trimmed(mantissa: str) -> str:
    shown = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return shown.replace("-", _MINUS)


def _raised(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
