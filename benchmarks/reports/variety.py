"""Which of many good layouts to show, so that they differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

__all__ = ["SHARE", "pick_varied"]

SHARE: Final = 0.5
"""Share of the layouts, the best ones, that are shown from."""


def pick_varied(genomes: npt.ArrayLike, count: int, *, share: float = SHARE) -> list[int]:
    """Layouts that are good and differ from one another.

    The first is the best; each next one is, of the better half, the one whose nearest layout among those already taken
    is farthest (the greedy rule of max-min diversity, at most a factor of two from the best choice). Distance is the
    mean over genes of how far they differ, each gene as a share of its range within that half; ties go to the better
    layout.

    Args:
        genomes: ``(n, d)``, the best first.
        count: How many to take.
        share: Of the layouts to choose from, the best ones; never fewer than ``count``.

    Returns:
        At most ``count`` rows in the order they were taken, without two equal genomes.
    """
    rows = np.asarray(genomes, dtype=np.float64)
    room = min(len(rows), max(math.ceil(share * len(rows)), count))
    if not room or count < 1:
        return []
    rows = rows[:room]
    extent = np.ptp(rows, axis=0)
    scaled = rows / np.where(extent > 0, extent, 1.0)
    taken = [0]
    nearest = np.abs(scaled - scaled[0]).mean(axis=1)
    while len(taken) < min(count, room):
        farthest = int(np.argmax(nearest))
        if nearest[farthest] <= 0.0:
            break
        taken.append(farthest)
        nearest = np.minimum(nearest, np.abs(scaled - scaled[farthest]).mean(axis=1))
    return taken
