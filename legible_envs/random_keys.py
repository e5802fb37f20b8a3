"""Layouts as vectors of real numbers in [0, 1], for optimisers that only know such vectors.

Bean's random keys (*Genetic algorithms and random keys for sequencing and optimization*, 1994): a decoder turns any
vector of keys into a valid layout. Which decoder fits a design problem, the workspace knows
(:meth:`legible_envs.workspace.Workspace.key_decoder`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["BoundedGenomes", "BoundedKeys", "KeyDecoder"]

_REPAIRS = 8
Keys = npt.NDArray[np.float64]


class KeyDecoder(ABC):
    """Turns vectors of keys into valid layouts and back.

    Attributes:
        size: Number of keys of one layout, ``m``.
    """

    size: int

    @abstractmethod
    def encode(self, genomes: npt.NDArray[Any]) -> Keys:
        """``(n, m)`` keys in [0, 1] that decode into the ``(n, d)`` valid genomes."""

    @abstractmethod
    def decode(self, keys: Keys, anchors: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes.

        Args:
            keys: ``(n, m)`` any finite numbers; those outside [0, 1] count as the nearer end.
            anchors: ``(n, d)`` valid genomes, one per row, which a decoder may mix in to repair a layout.
            rng: Source of all randomness.
        """


class BoundedGenomes(Protocol):
    """The part of a workspace that :class:`BoundedKeys` needs."""

    @property
    def genome_dtype(self) -> np.dtype[Any]:
        """Data type of genomes."""

    @property
    def lower_bounds(self) -> npt.NDArray[Any]:
        """``(d,)`` least value of each gene."""

    @property
    def upper_bounds(self) -> npt.NDArray[Any]:
        """``(d,)`` greatest value of each gene, inclusive."""

    def valid(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """``(n,)`` which genomes are valid layouts."""


class BoundedKeys(KeyDecoder):
    """One key per gene, stretched to its bounds and rounded down to a whole number where genes are integers.

    A layout that is not valid then takes random genes from its anchor until it is: half of them, up to eight times,
    then all.

    Args:
        workspace: The design problem.
    """

    def __init__(self, workspace: BoundedGenomes) -> None:
        self._workspace = workspace
        self._dtype = np.dtype(workspace.genome_dtype)
        self._whole = bool(np.issubdtype(self._dtype, np.integer))
        self._lower = np.asarray(workspace.lower_bounds, dtype=np.float64)
        self._span = np.asarray(workspace.upper_bounds, dtype=np.float64) - self._lower
        self.size = len(self._lower)

    def encode(self, genomes: npt.NDArray[Any]) -> Keys:
        """``(n, m)`` keys; of an integer gene the middle of the interval of keys that stands for it."""
        offset = np.asarray(genomes, dtype=np.float64) - self._lower
        if self._whole:
            return (offset + 0.5) / (self._span + 1.0)
        return offset / np.where(self._span > 0, self._span, 1.0)

    def decode(self, keys: Keys, anchors: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes of ``(n, m)`` keys, repaired with genes of ``(n, d)`` valid ``anchors``."""
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
