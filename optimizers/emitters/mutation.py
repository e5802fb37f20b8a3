"""Plain MAP-Elites: random elites, each perturbed once; and the draws other emitters share with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from ribs.emitters import EmitterBase

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["MutationEmitter", "crossed", "draw_elites", "perturbed"]

_BATCH = 1024
_ROUNDS = 40


class MutationEmitter(EmitterBase):
    """MAP-Elites as first described (Mouret & Clune, 2015): one random perturbation of each of some random elites.

    There is no climb: whether a child is any good shows only in whether the archive keeps it.

    On an empty archive ``ask`` proposes random layouts instead.

    Args:
        archive: Archive the elites are drawn from, uniformly over occupied cells.
        workspace: The design problem; must offer ``sample``, ``perturb`` and ``phases``. Where it has several phases,
            each child is perturbed in one drawn at random.
        batch_size: Layouts per ``ask``. Default 1,024, but few enough for 40 batches within ``evaluations``.
        evaluations: Planned number of evaluations, used only for the default of ``batch_size``.
        seed: Seed of this emitter's draws.
    """

    emits_valid = True

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Any,
        *,
        batch_size: int | None = None,
        evaluations: int | None = None,
        seed: int | np.random.SeedSequence | None = None,
    ) -> None:
        if batch_size is not None and batch_size < 1:
            raise ValueError(f"batch_size must be at least 1, got {batch_size}")
        super().__init__(
            archive,
            solution_dim=archive.solution_dim,
            bounds=None,
            lower_bounds=workspace.lower_bounds,
            upper_bounds=workspace.upper_bounds,
        )
        planned = _BATCH if evaluations is None else min(_BATCH, max(1, evaluations // _ROUNDS))
        self._batch_size = planned if batch_size is None else int(batch_size)
        self._workspace = workspace
        self._rng = np.random.default_rng(seed)

    @property
    def settings(self) -> dict[str, int]:
        """The settings in force, for the manifest of a run."""
        return {"batch_size": self._batch_size}

    def ask(self) -> npt.NDArray[Any]:
        """Propose ``(batch_size, d)`` valid genomes."""
        if self.archive.empty:
            return self._workspace.sample(self._batch_size, self._rng)
        parents, _ = draw_elites(self.archive, self._batch_size, self._rng)
        return perturbed(self._workspace, parents, self._rng)


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


def perturbed(workspace: Any, genomes: npt.NDArray[Any], rng: np.random.Generator) -> npt.NDArray[Any]:
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
    workspace: Any, mothers: npt.NDArray[Any], fathers: npt.NDArray[Any], rng: np.random.Generator
) -> npt.NDArray[Any]:
    """``(n, d)`` uniform crossover: each gene from either parent; the mother where that is no valid layout."""
    children = np.where(rng.random(mothers.shape) < 0.5, mothers, fathers).astype(mothers.dtype)
    return np.where(np.asarray(workspace.valid(children))[:, None], children, mothers)
