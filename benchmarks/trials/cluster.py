"""Trials on a Dask cluster."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any

from benchmarks.trials.attempts import Outcome, run_one
from benchmarks.trials.store import Trial
from optimizers.cluster import WORKERS, connect, wait_for_workers

__all__ = ["ClusterPool"]

_POLL = 0.5
"""Seconds after which progress per worker is asked for again."""


def run_here(function: str, number: int, trial: Trial) -> Outcome:
    """One attempt, on a worker of a cluster."""
    from distributed import get_worker

    return run_one(function, number, trial, str(get_worker().address))


class ClusterPool:
    """Runs trials on the workers of a Dask scheduler, one per thread.

    A lost worker's trials are run elsewhere; results come back to this process, the only one that writes.

    Args:
        scheduler: Its address.
        patience: Seconds to wait for the first worker, and for another one where all were lost.

    Raises:
        ConnectionError: No scheduler answers at the address.
    """

    def __init__(self, scheduler: str, patience: float = WORKERS) -> None:
        self._scheduler = scheduler
        self._patience = patience
        self._client = connect(scheduler)
        self._queue: deque[tuple[int, Trial]] = deque()

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> Iterator[Outcome | dict[str, Trial]]:
        """Outcomes in any order; between them, mappings of worker to trial whenever that changes.

        Raises:
            ConnectionError: The scheduler is without workers for longer than ``patience``.
        """
        from distributed import wait

        self._queue.extend(trials)
        running: dict[Any, tuple[int, Trial]] = {}
        try:
            while self._queue or running:
                wait_for_workers(self._client, self._scheduler, self._patience)
                self._submit(function, running)
                try:
                    with self._client.as_current():
                        ended = wait(list(running), timeout=_POLL, return_when="FIRST_COMPLETED").done
                except TimeoutError:
                    ended = set()
                # All at once: a result that is not fetched before its worker is lost has to be computed again.
                outcomes = [_outcome(future, running.pop(future)[0]) for future in ended]
                yield self._working(running)
                yield from sorted(outcomes, key=lambda outcome: outcome.number)
            yield {}
        finally:
            self._client.cancel(list(running))
            self._client.close()

    def again(self, number: int, trial: Trial) -> None:
        """Put a trial back at the end of the queue."""
        self._queue.append((number, trial))

    def _submit(self, function: str, running: dict[Any, tuple[int, Trial]]) -> None:
        """A trial per thread, no more: the others cannot be lost, nor be stuck behind a slow worker."""
        room = max(1, sum(self._client.nthreads().values())) - len(running)
        while self._queue and room > 0:
            number, trial = self._queue.popleft()
            running[self._client.submit(run_here, function, number, dict(trial), pure=False)] = (number, trial)
            room -= 1

    def _working(self, running: dict[Any, tuple[int, Trial]]) -> dict[str, Trial]:
        """What each worker runs: the first trial that it was given and has not ended."""
        trials = {future.key: trial for future, (_, trial) in running.items()}
        return {
            worker: next(trials[key] for key in keys if key in trials)
            for worker, keys in self._client.processing().items()
            if any(key in trials for key in keys)
        }


def _outcome(future: Any, number: int) -> Outcome:
    if future.status == "finished":
        return future.result()
    error = future.exception() if future.status == "error" else None
    return Outcome(number, None, f"the worker was lost: {error or future.status}", 0.0, "")
