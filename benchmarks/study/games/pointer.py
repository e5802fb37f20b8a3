"""The pointer as the hand: samples at the rate of a screen become steps at the rate of the table."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from typing import Final

from benchmarks.study.games.tabletop import RATE

__all__ = ["PointerTrack"]

_PAUSE: Final = 250.0
"""Milliseconds without a sample after which the pointer counts as having rested, not as having glided."""


class PointerTrack:
    """Where the pointer was, as far as the table has not been played yet.

    Times are milliseconds since the round began; step ``k`` (from 0) ends at ``(k + 1) * 1000 / 30``.

    Args:
        at: ``(x, y)`` before the first sample: where the hand is.
        steps: Steps that have been played.
    """

    def __init__(self, at: tuple[float, float], steps: int = 0) -> None:
        self.steps = steps
        self._samples: list[tuple[float, float, float]] = [(self.time, *at)]

    @property
    def time(self) -> float:
        """Up to where the table has been played."""
        return self.steps * 1000.0 / RATE

    @property
    def last(self) -> float:
        """When the last sample was taken."""
        return self._samples[-1][0]

    def add(self, samples: Sequence[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
        """Take in samples ``(t, x, y)``.

        Returns:
            Those that are later than all before; others are left out.
        """
        kept = []
        for t, x, y in samples:
            if t > self.last:
                self._samples.append((t, x, y))
                kept.append((t, x, y))
        return kept

    def ready(self) -> int:
        """How many steps can be played with what is known."""
        return max(0, int((self.last + 1e-6) * RATE / 1000.0) - self.steps)

    def take(self) -> tuple[float, float]:
        """Where the pointer is at the end of the next step, which counts as played then."""
        self.steps += 1
        found = self._at(self.time)
        place = bisect_left(self._samples, (self.time,))
        del self._samples[: max(0, place - 1)]
        return found

    def _at(self, t: float) -> tuple[float, float]:
        place = bisect_left(self._samples, (t,))
        if place >= len(self._samples):
            return self._samples[-1][1:]
        after = self._samples[place]
        if place == 0 or after[0] <= t:
            return after[1:]
        before = self._samples[place - 1]
        if after[0] - before[0] > _PAUSE:
            return before[1:]
        share = (t - before[0]) / (after[0] - before[0])
        return before[1] + share * (after[1] - before[1]), before[2] + share * (after[2] - before[2])
