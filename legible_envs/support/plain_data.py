"""JSON, YAML and TOML from files of people: plain data of bounded size, or one kind of error.

Plain data are mappings with texts as keys, lists, texts, finite numbers, truth values and None. Python's own readers
accept more and trust more: YAML aliases that unfold to billions of entries, keys given twice, whole numbers of any
length, dates, NaN, and nesting that exhausts the stack.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Hashable
from datetime import date, time
from typing import Any, Final

import yaml

from legible_envs.support.validation import shown

__all__ = [
    "MOST_CHARACTERS",
    "MOST_CHARACTERS_OF_TOML",
    "MOST_CHARACTERS_OF_YAML",
    "MOST_ENTRIES_OF_YAML",
    "MOST_MARKS_OF_YAML",
    "check_plain",
    "parse_json",
    "parse_toml",
    "parse_yaml",
]

MOST_CHARACTERS: Final = 16_000_000
"""Longest JSON that is read."""

MOST_CHARACTERS_OF_TOML: Final = 500_000
"""Longest TOML that is read."""

MOST_CHARACTERS_OF_YAML: Final = 50_000
"""Longest YAML that is read; its reader takes up to 20 microseconds a character."""

MOST_MARKS_OF_YAML: Final = 12_000
"""Most brackets, commas, colons, dashes and other marks of YAML in a text; its reader takes 50 microseconds a mark."""

MOST_ENTRIES_OF_YAML: Final = 100_000
"""Most values of a YAML file, those repeated by aliases counted as often as they are named."""

_BITS: Final = 128  # seeds may be that long
_LEVELS: Final = 100
_MARKS: Final = re.compile(r"[\[\]{},:?&*!-]")
_BRACKETS: Final = re.compile(r"[\[\]{}]")
_LONG_KEY: Final = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++[ \t]*+\.[ \t]*+){100}")


def parse_json(text: str, *, finite: bool = True, most: int = MOST_CHARACTERS) -> Any:
    """Read JSON.

    Args:
        text: The whole text.
        finite: Whether NaN and infinities, which Python writes as ``NaN`` and ``Infinity``, are refused.
        most: How many characters it may have.

    Raises:
        ValueError: It is not JSON; longer than ``most``; nested more than 100 levels deep; a key stands
            twice in one mapping, or a number is not finite or longer than 128 bits. Says where.

    Example:
        >>> parse_json('{"size": [1, 2.5]}')
        {'size': [1, 2.5]}
        >>> parse_json('{"size": [1, 1e999]}')
        Traceback (most recent call last):
        ValueError: `size[1]` must be a finite number, got inf
    """
    _check_length(text, most, "JSON")
    return _checked("JSON", lambda: json.loads(text, object_pairs_hook=_without_repeats), finite=finite)


def parse_toml(text: str, *, finite: bool = True) -> dict[str, Any]:
    """Read TOML.

    Args:
        text: The whole text.
        finite: Whether NaN and infinities are refused.

    Raises:
        ValueError: It is not TOML; longer than :data:`MOST_CHARACTERS_OF_TOML`; nested more than 100 levels deep; or it
            holds a date or time, or a number that is not finite or longer than 128 bits. Says where.
    """
    _check_length(text, MOST_CHARACTERS_OF_TOML, "TOML")
    if _LONG_KEY.search(text):  # its reader takes seconds for a key of thousands of parts
        raise _too_deep()
    data: dict[str, Any] = _checked("TOML", lambda: tomllib.loads(text), finite=finite)
    return data


def parse_yaml(text: str) -> Any:
    """Read YAML 1.1 of plain data, aliases included.

    Raises:
        ValueError: It is not YAML, or more than plain data; longer than :data:`MOST_CHARACTERS_OF_YAML`, with more
            marks than :data:`MOST_MARKS_OF_YAML`; its values, aliases unfolded, are more than
            :data:`MOST_ENTRIES_OF_YAML` or nested more than 100 levels deep; a key stands twice, or a number is not
            finite or longer than 128 bits. Says where.
    """
    _check_length(text, MOST_CHARACTERS_OF_YAML, "YAML")
    if (marks := len(_MARKS.findall(text))) > MOST_MARKS_OF_YAML:
        raise ValueError(f"it has {marks:,} brackets, commas, colons and such; at most {MOST_MARKS_OF_YAML:,} are read")
    if _open_brackets(text) > 2 * _LEVELS:  # its reader takes time as the square of these
        raise _too_deep()
    return _checked("YAML", lambda: _load_yaml(text))


def _open_brackets(text: str) -> int:
    """The most brackets that stand open at a time, those in quotes taken for brackets, too."""
    depth = most = 0
    for bracket in _BRACKETS.findall(text):
        depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
        most = max(most, depth)
    return most


def _check_length(text: str, most: int, kind: str) -> None:
    if len(text) > most:
        raise ValueError(f"it has {len(text):,} characters; {kind} of at most {most:,} is read")


def _checked(kind: str, parse: Callable[[], Any], *, finite: bool = True) -> Any:
    try:
        data = parse()
    except _RefusedError:
        raise
    except (ValueError, yaml.YAMLError) as error:
        raise ValueError(f"not valid {kind}: {' '.join(str(error).split())}") from error
    except RecursionError as error:
        raise _too_deep() from error
    check_plain(data, finite=finite)
    return data


class _RefusedError(ValueError):
    """It can be parsed, and is refused all the same."""


def _too_deep() -> ValueError:
    return _RefusedError(f"it is nested too deeply; at most {_LEVELS} levels are read")


def check_plain(data: Any, *, finite: bool = True) -> None:
    """Refuse values that are no plain data, wherever they stand in lists and dictionaries.

    Args:
        data: Any data; that of a program goes through :func:`~legible_envs.support.models.as_plain` first.
        finite: Whether NaN and infinities are refused.

    Raises:
        ValueError: There is one; names it by keys and positions from 0.
    """
    waiting: list[tuple[Any, tuple[str | int, ...]]] = [([data], ())]
    while waiting:
        container, path = waiting.pop()
        if len(path) > _LEVELS:
            raise _too_deep()
        if isinstance(container, dict):
            odd = next((key for key in container if not isinstance(key, str)), None)
            if odd is not None:
                raise ValueError(f"{_where(path[1:])} must have texts as keys, got the key {shown(odd)}")
        pairs = container.items() if isinstance(container, dict) else enumerate(container)
        for key, value in pairs:
            if isinstance(value, dict | list):
                waiting.append((value, (*path, key)))
            elif (wanted := _wanted_instead(value, finite)) is not None:
                raise ValueError(f"{_where((*path, key)[1:])} must be {wanted}, got {_shown(value)}")


def _shown(value: Any) -> str:
    return f"the date or time {value}" if isinstance(value, date | time) else shown(value)


def _wanted_instead(value: Any, finite: bool) -> str | None:
    """What a single value should be; None where it is that."""
    if value is None or isinstance(value, str | bool):
        return None
    if isinstance(value, float):
        return "a finite number" if finite and not math.isfinite(value) else None
    if isinstance(value, int):
        return f"a number of at most {_BITS} bits" if value.bit_length() > _BITS else None
    return "a text, number, truth value, list or table"


def _where(path: tuple[str | int, ...]) -> str:
    """Such as "`goals[2].name`", or "it" for the whole."""
    from legible_envs.support.models import as_path

    return f"`{as_path(path)}`" if path else "it"


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise _RefusedError(f"the key {shown(twice)} stands twice in one mapping")
    return found


class _PlainLoader(yaml.SafeLoader):
    """PyYAML's safe loader that refuses repeated keys; the one in Python: that of libyaml crashes at deep nesting."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        seen: set[Any] = set()
        for key_node, _ in node.value if isinstance(node.value, list) else ():
            key = None if key_node.tag == _MERGE else self.construct_object(key_node, deep=True)
            if key_node.tag != _MERGE and isinstance(key, Hashable):
                if key in seen:
                    line = key_node.start_mark.line + 1
                    raise _RefusedError(f"the key {shown(key)} stands twice in one mapping, again in line {line}")
                seen.add(key)
        return super().construct_mapping(node, deep)


