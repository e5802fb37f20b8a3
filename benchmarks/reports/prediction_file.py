"""What the file of an evaluation may hold, which a report shows: keys, types and bounds."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from legible_envs.support.models import Checked, Choice, FileModel, Length, Text, Whole
from legible_envs.support.validation import shown

__all__ = ["SCHEMA", "UNSEALED", "EvaluationContent"]

SCHEMA: Final = 2
UNSEALED: Final = 1
"""The schema of earlier versions, without digests."""
_MOST_ROWS: Final = 10_000


def _cell(name: str, value: object) -> object:
    if not isinstance(value, str | int | float | bool | None):
        raise ValueError(f"{name} must be a single value, got {shown(value)}")
    return value


Words = Annotated[str, Text(10_000, empty=True)]
Digest = Annotated[str, Text(64, empty=True)]
Row = Annotated[dict[str, Annotated[object, Checked(_cell)]], Length(1, 100)]


def _alike(name: str, value: object) -> object:
    """Rows that share their keys."""
    if isinstance(value, list) and len({tuple(row) if isinstance(row, dict) else row is None for row in value}) > 1:
        raise ValueError(f"{name} must be rows with the same keys")
    return value


Rows = Annotated[list[Row], Length(1, _MOST_ROWS), Checked(_alike)]


class ComparisonEntry(FileModel):
    """Differences of pairs, and the verdict on them in words."""

    what: Words
    verdict: Words
    pairs: Rows


class EvaluationContent(FileModel):
    """See :func:`~benchmarks.reports.prediction_report.write_evaluation`."""

    version: Annotated[int, Choice(UNSEALED, SCHEMA)] = Field(alias="schema")
    definition: Words
    walks: Annotated[int, Whole(0)]
    participants: Annotated[int, Whole(0)]
    summary: Rows
    comparisons: Annotated[list[ComparisonEntry], Length(0, 100)]
    notes: Annotated[list[Words], Length(0, 1000)]
    figures: Annotated[dict[str, Digest], Length(0, 100)] = Field(default_factory=dict)
    sha256: Digest = ""
