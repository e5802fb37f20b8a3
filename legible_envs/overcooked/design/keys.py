"""Random keys of kitchens: every vector of real numbers is a valid kitchen."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.design.key_kernels import decode_kitchens
from legible_envs.overcooked.design.rules import DesignRules
from legible_envs.random_keys import KeyDecoder

__all__ = ["KitchenKeys"]


class KitchenKeys(KeyDecoder):
    """One key per gene of a kitchen; every vector is a valid kitchen, and every valid kitchen has a vector.

    A station's key names the place on the ring of counters where the station would like to stand; it gets the nearest
    place that leaves room for all stations. Inner cells become obstacles in descending order of their keys, down to
    one half, where that cuts no station off.

    Args:
        rules: Which kitchens are valid.
    """

    def __init__(self, rules: DesignRules) -> None:
        self._geometry = rules.geometry
        self._dtype = rules.dtype
        self._upper = np.asarray(rules.upper_bounds, dtype=np.float64)
        self.size = len(self._upper)
        # Stations with the fewest places first: the locked ones stand before others look for room.
        self._order = np.argsort(self._geometry.allowed.sum(axis=1), kind="stable").astype(np.int64)

    def encode(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """``(n, m)`` keys, each in the middle of the interval that stands for its gene."""
        return (np.asarray(genomes, dtype=np.float64) + 0.5) / (self._upper + 1.0)

    def decode(
        self,
        keys: npt.NDArray[np.float64],
        anchors: npt.NDArray[Any] | None = None,
        rng: np.random.Generator | None = None,
    ) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes of ``(n, m)`` keys; neither ``anchors`` nor ``rng`` is needed.

        Raises:
            RuntimeError: The rules leave no room for the stations.
        """
        genomes = np.empty(keys.shape, dtype=self._dtype)
        if not decode_kitchens(np.clip(keys, 0.0, 1.0), self._geometry, self._order, genomes):
            raise RuntimeError("the rules of this workspace leave no room for its stations")
        return genomes
