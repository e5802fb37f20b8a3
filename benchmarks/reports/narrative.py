"""The prose of reports, rendered from the templates in ``benchmarks/templates/experiments``.

A template holds the sentences, Python the figures in them. The result is plain text: paragraphs separated by an empty
line, words between backticks to be set as code. It is escaped where it enters the page, by
:func:`~benchmarks.reports.experiment_report.write_experiment_report`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["narrate"]

Pair = tuple[str, Any] | Mapping[str, Any]


def narrate(template: str, **context: Any) -> str:
    """The text of a template.

    Templates have three filters: ``fmt`` formats a number (``{{ gain | fmt("+.3f") }}``), ``each`` formats every pair
    of a name and a value, or every mapping (``{{ gains | each("{value:+.3f} ({name})") }}``), and ``listed`` joins
    names or says none.

    Args:
        template: Its path below ``templates/experiments``, without ``.md.j2``.
        context: The values that it names; a missing one is an error.

    Returns:
        Paragraphs separated by an empty line, each on one line.

    Raises:
        jinja2.TemplateNotFound: There is no such template.
        jinja2.UndefinedError: The template names a value that is not given.
    """
    text = _environment().get_template(f"{template}.md.j2").render(context)
    paragraphs = (" ".join(part.split()) for part in text.split("\n\n"))
    return "\n\n".join(part for part in paragraphs if part)


@lru_cache(maxsize=1)
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("benchmarks", "templates/experiments")
    # Plain text: the page escapes it.
    made = Environment(loader=loader, undefined=StrictUndefined, autoescape=False, trim_blocks=True, lstrip_blocks=True)
    made.filters |= {"fmt": _formatted, "each": _each, "listed": _listed}
    return made


def _formatted(value: Any, spec: str) -> str:
    from jinja2 import Undefined

    return str(value) if isinstance(value, Undefined) else format(value, spec)  # str of a missing value is the error


def _each(pairs: Iterable[Pair], pattern: str, separator: str = ", ") -> str:
    """A pattern such as ``"{name} {value:.2f}"``, filled in with each pair or mapping."""
    filled = (pair if isinstance(pair, Mapping) else dict(zip(("name", "value"), pair, strict=True)) for pair in pairs)
    return separator.join(pattern.format(**values) for values in filled)


def _listed(names: Iterable[Any], none: str = "none") -> str:
    return ", ".join(map(str, names)) or none
