"""Trials on this machine: one process per core, each with its own fate."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Iterator, Sequence
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any, Final

from benchmarks.trials.attempts import News, Outcome, run_one
from benchmarks.trials.lifetime import end_with_parent
from benchmarks.trials.store import Trial

__all__ = ["InProcess", "LocalPool", "num_cores"]

_GRACE: Final = 5.0
"""Seconds that a process has to end when it is asked to."""


def num_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcess:
    """Runs trials one after the other in this process."""

    def __init__(self) -> None:
        self._queue: deque[tuple[int, Trial]] = deque()

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> News:
        """Run the trials, and what is put back meanwhile."""
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

    A worker that dies (killed, out of memory) takes only its running trial along, and is replaced. Workers end with
    this process, however it ends (see :mod:`benchmarks.trials.lifetime`).

    Args:
        workers: Number of processes; each is started when there is a trial for it.
    """

    def __init__(self, workers: int) -> None:
        self._queue: deque[tuple[int, Trial]] = deque()
        self._workers = [_Worker(f"process {i + 1}") for i in range(workers)]

    def run(self, function: str, trials: Iterator[tuple[int, Trial]]) -> News:
        """Run the trials, and what is put back meanwhile."""
        self._queue.extend(trials)
        try:
            while True:
                for worker in self._workers:
                    if worker.job is None and self._queue:
                        worker.give(function, *self._queue.popleft())
                busy = [worker for worker in self._workers if worker.job is not None]
                yield {worker.name: worker.job[1] for worker in busy if worker.job is not None}
                if not busy:
                    return
                # A worker whose trial started processes of its own may be gone while its pipe is still open.
                ready = set(connection.wait([end for worker in busy for end in worker.signs]))
                for worker in busy:
                    if not ready.isdisjoint(worker.signs):
                        yield worker.outcome()
        finally:
            _stop(self._workers)

    def again(self, number: int, trial: Trial) -> None:
        """Put a trial back at the end of the queue."""
        self._queue.append((number, trial))


class _Worker:
    """A process that runs one trial after the other, and the pipe to it.

    A pipe and nothing else: the locks of a queue would be left behind by a killed parent.

    Args:
        name: What events call it.

    Attributes:
        job: Number of the trial that it runs, and the trial; None while it is idle.
        process: The process; None before the first trial, and after it was lost.
        pipe: This process's end of the pipe.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.job: tuple[int, Trial] | None = None
        self.process: SpawnProcess | None = None
        self.pipe: Connection | None = None

    @property
    def signs(self) -> tuple[Any, ...]:
        """What becomes ready when there is an outcome, or never will be one."""
        return () if self.process is None else (self.pipe, self.process.sentinel)

    def give(self, function: str, number: int, trial: Trial) -> None:
        """Let it run a trial; starts the process if there is none."""
        if self.process is not None and not self.process.is_alive():
            self.forget()
        if self.process is None:
            # Fresh interpreters: forks of a process with threads (OpenMP, torch) may hang.
            spawn = multiprocessing.get_context("spawn")
            self.pipe, theirs = spawn.Pipe()
            self.process = spawn.Process(target=_serve, args=(theirs, self.name), name=self.name)
            with _deaf_to_interrupts():
                self.process.start()
            theirs.close()  # else its end would not be seen when the process is gone
        self.job = (number, trial)
        assert self.pipe is not None
        with contextlib.suppress(OSError):  # lost this very moment: `outcome` says so
            self.pipe.send((function, number, dict(trial)))

    def outcome(self) -> Outcome:
        """How its trial ended; to be asked once one of the ``signs`` is ready."""
        assert self.job is not None
        assert self.process is not None
        assert self.pipe is not None
        number, self.job = self.job[0], None
        try:
            if self.pipe.poll():
                return self.pipe.recv()
        except (EOFError, OSError):
            pass
        self.process.join(_GRACE)
        error = f"the worker was lost: {_how_it_ended(self.process.exitcode)}"
        self.forget()
        return Outcome(number, None, error, 0.0, self.name)

    def forget(self) -> None:
        """End the process, and wait for its end."""
        if self.process is None or self.pipe is None:
            return
        self.pipe.close()
        self.process.terminate()
        self.process.join(_GRACE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.process.close()
        self.process, self.pipe = None, None


def _serve(pipe: Connection, name: str) -> None:
    """What a worker does: run the trials that come, until the other end of the pipe is closed."""
    end_with_parent()
    with contextlib.suppress(EOFError, OSError):
        while True:
            function, number, trial = pipe.recv()
            pipe.send(run_one(function, number, trial, name))


def _stop(workers: Sequence[_Worker]) -> None:
    """End all at once, also in the middle of trials: their results would be thrown away."""
    for worker in workers:
        if worker.process is not None:
            worker.process.terminate()
    for worker in workers:
        worker.forget()


def _how_it_ended(code: int | None) -> str:
    if code is None or code >= 0:
        return f"it ended with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    return f"it was ended by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")


@contextlib.contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes started meanwhile do not hear Ctrl-C, which a terminal sends to all: this process ends them.

    They would print a traceback each. This process hears what came meanwhile afterwards.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the first process would start it, which lets Ctrl-C through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
