"""Experiments as cells: one setting and seed each, run once, on any number of processes or machines.

A *cell* is a mapping that JSON can hold. Its function turns it into result rows; these are written the moment the cell
ends, so that an interrupted experiment goes on where it stopped.
"""

from benchmarks.trials.running import CellsFailed, Event, run_cells
from benchmarks.trials.store import CellStore

__all__ = ["CellStore", "CellsFailed", "Event", "run_cells"]
