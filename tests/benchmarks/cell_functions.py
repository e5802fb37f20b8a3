"""What the tests of cells run in other processes."""

from __future__ import annotations

import math
import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np


def draw(cell: dict[str, Any]) -> list[dict[str, Any]]:
    """Two rows that depend on the cell alone."""
    rng = np.random.default_rng(cell["seed"])
    return [{"step": i, "value": float(rng.normal()), "count": np.int64(i)} for i in range(2)]


def not_a_number(cell: dict[str, Any]) -> dict[str, Any]:
    """A row without a value."""
    return {"value": math.nan, "note": "none"}


def draw_and_count(cell: dict[str, Any]) -> dict[str, Any]:
    """As ``draw``, leaving a mark for every time it is run."""
    mark(cell)
    return draw(cell)[0]


def mark(cell: dict[str, Any]) -> int:
    """Leave one more mark; how many there were."""
    folder = Path(cell["marks"])
    count = len(list(folder.glob(f"{cell['seed']}-*")))
    (folder / f"{cell['seed']}-{count}").touch()
    return count


def fail_at_first(cell: dict[str, Any]) -> dict[str, Any]:
    """Raises the first time."""
    if mark(cell) == 0 and cell["seed"] == 1:
        raise RuntimeError("not yet")
    return draw(cell)[0]


def always_fail_at_two(cell: dict[str, Any]) -> dict[str, Any]:
    """Cell 2 raises every time."""
    mark(cell)
    if cell["seed"] == 2:
        raise RuntimeError("two is not allowed")
    return draw(cell)[0]


def die_at_first(cell: dict[str, Any]) -> dict[str, Any]:
    """Cell 1 takes its process along the first time."""
    if mark(cell) == 0 and cell["seed"] == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return draw(cell)[0]


def slowly(cell: dict[str, Any]) -> dict[str, Any]:
    """Long enough to be interrupted."""
    mark(cell)
    time.sleep(cell.get("seconds", 0.4))
    return draw(cell)[0]


def not_rows(cell: dict[str, Any]) -> Any:
    """No rows at all."""
    return {"value": np.zeros(3)}


def stuck(archive, workspace, rng):
    """An emitter that fails when asked."""
    raise RuntimeError("nowhere to go")
