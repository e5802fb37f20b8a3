"""The goals of the most similar prefixes seen: a baseline that knows nothing about how people walk."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts import Trajectory
from predictors.grid.nearest import votes_of_nearest
from predictors.grid.prefixes import PrefixEncoder, PrefixPredictor, Steps, distinct_prefixes

__all__ = ["GridNeighbours"]


class GridNeighbours(PrefixPredictor):
    """Shares of goals among the ``k`` nearest prefixes.

    Prefixes are compared by the Euclidean distance of their features (see
    :class:`~predictors.grid.prefixes.PrefixEncoder`). All that are as near as the ``k``-th count, so the answer does
    not depend on the order of the walks; the prior counts as one more neighbour.

    Args:
        k: Number of neighbours; all prefixes of one walk together count as one.

    Attributes:
        classes_: ``(K,)`` names of all goals and candidates seen in ``fit``, sorted.
    """

    def __init__(self, k: int = 15) -> None:
        self.k = k

    def _check_parameters(self) -> None:
        if isinstance(self.k, bool) or not isinstance(self.k, int) or self.k < 1:
            raise ValueError(f"`k` must be an integer >= 1, got {self.k!r}")

    def _learn(self, walks: Sequence[Trajectory]) -> None:
        self._encoder = PrefixEncoder(walks, self.classes_)
        features, weights = distinct_prefixes(walks, self._encoder, self.classes_)
        self._columns_first, self._weights = np.ascontiguousarray(features.T), weights
        self._squares = (features**2).sum(axis=1)
        self._sizes = weights.sum(axis=1)
        self._fallback = self._prior.of(self.classes_.tolist())

    def _read(self, walk: Trajectory, cells: Steps) -> npt.NDArray[np.float64]:
        query = self._encoder.encode(walk, cells)
        there = np.flatnonzero(query)  # a dozen features of hundreds
        found = votes_of_nearest(
            there, query[there], self._columns_first, self._squares, self._weights, self._sizes, float(self.k)
        )
        return found + self._fallback
