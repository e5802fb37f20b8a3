"""Layouts as vectors of real numbers in [0, 1], for optimisers that only know such vectors.

Bean's random keys (*Genetic algorithms and random keys for sequencing and optimization*, 1994): a decoder reads a valid
layout from any vector. In a kitchen, a station's key names the place on the ring of counters where it would like to
stand, and it gets the nearest one that leaves room for all; cells become obstacles in descending order of their keys,
down to one half, where that cuts nothing off. Of any other workspace each key is one gene, stretched to its bounds and
rounded where genes are whole numbers; what is then not valid takes random genes from a valid layout until it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace

__all__ = ["BoundedKeys", "Keys", "KitchenKeys", "random_keys"]

_REPAIRS = 8
Array = npt.NDArray[np.float64]


class Keys(Protocol):
    """A decoder; ``m`` is :attr:`size`."""

    size: int

    def encode(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, m)`` keys that decode into the ``(n, d)`` valid genomes."""

    def decode(self, keys: Array, anchors: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes of ``(n, m)`` keys, repaired with ``(n, d)`` valid ``anchors`` where need be."""


def random_keys(workspace: Any) -> Keys:
    """The decoder that fits a workspace."""
    if workspace.name == "overcooked" and hasattr(workspace, "rules"):
        return KitchenKeys(workspace)
    return BoundedKeys(workspace)


class KitchenKeys:
    """Random keys of kitchens: every vector is a valid kitchen, and every valid kitchen has a vector.

    Args:
        workspace: The design of kitchens.
    """

    def __init__(self, workspace: OvercookedWorkspace) -> None:
        self._geometry = workspace.rules.geometry
        self._upper = np.asarray(workspace.upper_bounds, dtype=np.float64)
        self.size = len(self._upper)
        # Stations with the fewest places first: the locked ones stand before others look for room.
        self._order = np.argsort(self._geometry.allowed.sum(axis=1), kind="stable").astype(np.int64)

    def encode(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, m)`` keys in the middle of the interval that stands for each gene."""
        return (np.asarray(genomes, dtype=np.float64) + 0.5) / (self._upper + 1.0)

    def decode(self, keys: Array, anchors: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[np.int8]:
        """``(n, d)`` kitchens; keys outside [0, 1] count as the nearer end; anchors and rng are not needed.

        Raises:
            RuntimeError: The rules of the workspace leave no room for its stations.
        """
        from optimizers.emitters.key_kernels import decode_kitchens

        genomes = np.empty(keys.shape, dtype=np.int8)
        if not decode_kitchens(np.clip(keys, 0.0, 1.0), self._geometry, self._order, genomes):
            raise RuntimeError("the rules of this workspace leave no room for its stations")
        return genomes


class BoundedKeys:
    """Each key a gene, between the workspace's bounds.

    Args:
        workspace: The design problem.
    """

    def __init__(self, workspace: Any) -> None:
        self._workspace = workspace
        self._dtype = np.dtype(workspace.genome_dtype)
        self._whole = bool(np.issubdtype(self._dtype, np.integer))
        self._lower = np.asarray(workspace.lower_bounds, dtype=np.float64)
        self._span = np.asarray(workspace.upper_bounds, dtype=np.float64) - self._lower
        self.size = len(self._lower)

    def encode(self, genomes: npt.NDArray[Any]) -> Array:
        """``(n, m)`` keys; of whole numbers the middle of the interval that is rounded to each."""
        offset = np.asarray(genomes, dtype=np.float64) - self._lower
        if self._whole:
            return (offset + 0.5) / (self._span + 1.0)
        return offset / np.where(self._span > 0, self._span, 1.0)

    def decode(self, keys: Array, anchors: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` genomes; those not valid take half the genes of their anchor, up to eight times, then all."""
        keys = np.clip(keys, 0.0, 1.0)
        if self._whole:
            raw = self._lower + np.minimum(np.floor(keys * (self._span + 1.0)), self._span)
        else:
            raw = np.clip(self._lower + keys * self._span, self._lower, self._lower + self._span)
        genomes = raw.astype(self._dtype)
        for last in [False] * _REPAIRS + [True]:
            wrong = np.flatnonzero(~np.asarray(self._workspace.valid(genomes), dtype=bool))
            if not wrong.size:
                break
            taken = rng.random((len(wrong), genomes.shape[1])) < (1.0 if last else 0.5)
            genomes[wrong] = np.where(taken, anchors[wrong], genomes[wrong])
        return genomes
