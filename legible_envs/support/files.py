"""Files that are either the old one or the new one, never half of each."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

__all__ = ["remove_leftovers", "write_atomically", "write_npz", "write_text"]

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
