"""Predictors that could not be evaluated on some trajectories: what results say of them instead of numbers.

That all people chose one goal, or that there are fewer trajectories than folds, is a fact of the data. It keeps a
predictor from being fitted, but not the others from being evaluated: tables show a dash for it, with the reason.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

from legible_envs.support.names import printable

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "NO_NUMBER",
    "Omission",
    "dashed",
    "markdown_row",
    "markdown_table",
    "no_predictor_left",
    "omission_notes",
    "omission_table",
]

NO_NUMBER: Final = "\u2013"
"""What tables show where a predictor could not be evaluated: a dash."""


_TAG: Final = re.compile(r"<(?=[A-Za-z/!?])")


class Omission(NamedTuple):
    """A predictor that could not be evaluated.

    Attributes:
        predictor: Its name.
        part: The condition or layout in which it could not; ``""`` where trajectories are evaluated together.
        reason: Why.
    """

    predictor: str
    part: str
    reason: str


def omission_table(omissions: Sequence[Omission] = (), by: str | None = None) -> pd.DataFrame:
    """Columns ``predictor`` (and what ``by`` names) and ``reason``, a row per omission."""
    import pandas as pd

    table = pd.DataFrame(list(omissions), columns=["predictor", by or "part", "reason"], dtype=object)
    return table if by else table.drop(columns="part")


def omission_notes(omitted: pd.DataFrame) -> list[str]:
    """A sentence for each row of :func:`omission_table`."""
    parts = [name for name in omitted.columns if name not in ("predictor", "reason")]
    return [
        f"{row['predictor']} was not evaluated"
        + "".join(f" in {part} {row[part]!r}" for part in parts)
        + f": {row['reason']}"
        for row in omitted.to_dict("records")
    ]


def no_predictor_left(omissions: Sequence[Omission], by: str | None = None) -> ValueError:
    """The error of an evaluation in which no predictor could be evaluated; a reason that all share is said once."""
    reasons: dict[str, list[str]] = {}
    for each in omissions:
        reason = f"{by} {each.part!r}: {each.reason}" if by else each.reason
        reasons.setdefault(reason, []).append(each.predictor)
    if len(reasons) == 1:
        return ValueError(next(iter(reasons)))
    return ValueError("; ".join(f"{', '.join(dict.fromkeys(names))}: {reason}" for reason, names in reasons.items()))


def dashed(value: object) -> str:
    """A value as tables show it: three decimals, a dash for NaN and None."""
    if value is None or value != value:
        return NO_NUMBER
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def markdown_table(table: pd.DataFrame) -> str:
    """A table in Markdown; numbers stand to the right, NaN are dashes."""
    columns = [str(name) for name in table.columns]
    numeric = [table[name].dtype.kind in "iuf" for name in table.columns]
    lines = [columns, [" ---: " if is_number else " --- " for is_number in numeric]]
    lines += [[dashed(value) for value in row] for row in table.itertuples(index=False, name=None)]
    head, rule, *rows = lines
    return "\n".join([markdown_row(head), "|" + "|".join(rule) + "|", *(markdown_row(row) for row in rows)]) + "\n"


def markdown_row(cells: Sequence[str]) -> str:
    """A row of a table in Markdown; nothing in a cell ends it, begins an element of HTML, or steers a terminal."""
    return "| " + " | ".join(_cell(cell) for cell in cells) + " |"


def _cell(text: str) -> str:
    told = text.replace("\n", " ").replace("|", "\\|").replace("](", "]\\(")
    return printable(_TAG.sub("&lt;", told))
