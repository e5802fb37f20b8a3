"""Measuring: samples that take turns, so that run-to-run variance affects all of them alike."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sized
from dataclasses import dataclass
from typing import TypeVar

__all__ = ["Figure", "alternate", "rate", "sampler"]

Batch = TypeVar("Batch", bound=Sized)


@dataclass(frozen=True)
class Figure:
    """One measured quantity.

    Attributes:
        key: Its name in :data:`benchmarks.throughput.sweep.TARGETS`, or any other.
        what: Its description in tables.
        unit: ``"/s"``, ``"s"``, ``"x"`` (a ratio), ``"share"``, ``"MB"`` (1e6 bytes) or ``"count"``.
        samples: All measured values; the median is reported.
    """

    key: str
    what: str
    unit: str
    samples: tuple[float, ...]

    @property
    def value(self) -> float:
        """Median of the samples."""
        return statistics.median(self.samples)

    def over(self, other: Figure, key: str, what: str) -> Figure:
        """This quantity over another one measured in turn with it: the ratios of their paired samples."""
        return Figure(key, what, "x", tuple(a / b for a, b in zip(self.samples, other.samples, strict=True)))


def rate(work: Callable[[], int], seconds: float) -> float:
    """How many units per second of processor time ``work`` does, which returns how many one call did.

    It is called until at least ``seconds`` have passed. Time that other processes took does not count.
    """
    done, start = 0, time.process_time()
    while True:
        done += work()
        passed = time.process_time() - start
        if passed >= seconds:
            return done / passed


def sampler(score: Callable[[Batch], object], batch: Batch, seconds: float) -> Callable[[], float]:
    """A sampler of how many items of a batch ``score`` does per second; see :func:`rate`."""

    def work() -> int:
        score(batch)
        return len(batch)

    return lambda: rate(work, seconds)


def alternate(samplers: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, tuple[float, ...]]:
    """Take one sample of each in turn, ``rounds`` times, after one unrecorded warm-up round."""
    samples: dict[str, list[float]] = {name: [] for name in samplers}
    for number in range(rounds + 1):
        for name, sampler in samplers.items():
            value = sampler()
            if number:
                samples[name].append(value)
    return {name: tuple(values) for name, values in samples.items()}
