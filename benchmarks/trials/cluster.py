"""Trials on a Dask cluster."""

from __future__ import annotations

import traceback
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from benchmarks.trials.attempts import News, Outcome, run_one
from benchmarks.trials.store import Trial
from optimizers.cluster import WORKERS, Cluster, Process
from optimizers.fingerprint import OtherCodeError, expect

__all__ = ["ClusterPool"]

_POLL: Final = 0.5
"""Seconds after which it is looked again which workers are there."""

_LOSSES: Final = 3
"""An attempt fails once so many workers were lost while they ran it."""


def run_here(digests: Mapping[str, str], function: str, number: int, trial: Trial, worker: str) -> Outcome:
    """One attempt, on a worker of a cluster.

    Raises:
        OtherCodeError: The code here is not the one with these digests.
    """
    expect(digests)
    return run_one(function, number, trial, worker)


class _Given(NamedTuple):
    """A trial, and the worker that runs it."""

    worker: Process
    number: int
    trial: Trial


class ClusterPool:
    """Runs trials on the workers of a Dask scheduler, one per thread.

    Each trial is given to one worker. A lost worker's trials are run elsewhere; results come back to this process, the
    only one that writes.

    Args:
        scheduler: Its address.
        packages: What the workers run; see :class:`optimizers.cluster.Cluster`.
        patience: Seconds to wait for the first worker, and for another one where all were lost.

    Raises:
        ClusterError: No scheduler answers at the address.
    """

    def __init__(self, scheduler: str, packages: Iterable[str], patience: float = WORKERS) -> None:
        self._cluster = Cluster(scheduler, packages, patience)
        self._queue: deque[tuple[int, Trial]] = deque()
        self._running: dict[Any, _Given] = {}
        self._losses: Counter[int] = Counter()

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> News:
        """Run the trials, and what is put back meanwhile.

        Raises:
            ClusterError: The scheduler was lost, or is without workers for longer than ``patience``.
        """
        self._queue.extend(trials)
        try:
            while self._queue or self._running:
                workers = self._cluster.workers() if self._running else self._cluster.wait()
                yield from self._lost()
                self._give(function, workers)
                ended = self._cluster.ended(list(self._running), _POLL, any_of=True) if self._running else []
                # All at once: a result that is not fetched before its worker is lost has to be computed again.
                outcomes = [outcome for future in ended if (outcome := self._outcome(future)) is not None]
                yield {given.worker[0]: given.trial for given in self._running.values()}
                yield from sorted(outcomes, key=lambda outcome: outcome.number)
            yield {}
        finally:
            self._cluster.cancel(list(self._running))
            self._cluster.close()

    def again(self, number: int, trial: Trial) -> None:
        """Put a trial back at the end of the queue."""
        self._queue.append((number, trial))

    def _give(self, function: str, workers: Mapping[Process, int]) -> None:
        """A trial per thread, no more: the others cannot be lost, nor be stuck behind a slow worker."""
        busy = Counter(given.worker for given in self._running.values())
        for worker, threads in workers.items():
            for _ in range(threads - busy[worker]):
                if not self._queue:
                    return
                number, trial = self._queue.popleft()
                work = (self._cluster.digests, function, number, dict(trial), worker[0])
                self._running[self._cluster.submit(run_here, *work, workers=[worker])] = _Given(worker, number, trial)

    def _lost(self) -> Iterator[Outcome]:
        """Put back the trials of workers that are gone; the outcomes of those that have lost too many."""
        gone = {future: given for future, given in self._running.items() if not self._cluster.there(given.worker)}
        self._cluster.cancel(list(gone))
        for future, (worker, number, trial) in gone.items():
            del self._running[future]
            self._losses[number] += 1
            if self._losses[number] < _LOSSES:
                self.again(number, trial)
            else:
                del self._losses[number]
                error = f"{_LOSSES} workers were lost while they ran it, {worker[0]} the last (out of memory?)"
                yield Outcome(number, None, error, 0.0, worker[0])

    def _outcome(self, future: Any) -> Outcome | None:
        """How a trial ended; None where its result did not come, or is not to be used."""
        worker, number, trial = self._running[future]
        try:
            found = self._cluster.results([future])
        except OtherCodeError:  # the worker was replaced by another one just now
            self._cluster.forget()
            del self._running[future]
            self.again(number, trial)
            return None
        except ConnectionError:
            raise
        except Exception:
            del self._running[future]
            return Outcome(number, None, f"the worker failed: {traceback.format_exc(limit=0)}", 0.0, worker[0])
        if found is None:
            return None
        del self._running[future]
        return found[0]
