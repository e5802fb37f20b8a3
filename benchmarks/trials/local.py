"""Cells on this machine: one process per core, each with its own fate."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

from benchmarks.trials.running import Outcome, run_one
from benchmarks.trials.store import Cell

__all__ = ["InProcess", "LocalPool", "num_cores"]


def num_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcess:
    """Runs cells one after the other in this process."""

    def __init__(self) -> None:
        self._queue: deque[tuple[int, Cell]] = deque()

    def run(self, function: str, cells: Iterator[tuple[int, Cell]]) -> Iterator[Outcome | dict[str, Cell]]:
        """See :class:`~benchmarks.trials.running.Pool`."""
        self._queue.extend(cells)
        while self._queue:
            number, cell = self._queue.popleft()
            yield {"this process": cell}
            yield run_one(function, number, cell, "this process")
        yield {}

    def again(self, number: int, cell: Cell) -> None:
        """See :class:`~benchmarks.trials.running.Pool`."""
        self._queue.append((number, cell))


class LocalPool:
    """Runs cells in processes of this machine.

    Every worker is an executor of its own: one that dies (killed, out of memory) takes only its running cell along, and
    is replaced.

    Args:
        workers: Number of processes.
    """

    def __init__(self, workers: int) -> None:
        self._queue: deque[tuple[int, Cell]] = deque()
        self._executors = {f"process {i + 1}": _executor() for i in range(workers)}

    def run(self, function: str, cells: Iterator[tuple[int, Cell]]) -> Iterator[Outcome | dict[str, Cell]]:
        """See :class:`~benchmarks.trials.running.Pool`."""
        self._queue.extend(cells)
        running: dict[Future[Outcome], tuple[str, int, Cell]] = {}
        try:
            while True:
                idle = [name for name in self._executors if name not in {worker for worker, _, _ in running.values()}]
                while idle and self._queue:
                    worker, (number, cell) = idle.pop(0), self._queue.popleft()
                    future = self._executors[worker].submit(run_one, function, number, cell, worker)
                    running[future] = (worker, number, cell)
                yield {worker: cell for worker, _, cell in running.values()}
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    worker, number, _ = running.pop(future)
                    yield self._outcome(future, worker, number)
        finally:
            self._stop()

    def again(self, number: int, cell: Cell) -> None:
        """See :class:`~benchmarks.trials.running.Pool`."""
        self._queue.append((number, cell))

    def _outcome(self, future: Future[Outcome], worker: str, number: int) -> Outcome:
        try:
            return future.result()
        except BrokenProcessPool as error:
            self._executors[worker].shutdown(wait=False)
            self._executors[worker] = _executor()
            return Outcome(number, None, f"the worker was lost: {error}", 0.0, worker)

    def _stop(self) -> None:
        """End at once, also in the middle of cells: their results would be thrown away."""
        for executor in self._executors.values():
            processes = list((getattr(executor, "_processes", None) or {}).values())
            executor.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.terminate()


def _executor() -> ProcessPoolExecutor:
    # Fresh interpreters: forks of a process with threads (OpenMP, torch) may hang.
    return ProcessPoolExecutor(max_workers=1, mp_context=multiprocessing.get_context("spawn"))
