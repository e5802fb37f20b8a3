"""Rows of ``explain()``, where a layout wins and loses its score, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

__all__ = ["explains_stages", "loss_row", "losses_and_gains"]

_STAGE: Final = frozenset({"start", "goal", "goals", "weight", "score", "contribution", "ties_with"})
_ALIKE: Final = 1e-9


def explains_stages(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether rows of ``explain()`` are the stages of a task, whose contributions sum to the score."""
    return bool(rows) and rows[0].keys() >= _STAGE


def loss_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of ``explain()`` for reading; rows that are no stages of a task are shown as they are.

    A stage says how far an observer believes in the true goal on average, and which other goal comes nearest; rows of
    workspaces that tell no ``belief`` say how much of the path each other goal ties with the true one.
    """
    if not row.keys() >= _STAGE:
        return {str(key).replace("_", " "): value for key, value in row.items()}
    others = [str(goal) for goal in row["goals"] if goal != row["goal"]]
    return {
        "from": row["start"],
        "to": row["goal"],
        "not to": ", ".join(others) or "no other goal",
        "times": row["weight"],
        "score": row["score"],
        "contribution": row["contribution"],
        **(_belief(row) if row.get("belief") else {"confused with (share of the path)": _ties(row)}),
    }


def _belief(row: Mapping[str, Any]) -> dict[str, str]:
    belief = {str(goal): float(share) for goal, share in row["belief"].items()}
    true = str(row["goal"])
    others = {goal: share for goal, share in belief.items() if goal != true}
    most = max(others.values(), default=0.0)
    nearest = [goal for goal, share in others.items() if most - share <= _ALIKE]
    each = " each" if len(nearest) > 1 else ""
    return {
        "believed in": f"{belief.get(true, 0.0):.0%}",
        "runner-up": f"{' and '.join(nearest)} {most:.0%}{each}" if nearest else "none",
    }


def _ties(row: Mapping[str, Any]) -> str:
    ties = sorted(row["ties_with"].items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {share:.0%}" for name, share in ties if share > 0) or "none"


def losses_and_gains(
    rows: Sequence[Mapping[str, Any]], worst: int, best: int
) -> tuple[list[Mapping[str, Any]], list[Mapping[str, Any]], str]:
    """The stages that cost most and those that win most, and what the first ones are called.

    Args:
        rows: Stages of ``explain()``, the greatest loss first.
        worst: At most so many of the first.
        best: At most so many of the others, the greatest gain first.

    Returns:
        The rows that lose, or where none does those that win least; rows that win most; and the title of the former.
    """
    losing = [row for row in rows if row["contribution"] < 0]
    first = list(losing[:worst] if losing else rows[:worst])
    gaining = [row for row in rows[len(first) :] if row["contribution"] >= 0]
    title = "Reaches that lose most" if losing else "No reach loses; these win least"
    return first, gaining[: -best - 1 : -1], title
