"""Files that are either the old one or the new one, never half of each."""

from __future__ import annotations

import contextlib
import os
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from legible_envs.support.file_kinds import describe_file, is_zip

__all__ = ["is_leftover", "open_npz", "remove_leftovers", "write_atomically", "write_npz", "write_text"]

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
    """Write a text in UTF-8, all or nothing, its line breaks as they are.

    Raises:
        OSError: The file could not be written; what was there before is untouched.
    """
    write_atomically(path, lambda stream: stream.write(text.encode()))


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
def open_npz(path: str | os.PathLike[str]) -> Iterator[Mapping[str, Any]]:
    """The arrays of an ``.npz``, read when they are looked up; pickles in it are never loaded.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is no ``.npz``, with what it looks like; or, where an array is looked up, damaged or a pickle.
    """
    try:
        if not is_zip(path):
            raise ValueError(f"it looks like {describe_file(path)}, and is no .npz")
        with np.load(path, allow_pickle=False) as arrays:
            yield arrays
    except (OSError, zipfile.BadZipFile, EOFError, MemoryError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise ValueError(f"it is a damaged or incomplete .npz ({error or type(error).__name__})") from error
    except ValueError as error:
        if "allow_pickle" in str(error):
            raise ValueError("it holds pickled objects, which are never loaded") from error
        raise


def is_leftover(path: Path) -> bool:
    """Whether a file is, by its name, a temporary one of a process that was killed while it wrote."""
    return path.name.startswith(".") and _MARK in path.name


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files that a killed process left in a folder."""
    for leftover in filter(is_leftover, folder.glob(".*")):
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
