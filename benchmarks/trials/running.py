"""Run cells on this machine's cores or on a Dask cluster; each once, retried once, none lost."""

from __future__ import annotations

import importlib
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from benchmarks.trials.store import Cell, CellStore, Rows, plain

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["CellsFailed", "Event", "Outcome", "Pool", "run_cells", "run_one"]

ATTEMPTS: Final = 2


class Outcome(NamedTuple):
    """How one attempt at a cell ended; either ``rows`` or ``error`` is set.

    Attributes:
        number: Index of the cell.
        rows: Its result rows.
        error: Its traceback, or how its worker was lost.
        seconds: How long it took.
        worker: Who ran it.
    """

    number: int
    rows: Rows | None
    error: str | None
    seconds: float
    worker: str


@dataclass
class Event:
    """Where an experiment stands; handed to ``progress`` whenever something changes.

    Attributes:
        total: Number of cells.
        done: Finished ones, those found on disk included.
        found: Those found on disk.
        failed: Cells given up.
        retried: Attempts that failed and were repeated.
        running: What each worker is at: its name and the cell.
        last: The newest outcome, if any.
    """

    total: int
    done: int = 0
    found: int = 0
    failed: int = 0
    retried: int = 0
    running: dict[str, Cell] = field(default_factory=dict)
    last: Outcome | None = None


class CellsFailed(RuntimeError):
    """Some cells failed twice; everything else is finished and on disk.

    Attributes:
        failures: What :meth:`CellStore.failures` says of each.
        table: Rows of the finished cells.
    """

    def __init__(self, message: str, failures: list[dict[str, Any]], table: pd.DataFrame) -> None:
        super().__init__(message)
        self.failures = failures
        self.table = table


class Pool(Protocol):
    """Whoever runs cells: takes them one by one, gives outcomes as they come."""

    def run(self, function: str, cells: Iterator[tuple[int, Cell]]) -> Iterator[Outcome | dict[str, Cell]]:
        """Outcomes in any order; between them, mappings of worker to cell whenever that changes."""

    def again(self, number: int, cell: Cell) -> None:
        """Put a cell back at the end of the queue."""


def run_cells(
    function: Callable[[dict[str, Any]], Any] | str,
    cells: Iterable[Cell],
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Event], object] | None = None,
) -> pd.DataFrame:
    """Run a function over cells and keep every result.

    The table depends on the cells alone: not on how many workers ran them, in which order they ended, or how often the
    run was interrupted.

    Args:
        function: Takes a cell, returns a mapping or a list of mappings (result rows); defined at the top of a module
            that workers can import, or its ``"module:name"``.
        cells: Settings and seed, one mapping of plain data each; equal ones are run once.
        folder: Where results are kept. Cells that have a result there are not run again; cells that failed are.
        workers: Processes on this machine; all cores if None; 1 runs everything in this process. A script of your own
            that starts several needs the usual ``if __name__ == "__main__":``.
        scheduler: Address of a Dask scheduler, such as ``"tcp://10.0.0.1:8786"``, whose workers can import
            ``function``; wins over ``workers``.
        progress: Called with an :class:`Event` whenever something changes.

    Returns:
        A row per result row, in the order of ``cells``, its cell's settings as leading columns.

    Raises:
        CellsFailed: Some cells failed twice. Raised at the end, when all others are finished.
        ValueError: A cell that JSON cannot hold, or a function that workers cannot find.
    """
    path = _path_of(function)
    store = CellStore(folder, path)
    unique = list({store.key(cell): dict(cell) for cell in cells}.values())
    waiting = [(i, cell) for i, cell in enumerate(unique) if store.load(cell) is None]
    event = Event(total=len(unique), done=len(unique) - len(waiting), found=len(unique) - len(waiting))
    report = progress or (lambda event: None)
    report(event)
    if waiting:
        _run(_pool(workers, scheduler, len(waiting)), path, unique, waiting, store, event, report)
    table = store.table(unique)
    keys = {store.key(cell) for cell in unique}
    failures = [failure for failure in store.failures() if store.key(failure["cell"]) in keys]
    if event.failed:
        last = failures[-1]["traceback"].strip().splitlines()[-1]
        raise CellsFailed(
            f"{event.failed} of {event.total} cells failed {ATTEMPTS} times; the others are finished. Tracebacks: "
            f"{store.folder / 'failed'}. The last: {last}",
            failures,
            table,
        )
    return table


def _run(
    pool: Pool,
    function: str,
    cells: Sequence[Cell],
    waiting: Sequence[tuple[int, Cell]],
    store: CellStore,
    event: Event,
    report: Callable[[Event], object],
) -> None:
    attempts: dict[int, int] = {}
    for news in pool.run(function, iter(waiting)):
        if not isinstance(news, Outcome):
            event.running = news
            report(event)
            continue
        cell = cells[news.number]
        event.last = news
        if news.rows is not None:
            store.save(cell, news.rows, news.seconds, news.worker)
            event.done += 1
        else:
            attempts[news.number] = attempts.get(news.number, 0) + 1
            store.save_failure(cell, news.error or "", attempts[news.number], news.worker)
            if attempts[news.number] < ATTEMPTS:
                event.retried += 1
                pool.again(news.number, cell)
            else:
                event.failed += 1
        report(event)


def _pool(workers: int | None, scheduler: str | None, num_cells: int) -> Pool:
    if scheduler is not None:
        from benchmarks.trials.cluster import ClusterPool

        return ClusterPool(scheduler)
    from benchmarks.trials.local import InProcess, LocalPool, num_cores

    count = num_cores() if workers is None else workers
    if count < 1:
        raise ValueError(f"workers must be at least 1, got {workers}")
    return InProcess() if count == 1 else LocalPool(min(count, num_cells))


def run_one(function: str, number: int, cell: Cell, worker: str) -> Outcome:
    """One attempt at one cell, in the process that calls this."""
    started = time.perf_counter()
    rows, error = None, None
    try:
        rows = plain(_resolve(function)(dict(cell)))
    except Exception:
        error = traceback.format_exc()
    return Outcome(number, rows, error, time.perf_counter() - started, worker)


def _resolve(path: str) -> Callable[[dict[str, Any]], Any]:
    module, _, name = path.partition(":")
    return getattr(importlib.import_module(module), name)


def _path_of(function: Callable[[dict[str, Any]], Any] | str) -> str:
    if isinstance(function, str):
        path = function
    else:
        path = f"{getattr(function, '__module__', None)}:{getattr(function, '__qualname__', None)}"
    try:
        found = _resolve(path)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"workers cannot find {path!r}; give a function at the top of a module ({error})") from error
    if not callable(found):
        raise ValueError(f"{path!r} is {type(found).__name__}, not a function")
    return path
