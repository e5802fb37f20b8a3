"""What a person knows of a kitchen on the way to one goal, for kernels.

Cells are flat indices of an ``H x W`` grid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel

__all__ = ["GoalField", "is_option"]

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


class GoalField(NamedTuple):
    """All that a person needs to know of the kitchen to reach one goal; ``n = H * W``.

    Attributes:
        height: Rows of the grid.
        width: Columns of the grid.
        floor: ``[n]`` where the person may stand.
        costs: ``[n]`` cost of stepping on each cell.
        station: Cell of the goal.
        cost_to_go: ``[n]`` least cost from each cell into the goal; ``inf`` where no path leads.
    """

    height: int
    width: int
    floor: Flags
    costs: Floats
    station: int
    cost_to_go: Floats


@kernel
def is_option(after: int, field: GoalField) -> bool:
    """Whether a person who goes there may step on a cell: into the goal, or onto floor from which it can be reached."""
    return after >= 0 and (after == field.station or (field.floor[after] and field.cost_to_go[after] < np.inf))
