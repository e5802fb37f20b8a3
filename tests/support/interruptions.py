"""Kills without processes: a search is stopped at any single operation on its files, and nothing happens after it.

A process that is killed leaves what it had done to the disk by then. ``killed_at(folder, k)`` lets ``k`` operations on
files below a folder happen and raises :class:`Killed` at the next one, and at all that follow, so that no cleaning up
of the stopped program is seen on the disk either. All ``k`` together are all instants that the disk can tell apart.
"""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

__all__ = ["Killed", "killed_at"]


class Killed(BaseException):
    """The process is dead; nothing that it still does has an effect."""


class Operations:
    """Counts operations on files below a folder.

    Attributes:
        done: How many happened.
        dead: Whether the limit was reached and another one was tried.
    """

    def __init__(self, folder: Path, limit: int) -> None:
        self.folder = os.fspath(folder)
        self.limit = limit
        self.done = 0
        self.dead = False

    def concern(self, path: Any) -> bool:
        return isinstance(path, str | os.PathLike) and os.fspath(path).startswith(self.folder)

    def count(self) -> None:
        if self.done >= self.limit:
            self.dead = True
            raise Killed
        self.done += 1


class _Stream:
    """A file open for writing; what is written reaches it at once, and half of it where the process dies."""

    def __init__(self, stream: Any, operations: Operations) -> None:
        self._stream = stream
        self._operations = operations

    def write(self, data: Any) -> int:
        was_alive = not self._operations.dead
        try:
            self._operations.count()
        except Killed:
            if was_alive:
                self._stream.write(data[: len(data) // 2])
                self._stream.flush()
            raise
        written: int = self._stream.write(data)
        self._stream.flush()
        return written

    def __enter__(self) -> _Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def killed_at(folder: Path, limit: int) -> Iterator[Operations]:
    """Let so many operations on files below a folder happen; the block ends quietly when the next one is tried."""
    operations = Operations(folder, limit)
    system: dict[str, Callable[..., Any]] = {
        name: getattr(os, name) for name in ("replace", "rename", "unlink", "remove", "mkdir", "rmdir")
    }
    opened = io.open

    def counted(name: str) -> Callable[..., Any]:
        def call(path: Any, *more: Any, **options: Any) -> Any:
            if operations.concern(path):
                operations.count()
            return system[name](path, *more, **options)

        return call

    def open_counted(path: Any, mode: str = "r", *more: Any, **options: Any) -> Any:
        if not (operations.concern(path) and set(mode) & set("wax+")):
            return opened(path, mode, *more, **options)
        operations.count()
        stream = opened(path, mode, *more, **options)
        # What stands in a temporary file matters to nobody: opening it is one instant, renaming it another.
        return stream if ".part-" in os.fspath(path) else _Stream(stream, operations)

    try:
        for name in system:
            setattr(os, name, counted(name))
        io.open = open_counted  # type: ignore[assignment]
        with contextlib.suppress(Killed):
            yield operations
    finally:
        for name, call in system.items():
            setattr(os, name, call)
        io.open = opened
