"""Places that commands write to, checked while the command line is read: before any work is done.

Every option that names such a place has one of the types here. Folders that are missing are made when something is
written, not by the check.
"""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path
from typing import Any

import click

__all__ = ["DestinationFile", "DestinationFileOrFolder", "DestinationFolder", "check_folder"]

_LONGEST = 200
"""Bytes of a name; systems allow 255, and files are written under longer names first."""


class DestinationFolder(click.ParamType):
    """A folder to write to, there or to be made."""

    name = "directory"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path, once it is sure that files can be written there."""
        path = _path(self, value, param, ctx)
        if problem := _folder_problem(path):
            self.fail(problem, param, ctx)
        return path


class DestinationFile(click.ParamType):
    """A file to write or to replace.

    Args:
        suffixes: How its name may end, whatever the case; the file is of that kind.
    """

    name = "file"

    def __init__(self, *suffixes: str) -> None:
        self.suffixes = suffixes

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path, once it is sure that the file can be written."""
        path = _path(self, value, param, ctx)
        if problem := self._problem(path, str(value)):
            self.fail(problem, param, ctx)
        return path

    def _problem(self, path: Path, given: str) -> str:
        shown = click.format_filename(path)
        try:
            if path.is_dir() or given.endswith(("/", os.sep)):
                return f"{shown} is a folder; name a file in it"
            if path.suffix.lower() not in self.suffixes:
                return f"{shown} must be a name that ends in {' or '.join(self.suffixes)}: nothing else is written"
            if not stat.S_ISREG(path.stat().st_mode):
                return f"{shown} is no plain file and cannot be replaced by one"
        except FileNotFoundError:
            pass
        except OSError:
            return _folder_problem(path)  # the way there is at fault
        return _folder_problem(path.parent) or _name_problem(path)


class DestinationFileOrFolder(click.ParamType):
    """A file of one kind, told by how its name ends, or else a folder.

    Args:
        suffix: How names of files end, whatever the case.
    """

    name = "path"

    def __init__(self, suffix: str) -> None:
        self.suffix = suffix

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path, once it is sure that it can be written."""
        is_file = Path(value).suffix.lower() == self.suffix
        return (DestinationFile(self.suffix) if is_file else DestinationFolder()).convert(value, param, ctx)


def check_folder(path: Path, option: str | None = None) -> None:
    """Refuse a folder that no option named but that is written to all the same.

    Args:
        path: The folder.
        option: The option that names another one, if there is one.

    Raises:
        click.UsageError: Nothing can be written there.
    """
    if problem := _folder_problem(path):
        advice = "" if option is None else f"; choose another place with {option}"
        raise click.UsageError(f"the results cannot be written: {problem}{advice}")


def _path(kind: click.ParamType, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
    if not os.fspath(value):
        kind.fail("the name of the place to write to is empty", param, ctx)
    return Path(value)


def _folder_problem(path: Path) -> str:
    """Why no file can be written into a folder that is there or is to be made; empty where one can."""
    shown = click.format_filename(path)
    try:
        there = next(place for place in (path, *path.absolute().parents) if _exists(place))
        if not there.is_dir():
            kind = "a link that leads nowhere" if there.is_symlink() and not there.exists() else "a file"
            return f"{click.format_filename(there)} is {kind}, where a folder must be"
        with tempfile.TemporaryFile(dir=there):  # the sure way to know, and it leaves no trace
            pass
    except OSError as error:
        return f"{shown} cannot be written to: {error.strerror or error}"
    return _name_problem(path)


def _name_problem(path: Path) -> str:
    """Why a path has no names that files can have; empty where it has."""
    if any(len(os.fsencode(part)) > _LONGEST for part in path.parts):
        return f"{click.format_filename(path)} cannot be written to: a name in it is longer than {_LONGEST} bytes"
    return ""


def _exists(place: Path) -> bool:
    """Whether something is there, be it a link that leads nowhere.

    Raises:
        OSError: That cannot be known.
    """
    try:
        place.lstat()
    except (FileNotFoundError, NotADirectoryError):  # the latter: a parent is a file, which is found next
        return False
    return True
