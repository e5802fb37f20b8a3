"""Layouts as vectors of real numbers in [0, 1], for optimisers that only know such vectors.

Bean's random keys (*Genetic algorithms and random keys for sequencing and optimization*, 1994): a decoder turns any
vector of keys into a valid layout. Which decoder fits a design problem, the workspace knows
(:meth:`legible_envs.workspace.Workspace.key_decoder`); optimisers use it through a
:class:`~legible_envs.key_space.KeySpace`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["BoundedGenomes", "BoundedKeys", "KeyDecoder"]

_REPAIRS = 8
_BANK_SIZE: Final = 256
_BANK_SEED: Final = 20240311
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
    def decode(
        self, keys: Keys, anchors: npt.NDArray[Any] | None = None, rng: np.random.Generator | None = None
    ) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes.

        Args:
            keys: ``(n, m)`` any finite numbers; those outside [0, 1] count as the nearer end.
            anchors: ``(n, d)`` valid genomes, one per row, which a decoder may mix in to repair a layout, drawing from
                ``rng``. None repairs without them: each row's layout then depends on its keys alone.
            rng: Source of all randomness; needed with ``anchors`` only.
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

    def sample(self, n: int, rng: np.random.Generator) -> npt.NDArray[Any]:
        """``(n, d)`` random valid genomes."""


class BoundedKeys(KeyDecoder):
    """One key per gene, stretched to its bounds and rounded down to a whole number where genes are integers.

    A layout that is not valid is repaired with genes of a valid one:

    - With an anchor, it takes random genes from it until it is valid: half of them, up to eight times, then all.
    - Without, the anchor is the nearest of 256 random layouts (drawn once, with a fixed seed), and the layout goes from
      there to where the keys point, one gene after the other, twice over; a step that would make it invalid is left
      out. So it keeps every gene of the keys that the others have room for.

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

    def decode(
        self, keys: Keys, anchors: npt.NDArray[Any] | None = None, rng: np.random.Generator | None = None
    ) -> npt.NDArray[Any]:
        """``(n, d)`` valid genomes of ``(n, m)`` keys; see the class for how they are repaired."""
        if anchors is None:
            return self._nearest(self._stretch(keys))
        if rng is None:
            raise ValueError("`rng` must be a numpy Generator where anchors are given, got None")
        genomes = self._stretch(keys)
        for last in [False] * _REPAIRS + [True]:
            wrong = self._wrong(genomes)
            if not wrong.size:
                break
            taken = rng.random((len(wrong), genomes.shape[1])) < (1.0 if last else 0.5)
            genomes[wrong] = np.where(taken, anchors[wrong], genomes[wrong])
        return genomes

    def _stretch(self, keys: Keys) -> npt.NDArray[Any]:
        """``(n, d)`` what the keys point to, valid or not."""
        keys = np.clip(keys, 0.0, 1.0)
        if self._whole:
            raw = self._lower + np.minimum(np.floor(keys * (self._span + 1.0)), self._span)
        else:
            raw = np.clip(self._lower + keys * self._span, self._lower, self._lower + self._span)
        return raw.astype(self._dtype)

    def _wrong(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.intp]:
        return np.flatnonzero(~np.asarray(self._workspace.valid(genomes), dtype=bool))

    def _nearest(self, wanted: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """``(n, d)`` the wanted genomes where they are valid, else a valid one with as many of their genes as fit."""
        genomes = wanted.copy()
        wrong = self._wrong(genomes)
        if not wrong.size:
            return genomes
        targets = wanted[wrong]
        repaired = self._bank[self._closest(targets)]
        for gene in [*range(wanted.shape[1])] * 2:
            rows = np.flatnonzero(repaired[:, gene] != targets[:, gene])
            if rows.size:
                stepped = repaired[rows]
                stepped[:, gene] = targets[rows, gene]
                allowed = np.asarray(self._workspace.valid(stepped), dtype=bool)
                repaired[rows[allowed], gene] = targets[rows[allowed], gene]
        genomes[wrong] = repaired
        return genomes

    @cached_property
    def _bank(self) -> npt.NDArray[Any]:
        """Valid layouts to begin repairs from, always the same."""
        return self._workspace.sample(_BANK_SIZE, np.random.default_rng(_BANK_SEED))

    def _closest(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.intp]:
        """``(n,)`` which layout of the bank has the least Euclidean distance in keys."""
        ours, theirs = self.encode(genomes), self.encode(self._bank)
        # |a - b|^2 without |a|^2, which is the same for every b
        return np.argmin((theirs**2).sum(axis=1) - 2.0 * (ours @ theirs.T), axis=1)
