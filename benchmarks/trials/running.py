"""Run trials on this machine's cores or on a Dask cluster; each once, retried once, none lost."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.console import plural
from benchmarks.trials.attempts import Outcome, Pool
from benchmarks.trials.functions import name_of, path_of
from benchmarks.trials.store import Trial, TrialStore
from legible_envs.support.validation import integer

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Event", "TrialsFailed", "run_trials"]

ATTEMPTS: Final = 2
MOST_WORKERS: Final = 1_024
"""Processes on this machine."""


@dataclass
class Event:
    """Where an experiment stands; handed to ``progress`` whenever something changes.

    Attributes:
        total: Number of trials.
        done: Finished ones, those found on disk included.
        found: Those found on disk.
        failed: Trials given up.
        retried: Attempts that failed and were repeated.
        running: What each worker runs: its name and the trial.
        last: The newest outcome, if any.
    """

    total: int
    done: int = 0
    found: int = 0
    failed: int = 0
    retried: int = 0
    running: dict[str, Trial] = field(default_factory=dict)
    last: Outcome | None = None


class TrialsFailed(RuntimeError):
    """Some trials failed twice; everything else is finished and on disk.

    Attributes:
        failures: What :meth:`TrialStore.failures` says of each.
        table: Rows of the finished trials.
    """

    def __init__(self, message: str, failures: list[dict[str, Any]], table: pd.DataFrame) -> None:
        super().__init__(message)
        self.failures = failures
        self.table = table


def run_trials(
    function: Callable[[dict[str, Any]], Any] | str,
    trials: Iterable[Trial],
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Event], object] | None = None,
) -> pd.DataFrame:
    """Run a function over trials and keep every result.

    The table depends on the trials alone: not on how many workers ran them, in which order they ended, or how often the
    run was interrupted.

    Args:
        function: Takes a trial, returns a mapping or a list of mappings (result rows); defined at the top of a module
            that workers can import, or its ``"module:name"``.
        trials: Settings and seed, one mapping of plain data each; equal ones are run once.
        folder: Where results are kept. Trials that have a result there are not run again; trials that failed are. A
            result belongs to its trial and to the name of the function (see :func:`.trial_function`), which is its path
            unless it was given one.
        workers: Processes on this machine; all cores if None; 1 runs everything in this process. A script of your own
            that starts several needs the usual ``if __name__ == "__main__":``.
        scheduler: Address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``, whose workers can import
            ``function``; wins over ``workers``.
        progress: Called with an :class:`Event` whenever something changes.

    Returns:
        A row per result row, in the order of ``trials``, its trial's settings as leading columns.

    Raises:
        TrialsFailed: Some trials failed twice. Raised at the end, when all others are finished.
        ValueError: A trial that JSON cannot hold, or a function that workers cannot find.
    """
    path = path_of(function)
    store = TrialStore(folder, name_of(path))
    unique = list({store.key(trial): dict(trial) for trial in trials}.values())
    waiting = [(i, trial) for i, trial in enumerate(unique) if store.load(trial) is None]
    event = Event(total=len(unique), done=len(unique) - len(waiting), found=len(unique) - len(waiting))
    report = progress or (lambda event: None)
    report(event)
    if waiting:
        _run(_pool(workers, scheduler, len(waiting)), path, unique, waiting, store, event, report)
    table = store.table(unique)
    keys = {store.key(trial) for trial in unique}
    failures = [failure for failure in store.failures() if store.key(failure["cell"]) in keys]
    if event.failed:
        last = failures[-1]["traceback"].strip().splitlines()[-1]
        raise TrialsFailed(
            f"{event.failed} of {plural(event.total, 'trial')} failed {ATTEMPTS} times; the others are finished. "
            f"Tracebacks: {store.folder / 'failed'}. The last: {last}",
            failures,
            table,
        )
    return table


def _run(
    pool: Pool,
    function: str,
    trials: Sequence[Trial],
    waiting: Sequence[tuple[int, Trial]],
    store: TrialStore,
    event: Event,
    report: Callable[[Event], object],
) -> None:
    attempts: dict[int, int] = {}
    for news in pool.run(function, iter(waiting)):
        if not isinstance(news, Outcome):
            event.running = news
            report(event)
            continue
        trial = trials[news.number]
        event.last = news
        if news.rows is not None:
            store.save(trial, news.rows, news.seconds, news.worker)
            event.done += 1
        else:
            attempts[news.number] = attempts.get(news.number, 0) + 1
            store.save_failure(trial, news.error or "", attempts[news.number], news.worker)
            if attempts[news.number] < ATTEMPTS:
                event.retried += 1
                pool.again(news.number, trial)
            else:
                event.failed += 1
        report(event)


def _pool(workers: int | None, scheduler: str | None, num_trials: int) -> Pool:
    if scheduler is not None:
        from benchmarks.trials.cluster import ClusterPool

        return ClusterPool(scheduler)
    from benchmarks.trials.local import InProcess, LocalPool, num_cores

    count = num_cores() if workers is None else integer("workers", workers, 1, MOST_WORKERS, also="None")
    return InProcess() if count == 1 else LocalPool(min(count, num_trials))
