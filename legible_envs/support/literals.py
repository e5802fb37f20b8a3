"""Plain data in files that people write: JSON, or a Python literal, read without running any of it."""

from __future__ import annotations

import ast
import warnings
from dataclasses import dataclass
from typing import Any, Final

from legible_envs.support.text import clean_text

__all__ = ["Expression", "read_literal"]

_LONGEST: Final = 500_000
_SHOWN: Final = 60


@dataclass(frozen=True)
class Expression:
    """What stands in a literal and is none, such as a call: its text, which is never run.

    Attributes:
        text: The expression, cut where it is long.
        line: The line it begins in, from 1.
    """

    text: str
    line: int

    def __repr__(self) -> str:
        return f"the expression {self.text} (line {self.line})"


def read_literal(text: str) -> Any:
    """Read JSON or a Python literal; comments, trailing commas and tuples are allowed.

    Args:
        text: The text of a whole file.

    Returns:
        Plain data. Whatever is no literal, such as ``float('inf')``, is an :class:`Expression` in its place, so that
        those who need only some of the entries are not stopped by others.

    Raises:
        ValueError: It is neither, with the line and column; or longer than 500,000 characters.

    Example:
        >>> read_literal("{'rows': ('XXX',), 'bonus': float('inf'),}  # mine")
        {'rows': ('XXX',), 'bonus': the expression float('inf') (line 1)}
    """
    from legible_envs.support.plain_data import parse_json

    text = clean_text(text)
    if len(text) > _LONGEST:
        raise ValueError(f"it has {len(text):,} characters; expected at most {_LONGEST:,}")
    try:
        return parse_json(text, finite=False)
    except ValueError:
        pass  # Python's literals say more, and their errors name the line as well
    try:
        with warnings.catch_warnings():  # about escapes such as "\d" in other people's strings
            warnings.simplefilter("ignore")
            node = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        *above, indent = text[: len(text) - len(text.lstrip())].split("\n")
        line, column = error.lineno or 1, error.offset or 1
        column += len(indent) if line == 1 else 0
        raise ValueError(f"line {line + len(above)}, column {column}: {error.msg}") from error
    except UnicodeError as error:
        raise ValueError("it holds half a character (a lone surrogate), which no text can") from error
    except (ValueError, MemoryError, RecursionError, OverflowError) as error:
        reason = str(error) if isinstance(error, ValueError) else "nested too deeply"
        raise ValueError(f"neither JSON nor a Python literal: {reason}") from error
    return _value(node, text.strip())


def _value(node: ast.expr, text: str) -> Any:
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.List | ast.Tuple | ast.Set):
        values = [_value(each, text) for each in node.elts]
        return tuple(values) if isinstance(node, ast.Tuple) else values
    if isinstance(node, ast.Dict):
        pairs = zip(node.keys, node.values, strict=True)  # a key is None where a mapping is unpacked
        return {key.value: _value(value, text) for key, value in pairs if isinstance(key, ast.Constant)}
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
        number = node.operand.value
        if isinstance(number, int | float) and not isinstance(number, bool):
            return -number
    if isinstance(node, ast.Name) and node.id in _NAMES:
        return _NAMES[node.id]
    lines = text.split("\n")[node.lineno - 1].encode()[node.col_offset :].decode(errors="replace")
    if node.end_lineno == node.lineno and node.end_col_offset is not None:
        lines = lines.encode()[: node.end_col_offset - node.col_offset].decode(errors="replace")
    return Expression(lines if len(lines) <= _SHOWN else lines[: _SHOWN - 1] + "…", node.lineno)


_NAMES: Final = {"true": True, "false": False, "null": None}
"""JSON's words, in a text that is JSON but for a comment or a trailing comma."""
