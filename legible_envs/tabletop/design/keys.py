"""Random keys of tables: every vector of real numbers is a valid table."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.random_keys import BoundedGenomes, BoundedKeys
from legible_envs.tabletop.design.key_kernels import settle_tables
from legible_envs.tabletop.design.rules import DesignRules

__all__ = ["TableKeys"]

STEP: Final = 0.005
REACH: Final = 0.15
COARSE: Final = 0.02
TURNS: Final = (0.0, np.pi / 4, -np.pi / 4, np.pi / 2)
PER_RADIAN: Final = 0.05
Floats = npt.NDArray[np.float64]


class TableKeys(BoundedKeys):
    """One key per gene of a table, stretched to its bounds; every vector is a valid table.

    Objects take the nearest place that leaves them room, one after the other, on a grid of 5 mm around where they
    should lie; then each obstacle whose ``active`` is above one half takes the nearest valid pose within 15 cm and a
    quarter turn (steps of 2 cm and 45 degrees, where 20 degrees count as much as 1.7 cm), and is left out where there
    is none. Tables that are valid stay as they are. If objects find no room that way, all lie as in one fixed valid
    table.

    Genomes come packed: obstacles in the first places with ``active`` 1, zeros after them. In the keys of a genome an
    obstacle has ``active`` .75, and an unused place .25 and the middle of the table: a small step may lay one there.

    Args:
        workspace: The design problem.
        rules: Which tables are valid.
    """

    def __init__(self, workspace: BoundedGenomes, rules: DesignRules) -> None:
        super().__init__(workspace)
        self._rules = rules

    def encode(self, genomes: npt.NDArray[Any]) -> Floats:
        """``(n, m)`` keys of valid genomes."""
        keys = super().encode(genomes)
        places = keys[:, 2 * len(self._rules.movable) :].reshape(len(keys), -1, 4)
        is_used = places[..., 0] > 0.5
        places[..., 0] = np.where(is_used, 0.75, 0.25)
        places[~is_used, 1:] = 0.5
        return keys

    def decode(
        self, keys: Floats, anchors: npt.NDArray[Any] | None = None, rng: np.random.Generator | None = None
    ) -> Floats:
        """``(n, d)`` valid genomes of ``(n, m)`` keys; neither ``anchors`` nor ``rng`` is needed."""
        wanted = self._stretch(keys)
        genomes = np.empty_like(wanted)
        settle_tables(wanted, self._rules.arrays, self._moves, _shifts(), self._anchor, genomes)
        return genomes

    @cached_property
    def _anchor(self) -> Floats:
        return self._bank[0]

    @cached_property
    def _moves(self) -> Floats:
        """``(K, 3)`` steps along x and y to anywhere in the region, and their lengths, the shortest first."""
        num_genes = 2 * len(self._rules.movable)
        spans = self._span[:num_genes].reshape(-1, 2).max(axis=0, initial=0.0)
        moves = _by_length(*(np.arange(-int(span / STEP), int(span / STEP) + 1) * STEP for span in spans))
        return np.column_stack([moves, np.hypot(*moves.T)])


def _shifts() -> Floats:
    """``(K, 3)`` steps along x and y, and turns, the smallest first."""
    steps = np.arange(-int(REACH / COARSE), int(REACH / COARSE) + 1) * COARSE
    shifts = _by_length(steps, steps, np.array(TURNS) * PER_RADIAN)
    shifts = shifts[np.hypot(shifts[:, 0], shifts[:, 1]) <= REACH]
    shifts[:, 2] /= PER_RADIAN
    return shifts


def _by_length(*axes: npt.NDArray[Any]) -> Floats:
    """``(K, len(axes))`` all combinations, the shortest vectors first."""
    vectors = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return np.ascontiguousarray(vectors[np.argsort((vectors**2).sum(axis=1), kind="stable")])
