"""Files that are either the old one or the new one, never half of each."""

from __future__ import annotations

import contextlib
import errno
import lzma
import math
import os
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
import numpy.typing as npt

from legible_envs.support.file_kinds import describe_file, is_zip

__all__ = ["MOST_ARRAYS", "MOST_BYTES", "open_npz", "remove_leftovers", "write_atomically", "write_npz", "write_text"]

MOST_BYTES: Final = 2**30
"""How large the arrays of an ``.npz`` may be together, uncompressed, unless a caller asks for more."""

MOST_ARRAYS: Final = 256
"""How many arrays an ``.npz`` may hold, unless a caller asks for more."""

_MARK = ".part-"


def write_atomically(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file so that a crash, a kill or a full disk at any moment leaves the previous one intact.

    The bytes go to a temporary file in the same folder, are forced to the disk, and take the name in one step.

    Args:
        path: The file to write or replace.
        write: Called with the open temporary file.

    Raises:
        OSError: The file could not be written; the temporary one is removed and ``path`` is as before.
    """
    temporary = path.with_name(f".{path.name}{_MARK}{os.getpid()}")
    try:
        with temporary.open("wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    _sync_folder(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8, all or nothing, its line breaks as they are; halves of characters as escapes.

    Raises:
        OSError: The file could not be written; what was there before is untouched.
    """
    write_atomically(path, lambda stream: stream.write(text.encode(errors="backslashreplace")))


def write_npz(path: str | os.PathLike[str], arrays: Mapping[str, Any]) -> None:
    """Write a compressed ``.npz`` without pickles, all or nothing; folders that are missing are made.

    Raises:
        OSError: The folder cannot be made or written to.
        ValueError: An array would need a pickle.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, lambda stream: np.savez_compressed(stream, allow_pickle=False, **arrays))


@contextlib.contextmanager
def open_npz(
    path: str | os.PathLike[str], *, most_bytes: int = MOST_BYTES, most_arrays: int = MOST_ARRAYS
) -> Iterator[Mapping[str, Any]]:
    """The arrays of an ``.npz``, read when they are looked up; pickles in it are never loaded.

    Sizes are checked before anything is allocated, checksums when an array is read.

    Args:
        path: The file.
        most_bytes: How large all arrays may be together, uncompressed.
        most_arrays: How many there may be.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is no ``.npz``, with what it looks like, or too large; or, where an array is looked up, damaged,
            of another size than announced, or a pickle.
        KeyError: Where an array is looked up: there is none of that name.
    """
    if not is_zip(path):
        raise ValueError(f"it looks like {describe_file(path)}, and is no .npz")
    try:
        file = zipfile.ZipFile(path)
    except _DAMAGES as error:
        raise _damaged(error) from error
    with file:
        members = _members(file, most_bytes, most_arrays)
        yield _Arrays(file, members)


class _Arrays(Mapping[str, Any]):
    def __init__(self, file: zipfile.ZipFile, members: Mapping[str, zipfile.ZipInfo]) -> None:
        self._file = file
        self._members = members

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        member = self._members[name]
        try:
            return _read_array(self._file, member)
        except _DAMAGES as error:
            raise _damaged(error) from error

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)


def _members(file: zipfile.ZipFile, most_bytes: int, most_arrays: int) -> dict[str, zipfile.ZipInfo]:
    found = {member.filename.removesuffix(".npy"): member for member in file.infolist()}
    if len(file.infolist()) > most_arrays:
        raise ValueError(f"it holds {len(file.infolist()):,} arrays; at most {most_arrays:,} are read")
    if len(found) < len(file.infolist()):
        raise ValueError("it is a damaged .npz (two arrays of one name)")
    size = sum(member.file_size for member in found.values())
    if size > most_bytes:
        raise ValueError(f"its arrays take {size:,} bytes; at most {most_bytes:,} are read")
    return found


def _read_array(file: zipfile.ZipFile, member: zipfile.ZipInfo) -> npt.NDArray[Any]:
    """One array, if it is as large as its header and the directory of the zip say.

    Raises:
        ValueError: It is not, or it is a pickle.
        Exception: Whatever numpy and zipfile raise at damaged bytes.
    """
    with file.open(member) as stream:
        major, _ = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
        shape, _, dtype = read_header(stream)
        if dtype.hasobject:
            raise ValueError("it holds pickled objects, which are never loaded")
        if math.prod(shape) * dtype.itemsize > member.file_size:
            raise ValueError(f"it is a damaged .npz (`{member.filename}` is shorter than its header says)")
    with file.open(member) as stream:
        array: npt.NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
        if stream.read(1):  # also makes zipfile compare the checksum, which it does at the end alone
            raise ValueError(f"it is a damaged .npz (`{member.filename}` is longer than its header says)")
    return array


# What zipfile, zlib and numpy raise at bytes that are none of theirs.
_DAMAGES: Final = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    tokenize.TokenError,
    struct.error,
    EOFError,
    NotImplementedError,
    OverflowError,
    RuntimeError,
    SyntaxError,
    TypeError,
    KeyError,
    IndexError,
    MemoryError,
    ValueError,
    OSError,
)


def _damaged(error: Exception) -> Exception:
    """The error to raise instead: ours stay, and those of the system; "invalid argument" comes of a damaged offset."""
    if isinstance(error, OSError) and error.errno not in (None, errno.EINVAL):
        return error
    said = str(error)
    if type(error) is ValueError and said.startswith("it "):
        return error
    return ValueError(f"it is a damaged or incomplete .npz ({said or type(error).__name__})")


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files that a killed process left in a folder."""
    for leftover in folder.glob(f".*{_MARK}*"):
        with contextlib.suppress(OSError):
            leftover.unlink()


def _sync_folder(folder: Path) -> None:
    """Make the new name itself durable; not every system lets a folder be synced."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
