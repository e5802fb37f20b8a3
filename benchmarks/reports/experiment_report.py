"""The report of an experiment: one self-contained page made of the pieces that its analysis hands over."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import unescape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.reports.numbers import with_minus
from benchmarks.reports.pages import page_environment, table_of
from legible_envs import __version__
from legible_envs.support.files import write_text
from legible_envs.support.names import printable

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Section", "write_experiment_report"]

LONG: Final = 24
"""Rows from which on a table is folded up."""
_KINDS: Final = {".png": "image/png", ".svg": "image/svg+xml"}


def write_experiment_report(
    folder: Path, sections: Sequence[Section], *, title: str, lede: str, eyebrow: str = "reproduction"
) -> Path:
    """Write ``folder/report.html``; tables and figures lie inside it, nothing is loaded from anywhere.

    Args:
        folder: Of the experiment.
        sections: The pieces, in order.
        title: Heading of the page.
        lede: A sentence or two below it.
        eyebrow: The kind of page.
    """
    text = (
        page_environment()
        .get_template("experiment.html.j2")
        .render(
            title=title,
            lede=lede,
            eyebrow=eyebrow,
            sections=[_content(section) for section in sections],
            footer=f"legible-envs {__version__}. Every table lies beside this page as CSV.",
        )
    )
    path = folder / "report.html"
    write_text(path, text)
    return path


def _content(section: Section) -> dict[str, Any]:
    return {
        "title": section.title,
        "paragraphs": [_with_code(part.strip()) for part in section.text.split("\n\n") if part.strip()],
        "tables": [_table(caption, table) for caption, table in section.tables.items() if len(table)],
        "figures": [
            (_described(path, section.captions), section.captions.get(path.stem, ""), _data_url(path), _is_wide(path))
            for path in section.figures
        ],
    }


def _with_code(text: str) -> Any:
    """Words for the page, where what stands between backticks is set as code."""
    from markupsafe import Markup, escape

    text = printable(text, lines=True)
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return escape(with_minus(text))
    marked = (Markup("<code>{}</code>").format(p) if i % 2 else escape(with_minus(p)) for i, p in enumerate(parts))
    return Markup("").join(marked)


def _table(caption: str, table: pd.DataFrame) -> dict[str, Any]:
    """A table under its caption, and whether it is so long that it is folded up."""
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.itertuples(index=False, name=None)]
    label = caption.replace("`", "")
    return {"caption": _with_code(caption), "label": label, "body": table_of([("", rows)]), "is_long": len(rows) > LONG}


def _described(path: Path, captions: Mapping[str, str]) -> str:
    """What a figure shows, for those who cannot see it: its caption, or a chart's own title and description."""
    if path.stem in captions:
        return captions[path.stem]
    told = (
        re.findall(r"<(?:title|desc)>([^<]+)</(?:title|desc)>", path.read_text(encoding="utf-8"))
        if path.suffix == ".svg"
        else []
    )
    return ". ".join(unescape(words).rstrip(".") for words in told[:2]) or path.stem.replace("_", " ")


def _is_wide(path: Path) -> bool:
    """Whether a picture is a strip that wants the whole width of the page."""
    if path.suffix != ".png":
        return False
    from PIL import Image

    with Image.open(path) as image:
        return image.width > 1.9 * image.height


def _data_url(path: Path) -> str:
    """A picture as part of the page.

    Raises:
        ValueError: It is neither PNG nor SVG.
    """
    kind = _KINDS.get(path.suffix)
    if kind is None:
        raise ValueError(f"a figure must be one of {list(_KINDS)}, got {path}")
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode()}"


@dataclass(frozen=True, eq=False)
class Section:
    """One piece of a report.

    Attributes:
        title: Its heading.
        text: What its tables and figures say; paragraphs are separated by an empty line.
        tables: By the caption that stands above each.
        figures: Files, ``.svg`` or ``.png``, in the order to be shown.
        captions: What pictures show, by the names of their files without endings; charts carry their own headings.
    """

    title: str
    text: str = ""
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    figures: list[Path] = field(default_factory=list)
    captions: dict[str, str] = field(default_factory=dict)
