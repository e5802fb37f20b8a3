"""From measured figures to tables, on the terminal and in Markdown."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.throughput.measure import Figure
from benchmarks.throughput.sweep import TARGETS, Settings

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["machine", "result_table", "to_markdown"]


def _shown(value: float, unit: str) -> str:
    if unit == "/s":
        return f"{value:,.0f} /s"
    if unit == "x":
        return f"{value:,.0f}x" if value >= 100 else f"{value:,.1f}x"
    if unit == "share":
        return f"{value:.0%}"
    if unit in ("MB", "count"):
        return f"{value:,.0f} MB" if unit == "MB" else f"{value:,.0f}"
    if value < 0.1:
        return f"{value * 1e6:,.0f} us" if value < 1e-3 else f"{value * 1e3:,.0f} ms"
    return f"{value:,.2f} s"


def _row(figure: Figure) -> tuple[str, str, str, str]:
    """What, median with the range of its samples, promised, and whether that is met."""
    target = TARGETS.get(figure.key)
    value = _shown(figure.value, figure.unit)
    if len(figure.samples) > 1:
        value += f" ({_shown(min(figure.samples), figure.unit)} to {_shown(max(figure.samples), figure.unit)})"
    if target is None:
        return figure.what, value, "", ""
    met = "yes" if target.met_by(figure.value) else "no"
    return figure.what, value, f"{target.sense} {_shown(target.value, figure.unit)}", met


_COLUMNS = ("what", "median (range)", "promised", "met")


def result_table(figures: Sequence[Figure]) -> Table:
    """The figures for a terminal."""
    from benchmarks.console import table

    return table([dict(zip(_COLUMNS, _row(figure), strict=True)) for figure in figures])


def to_markdown(figures: Sequence[Figure], remarks: Sequence[str], settings: Settings) -> str:
    """The figures as a page of documentation."""
    lines = [
        "# Speed",
        "",
        f"`legible bench` on {machine()}.",
        "",
        f"Medians of {settings.rounds} samples; those of a group are taken in turn, and ratios are medians of the",
        "ratios of paired samples. Rates count processor time of one core, durations wall time. Absolute figures",
        "belong to this machine, ratios travel better.",
        "",
        "| " + " | ".join(_COLUMNS) + " |",
        "| --- | --- | --- | --- |",
        *("| " + " | ".join(_row(figure)) + " |" for figure in figures),
        "",
    ]
    return "\n".join([*lines, *(f"{remark}\n" for remark in remarks)])


def machine() -> str:
    """Processor, cores, and the versions that matter, in one line."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "gymnasium", "ribs"))
    return f"{_processor()}, {os.cpu_count()} cores, Python {platform.python_version()}, {packages}"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
