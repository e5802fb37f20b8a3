"""Writing a new study: the paper's, with any layouts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.study.design.package_files import package_texts, read_file, scale_names
from benchmarks.study.design.sources import DOMAINS, all_conditions, practice_layout
from benchmarks.study.errors import StudyError
from legible_envs.support.files import write_text
from legible_envs.support.names import file_name

__all__ = ["new_study"]

_TITLES: Final = {"overcooked": "Cooking in different kitchens", "tabletop": "Building at different tables"}
_POLICIES: Final = {"overcooked": "random", "tabletop": "williams"}
"""As in the paper: simple random online, counterbalanced at the table."""
_QUESTIONNAIRES: Final = {
    "overcooked": [("nasa-tlx", "condition"), ("comments", "study")],
    "tabletop": [("nasa-tlx", "condition"), ("fluency", "condition"), ("comments", "study")],
}
_IGNORED: Final = "# What participants did, and keys of the server: never into version control.\ndata/\n"


def new_study(folder: str | Path, *, domain: str, sources: Sequence[str] = (), language: str = "en") -> Path:
    """Write the paper's study: settings, texts and layouts, to be edited.

    A training round, the conditions, three soups a round in kitchens or eight reaches per condition beside a robot at
    tables, NASA-TLX after each condition (and questions about the robot, where there is one), and free comments.

    Args:
        folder: Where to write; must not be there, or be empty.
        domain: ``"overcooked"`` or ``"tabletop"``.
        sources: Where the conditions' layouts come from, see :func:`~benchmarks.study.design.sources.conditions_of`;
            none: the paper's four conditions with layouts of the package.
        language: Of the texts, a tag such as ``"de"``. They are written in English, to be translated.

    Returns:
        The settings' file.

    Raises:
        StudyError: The folder holds something, or a source gives no condition.
        OSError: Something cannot be written.
    """
    folder = Path(folder)
    if domain not in DOMAINS:
        raise StudyError(f"`domain` must be one of {', '.join(DOMAINS)}, got {domain!r}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise StudyError(f"{folder} is there and not empty: a new study needs a folder of its own")
    conditions, practice = all_conditions(sources, domain), practice_layout(domain)
    files = {each.file(domain): each.layout for each in (*conditions, practice)}
    if len(files) <= len(conditions):
        raise StudyError(f"a condition cannot be called {practice.name!r}: its layout would be that of the practice")
    files |= {f"texts/{name}.md": text for name, text in package_texts(domain).items()}
    files["texts/words.toml"] = read_file("texts/common/words.toml")
    files[".gitignore"] = _IGNORED
    files["study.toml"] = _settings(
        name=file_name(folder.resolve().name.replace("#", "-"))[:80].rstrip(". "),
        title=_TITLES[domain],
        domain=domain,
        language=language,
        predictor="bayesian",
        conditions=[{"name": each.name, "file": each.file(domain)} for each in conditions],
        practice=practice.file(domain),
        policy=_POLICIES[domain] if len(conditions) > 1 else "fixed",
        questionnaires=_QUESTIONNAIRES[domain],
        scales=scale_names(),
    )
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        write_text(folder / path, text)
    return folder / "study.toml"


def _settings(**values: Any) -> str:
    from jinja2 import Environment, StrictUndefined

    made = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    made.filters["toml"] = lambda text: json.dumps(text, ensure_ascii=False)
    return made.from_string(read_file("study.toml.j2")).render(values)
