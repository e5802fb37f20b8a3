"""What a designer sees: the layout as numbers that line up with the edits, or as a grid; and how the design stands."""

from __future__ import annotations

from typing import Any, Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from legible_envs.design_game.edits import MOST_VALUES
from legible_envs.workspace import Workspace

__all__ = ["GenomeFeatures", "GridWorkspace", "grid_planes", "grid_space", "standing"]

Floats = npt.NDArray[np.float32]

FAR: Final = 10.0
"""Standard deviations of random layouts that count as 1; no archive keeps what lies that far below their mean."""


@runtime_checkable
class GridWorkspace(Protocol):
    """What a :class:`.Workspace` offers beyond its contract so that its layouts are seen as grids."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of every layout."""

    @property
    def num_cell_codes(self) -> int:
        """How many codes there are: cells hold 0 to one less than that."""

    def cells(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.integer[Any]]:
        """``(n, H, W)`` what stands on each cell of ``(n, d)`` valid genomes, as a code."""


class GenomeFeatures:
    """Genomes as numbers in [0, 1] for a small network: one-hot where a gene is a choice, else scaled.

    Whole-numbered genes say *which* place, so that their size means little: each is one number per value, 1 for the
    value it has, in the order of :class:`.Edits`. A gene of two values is one number, 0 or 1. A gene of real numbers
    (or of more than 1,024 whole ones) is one number, its share of the way between its bounds. Genes whose bounds are
    equal are left out.

    Args:
        workspace: The design problem.

    Attributes:
        size: Numbers of one layout.
    """

    def __init__(self, workspace: Workspace) -> None:
        lower = np.asarray(workspace.lower_bounds, dtype=np.float64)
        span = np.asarray(workspace.upper_bounds, dtype=np.float64) - lower
        whole = np.issubdtype(np.dtype(workspace.genome_dtype), np.integer)
        chosen = (span >= 2) & (span < MOST_VALUES) if whole else np.zeros(len(span), dtype=np.bool_)
        self._scaled = np.flatnonzero((span > 0) & ~chosen)
        self._chosen = np.flatnonzero(chosen)
        counts = (span[self._chosen] + 1).astype(np.int64)
        self._lower, self._span = lower, span
        self._first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        self.size = int(self._first[-1]) + len(self._scaled)

    def __call__(self, genomes: npt.NDArray[Any]) -> Floats:
        """``(n, size)`` float32: the choices, then the scaled genes."""
        features = np.zeros((len(genomes), self.size), dtype=np.float32)
        offsets = np.asarray(genomes, dtype=np.float64) - self._lower
        places = self._first[:-1] + offsets[:, self._chosen].astype(np.int64)
        np.put_along_axis(features, places, 1.0, axis=1)
        features[:, self._first[-1] :] = offsets[:, self._scaled] / self._span[self._scaled]
        return features


def standing(left: float, score: float, scale: tuple[float, float]) -> Floats:
    """``(2,)`` the share of edits left, and the objective in tens of standard deviations of random layouts, clipped."""
    mean, spread = scale
    return np.array([left, min(max((score - mean) / (FAR * spread), -1.0), 1.0)], dtype=np.float32)


def grid_planes(workspace: GridWorkspace, genome: npt.NDArray[Any], stands: Floats) -> Floats:
    """``(H, W, codes + 2)`` float32: a plane per cell code, then :func:`standing` on every cell."""
    cells = np.asarray(workspace.cells(genome[None])[0])
    planes = np.empty((*cells.shape, workspace.num_cell_codes + 2), dtype=np.float32)
    planes[..., :-2] = cells[..., None] == np.arange(workspace.num_cell_codes)
    planes[..., -2:] = stands
    return planes


def grid_space(workspace: GridWorkspace) -> spaces.Box:
    """Space of :func:`grid_planes`."""
    low = np.zeros((*workspace.shape, workspace.num_cell_codes + 2), dtype=np.float32)
    low[..., -1] = -1.0
    return spaces.Box(low, np.ones_like(low), dtype=np.float32)
