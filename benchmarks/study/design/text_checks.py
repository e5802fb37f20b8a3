"""Whether the texts of a study can be shown: all there, no placeholder left, every short text with its values."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Final

from benchmarks.study.design.draft import SETTINGS, Draft, is_english, problem_at
from benchmarks.study.design.package_files import default_words, package_texts
from benchmarks.study.design.text_names import known_texts, needed_texts

__all__ = ["check_texts"]

_LONGEST: Final = 100_000
_LONGEST_WORD: Final = 1000
_PLACEHOLDER: Final = re.compile(r"(?<![!\\\]])\[([^\[\]\n]+)\](?![(\[:])")
_HTML: Final = re.compile(r"<(?:/?[A-Za-z][A-Za-z0-9-]*(?:\s[^<>]*)?/?>|!--)")
_PICTURE: Final = re.compile(r"!\[[^\]]*\]\(")
_VALUE: Final = re.compile(r"\{(\w*)\}")


def check_texts(draft: Draft) -> None:
    """Note everything about texts and words that participants would stumble over."""
    for name, text in draft.texts.items():
        _check_text(draft, f"{draft.content.texts}/{name}.md", text)
    _check_words(draft)
    if not is_english(draft.content):
        _check_translated(draft)
    _check_unused(draft)


def _check_text(draft: Draft, file: str, text: str) -> None:
    if not text.strip():
        draft.refuse_file(file, "the text is empty")
    if len(text) > _LONGEST:
        draft.refuse_file(file, f"the text has {len(text):,} characters; at most {_LONGEST:,} are shown")
    for number, line in enumerate(text.split("\n"), 1):
        for match in _PLACEHOLDER.finditer(line):
            if match.group(1).strip().lower() in ("", "x"):
                continue  # boxes of a list
            draft.refuse_file(file, f"the placeholder {match.group()} is still to be filled in", line=number, warn=True)
    for pattern, message in (
        (_HTML, "HTML is shown as it is written, not as HTML"),
        (_PICTURE, "pictures are not shown: the page asks no other host, and a study has no files of pictures"),
    ):
        if (found := pattern.search(text)) is not None:
            draft.refuse_file(file, message, line=text.count("\n", 0, found.start()) + 1, warn=True)


def _check_words(draft: Draft) -> None:
    file = f"{draft.content.texts}/words.toml"
    if not draft.words:
        return  # said elsewhere
    defaults = default_words()

    def refuse(key: str, message: str) -> None:
        draft.problems.append(problem_at(file, draft.words_source, (key,), message))

    for key in [key for key in defaults if key not in draft.words]:
        refuse(key, f"the key `{key}` is missing; in English it is {defaults[key]!r}")
    for key, text in draft.words.items():
        if key not in defaults:
            near = get_close_matches(key, list(defaults), 1)
            refuse(key, f"the key `{key}` is unknown{f' (did you mean `{near[0]}`?)' if near else ''}")
            continue
        if not text.strip() or len(text) > _LONGEST_WORD:
            refuse(key, f"`{key}` must be a text of 1 to {_LONGEST_WORD:,} characters, got one of {len(text):,}")
        wanted, found = (sorted(set(_VALUE.findall(each))) for each in (defaults[key], text))
        if wanted != found:
            expected = ", ".join(f"{{{name}}}" for name in wanted) or "no {value}"
            refuse(key, f"`{key}` must hold {expected}, as in English ({defaults[key]!r}); got {text!r:.200}")


def _check_translated(draft: Draft) -> None:
    """Warn about texts of the package that are still as they were written, in English."""
    folder, language = draft.content.texts, draft.content.language
    for name, text in package_texts(draft.content.domain).items():
        if draft.texts.get(name) == text:
            draft.refuse_file(f"{folder}/{name}.md", f"the text is still in English, not in {language!r}", warn=True)
    defaults = default_words()
    same = [key for key, text in draft.words.items() if defaults.get(key) == text and any(c.isalpha() for c in text)]
    if len(same) > len(defaults) // 2:
        draft.refuse_file(
            f"{folder}/words.toml",
            f"{len(same)} of {len(defaults)} words are still in English, such as {same[0]}",
            warn=True,
        )


def _check_unused(draft: Draft) -> None:
    """Warn about files that nothing uses: a name with a slip of the pen, or a text that nobody will see."""
    content = draft.content
    texts = {f"{content.texts}/{name}.md" for name in needed_texts(content)}
    used = {f"questionnaires/{use.name}.toml" for use in content.questionnaires}
    used |= {f"{content.texts}/{name}" for name in used}
    for folder, suffix, names in (
        (content.texts, ".md", texts),
        ("questionnaires", ".toml", used),
        (f"{content.texts}/questionnaires", ".toml", used),
    ):
        place = draft.folder / folder
        if not place.is_dir() or not place.resolve().is_relative_to(draft.folder.resolve()):
            continue
        for entry in sorted(place.iterdir()):
            name = f"{folder}/{entry.name}"
            if entry.suffix != suffix or entry.name.startswith(".") or name in names:
                continue
            if suffix == ".md" and entry.stem in known_texts():
                continue  # a text for what this design does not have
            near = get_close_matches(entry.stem, known_texts(), 1) if suffix == ".md" else []
            meant = f"; did you mean {near[0]}.md?" if near else ""
            draft.refuse_file(name, f"nothing in {SETTINGS} uses this file{meant}", warn=True)
