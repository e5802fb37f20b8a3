"""A study in memory: its settings, and everything its folder holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.study.design.models import StudyContent
from benchmarks.study.design.questionnaires import Questionnaire

__all__ = ["Study", "load_study"]


@dataclass(frozen=True, eq=False)
class Study:
    """A study whose folder is in order.

    Attributes:
        folder: Where it lies.
        content: The settings of ``study.toml``.
        texts: Markdown by name: ``welcome``, ``consent``, ``instructions``, ….
        words: The short texts of the page (buttons, warnings) by key.
        layouts: Contents of layout files, by the path that the settings name.
        questionnaires: By name.
        design_hash: 16 hexadecimal digits of SHA-256 over all of the above that a participant meets; kept in every row
            of the database. Recruitment, limits of idling and the monitor's predictor do not count.
    """

    folder: Path
    content: StudyContent
    texts: Mapping[str, str]
    words: Mapping[str, str]
    layouts: Mapping[str, str]
    questionnaires: Mapping[str, Questionnaire]
    design_hash: str

    @property
    def conditions(self) -> list[str]:
        """Names, in the order of the file."""
        return [entry.name for entry in self.content.conditions]

    def layout_of(self, condition: str) -> str:
        """The text of a condition's layout file; that of the practice for ``""``."""
        if not condition:
            assert self.content.practice is not None
            return self.layouts[self.content.practice.layout]
        return self.layouts[next(entry.layout for entry in self.content.conditions if entry.name == condition)]


def load_study(folder: str | Path) -> Study:
    """Read a study.

    Raises:
        StudyError: It cannot be used; ``problems`` holds everything that is missing or wrong.
    """
    raise NotImplementedError
