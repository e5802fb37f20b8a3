"""Trials on this machine: one process per core, each with its own fate."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

from benchmarks.trials.attempts import Outcome, run_one
from benchmarks.trials.store import Trial

__all__ = ["InProcess", "LocalPool", "num_cores"]


def num_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcess:
    """Runs trials one after the other in this process."""

    def __init__(self) -> None:
        self._queue: deque[tuple[int, Trial]] = deque()

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> Iterator[Outcome | dict[str, Trial]]:
        """Outcomes in any order; between them, mappings of worker to trial whenever that changes."""
        self._queue.extend(trials)
        while self._queue:
            number, trial = self._queue.popleft()
            yield {"this process": trial}
            yield run_one(function, number, trial, "this process")
        yield {}

    def again(self, number: int, trial: Trial) -> None:
        """Put a trial back at the end of the queue."""
        self._queue.append((number, trial))


class LocalPool:
    """Runs trials in processes of this machine.

    Every worker is an executor of its own: one that dies (killed, out of memory) takes only its running trial along,
    and is replaced.

    Args:
        workers: Number of processes.
    """

    def __init__(self, workers: int) -> None:
        self._queue: deque[tuple[int, Trial]] = deque()
        self._executors = {f"process {i + 1}": _executor() for i in range(workers)}

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> Iterator[Outcome | dict[str, Trial]]:
        """Outcomes in any order; between them, mappings of worker to trial whenever that changes."""
        self._queue.extend(trials)
        running: dict[Future[Outcome], tuple[str, int, Trial]] = {}
        try:
            while True:
                idle = [name for name in self._executors if name not in {worker for worker, _, _ in running.values()}]
                while idle and self._queue:
                    worker, (number, trial) = idle.pop(0), self._queue.popleft()
                    with _deaf_to_interrupts():
                        future = self._executors[worker].submit(run_one, function, number, trial, worker)
                    running[future] = (worker, number, trial)
                yield {worker: trial for worker, _, trial in running.values()}
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    worker, number, _ = running.pop(future)
                    yield self._outcome(future, worker, number)
        finally:
            self._stop()

    def again(self, number: int, trial: Trial) -> None:
        """Put a trial back at the end of the queue."""
        self._queue.append((number, trial))

    def _outcome(self, future: Future[Outcome], worker: str, number: int) -> Outcome:
        try:
            return future.result()
        except BrokenProcessPool as error:
            self._executors[worker].shutdown(wait=False)
            self._executors[worker] = _executor()
            return Outcome(number, None, f"the worker was lost: {error}", 0.0, worker)

    def _stop(self) -> None:
        """End at once, also in the middle of trials: their results would be thrown away."""
        for executor in self._executors.values():
            processes = list((getattr(executor, "_processes", None) or {}).values())
            executor.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.terminate()


@contextlib.contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes started meanwhile do not hear Ctrl-C, which a terminal sends to all: this process ends them.

    They would print a traceback each. This process hears what came meanwhile afterwards.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _executor() -> ProcessPoolExecutor:
    # Fresh interpreters: forks of a process with threads (OpenMP, torch) may hang.
    return ProcessPoolExecutor(max_workers=1, mp_context=multiprocessing.get_context("spawn"))
