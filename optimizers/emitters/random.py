"""Random layouts: the baseline every other emitter must beat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from legible_envs.support.validation import integers
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import Seed, WorkspaceEmitter

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["RandomWorkspaceEmitter"]


class RandomWorkspaceEmitter(WorkspaceEmitter):
    """Valid layouts drawn independently from the workspace's own distribution.

    Args:
        archive: Archive of the search; only its genome size and type matter.
        workspace: The design problem; must offer ``sample``.
        batch_size: Layouts per ``ask``.
        seed: Seed of the draws.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        batch_size: int = 1024,
        seed: Seed = None,
    ) -> None:
        integers(1, MOST_GENOMES, batch_size=batch_size)
        super().__init__(archive, workspace, seed=seed)
        self._batch_size = int(batch_size)

    @property
    def settings(self) -> dict[str, int]:
        """The settings in force, for the manifest of a run."""
        return {"batch_size": self._batch_size}

    def ask(self) -> npt.NDArray[Any]:
        """Propose ``(batch_size, d)`` random valid genomes."""
        return self._workspace.sample(self._batch_size, self._rng)
