"""Text that people hand over: byte-order marks, line endings and encodings are dealt with here, once."""

from __future__ import annotations

import codecs
import os
from pathlib import Path
from typing import Any, Final

__all__ = ["clean_text", "decode_text", "dump_yaml", "read_source", "read_text"]

# The longer marks first: UTF-32's begins with UTF-16's.
_MARKS: Final = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def read_text(path: str | os.PathLike[str]) -> str:
    r"""Read a text file that a person wrote, with any editor, on any system.

    Returns:
        The text without byte-order mark; every line ends in ``\n`` alone, but for a last one that had no ending.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is not text; says what it looks like.
    """
    return decode_text(Path(path).read_bytes(), os.fspath(path))


def read_source(source: str | Path, suffixes: tuple[str, ...]) -> tuple[str, str]:
    """The text of a file, or a text itself.

    Args:
        source: A ``Path``, or a string: that of a file where it is one line with one of the suffixes, else the text.
        suffixes: Such as ``(".json",)``.

    Returns:
        The text, and how messages about it begin: the path and a colon, nothing for a text itself.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is not text; names the file.
    """
    if isinstance(source, Path) or ("\n" not in source and source.endswith(suffixes)):
        return read_text(source), f"{source}: "
    return clean_text(str(source)), ""


def decode_text(data: bytes, source: str = "the text", *, unify: bool = True) -> str:
    r"""Decode UTF-8, or UTF-16 and UTF-32 that begin with a byte-order mark; unify line endings.

    Args:
        data: The bytes of a whole text.
        source: What messages call it, such as the path of its file.
        unify: Whether every line shall end in ``\n`` alone. Quoted text may hold line breaks that have to stay.

    Raises:
        ValueError: Bytes of another kind; names ``source``, what was expected and the offending byte with its line.
    """
    mark, encoding = next((known for known in _MARKS if data.startswith(known[0])), (b"", "utf-8"))
    data = data[len(mark) :]
    if not mark and b"\0" in data[:4096]:
        raise ValueError(f"{source} is not text: it holds zero bytes; expected text in UTF-8")
    try:
        text = data.decode(encoding)
        return clean_text(text) if unify else text.removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ValueError(
            f"{source}, line {line}: byte 0x{data[error.start]:02x} is not {encoding.upper()}; "
            "expected text in UTF-8 (in a spreadsheet: save as 'CSV UTF-8')"
        ) from error


def clean_text(text: str) -> str:
    r"""A text without byte-order mark, every line ending in ``\n`` alone."""
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def dump_yaml(data: Any) -> str:
    r"""Plain data as YAML that is read back equal, letters of all scripts as they are.

    A next-line character (``\x85``), which PyYAML would write as it is and read as a line break, has all such letters
    escaped.
    """
    import yaml

    text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    return text if "\x85" not in text else yaml.safe_dump(data, sort_keys=False)
