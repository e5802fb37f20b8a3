"""Plain MAP-Elites: random elites, each perturbed once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from legible_envs.support.validation import integers
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import Seed, WorkspaceEmitter
from optimizers.emitters.draws import draw_elites, perturbed

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["MutationEmitter"]

_BATCH = 1024
_ROUNDS = 40


class MutationEmitter(WorkspaceEmitter):
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

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        batch_size: int | None = None,
        evaluations: int | None = None,
        seed: Seed = None,
    ) -> None:
        integers(1, MOST_GENOMES, batch_size=batch_size)
        super().__init__(archive, workspace, seed=seed)
        planned = _BATCH if evaluations is None else min(_BATCH, max(1, evaluations // _ROUNDS))
        self._batch_size = planned if batch_size is None else int(batch_size)

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
