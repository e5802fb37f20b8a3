"""How many participants may be simulated at once."""

from __future__ import annotations

from typing import Final

from legible_envs.support.validation import integer

__all__ = ["MOST_PARTICIPANTS", "check_participants"]

MOST_PARTICIPANTS: Final = 100_000
"""Of one call."""
MOST_TASKS: Final = 1_000_000
"""That all of them do together."""


def check_participants(n: object, executions: object) -> tuple[int, int]:
    """Number of participants, and how often each does the task.

    Raises:
        ValueError: One is no whole number, or they are more than one call simulates.
    """
    n = integer("n", n, 0, MOST_PARTICIPANTS, unit="participants")
    executions = integer("executions", executions, 0, MOST_TASKS, unit="tasks")
    if n * executions > MOST_TASKS:
        raise ValueError(
            f"{n:,} participants who do the task {executions:,} times each do more than {MOST_TASKS:,} tasks; simulate "
            "them by several calls"
        )
    return n, executions
