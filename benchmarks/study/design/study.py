"""A study in memory: its settings, and everything its folder holds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.study.design.models import StudyContent, plain
from benchmarks.study.design.questionnaires import Questionnaire
from benchmarks.study.errors import Problem, StudyError

if TYPE_CHECKING:
    from benchmarks.study.design.draft import Draft

__all__ = ["Study", "check_study", "load_study"]


@dataclass(frozen=True, eq=False)
class Study:
    """A study whose folder is in order.

    Attributes:
        folder: Where it lies.
        content: The settings of ``study.toml``.
        texts: Markdown by name: ``welcome``, ``consent``, ``instructions``, …. Those about practice and pauses are
            there only where the study has them.
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
    draft = _checked_draft(Path(folder))
    errors = [problem for problem in draft.problems if problem.is_error]
    if errors:
        more = f" ({len(errors) - 1} more {'is' if len(errors) == 2 else 'are'} wrong)" if len(errors) > 1 else ""
        raise StudyError(f"{draft.folder / str(errors[0])}{more}; `legible study check` tells all", draft.problems)
    return Study(
        folder=draft.folder,
        content=draft.content,
        texts=draft.texts,
        words=draft.words,
        layouts=draft.layouts,
        questionnaires=draft.questionnaires,
        design_hash=_design_hash(draft),
    )


def check_study(folder: str | Path) -> list[Problem]:
    """Everything that is missing or wrong in a study's folder, and what a researcher should know, by file and line."""
    try:
        return _checked_draft(Path(folder)).problems
    except StudyError as error:
        return list(error.problems)


def _checked_draft(folder: Path) -> Draft:
    """The folder as it is, read and checked.

    Raises:
        StudyError: Not even its settings can be read.
    """
    from benchmarks.study.design.draft import SETTINGS
    from benchmarks.study.design.layout_checks import check_layouts
    from benchmarks.study.design.partner_checks import check_partners
    from benchmarks.study.design.reading import read_draft
    from benchmarks.study.design.settings_checks import check_settings
    from benchmarks.study.design.text_checks import check_texts

    draft = read_draft(folder)
    check_settings(draft)
    check_texts(draft)
    check_layouts(draft)
    check_partners(draft)
    draft.problems.sort(key=lambda problem: (problem.file != SETTINGS, problem.file, problem.line))
    return draft


def _design_hash(draft: Draft) -> str:
    """Of everything that a participant meets."""
    settings: dict[str, Any] = plain(draft.content)
    del settings["recruitment"], settings["orders"]["recent_minutes"]
    for limit in ("idle_warning", "idle_timeout", "resume_hours"):
        del settings["limits"][limit]
    if not settings["look"]["show_belief"]:
        del settings["predictor"]
    met = {
        "settings": settings,
        "texts": draft.texts,
        "words": draft.words,
        "layouts": draft.layouts,
        "task": draft.task,
        "questionnaires": {name: each.model_dump(mode="json") for name, each in draft.questionnaires.items()},
    }
    return hashlib.sha256(json.dumps(met, sort_keys=True).encode()).hexdigest()[:16]
