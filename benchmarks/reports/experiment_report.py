"""The report of an experiment: one self-contained page made of the pieces that its analysis hands over."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from legible_envs import __version__
from legible_envs.support.files import write_text

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Section", "write_experiment_report", "write_table", "write_tables"]

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
    from jinja2 import Environment

    templates = files("benchmarks") / "templates"
    page = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(
        (templates / "experiment.html.j2").read_text(encoding="utf-8")
    )
    text = page.render(
        title=title,
        lede=lede,
        eyebrow=eyebrow,
        style=_markup((templates / "report.css").read_text(encoding="utf-8")),
        sections=[_content(section) for section in sections],
        footer=f"legible-envs {__version__}. Every table lies beside this page as CSV.",
    )
    path = folder / "report.html"
    write_text(path, text)
    return path


def _markup(text: str) -> Any:
    from markupsafe import Markup

    return Markup(text)


def _content(section: Section) -> dict[str, Any]:
    return {
        "title": section.title,
        "paragraphs": [_with_code(part.strip()) for part in section.text.split("\n\n") if part.strip()],
        "tables": [_table(caption, table) for caption, table in section.tables.items()],
        "figures": [(path.stem.replace("_", " "), _data_url(path), _is_wide(path)) for path in section.figures],
    }


def _with_code(text: str) -> Any:
    """Words for the page, where what stands between backticks is set as code."""
    from markupsafe import Markup, escape

    parts = text.split("`")
    if len(parts) % 2 == 0:
        return escape(text)
    marked = (Markup("<code>{}</code>").format(part) if i % 2 else escape(part) for i, part in enumerate(parts))
    return Markup("").join(marked)


def _table(caption: str, table: pd.DataFrame) -> dict[str, Any]:
    from pandas.api.types import is_bool_dtype, is_numeric_dtype

    numeric = [is_numeric_dtype(table[name]) and not is_bool_dtype(table[name]) for name in table.columns]
    return {
        "caption": _with_code(caption),
        "label": caption.replace("`", ""),
        "columns": [(str(name).replace("_", " "), kind) for name, kind in zip(table.columns, numeric, strict=True)],
        "rows": [
            [(_text(value), kind) for value, kind in zip(row, numeric, strict=True)]
            for row in table.itertuples(index=False, name=None)
        ],
    }


def _text(value: Any) -> str:
    """A value for reading: four significant digits, a dash where there is none."""
    if value is None or value != value:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:,.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    return str(value)


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
    """

    title: str
    text: str = ""
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    figures: list[Path] = field(default_factory=list)


def write_table(path: Path, table: pd.DataFrame) -> Path:
    """Write a table as CSV, all or nothing; folders that are missing are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, table.to_csv(index=False))
    return path


def write_tables(folder: Path, tables: Iterable[tuple[str, pd.DataFrame]]) -> list[Path]:
    """Write each table to ``folder/NAME.csv``."""
    return [write_table(folder / f"{name}.csv", table) for name, table in tables]