_MERGE: Final = "tag:yaml.org,2002:merge"


def _load_yaml(text: str) -> Any:
    loader = _PlainLoader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        _check_unfolded(node)
        return loader.construct_document(node)
    except (AttributeError, IndexError, KeyError, TypeError) as error:  # PyYAML at tags that do not fit their values
        raise ValueError(f"a tag does not fit its value ({error})") from error
    finally:
        loader.dispose()


def _check_unfolded(node: Any) -> None:
    """Refuse aliases that unfold to too much, before anything is built of them.

    Raises:
        ValueError: Too many values, too many levels, or a value that holds itself.
    """
    sizes: dict[int, int | None] = {}

    def size(node: Any, level: int) -> int:
        if level > _LEVELS:
            raise _too_deep()
        if id(node) in sizes:
            known = sizes[id(node)]
            if known is None:
                raise _RefusedError(f"the value that begins in line {node.start_mark.line + 1} holds itself")
            return known
        sizes[id(node)] = None
        inner = node.value if isinstance(node.value, list) else []
        parts = (part for entry in inner for part in (entry if isinstance(entry, tuple) else (entry,)))
        total = 1 + sum(size(part, level + 1) for part in parts)
        if total > MOST_ENTRIES_OF_YAML:
            raise _RefusedError(f"it holds more than {MOST_ENTRIES_OF_YAML:,} values, aliases unfolded")
        sizes[id(node)] = total
        return total

    size(node, 0)
