"""Steps that experiments share: run trials, log their rows, and take as many layouts as asked for."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypedDict, TypeVar, Unpack

from benchmarks.csv_tables import write_table
from benchmarks.trials import Event, run_trials
from benchmarks.trials.store import Rows

if TYPE_CHECKING:
    import pandas as pd

    from benchmarks.trials.store import Trial

__all__ = ["Rows", "RunOptions", "log_trials", "with_layouts"]


class RunOptions(TypedDict, total=False):
    """Where trials are run; see :func:`benchmarks.trials.run_trials`.

    Attributes:
        workers: Processes on this machine; all cores if None.
        scheduler: Address of a Dask scheduler instead.
        progress: Called with an :class:`~benchmarks.trials.Event` whenever something changes.
    """

    workers: int | None
    scheduler: str | None
    progress: Callable[[Event], object] | None


def log_trials(
    function: Callable[[dict[str, Any]], Any],
    trials: Iterable[Trial],
    path: Path,
    *,
    hidden: Sequence[str] = ("how",),
    **how: Unpack[RunOptions],
) -> pd.DataFrame:
    """Run the trials that have no result yet, and write the rows of all of them as CSV.

    Args:
        function: Takes a trial, returns its rows.
        trials: Settings and seed each.
        path: The CSV file; results of single trials are kept in its folder.
        hidden: Settings of trials that are left out of the file.
        how: Where trials are run.

    Returns:
        The rows, hidden settings included.
    """
    rows = run_trials(function, trials, path.parent, **how)
    write_table(path, rows.drop(columns=[name for name in rows if str(name).split(".")[0] in hidden]))
    return rows


class _HasLayouts(Protocol):
    @property
    def layouts(self) -> int: ...


Settings = TypeVar("Settings", bound=_HasLayouts)


def with_layouts(settings: Settings, layouts: int | None) -> Settings:
    """Settings with so many layouts per condition; None leaves them as they are.

    Raises:
        ValueError: Fewer than two layouts per condition: nothing could be said about conditions.
    """
    if layouts is not None:
        settings = dataclasses.replace(settings, layouts=layouts)  # type: ignore[type-var]
    if settings.layouts < 2:
        raise ValueError(
            f"conditions are compared by layouts: 2 or more per condition are needed, got {settings.layouts}"
        )
    return settings
