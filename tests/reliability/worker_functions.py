"""What the tests of this folder run in workers."""

from __future__ import annotations

import ctypes
import time
from pathlib import Path
from typing import Any

import numpy as np


def draw(trial: dict[str, Any]) -> dict[str, Any]:
    """A row that depends on the trial alone; takes a while, and leaves a mark as it begins."""
    rng = np.random.default_rng(trial["seed"])
    if "marks" in trial:
        (Path(trial["marks"]) / str(trial["seed"])).touch()
    time.sleep(trial.get("seconds", 0.05))
    deadline = time.monotonic() + 120
    while "until" in trial and not Path(trial["until"]).exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    return {"value": float(rng.normal())}


def never_let_go(trial: dict[str, Any]) -> dict[str, Any]:
    """Minutes in compiled code that gives no other thread a turn."""
    (Path(trial["marks"]) / str(trial["seed"])).touch()
    ctypes.PyDLL(None).sleep(300)
    return {"value": 0.0}
