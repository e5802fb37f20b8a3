"""The random draws that emitters share: elites of an archive, perturbed children, crossed parents."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from legible_envs.workspace import Workspace

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["crossed", "draw_elites", "perturbed"]


def draw_elites(
    archive: ArchiveBase, n: int, rng: np.random.Generator, *, replace: bool = True
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64]]:
    """Draw elites uniformly over occupied cells.

    They are numbered by cell index, not by arrival: the draw depends on what the archive holds alone.

    Args:
        archive: Not empty.
        n: How many.
        rng: Source of randomness.
        replace: Whether an elite may be drawn again; if not, at most as many come back as there are.

    Returns:
        ``(n, d)`` genomes and ``(n,)`` scores.
    """
    elites = archive.data(["index", "solution", "objective"])
    order = np.argsort(elites["index"])
    if replace:
        drawn = order[rng.integers(len(order), size=n)]
    else:
        drawn = rng.permutation(order)[:n]
    return elites["solution"][drawn], elites["objective"][drawn]


def perturbed(workspace: Workspace, genomes: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[Any]:
    """``(n, d)`` one valid child of each of ``(n, d)`` valid genomes, each in a phase drawn at random."""
    if not len(genomes):
        return genomes
    phases = int(workspace.phases)
    if phases == 1:
        return workspace.perturb(genomes, 1, rng)
    drawn = rng.integers(phases, size=len(genomes))
    children = np.empty_like(genomes)
    for phase in range(phases):
        members = drawn == phase
        if members.any():
            children[members] = workspace.perturb(genomes[members], 1, rng, phase=phase)
    return children


def crossed(
    workspace: Workspace, mothers: npt.NDArray[Any], fathers: npt.NDArray[Any], rng: np.random.Generator
) -> npt.NDArray[Any]:
    """``(n, d)`` uniform crossover: each gene from either parent; the mother where that is no valid layout."""
    children = np.where(rng.random(mothers.shape) < 0.5, mothers, fathers).astype(mothers.dtype)
    return np.where(np.asarray(workspace.valid(children))[:, None], children, mothers)
