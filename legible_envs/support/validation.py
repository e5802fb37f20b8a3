"""Checks of the numbers that a kitchen's workspace is given."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["check_costs", "check_finite"]


def check_finite(name: str, value: float, minimum: float) -> float:
    """Return a finite number that is at least ``minimum``.

    Raises:
        ValueError: It is not; the message names the parameter.
    """
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float | np.number)
        or not minimum <= float(value) < np.inf
    ):
        raise ValueError(f"{name} must be a finite number >= {minimum:g}, got {value!r}")
    return float(value)


def check_costs(
    cell_costs: npt.ArrayLike | None, shape: tuple[int, int], tie_tolerance: float
) -> npt.NDArray[np.float64] | None:
    """Return a read-only ``(H, W)`` copy of the costs of stepping on each cell, or None.

    Raises:
        ValueError: Another shape, or inner cells whose costs are not finite, not positive, or lost in the tolerance.
    """
    if cell_costs is None:
        return None
    costs = np.array(cell_costs, dtype=np.float64)
    if costs.shape != shape:
        raise ValueError(f"cell_costs must have shape {shape}, got {costs.shape}")
    inner = costs[1:-1, 1:-1]
    least = max(1e-6, 2 * tie_tolerance)
    if not np.isfinite(inner).all() or inner.min() < least:
        raise ValueError(f"cell_costs of inner cells must be finite and at least {least:g}, got {inner.min():g}")
    costs.setflags(write=False)
    return costs
