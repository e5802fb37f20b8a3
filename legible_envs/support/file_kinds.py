"""What a file looks like, in words for messages: by its first bytes, whatever its name says."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path
from typing import Final

from legible_envs.support.text import decode_text

__all__ = ["describe_file", "is_zip"]

_HEAD: Final = 65_536
_ZIP: Final = b"PK\x03\x04"
_SIGNATURES: Final = (
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"BM", "a BMP picture"),
    (b"%PDF-", "a PDF document"),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    (b"\x93NUMPY", "a NumPy array (.npy)"),
    (b"PK\x05\x06", "an empty ZIP archive"),
    (b"\x1f\x8b", "a gzip archive, which has to be unpacked first"),
    (b"BZh", "a bzip2 archive, which has to be unpacked first"),
    (b"\xfd7zXZ\x00", "an xz archive, which has to be unpacked first"),
    (b"PAR1", "a Parquet table"),
    (b"ARROW1", "an Arrow table"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x7fELF", "a program"),
)


def describe_file(path: str | os.PathLike[str]) -> str:
    """What a file or folder looks like: "a PNG picture", "JSON, an object with the keys 'a', 'b'", "an empty file".

    Raises:
        OSError: There is nothing of that name, or it cannot be read.

    Example:
        >>> describe_file(os.devnull)
        'an empty file'
    """
    path = Path(path)
    if path.is_dir():
        return "a folder"
    with path.open("rb") as file:
        head = file.read(_HEAD)
        is_whole = not file.read(1)
    if not head:
        return "an empty file"
    if head.startswith(_ZIP):
        return _describe_zip(path)
    for signature, name in _SIGNATURES:
        if head.startswith(signature):
            return name
    if head[:1] == b"\x80" and head[1:2] in b"\x02\x03\x04\x05":
        return "a Python pickle"
    return _describe_text(head, is_whole) or "binary data of an unknown kind"


def is_zip(path: str | os.PathLike[str]) -> bool:
    """Whether a file begins like a ZIP archive, as every ``.npz`` does."""
    with open(path, "rb") as file:
        return file.read(len(_ZIP)) == _ZIP


def _describe_zip(path: Path) -> str:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return "a damaged or incomplete ZIP archive (.npz files are ZIP archives)"
    if names and all(name.endswith(".npy") for name in names):
        return f"an .npz with the arrays {_some(name.removesuffix('.npy') for name in names)}"
    return f"a ZIP archive with {_some(names)}"


def _describe_text(head: bytes, is_whole: bool) -> str | None:
    try:
        text = decode_text(head if is_whole else head[: head.rfind(b"\n") + 1] or head)
    except ValueError:
        # one character of the last line may be cut, or the text may have an older encoding
        printable = sum(byte >= 32 or byte in b"\t\r\n\f" for byte in head)
        is_text = b"\0" not in head and printable == len(head)
        return "text in another encoding than UTF-8" if is_text else None
    stripped = text.strip()
    if not stripped:
        return "a text without content"
    if any(not (c.isprintable() or c in "\n\t\f") for c in text[:2000]):
        return None
    if stripped[0] in "{[":
        found = _describe_json(stripped, is_whole)
        if found:
            return found
    if stripped[:5].lower() in ("<html", "<!doc", "<?xml"):
        return "a web page or XML"
    first = stripped.split("\n", 1)[0]
    return f"text that begins with {first[:60]!r}{'…' if len(first) > 60 else ''}"


def _describe_json(text: str, is_whole: bool) -> str | None:
    if not is_whole:
        return "JSON" if text[1:].lstrip()[:1] in ('"', "{", "[", "}", "]") else None
    from legible_envs.support.plain_data import parse_json

    try:
        value = parse_json(text, finite=False)
    except ValueError:
        return None
    if isinstance(value, dict):
        return f"JSON, an object with the keys {_some(value)}" if value else "JSON, an empty object"
    return f"JSON, a list of {len(value)} entries"


def _some(names: object) -> str:
    listed = [str(name) for name in names]  # type: ignore[attr-defined]
    shown = ", ".join(repr(name[:40]) for name in listed[:6])
    return f"{shown} and {len(listed) - 6} more" if len(listed) > 6 else shown or "nothing in it"
