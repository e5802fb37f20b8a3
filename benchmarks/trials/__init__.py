"""Experiments as trials: one setting and seed each, run once, on any number of processes or machines.

A *trial* is a mapping that JSON can hold. Its function turns it into result rows; these are written the moment the
trial ends, so that an interrupted experiment goes on where it stopped.
"""

from benchmarks.trials.functions import TrialName, trial_function
from benchmarks.trials.running import Event, TrialsFailed, TrialsStopped, run_trials
from benchmarks.trials.store import TrialStore

__all__ = ["Event", "TrialName", "TrialStore", "TrialsFailed", "TrialsStopped", "run_trials", "trial_function"]
