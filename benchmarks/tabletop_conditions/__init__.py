"""The paper's tables: are people at legible ones read better, and does a robot profit? Settings, run and analysis.

Tung, Luebbers, Roncone and Hayes, *Workspace Optimization Techniques to Improve Prediction of Human Motion During
Human-Robot Collaboration* (HRI 2024), the study at a table, with simulated people; and what it left out, the robot.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benchmarks.tabletop_conditions.analysis import sections
    from benchmarks.tabletop_conditions.run import reproduce
    from benchmarks.tabletop_conditions.sweep import FULL, QUICK, Settings

__all__ = ["FULL", "QUICK", "Settings", "reproduce", "sections"]

_HOME = {"FULL": "sweep", "QUICK": "sweep", "Settings": "sweep", "reproduce": "run", "sections": "analysis"}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
