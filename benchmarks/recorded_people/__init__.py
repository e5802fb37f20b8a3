"""Is the legibility score a predictor of how well real people are predicted? Settings, run and analysis."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.recorded_people.analysis import sections
    from benchmarks.recorded_people.run import reproduce
    from benchmarks.recorded_people.sweep import FULL, QUICK, Settings

__all__ = ["FULL", "QUICK", "Settings", "reproduce", "sections"]

_HOME = {"FULL": "sweep", "QUICK": "sweep", "Settings": "sweep", "reproduce": "run", "sections": "analysis"}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
