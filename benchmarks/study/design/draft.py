"""A study's folder as it is being read: what was found so far, and everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from benchmarks.study.design.models import StudyContent
from benchmarks.study.design.questionnaires import Questionnaire
from benchmarks.study.design.toml_lines import line_of
from benchmarks.study.errors import Problem
from legible_envs.support.models import as_path
from legible_envs.support.text import decode_text
from legible_envs.support.validation import shown

__all__ = ["MOST_BYTES", "SETTINGS", "Draft", "is_english", "path_problem", "problem_at", "read_bounded"]

SETTINGS: Final = "study.toml"
MOST_BYTES: Final = 1_000_000
"""Of any file of a study."""


@dataclass(eq=False)
class Draft:
    """What a folder holds.

    Attributes:
        folder: Where it lies.
        source: The text of ``study.toml``.
        content: Its settings.
        texts: Markdown by name.
        words: Short texts by key.
        words_source: The text of their file; empty where those of the package are used.
        layouts: Contents of layout files, by the path that the settings name.
        task: The text of the task's file; empty for a built-in task.
        questionnaires: By name.
        problems: Everything that is wrong, in the order in which it was found.
    """

    folder: Path
    source: str
    content: StudyContent
    texts: dict[str, str] = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)
    words_source: str = ""
    layouts: dict[str, str] = field(default_factory=dict)
    task: str = ""
    questionnaires: dict[str, Questionnaire] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def refuse(self, message: str, *path: str | int, warn: bool = False) -> None:
        """Note what is wrong with a setting, with the line in which it stands.

        Args:
            message: What was expected and what came.
            path: Keys and positions of the setting.
            warn: Whether a study can run with it.
        """
        self.problems.append(problem_at(SETTINGS, self.source, path, message, warn=warn))

    def refuse_file(self, file: str, message: str, *, line: int = 0, warn: bool = False) -> None:
        """Note what is wrong with another file."""
        self.problems.append(Problem(file, message, line=line, is_error=not warn))

    def read(self, name: str, what: str, *path: str | int) -> str | None:
        """The text of a file in the folder; None, and a problem noted, where it cannot be read.

        Args:
            name: Path within the folder, as a setting names it.
            what: What is expected there, such as ``the layout of condition 'Legible'``.
            path: The setting that names it; none: it is expected there in any case.
        """
        wrong = path_problem(self.folder, name)
        if wrong is None:
            try:
                return read_bounded(self.folder / name)
            except ValueError as error:
                self.refuse_file(name, str(error))
                return None
        message = f"{what}: {wrong}"
        if path:
            self.refuse(f"`{as_path(path)}` names {what}: {wrong}", *path)
        else:
            self.refuse_file(name, message)
        return None


def is_english(content: StudyContent) -> bool:
    """Whether the study is in the language of the package's texts."""
    return content.language.split("-")[0] == "en"


def problem_at(file: str, source: str, path: Sequence[str | int], message: str, *, warn: bool = False) -> Problem:
    """A problem with a setting of a TOML file, with the line in which it stands."""
    return Problem(file, message, as_path(path), line_of(source, path), not warn)


def path_problem(folder: Path, name: str) -> str | None:
    """Why a path is not that of a file inside a folder; None where it is.

    Links are followed: what lies elsewhere is not inside.
    """
    parts = name.split("/")
    if name.startswith(("/", "~")) or any(mark in name for mark in "\\:\0") or ".." in parts or "" in parts:
        return f"{shown(name)} must be a path within the study's folder, with / between folders and no .."
    path = folder / name
    try:
        if not path.resolve().is_relative_to(folder.resolve()):
            return f"{name} is a link that leads out of the study's folder"
        if not path.exists():
            return f"there is no file {name}"
        if not path.is_file():
            return f"{name} is not a plain file"
    except OSError as error:
        return f"{name} cannot be read: {error.strerror or error}"
    return None


def read_bounded(path: Path) -> str:
    """The text of a file of bounded size.

    Raises:
        ValueError: It is larger, cannot be read, or is not text; says so without the name.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise ValueError(f"it cannot be read: {error.strerror or error}") from error
    if len(data) > MOST_BYTES:
        raise ValueError(f"it has more than {MOST_BYTES:,} bytes, the most that is read")
    return decode_text(data, "the file")
