"""One attempt at a trial: how it is run, how it ends, and what a pool of workers has to offer."""

from __future__ import annotations

import time
import traceback
from collections.abc import Generator, Iterator
from typing import NamedTuple, Protocol

from benchmarks.trials.functions import resolve
from benchmarks.trials.store import Rows, Trial, plain

__all__ = ["News", "Outcome", "Pool", "run_one"]


class Outcome(NamedTuple):
    """How one attempt at a trial ended; either ``rows`` or ``error`` is set.

    Attributes:
        number: Index of the trial.
        rows: Its result rows.
        error: Its traceback, or how its worker was lost.
        seconds: How long it took.
        worker: Which worker ran it.
    """

    number: int
    rows: Rows | None
    error: str | None
    seconds: float
    worker: str


News = Generator["Outcome | dict[str, Trial]", None, None]
"""Outcomes in any order; between them, mappings of worker to trial whenever that changes. Closing it ends all work."""


class Pool(Protocol):
    """Runs trials: takes them one by one and yields outcomes as they come."""

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> News:
        """Run the trials, and what is put back meanwhile."""

    def again(self, number: int, trial: Trial) -> None:
        """Put a trial back at the end of the queue."""


def run_one(function: str, number: int, trial: Trial, worker: str) -> Outcome:
    """One attempt at one trial, in the process that calls this."""
    started = time.perf_counter()
    rows, error = None, None
    try:
        rows = plain(resolve(function)(dict(trial)))
    except Exception:
        error = traceback.format_exc()
    return Outcome(number, rows, error, time.perf_counter() - started, worker)
