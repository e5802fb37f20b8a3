"""Statements of many participants as few statements of many rows."""

from __future__ import annotations

import itertools
import operator
import re
from collections.abc import Sequence
from typing import Any, Final

__all__ = ["Statement", "is_many", "joined"]

Statement = tuple[str, Sequence[Any]]
"""SQL with ``?``, and the values for them; a list of value lists as second part means many rows."""

_MOST_ROWS: Final = 64
"""Of a statement: with ten columns, less than the 999 values that every SQLite takes."""
_ROW: Final = re.compile(r"(INSERT (?:OR \w+ )?INTO .* VALUES )(\([?, ]+\))")


def is_many(values: Sequence[Any]) -> bool:
    """Whether the values of a statement are those of many rows."""
    return bool(values) and isinstance(values[0], list | tuple)


def joined(statements: Sequence[Statement]) -> list[Statement]:
    """The same in the same order, where inserts into a table that follow each other are one statement of many rows.

    The interpreter's lock changes hands with each statement that SQLite executes. Beside a busy event loop the thread
    that writes waits for it far longer than an insert takes.

    Args:
        statements: Of one transaction.

    Returns:
        Statements with the values of one execution each.
    """
    found: list[Statement] = []
    for sql, group in itertools.groupby(statements, key=operator.itemgetter(0)):
        rows = [row for _, values in group for row in (values if is_many(values) else [values])]
        match = _ROW.fullmatch(sql)
        while rows:
            # Few lengths, each of which stays prepared: powers of two.
            count = min(_MOST_ROWS, 1 << (len(rows).bit_length() - 1)) if match else 1
            several = match[1] + ", ".join([match[2]] * count) if match else sql
            found.append((several, list(itertools.chain.from_iterable(rows[:count]))))
            rows = rows[count:]
    return found
