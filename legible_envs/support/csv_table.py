r"""Tables as comma-separated values (RFC 4180): strict, and every record with the line on which it begins.

The standard library's reader counts the lines of a record at its end, accepts quotes that are never closed, and limits
the size of a value by a setting of the whole process. This one has none of that, and lets a quoted value keep the
blanks at its ends; those of unquoted values are dropped.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Final, NamedTuple

__all__ = [
    "DELIMITERS",
    "CsvRecord",
    "CsvSyntaxError",
    "join_values",
    "read_records",
    "split_values",
    "spreadsheet_text",
    "text_of_spreadsheet",
]

DELIMITERS: Final = {",": "commas", ";": "semicolons", "\t": "tabs"}
"""What may stand between values, and what messages call it."""
_BLANKS: Final = " \t"


class CsvSyntaxError(ValueError):
    """A text that is no CSV; the message begins with the line."""


class CsvRecord(NamedTuple):
    """One record.

    Attributes:
        line: Number of the line on which it begins, from 1.
        values: Its values.
    """

    line: int
    values: list[str]


def read_records(text: str, delimiter: str = ",") -> Iterator[CsvRecord]:
    r"""The records of a table; lines without any value are left out.

    Args:
        text: The table; lines end in ``\n``, ``\r\n`` or ``\r``. Quoted values may hold line breaks, delimiters and
            doubled quotes.
        delimiter: What stands between values.

    Raises:
        CsvSyntaxError: A quote that is never closed, or inside an unquoted value.

    Example:
        >>> list(read_records('a, b\n"1\n2"," 3 "\n'))
        [CsvRecord(line=1, values=['a', 'b']), CsvRecord(line=2, values=['1\n2', ' 3 '])]
    """
    blanks = _BLANKS.replace(delimiter, "")
    lines = enumerate(io.StringIO(text, newline=""), 1)
    for number, line in lines:
        if '"' not in line:
            values = [value.strip(blanks) for value in line.rstrip("\r\n").split(delimiter)]
        else:
            parts, is_open = [line], line.count('"') % 2 == 1
            while is_open:
                _, line = next(lines, (0, ""))
                if not line:
                    raise CsvSyntaxError(f"line {number}: a quote is opened here and never closed")
                parts.append(line)
                is_open ^= line.count('"') % 2 == 1
            record = split_values("".join(parts).removesuffix("\n").removesuffix("\r"), delimiter)
            if record is None:
                raise CsvSyntaxError(
                    f"line {number}: a quote inside a value; such a value is quoted as a whole, its quotes doubled: "
                    '"a ""b"""'
                )
            values = record
        if any(values):
            yield CsvRecord(number, values)


def split_values(text: str, delimiter: str) -> list[str] | None:
    """The values of one record, or None where its quotes do not fit.

    Example:
        >>> split_values('a; "b;c" ;', ";"), split_values('a "b";c', ";")
        (['a', 'b;c', ''], None)
    """
    pattern, at, values = _pattern(delimiter), 0, []
    while True:
        found = pattern.match(text, at)
        if found is None:
            return None
        quoted, plain = found.groups()
        values.append(plain.strip(_BLANKS) if quoted is None else quoted.replace('""', '"'))
        if found.end() == len(text):
            return values
        at = found.end() + 1


@cache
def _pattern(delimiter: str) -> re.Pattern[str]:
    # possessive, so that a hostile text takes no more than linear time
    blank, end = f"[{_BLANKS.replace(delimiter, '')}]*+", f"(?={re.escape(delimiter)}|\\Z)"
    return re.compile(f'(?:{blank}"((?:[^"]|"")*+)"{blank}|([^"{re.escape(delimiter)}]*+)){end}')


def join_values(values: Sequence[str], delimiter: str = ",") -> str:
    """One record; values are quoted where :func:`split_values` would not give them back otherwise.

    Example:
        >>> join_values(["a", "b,c", ' "d" '])
        'a,"b,c"," ""d"" "'
    """
    return delimiter.join(_quoted(value, delimiter) for value in values)


def _quoted(value: str, delimiter: str) -> str:
    needs = delimiter in value or '"' in value or "\n" in value or "\r" in value or value.strip(_BLANKS) != value
    return '"' + value.replace('"', '""') + '"' if needs else value


# -- spreadsheets, which run what looks like a formula ----------------------------------------------------------------

_FORMULA: Final = re.compile(r"'* *[=+\-@\t\r\n＝＋－＠]")
_MARKED: Final = re.compile(f"'{_FORMULA.pattern}")
_HARMLESS: Final = re.compile(r"[+-]?(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|inf)?")


def spreadsheet_text(text: str) -> str:
    """A text as it stands in a CSV, so that no spreadsheet takes it for a formula and runs it.

    What begins like a formula (``=``, ``+``, ``-``, ``@``, their wide forms, a tab or the end of a line, also behind
    blanks) has an apostrophe in front, the mark of text in spreadsheets. Numbers such as ``-0.5`` stay as they are, and
    a lone sign. :func:`text_of_spreadsheet` gives every text back.

    Example:
        >>> spreadsheet_text("=1+1"), spreadsheet_text("-1"), spreadsheet_text("'=1+1"), spreadsheet_text("cube")
        ("'=1+1", '-1', "''=1+1", 'cube')
    """
    return f"'{text}" if _FORMULA.match(text) and not _HARMLESS.fullmatch(text) else text


def text_of_spreadsheet(value: str) -> str:
    """The text that :func:`spreadsheet_text` wrote; other values stay as they are.

    Example:
        >>> text_of_spreadsheet("'=1+1"), text_of_spreadsheet("'tis"), text_of_spreadsheet("-1")
        ('=1+1', "'tis", '-1')
    """
    return value[1:] if _MARKED.match(value) else value
