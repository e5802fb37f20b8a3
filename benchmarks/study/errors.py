"""What is wrong with a study, as one kind of error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Problem", "StudyError"]


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is missing or wrong in a study's folder.

    Attributes:
        file: Path within the folder.
        message: What was expected and what came.
        key: Of the setting, such as ``conditions[2].layout``; empty where it is about the file.
        line: From 1; 0 where it is not known.
        is_error: False for what a study can run with, but a researcher should know.
    """

    file: str
    message: str
    key: str = ""
    line: int = 0
    is_error: bool = True

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        return f"{place}: {self.message}"


class StudyError(ValueError):
    """A study that cannot be used.

    Args:
        message: What is wrong first.
        problems: Everything that is wrong.
    """

    def __init__(self, message: str, problems: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)
