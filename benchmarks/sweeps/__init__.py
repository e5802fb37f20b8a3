"""Sweeps: a grid of workspaces, objectives, emitters and seeds from one file, on cores or a cluster."""

from benchmarks.sweeps.run import run_sweep
from benchmarks.sweeps.sweep import Sweep, SweepError

__all__ = ["Sweep", "SweepError", "run_sweep"]
