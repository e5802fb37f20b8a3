"""Rows of ``explain()``, where a layout wins and loses its score, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

__all__ = ["explains_stages", "loss_row"]

_STAGE: Final = frozenset({"start", "goal", "goals", "weight", "score", "contribution", "ties_with"})


def explains_stages(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether rows of ``explain()`` are the stages of a task, whose contributions sum to the score."""
    return bool(rows) and rows[0].keys() >= _STAGE


def loss_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of ``explain()`` for reading; rows that are no stages of a task are shown as they are."""
    if not row.keys() >= _STAGE:
        return {str(key).replace("_", " "): value for key, value in row.items()}
    ties = sorted(row["ties_with"].items(), key=lambda item: -item[1])
    return {
        "from": row["start"],
        "to": row["goal"],
        "among": len(row["goals"]),
        "times": row["weight"],
        "score": row["score"],
        "contribution": row["contribution"],
        "confused with (share of the path)": ", ".join(f"{name} {share:.0%}" for name, share in ties if share > 0)
        or "-",
    }
