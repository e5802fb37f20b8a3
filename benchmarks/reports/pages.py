"""How pages are put together: templates, their filters, and tables that fit a phone as well as a desk."""

from __future__ import annotations

import numbers
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.reports.numbers import fixed, p_value, scale_of, significant, with_minus
from legible_envs.support.names import printable

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["Column", "PageTable", "page_environment", "table_of"]

_HEADINGS: Final = {
    "accuracy_sd": "SD of accuracy",
    "best_sd": "SD of best",
    "best_of_all": "best of all",
    "df1": "df 1",
    "df2": "df 2",
    "eta_squared": "η²",
    "hedges_g": "Hedges’ g",
    "p_corrected": "p, corrected",
    "p_holm": "p, Holm",
    "qd_score": "QD score",
    "qd_score_sd": "SD of QD score",
    "coverage_sd": "SD of coverage",
    "rho": "ρ",
    "rho_skill": "ρ above chance",
    "rho_within": "ρ within kitchens",
}
"""Columns whose names are no words."""
_SHORT: Final = 20
"""Letters of a heading and its longest entry that fit half a phone."""
_SHARE: Final = re.compile(r"[\d.]+ ?%")
_PROBABILITIES: Final = frozenset({"p", "p_corrected", "p_holm"})


@dataclass(frozen=True)
class Column:
    """A column of a table on a page.

    Attributes:
        name: Its heading.
        is_number: Whether it is set to the right.
        is_short: Whether two such columns stand beside each other on a phone.
    """

    name: str
    is_number: bool
    is_short: bool = True

    @property
    def kind(self) -> str:
        """Its class in style sheets."""
        return "number" if self.is_number else "" if self.is_short else "long"


@dataclass(frozen=True)
class PageTable:
    """A table, ready to be set.

    Attributes:
        columns: Its columns.
        groups: Rows under a heading each, which may be empty; a text for each column.
    """

    columns: Sequence[Column]
    groups: Sequence[tuple[str, Sequence[Sequence[str]]]]

    @property
    def count(self) -> int:
        """Number of rows."""
        return sum(len(rows) for _, rows in self.groups)


def table_of(
    groups: Iterable[tuple[str, Sequence[Mapping[str, Any]]]], digits: Mapping[type, int] | int | None = None
) -> PageTable | None:
    """A table from rows that share their keys; None where there is no row.

    Args:
        groups: A heading, which may be empty, and its rows.
        digits: Decimals of numbers that are not whole; None gives four digits that count.
    """
    parts = [(title, list(rows)) for title, rows in groups]
    everything = [row for _, rows in parts for row in rows]
    if not everything:
        return None
    names = list(everything[0])
    columns, texts = [], {}
    for name in names:
        values = [row[name] for row in everything]
        is_share = all(isinstance(v, str) and _SHARE.fullmatch(v) for v in values)
        is_number = is_share or (all(_is_number(v) or v is None for v in values) and any(_is_number(v) for v in values))
        longest = max((len(str(v)) for v in values if not _is_number(v)), default=0) + len(heading(str(name)))
        columns.append(Column(heading(str(name)), is_number, longest <= _SHORT))
        scale = scale_of(v for v in values if _is_number(v))
        texts[name] = lambda value, name=str(name), scale=scale: _cell(value, name, scale, digits)
    return PageTable(columns, [(t, [[texts[n](row[n]) for n in names] for row in rows]) for t, rows in parts if rows])


def heading(name: str) -> str:
    """The name of a column in words."""
    words = _HEADINGS.get(name, name.replace("_", " "))
    return words.replace("f1", "F1", 1) if words.startswith("f1") else words


def _is_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool | np.bool_)


def _cell(value: Any, name: str, scale: float, digits: Any) -> str:
    if value is None or value != value:
        return fixed(None)
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, numbers.Integral):
        return fixed(int(value), 0)
    if isinstance(value, numbers.Real):
        if name in _PROBABILITIES:
            return p_value(float(value))
        return significant(float(value), scale=scale) if digits is None else fixed(float(value), digits)
    return with_minus(str(value))


def _seen(value: Any) -> Any:
    """What is put into a page; of texts, what is not seen is written out. Markup is a page's own and stays."""
    return printable(value, lines=True) if type(value) is str else value


@lru_cache(maxsize=1)
def page_environment() -> Environment:
    """The templates of pages, which escape what is put into them; ``number`` sets a number."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    loader = PackageLoader("benchmarks")
    made = Environment(
        loader=loader,
        autoescape=True,
        finalize=_seen,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["number"] = fixed
    made.globals["style"] = Markup(loader.get_source(made, "report.css")[0])
    return made
