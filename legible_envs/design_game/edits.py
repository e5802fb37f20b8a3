"""What one edit of a layout can be: all of them numbered, for genomes of any workspace, with exact masks."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import integer
from legible_envs.workspace import Workspace

__all__ = ["KEEP", "Edits"]

KEEP: Final = 0
"""The edit that leaves the layout as it is."""

MOST_VALUES: Final = 1024
"""A gene of whole numbers with more values than this is edited in levels, like one of real numbers."""

_SET: Final = 1
_TOGGLE: Final = 2
_SWAP: Final = 3

_BATCH: Final = 2**23
"""Genes of candidates that are checked in one call: 8 MB of small integers."""

Genomes = npt.NDArray[Any]
Allowed = Callable[[Genomes], npt.NDArray[np.bool_]]


class Edits:
    """The single edits of layouts of a workspace, all numbered.

    They come in this order:

    1. one that keeps the layout (:data:`KEEP`),
    2. for each gene, one for each value it can be set to; a gene of two whole values, such as the bit of an obstacle,
       has a single one, which gives it its other value,
    3. for every two genes of whole numbers with the same bounds and more than two values, such as the places of two
       stations, one that swaps their values.

    A gene of real numbers is set to one of ``levels`` evenly spaced values between its bounds. Genes whose bounds are
    equal are left alone. An edit may lead to no valid layout, or change nothing: :meth:`masks` tells those that do
    something valid, and never forbids to keep the layout.

    Args:
        workspace: The design problem; its bounds and the type of its genomes are all that is looked at.
        levels: Values that a gene of real numbers can be set to, at least 2.

    Attributes:
        size: Number of edits, ``A``.
        genes: ``(A,)`` the gene that is edited; -1 for none, the first of two that are swapped.
        partners: ``(A,)`` the other gene of a swap; -1 elsewhere.
        values: ``(A,)`` the value that is set; NaN where none is: for toggles, swaps and the edit that keeps all.

    Raises:
        ValueError: ``levels`` is no whole number >= 2.

    Example:
        >>> from legible_envs.overcooked import OvercookedWorkspace
        >>> ws = OvercookedWorkspace(shape=(5, 5))
        >>> edits = Edits(ws)  # 7 stations on 12 places, 9 obstacles, 21 pairs of stations
        >>> edits.size == 1 + 7 * 12 + 9 + 21
        True
        >>> masks = edits.masks(ws.sample(4, np.random.default_rng(0)), ws.valid)
        >>> masks.shape, masks[:, KEEP].all()
        ((4, 115), np.True_)
    """

    def __init__(self, workspace: Workspace, levels: int = 15) -> None:
        integer("levels", levels, 2, MOST_VALUES)
        self._dtype = np.dtype(workspace.genome_dtype)
        self._lower = np.asarray(workspace.lower_bounds, dtype=np.float64)
        self._upper = np.asarray(workspace.upper_bounds, dtype=np.float64)
        self.is_whole = bool(np.issubdtype(self._dtype, np.integer))
        choices = [self._choices(gene, int(levels)) for gene in range(len(self._lower))]
        rows = [(-1, -1, np.nan)]
        for gene, values in enumerate(choices):
            is_toggle = self.is_whole and len(values) == 2
            rows += [(gene, -1, np.nan)] if is_toggle else [(gene, -1, value) for value in values if len(values) > 1]
        rows += [(i, j, np.nan) for i, j in self._pairs(choices)]
        self.genes = np.array([row[0] for row in rows], dtype=np.int64)
        self.partners = np.array([row[1] for row in rows], dtype=np.int64)
        self.values = np.array([row[2] for row in rows], dtype=np.float64)
        self.size = len(rows)
        self._kinds = np.where(self.partners >= 0, _SWAP, np.where(np.isnan(self.values), _TOGGLE, _SET))
        self._kinds[KEEP] = KEEP
        self._sets, self._toggles, self._swaps = (
            np.flatnonzero(self._kinds == kind) for kind in (_SET, _TOGGLE, _SWAP)
        )
        # A gene of two values has the other one when it has their sum less the one it has.
        self._ends = (self._lower + self._upper).astype(self._dtype)

    def _choices(self, gene: int, levels: int) -> list[float]:
        """The values that a gene can be set to."""
        low, high = float(self._lower[gene]), float(self._upper[gene])
        if low == high:
            return [low]
        if self.is_whole and high - low < MOST_VALUES:
            return [low + i for i in range(int(high - low) + 1)]
        spaced = np.linspace(low, high, levels)
        return list(dict.fromkeys((np.rint(spaced) if self.is_whole else spaced).tolist()))

    def _pairs(self, choices: list[list[float]]) -> list[tuple[int, int]]:
        """Genes whose values may be swapped."""
        if not self.is_whole:
            return []
        wide = [gene for gene, values in enumerate(choices) if len(values) > 2]
        return [(i, j) for i, j in itertools.combinations(wide, 2) if choices[i] == choices[j]]

    # -- doing them ----------------------------------------------------------------------------------------------------

    def apply(self, genomes: Genomes, actions: npt.NDArray[np.int64]) -> Genomes:
        """``(n, d)`` what ``(n,)`` edits make of ``(n, d)`` genomes, valid or not; one edit for each."""
        actions = np.asarray(actions)
        edited, genes, partners = np.array(genomes, dtype=self._dtype), self.genes[actions], self.partners[actions]
        kinds = self._kinds[actions]
        rows = np.flatnonzero(kinds == _SET)
        edited[rows, genes[rows]] = self.values[actions[rows]]
        rows = np.flatnonzero(kinds == _TOGGLE)
        edited[rows, genes[rows]] = self._ends[genes[rows]] - edited[rows, genes[rows]]
        rows = np.flatnonzero(kinds == _SWAP)
        edited[rows, genes[rows]] = genomes[rows, partners[rows]]
        edited[rows, partners[rows]] = genomes[rows, genes[rows]]
        return edited

    def candidates(self, genomes: Genomes) -> Genomes:
        """``(n, A, d)`` what every edit makes of each of ``(n, d)`` genomes, valid or not."""
        genomes = np.asarray(genomes, dtype=self._dtype)
        edited = np.repeat(genomes[:, None], self.size, axis=1)
        edited[:, self._sets, self.genes[self._sets]] = self.values[self._sets]
        genes = self.genes[self._toggles]
        edited[:, self._toggles, genes] = self._ends[genes] - genomes[:, genes]
        first, second = self.genes[self._swaps], self.partners[self._swaps]
        edited[:, self._swaps, first] = genomes[:, second]
        edited[:, self._swaps, second] = genomes[:, first]
        return edited

    def masks(self, genomes: Genomes, allowed: Allowed) -> npt.NDArray[np.bool_]:
        """``(n, A)`` edits that lead to another layout, and a valid one; the edit that keeps the layout always.

        All edits of all genomes are checked in one call of ``allowed``, or in a few where they are very many.

        Args:
            genomes: ``(n, d)`` valid ones.
            allowed: Which of ``(m, d)`` genomes are allowed: :meth:`.Workspace.valid`, or less than that.
        """
        masks = np.empty((len(genomes), self.size), dtype=np.bool_)
        step = max(1, _BATCH // (self.size * max(1, len(self._lower))))
        for start in range(0, len(genomes), step):
            part = genomes[start : start + step]
            edited = self.candidates(part)
            good = np.asarray(allowed(edited.reshape(-1, edited.shape[-1])), dtype=np.bool_)
            masks[start : start + step] = good.reshape(len(part), self.size) & (edited != part[:, None]).any(axis=-1)
        masks[:, KEEP] = True
        return masks

    def describe(self, action: int) -> str:
        """An edit in words: which gene, and what becomes of it."""
        gene, partner, value = int(self.genes[action]), int(self.partners[action]), float(self.values[action])
        if gene < 0:
            return "keep the layout"
        if partner >= 0:
            return f"swap genes {gene} and {partner}"
        return f"toggle gene {gene}" if np.isnan(value) else f"set gene {gene} to {value:g}"
