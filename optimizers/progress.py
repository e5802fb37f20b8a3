"""The progress bar of a search: best score, coverage, QD score and speed, on a terminal only unless asked for."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import TracebackType
from typing import Any

__all__ = ["Progress"]


class Progress:
    """A progress bar on standard error.

    Args:
        total: Evaluations or climbs to come.
        unit: What is counted, ``"evaluations"`` or ``"climbs"``.
        show: True always, False never, None only where standard error is a terminal.
    """

    def __init__(self, total: int, unit: str, show: bool | None) -> None:
        self.total = total
        self.unit = unit
        self._bar: Any = None
        self._task: Any = None
        self._shown = sys.stderr.isatty() if show is None else show

    def __enter__(self) -> Progress:
        if self._shown:
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
            from rich.progress import Progress as RichProgress

            self._bar = RichProgress(
                BarColumn(bar_width=None),
                TextColumn("{task.percentage:3.0f}%{task.fields[unit]} {task.fields[status]}", markup=False),
                TimeRemainingColumn(compact=True),
                console=Console(stderr=True),
                refresh_per_second=5,
            )
            self._bar.start()
            self._task = self._bar.add_task(
                "search", total=self.total, unit="" if self.unit == "evaluations" else f" of {self.unit}", status=""
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def update(self, done: int, row: Mapping[str, Any]) -> None:
        """Show a row of the history."""
        if self._bar is None:
            return
        best = "-" if row["best"] is None else f"{row['best']:.4g}"
        status = (
            f"· best {best} · coverage {row['coverage']:.0%} · QD {row['qd_score']:,.0f} · "
            f"{row['evaluations_per_second']:,.0f}/s"
        )
        self._bar.update(self._task, completed=min(done, self.total), status=status)
