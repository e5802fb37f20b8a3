"""How well predictors read the recorded play of real people: settings, run and analysis."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.human_play.analysis import accuracy_table
    from benchmarks.human_play.run import score_recorded_play
    from benchmarks.human_play.sweep import PREDICTORS

__all__ = ["PREDICTORS", "accuracy_table", "score_recorded_play"]

_HOME = {"PREDICTORS": "sweep", "accuracy_table": "analysis", "score_recorded_play": "run"}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
