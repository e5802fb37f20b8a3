"""How well predictors read the recorded play of real people: settings, run and analysis."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.human_play.analysis import accuracy_table, compare_with_reference
    from benchmarks.human_play.pointing import load_pointing
    from benchmarks.human_play.run import score_pointing, score_recorded_play
    from benchmarks.human_play.sweep import NEURAL, PREDICTORS, UNTRAINED, Experiment

__all__ = [
    "NEURAL",
    "PREDICTORS",
    "UNTRAINED",
    "Experiment",
    "accuracy_table",
    "compare_with_reference",
    "load_pointing",
    "score_pointing",
    "score_recorded_play",
]

_HOME = {
    "Experiment": "sweep",
    "NEURAL": "sweep",
    "PREDICTORS": "sweep",
    "UNTRAINED": "sweep",
    "accuracy_table": "analysis",
    "compare_with_reference": "analysis",
    "load_pointing": "pointing",
    "score_pointing": "run",
    "score_recorded_play": "run",
}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
