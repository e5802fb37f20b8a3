r"""Names that others chose, on their way out: as one line that can be looked at, and as the name of a file.

Layouts, tasks and trajectories come from strangers, and so do the names in them. Inside the programs a name is any
text; these functions stand where one leaves them. For spreadsheets there is
:func:`~legible_envs.support.csv_table.spreadsheet_text`.
"""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Callable
from typing import Final

from legible_envs.support.validation import shown

__all__ = ["check_file_name", "file_name", "is_whole", "printable"]

_UNSEEN: Final = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""Categories of Unicode: control, format (direction of writing, no width), half characters, ends of lines."""
_JOINERS: Final = "\u200c\u200d"
"""Part of the spelling of some scripts, and of emoji of several people."""
_SHORT: Final = {"\t": r"\t", "\n": r"\n", "\r": r"\r"}


def printable(text: str, *, lines: bool = False) -> str:
    r"""A text in which everything that is not seen, or that steers a terminal, is written out as an escape.

    That are control characters, marks of the direction of writing, characters of no width, ends of lines, halves of
    characters and noncharacters. What is left is one line, is valid in XML and HTML, and can be encoded. Joiners stay
    where they belong to the spelling, between letters that are not ASCII.

    Args:
        text: Any text.
        lines: Whether line feeds stay, in a text of several lines.

    Example:
        >>> printable("cube\x1b[2J"), printable("\u202egnp.exe"), printable("a\nb", lines=True)
        ('cube\\x1b[2J', '\\u202egnp.exe', 'a\nb')
    """
    if text.isprintable():
        return text
    kept = "\n" if lines else ""
    return "".join(
        character if character in kept or _is_seen(text, at) else _escaped(character)
        for at, character in enumerate(text)
    )


def is_whole(text: str) -> bool:
    r"""Whether a text is made of whole characters: halves of surrogate pairs are in no file, terminal or picture.

    Example:
        >>> is_whole("cup"), is_whole("\ud83c")
        (True, False)
    """
    return not any("\ud800" <= character <= "\udfff" for character in text)


def _is_seen(text: str, at: int) -> bool:
    character = text[at]
    if character in _JOINERS:
        return not (text[at - 1 : at] or "a").isascii() and not (text[at + 1 : at + 2] or "a").isascii()
    code = ord(character)
    is_noncharacter = code & 0xFFFE == 0xFFFE or 0xFDD0 <= code <= 0xFDEF
    return not is_noncharacter and unicodedata.category(character) not in _UNSEEN


def _escaped(character: str) -> str:
    code = ord(character)
    digits = f"x{code:02x}" if code < 0x100 else f"u{code:04x}" if code < 0x10000 else f"U{code:08x}"
    return _SHORT.get(character, f"\\{digits}")


LONGEST: Final = 200
"""Bytes of the name of a file; systems allow 255, and files are written under longer names first."""

_FORBIDDEN: Final = re.compile(r'[/\\:*?"<>|]+')
_RESERVED: Final = re.compile(r"(?:CON|PRN|AUX|NUL|CONIN\$|CONOUT\$|(?:COM|LPT)[0-9¹²³])(?=\.|$)", re.IGNORECASE)


def file_name(text: str) -> str:
    r"""A name for one file or folder, on every system, that resembles a text; most texts are such a name as they are.

    No path, no ``..``, no leading dot, no blanks or dots at the end, none of ``/ \ : * ? " < > |``, nothing that
    :func:`printable` escapes, none of the names that Windows keeps for devices, at most 200 bytes. Different texts may
    have the same name, unless they were cut.

    Example:
        >>> file_name("kitchen 7x7"), file_name("../../etc/passwd"), file_name("con"), file_name("...")
        ('kitchen 7x7', 'etc-passwd', '_con', '_')
    """
    seen = "".join(c if c.isprintable() or _is_seen(text, at) else "/" for at, c in enumerate(text))
    name = _FORBIDDEN.sub("-", seen).strip(" ").lstrip(".").rstrip(". ")
    if name != text:
        name = name.strip("-. ")
    if _RESERVED.match(name):
        name = f"_{name}"
    if len(name.encode()) > LONGEST:
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]
        name = f"{name.encode()[: LONGEST - 9].decode(errors='ignore').rstrip('. ')}-{digest}"
    return name or "_"


def check_file_name(name: str, value: object, *, error: Callable[[str], Exception] = ValueError) -> str:
    """Return a text that is the name of a file or folder on every system; see :func:`file_name`.

    Args:
        name: Of the argument; or a phrase that holds it in backticks.
        value: What the caller was given.
        error: Makes the exception of a message.

    Raises:
        ValueError: Or what ``error`` makes: it is none; the message says which would be.
    """
    if isinstance(value, str) and value and file_name(value) == value:
        return value
    argument = name if "`" in name else f"`{name}`"
    instead = f"; {file_name(value)!r} is one" if isinstance(value, str) and value.strip(". /\\") else ""
    raise error(
        f"{argument} must be the name of a file on every system: no path, no control characters, none of "
        f'/ \\ : * ? " < > |, no dot in front, no dot or blank at the end, at most {LONGEST} bytes, and no device of '
        f"Windows; got {shown(value)}{instead}"
    )
