"""How a participant's study can end."""

from __future__ import annotations

from typing import Final, Literal

__all__ = ["ENDINGS", "Ending"]

Ending = Literal[
    "complete", "refused", "device_failed", "practice_failed", "timed_out", "blocked", "expired", "withdrawn"
]
ENDINGS: Final[tuple[Ending, ...]] = (
    "complete", "refused", "device_failed", "practice_failed", "timed_out", "blocked", "expired", "withdrawn",
)  # fmt: skip
