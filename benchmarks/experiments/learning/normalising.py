"""Running means and deviations: observations and rewards of any unit become numbers that a network learns from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["RunningMoments", "normalised"]

Floats = npt.NDArray[np.float64]

_FARTHEST = 10.0
"""Normalised numbers beyond this are cut."""


class RunningMoments:
    """Mean and variance of all rows seen so far (Chan, Golub and LeVeque 1979).

    Args:
        shape: Of a row.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.mean: Floats = np.zeros(shape)
        self.variance: Floats = np.ones(shape)
        self.count = 0.0

    def update(self, rows: npt.NDArray[Any]) -> None:
        """Take ``(B, ...)`` rows in."""
        new, count = rows.astype(np.float64), float(len(rows))
        mean, total = new.mean(axis=0), self.count + count
        away = mean - self.mean
        squares = self.variance * self.count + new.var(axis=0) * count + away**2 * self.count * count / total
        self.mean = self.mean + away * count / total
        self.variance, self.count = squares / total, total

    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """All of it, as arrays by name."""
        return {"mean": self.mean, "variance": self.variance, "count": np.array(self.count)}

    def restore(self, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Go on from :meth:`arrays`."""
        self.mean, self.variance = np.array(arrays["mean"]), np.array(arrays["variance"])
        self.count = float(arrays["count"])


def normalised(obs: npt.NDArray[Any], mean: Floats, variance: Floats) -> npt.NDArray[np.float32]:
    """Observations with mean 0 and deviation 1, cut at 10 deviations."""
    found = (obs - mean) / np.sqrt(variance + 1e-8)
    return np.clip(found, -_FARTHEST, _FARTHEST).astype(np.float32)
