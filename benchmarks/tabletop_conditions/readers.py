"""A robot's reader that reads nothing, to compare with those that do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["NoReader"]


class NoReader:
    """Believes in every valid goal alike, whatever it sees: a predictor in the sense of ``ReachWatcher``."""

    def stream(self, context: Any) -> _Uniform:
        """The belief about one reach; ``context.candidates`` are the goals."""
        return _Uniform(context.candidates)


class _Uniform:
    def __init__(self, goals: Sequence[str]) -> None:
        self.belief = {goal: 1 / len(goals) for goal in goals}

    def update(self, point: Any, time: float | None = None) -> dict[str, float]:
        """The same, whatever was seen."""
        return dict(self.belief)
