"""Progress of many trials on a terminal: the whole, and what each worker is at."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any

from benchmarks.trials.running import Event
from benchmarks.trials.store import Trial
from legible_envs.support.names import printable

__all__ = ["TrialsProgress"]

_MAX_WORKERS = 12
_WIDTH = 72


class TrialsProgress:
    """A progress bar on standard error with a line per worker.

    Args:
        show: True always, False never, None only where standard error is a terminal.
    """

    def __init__(self, show: bool | None = None) -> None:
        self._shown = sys.stderr.isatty() if show is None else show
        self._bar: Any = None
        self._live: Any = None
        self._task: Any = None

    def __enter__(self) -> TrialsProgress:
        if self._shown:
            from rich.console import Console
            from rich.live import Live
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            self._bar = Progress(
                BarColumn(bar_width=None),
                MofNCompleteColumn(),
                TextColumn("{task.fields[status]}", markup=False),
                TimeRemainingColumn(compact=True),
            )
            self._task = self._bar.add_task("trials", total=None, status="")
            self._live = Live(self._bar, console=Console(stderr=True), refresh_per_second=4)
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, event: Event) -> None:
        """Show where an experiment stands."""
        if self._live is None:
            return
        from rich.console import Group
        from rich.text import Text

        counts = {"found": event.found, "retried": event.retried, "failed": event.failed}
        status = " · ".join(f"{count} {what}" for what, count in counts.items() if count)
        self._bar.update(self._task, total=event.total, completed=event.done + event.failed, status=status)
        workers = sorted(event.running.items())
        lines = [
            Text(printable(f"  {worker}: {describe(trial)}"), style="dim") for worker, trial in workers[:_MAX_WORKERS]
        ]
        if len(workers) > _MAX_WORKERS:
            lines.append(Text(f"  … and {len(workers) - _MAX_WORKERS} more workers", style="dim"))
        self._live.update(Group(self._bar, *lines))


def describe(trial: Trial) -> str:
    """A trial in a line: its plain values, one after the other."""
    text = printable(" ".join(f"{key}={_short(value)}" for key, value in trial.items()))
    return text if len(text) <= _WIDTH else text[: _WIDTH - 1] + "…"


def _short(value: Any) -> str:
    if isinstance(value, dict):
        return "/".join(_short(part) for part in value.values())
    if isinstance(value, list | tuple):
        return "x".join(_short(part) for part in value)
    return str(value)
