"""How well predictors read the recorded play of real people: settings, run and analysis."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.human_play.analysis import accuracy_table, compare_with_reference
    from benchmarks.human_play.run import score_recorded_play
    from benchmarks.human_play.sweep import PREDICTORS, UNTRAINED

__all__ = ["PREDICTORS", "UNTRAINED", "accuracy_table", "compare_with_reference", "score_recorded_play"]

_HOME = {
    "PREDICTORS": "sweep",
    "UNTRAINED": "sweep",
    "accuracy_table": "analysis",
    "compare_with_reference": "analysis",
    "score_recorded_play": "run",
}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
