"""Files that come with the package: texts, words, scales and layouts that a new study begins with."""

from __future__ import annotations

from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Final

__all__ = ["default_words", "list_files", "package_texts", "read_file", "scale_names"]

_HERE: Final = "benchmarks.study.design"


def _at(path: str) -> Traversable:
    return resources.files(_HERE).joinpath(*path.split("/"))


def read_file(path: str) -> str:
    """The text of a file, by its path below this package, such as ``scales/nasa-tlx.toml``.

    Raises:
        FileNotFoundError: There is none.
    """
    return _at(path).read_text(encoding="utf-8")


def list_files(folder: str) -> list[str]:
    """Names of the files of a folder below this package, sorted."""
    return sorted(entry.name for entry in _at(folder).iterdir() if entry.is_file())


def package_texts(domain: str) -> dict[str, str]:
    """The Markdown texts of a new study of a domain, by name."""
    return {
        name.removesuffix(".md"): read_file(f"texts/{part}/{name}")
        for part in ("common", domain)
        for name in list_files(f"texts/{part}")
        if name.endswith(".md")
    }


def scale_names() -> list[str]:
    """Names of the questionnaires that come with the package."""
    return [name.removesuffix(".toml") for name in list_files("scales") if name.endswith(".toml")]


@cache
def default_words() -> dict[str, str]:
    """The short texts of the page in English, by key; a study's ``words.toml`` has the same keys."""
    from legible_envs.support.plain_data import parse_toml

    return {key: str(text) for key, text in parse_toml(read_file("texts/common/words.toml")).items()}
