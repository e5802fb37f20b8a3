"""In which line of a TOML file a value stands, for messages to people who edit it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

__all__ = ["line_of", "lines_of"]

Path = tuple[str | int, ...]

_KEY: Final = re.compile(r"""[ \t]*(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|([\w-]+))[ \t]*""")
_SKIPPED: Final = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}'
    r"|'''.*?'{3,5}"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|[^\"'#\n\[\]{}]+"
    r"|.",
    re.DOTALL,
)


def line_of(text: str, path: Sequence[str | int]) -> int:
    r"""The line of a value, or of the nearest thing around it that has one.

    Tables (``[name]``), entries of lists of tables (``[[name]]``) and keys have lines; what stands in a list or table
    written in braces has the line of its key.

    Args:
        text: A valid TOML file.
        path: Keys and positions from 0, such as ``("conditions", 2, "layout")``.

    Returns:
        From 1; 0 where nothing of the path is there.

    Example:
        >>> text = 'name = "a"\n[[conditions]]\nname = "b"\n\n[[conditions]]\nlayout = "c"\n'
        >>> line_of(text, ("conditions", 1, "layout")), line_of(text, ("conditions", 1, "name"))
        (6, 5)
    """
    known = lines_of(text)
    for length in range(len(path), 0, -1):
        if (line := known.get(tuple(path[:length]))) is not None:
            return line
    return 0


def lines_of(text: str) -> dict[Path, int]:
    """The lines of all tables and keys of a valid TOML file, by their path; the first where there are several."""
    found: dict[Path, int] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    for line, statement in _statements(text):
        stripped = statement.strip()
        if stripped.startswith("[["):
            path = _placed(_keys(stripped[2:]), counts)
            number = counts.get(path, -1) + 1
            counts[path] = number
            found.setdefault(path, line)
            table = (*path, number)
            found.setdefault(table, line)
        elif stripped.startswith("["):
            table = _placed(_keys(stripped[1:]), counts)
            found.setdefault(table, line)
        elif stripped:
            keys = _keys(stripped)
            for length in range(1, len(keys) + 1):
                found.setdefault((*table, *keys[:length]), line)
    return found


def _placed(keys: Path, counts: dict[Path, int]) -> Path:
    """The path of a table's name: below the last entry of each list of tables on the way."""
    path: Path = ()
    for position, key in enumerate(keys):
        path = (*path, key)
        if position < len(keys) - 1 and path in counts:
            path = (*path, counts[path])
    return path


def _keys(text: str) -> Path:
    """The dotted key that a statement begins with."""
    keys: list[str | int] = []
    at = 0
    while match := _KEY.match(text, at):
        keys.append(next(part for part in match.groups() if part is not None))
        at = match.end()
        if text[at : at + 1] != ".":
            break
        at += 1
    return tuple(keys)


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Headers of tables and assignments with the line in which each begins; strings and lists may span lines."""
    line, begun, depth, is_empty = 1, 1, 0, True
    parts: list[str] = []
    for match in _SKIPPED.finditer(text):
        token = match.group()
        if token == "\n" and depth == 0:
            yield begun, "".join(parts)
            parts, is_empty = [], True
        elif not token.startswith("#"):
            if is_empty:
                begun, is_empty = line, not token.strip()
            parts.append(token)
            if token in "[{":
                depth += 1
            elif token in "]}":
                depth -= 1
        line += token.count("\n")
    yield begun, "".join(parts)
