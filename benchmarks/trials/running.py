"""Run trials on this machine's cores or on a Dask cluster; each once, retried once, none lost."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.console import plural
from benchmarks.trials.attempts import Outcome, Pool
from benchmarks.trials.functions import name_of, path_of
from benchmarks.trials.store import Trial, TrialStore
from legible_envs.support.validation import integer, real
from optimizers.errors import ClusterError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Event", "TrialsFailed", "TrialsStopped", "run_trials"]

ATTEMPTS: Final = 2
MOST_WORKERS: Final = 1_024
"""Processes on this machine."""
_NAMED: Final = 5
"""How many damaged files a warning names; ``Event.damaged`` names all."""


@dataclass
class Event:
    """Where an experiment stands; handed to ``progress`` whenever something changes.

    Attributes:
        total: Number of trials.
        done: Finished ones, those found on disk included.
        found: Those found on disk.
        failed: Trials given up.
        retried: Attempts that failed and were repeated.
        damaged: Kept files that were found damaged and set aside: a line for each, with file and reason. Trials that
            are left without a result by it are run again.
        running: What each worker runs: its name and the trial.
        last: The newest outcome, if any.
    """

    total: int
    done: int = 0
    found: int = 0
    failed: int = 0
    retried: int = 0
    damaged: tuple[str, ...] = ()
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


class TrialsStopped(ClusterError):
    """The cluster was lost, or had no worker that may be used; finished trials are on disk, the others were not run."""


def run_trials(
    function: Callable[[dict[str, Any]], Any] | str,
    trials: Iterable[Trial],
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    worker_timeout: float = 60.0,
    progress: Callable[[Event], object] | None = None,
) -> pd.DataFrame:
    """Run a function over trials and keep every result.

    The table depends on the trials alone: not on how many workers ran them, in which order they ended, or how often the
    run was interrupted.

    Args:
        function: Takes a trial, returns a mapping or a list of mappings (result rows); defined at the top of a module
            that workers can import, or its ``"module:name"``.
        trials: Settings and seed, one mapping of plain data each; equal ones are run once.
        folder: Where results are kept. Trials that have a result there are not run again; trials that failed are, and
            those whose file is damaged: a warning names it, and it is set aside as ``NAME.json.damaged``. A result
            belongs to its trial and to the name of the function (see :func:`.trial_function`), which is its path unless
            it was given one.
        workers: Processes on this machine; all cores if None; 1 runs everything in this process. A script of your own
            that starts several needs the usual ``if __name__ == "__main__":``.
        scheduler: Address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``, whose workers have the same code as
            this process, that of ``function`` included; wins over ``workers``. Workers with other code are named in a
            warning and not used.
        worker_timeout: Seconds to wait for a worker of the cluster where it has none that may be used.
        progress: Called with an :class:`Event` whenever something changes.

    Returns:
        A row per result row, in the order of ``trials``, its trial's settings as leading columns.

    Raises:
        TrialsFailed: Some trials failed twice. Raised at the end, when all others are finished.
        TrialsStopped: The scheduler was lost, or no worker came in time; what was finished is on disk.
        ClusterError: No scheduler answers at that address.
        ValueError: A trial that JSON cannot hold, or a function that workers cannot find.
    """
    path = path_of(function)
    store = TrialStore(folder, name_of(path))
    unique = list({store.key(trial): dict(trial) for trial in trials}.values())
    waiting = []
    for i, trial in enumerate(unique):
        if store.load(trial) is None:
            waiting.append((i, trial))
        else:
            store.forget_failure(trial)  # of a run that was killed between keeping the result and this
    store.failures()  # for those that are damaged
    event = Event(
        total=len(unique),
        done=len(unique) - len(waiting),
        found=len(unique) - len(waiting),
        damaged=tuple(store.set_damaged_aside()),
    )
    if event.damaged:
        warnings.warn(_about_damage(event.damaged), stacklevel=2)
    report = progress or (lambda event: None)
    report(event)
    if waiting:
        pool = _pool(workers, scheduler, worker_timeout, path, waiting)
        try:
            _run(pool, path, unique, waiting, store, event, report)
        except ClusterError as error:
            raise TrialsStopped(f"{error}. {_kept(event, store)}") from None
    table = store.table(unique)
    if event.failed:
        keys = {store.key(trial) for trial in unique if store.load(trial) is None}
        failures = [failure for failure in store.failures() if store.key(failure["cell"]) in keys]
        said = [line for failure in failures[-1:] for line in failure["traceback"].strip().splitlines()[-1:]]
        raise TrialsFailed(
            f"{event.failed} of {plural(event.total, 'trial')} failed {ATTEMPTS} times; the others are finished. "
            f"Tracebacks: {store.folder / 'failed'}.{' The last: ' + said[0] if said else ''}",
            failures,
            table,
        )
    return table


def _about_damage(files: Sequence[str]) -> str:
    """What was found damaged, in a sentence; names a few."""
    more = f"; and {len(files) - _NAMED:,} more" if len(files) > _NAMED else ""
    return (
        f"{plural(len(files), 'kept file')} of trials cannot be used, and what is missing now is run again: "
        f"{'; '.join(files[:_NAMED])}{more}"
    )


def _kept(event: Event, store: TrialStore) -> str:
    count = f"{event.done} of {plural(event.total, 'trial')}"
    return f"Finished and kept in {store.folder}: {count}; asked again, the others are run, on a cluster or without one"


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
    # Closed even where the loop ends by an error or Ctrl-C: its workers end with it, not with the garbage.
    with contextlib.closing(pool.run(function, iter(waiting))) as running:
        for news in running:
            if isinstance(news, Outcome):
                _note(news, trials[news.number], attempts, pool, store, event)
            else:
                event.running = news
            report(event)


def _note(
    outcome: Outcome, trial: Trial, attempts: dict[int, int], pool: Pool, store: TrialStore, event: Event
) -> None:
    """Keep a result; have a failed trial run once more."""
    event.last = outcome
    if outcome.rows is not None:
        store.save(trial, outcome.rows, outcome.seconds, outcome.worker)
        event.done += 1
        return
    attempts[outcome.number] = attempts.get(outcome.number, 0) + 1
    store.save_failure(trial, outcome.error or "", attempts[outcome.number], outcome.worker)
    if attempts[outcome.number] < ATTEMPTS:
        event.retried += 1
        pool.again(outcome.number, trial)
    else:
        event.failed += 1


def _pool(
    workers: int | None,
    scheduler: str | None,
    worker_timeout: float,
    function: str,
    waiting: Sequence[tuple[int, Trial]],
) -> Pool:
    real("worker_timeout", worker_timeout, 0, unit="seconds")
    if scheduler is not None:
        from benchmarks.trials.cluster import ClusterPool
        from benchmarks.trials.packages import packages_of

        if function.startswith("__main__:"):
            raise ValueError(f"workers of a cluster cannot import {function!r} from a script; put it into a module")
        return ClusterPool(scheduler, packages_of(function, (trial for _, trial in waiting)), worker_timeout)
    from benchmarks.trials.local import InProcess, LocalPool, num_cores

    count = num_cores() if workers is None else integer("workers", workers, 1, MOST_WORKERS, also="None")
    return InProcess() if count == 1 else LocalPool(min(count, len(waiting)))
