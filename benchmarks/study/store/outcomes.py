"""What a finished visit came to, and whether it counts."""

from __future__ import annotations

from typing import Any

from benchmarks.study.store.values import from_row

__all__ = ["RESTARTED", "counted_outcome"]

RESTARTED = "restarted"
"""Key of the server's note in an outcome: a reload made the participant begin this game again."""


def counted_outcome(finished: float | None, outcome: str | None) -> dict[str, Any] | None:
    """What a visit came to; None where it does not count: it is not finished, or it was begun again.

    Args:
        finished: When, or None; the column of the table ``visits``.
        outcome: Its text, the column of the same table.

    Raises:
        ValueError: The outcome of a finished visit is no mapping in JSON.
    """
    if finished is None:
        return None
    found = from_row(outcome or "{}")
    if not isinstance(found, dict):
        raise ValueError(f"the outcome of a visit must be a mapping, got {outcome!r:.80}")
    return None if found.get(RESTARTED) else found
