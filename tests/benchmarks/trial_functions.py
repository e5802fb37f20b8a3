"""What the tests of trials run in other processes."""

from __future__ import annotations

import math
import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trials import TrialName, trial_function


def draw(trial: dict[str, Any]) -> list[dict[str, Any]]:
    """Two rows that depend on the trial alone."""
    rng = np.random.default_rng(trial["seed"])
    return [{"step": i, "value": float(rng.normal()), "count": np.int64(i)} for i in range(2)]


def not_a_number(trial: dict[str, Any]) -> dict[str, Any]:
    """A row without a value."""
    return {"value": math.nan, "note": "none"}


def draw_and_count(trial: dict[str, Any]) -> dict[str, Any]:
    """As ``draw``, leaving a mark for every time it is run."""
    mark(trial)
    return draw(trial)[0]


@trial_function(TrialName("tests/draw", ("tests.benchmarks.trial_functions:draw_and_count",)))
def draw_and_count_renamed(trial: dict[str, Any]) -> dict[str, Any]:
    """As ``draw_and_count``, under a name of its own."""
    return draw_and_count(trial)


def mark(trial: dict[str, Any]) -> int:
    """Leave one more mark; how many there were."""
    folder = Path(trial["marks"])
    count = len(list(folder.glob(f"{trial['seed']}-*")))
    (folder / f"{trial['seed']}-{count}").touch()
    return count


def fail_at_first(trial: dict[str, Any]) -> dict[str, Any]:
    """Raises the first time."""
    if mark(trial) == 0 and trial["seed"] == 1:
        raise RuntimeError("not yet")
    return draw(trial)[0]


def always_fail_at_two(trial: dict[str, Any]) -> dict[str, Any]:
    """Cell 2 raises every time."""
    mark(trial)
    if trial["seed"] == 2:
        raise RuntimeError("two is not allowed")
    return draw(trial)[0]


def die_at_first(trial: dict[str, Any]) -> dict[str, Any]:
    """Cell 1 takes its process along the first time."""
    if mark(trial) == 0 and trial["seed"] == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return draw(trial)[0]


def slowly(trial: dict[str, Any]) -> dict[str, Any]:
    """Long enough to be interrupted."""
    mark(trial)
    time.sleep(trial.get("seconds", 0.4))
    return draw(trial)[0]


def not_rows(trial: dict[str, Any]) -> Any:
    """No rows at all."""
    return {"value": np.zeros(3)}


def stuck(archive, workspace, rng):
    """An emitter that fails when asked."""
    raise RuntimeError("nowhere to go")
