"""Reading a study's folder: every file that its settings name, and what is wrong with each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.study.design.draft import SETTINGS, Draft, is_english, path_problem, problem_at, read_bounded
from benchmarks.study.design.models import StudyContent
from benchmarks.study.design.package_files import default_words, read_file, scale_names
from benchmarks.study.design.questionnaires import Questionnaire, item_problems
from benchmarks.study.design.text_names import TEXTS, known_texts, needed_texts
from benchmarks.study.errors import Problem, StudyError
from legible_envs.support.models import problems_of, validated
from legible_envs.support.plain_data import parse_toml

__all__ = ["read_draft"]


def read_draft(folder: Path) -> Draft:
    """Read all files of a study.

    Raises:
        StudyError: There is no folder, or its ``study.toml`` is not what it must be: nothing else can be read then.
    """
    source, content = _read_settings(folder)
    draft = Draft(folder, source, content)
    _read_texts(draft)
    _read_words(draft)
    _read_layouts(draft)
    _read_questionnaires(draft)
    return draft


def _read_settings(folder: Path) -> tuple[str, StudyContent]:
    if not folder.is_dir():
        raise _error(folder, [Problem(SETTINGS, f"there is no folder {folder}; `legible study new` makes one")])
    wrong = path_problem(folder, SETTINGS)
    if wrong is not None:
        raise _error(folder, [Problem(SETTINGS, f"{wrong}; expected the settings of a study")])
    try:
        source = read_bounded(folder / SETTINGS)
        data = parse_toml(source)
    except ValueError as error:
        raise _error(folder, [Problem(SETTINGS, str(error), line=_line_in(str(error)))]) from error
    if found := problems_of(StudyContent, data, SETTINGS):
        problems = [problem_at(SETTINGS, source, path, message) for path, message in found]
        raise _error(folder, sorted(problems, key=lambda problem: problem.line))
    return source, validated(StudyContent, data, SETTINGS)


def _error(folder: Path, problems: Sequence[Problem]) -> StudyError:
    more = f" ({len(problems) - 1} more)" if len(problems) > 1 else ""
    return StudyError(f"{folder / str(problems[0])}{more}", problems)


def _line_in(message: str) -> int:
    """The line that the reader of TOML names in its message."""
    _, found, rest = message.partition("(at line ")
    digits = rest.partition(",")[0]
    return int(digits) if found and digits.isdigit() else 0


# -- texts -------------------------------------------------------------------------------------------------------------


def _read_texts(draft: Draft) -> None:
    content = draft.content
    needed = needed_texts(content)
    for name in known_texts():
        file = f"{content.texts}/{name}.md"
        if name not in needed and not (draft.folder / file).exists():
            continue
        text = draft.read(file, f"the text `{name}`, {TEXTS[name]}")
        if text is not None:
            draft.texts[name] = text


def _read_words(draft: Draft) -> None:
    """The words of the study; in English, those of the package for what it does not say."""
    file = f"{draft.content.texts}/words.toml"
    if is_english(draft.content):
        draft.words = dict(default_words())
        if not (draft.folder / file).exists():
            return
    source = draft.read(file, "the short texts of the page")
    if source is None:
        return
    draft.words_source = source
    try:
        found = parse_toml(source)
    except ValueError as error:
        draft.refuse_file(file, str(error), line=_line_in(str(error)))
        return
    for key, text in found.items():
        if isinstance(text, str):
            draft.words[key] = text
        else:
            draft.problems.append(problem_at(file, source, (key,), f"`{key}` must be a text, got {text!r:.80}"))


# -- layouts and questionnaires ---------------------------------------------------------------------------------------


def _read_layouts(draft: Draft) -> None:
    content = draft.content
    named: list[tuple[str, str, tuple[str | int, ...]]] = [
        (entry.layout, f"the layout of condition {entry.name!r}", ("conditions", number, "layout"))
        for number, entry in enumerate(content.conditions)
    ]
    if content.practice is not None:
        named.append((content.practice.layout, "the layout of the practice", ("practice", "layout")))
    for name, what, path in named:
        if name not in draft.layouts and (text := draft.read(name, what, *path)) is not None:
            draft.layouts[name] = text
    if content.domain == "tabletop" and content.table.task.endswith((".yaml", ".yml")):
        draft.task = draft.read(content.table.task, "the task", "table", "task") or ""


def _read_questionnaires(draft: Draft) -> None:
    for number, use in enumerate(draft.content.questionnaires):
        if use.name in draft.questionnaires:
            continue
        found = _find_questionnaire(draft, use.name, number)
        if found is None:
            continue
        file, source = found
        problems = _questionnaire_problems(file, source)
        draft.problems += problems
        if not problems:
            draft.questionnaires[use.name] = validated(Questionnaire, parse_toml(source))


def _find_questionnaire(draft: Draft, name: str, number: int) -> tuple[str, str] | None:
    """Path and text: with the texts (a translation), in the study, or of the package."""
    path = ("questionnaires", number, "name")
    places = (f"{draft.content.texts}/questionnaires/{name}.toml", f"questionnaires/{name}.toml")
    for file in places:
        if (draft.folder / file).exists():
            source = draft.read(file, f"the questionnaire {name!r}", *path)
            return None if source is None else (file, source)
    if name in scale_names():
        if not is_english(draft.content):
            draft.refuse(
                f"the questionnaire {name!r} of the package is in English, the study in {draft.content.language!r}: "
                f"translate it in {places[0]}",
                *path,
                warn=True,
            )
        return f"(package) {name}.toml", read_file(f"scales/{name}.toml")
    draft.refuse(
        f"there is no questionnaire {name!r}: expected {places[1]}, or one of the package: {', '.join(scale_names())}",
        *path,
    )
    return None


def _questionnaire_problems(file: str, source: str) -> list[Problem]:
    try:
        data: Any = parse_toml(source)
    except ValueError as error:
        return [Problem(file, str(error), line=_line_in(str(error)))]
    if found := problems_of(Questionnaire, data, "the questionnaire"):
        return [problem_at(file, source, path, message) for path, message in found]
    found = list(item_problems(validated(Questionnaire, data)))
    return [problem_at(file, source, path, message) for path, message in found]
