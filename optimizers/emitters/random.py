"""Random layouts: the baseline every other emitter must beat."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from ribs.emitters import EmitterBase

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["RandomWorkspaceEmitter"]


class RandomWorkspaceEmitter(EmitterBase):
    """Valid layouts drawn independently from the workspace's own distribution.

    Args:
        archive: Archive of the search; only its genome size and type matter.
        workspace: The design problem; must offer ``sample``.
        batch_size: Layouts per ``ask``.
        seed: Seed of the draws.
    """

    emits_valid = True

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Any,
        *,
        batch_size: int = 1024,
        seed: int | np.random.SeedSequence | None = None,
    ) -> None:
        if batch_size < 1:
            raise ValueError(f"batch_size must be at least 1, got {batch_size}")
        super().__init__(
            archive,
            solution_dim=archive.solution_dim,
            bounds=None,
            lower_bounds=workspace.lower_bounds,
            upper_bounds=workspace.upper_bounds,
        )
        self._workspace = workspace
        self._batch_size = int(batch_size)
        self._rng = np.random.default_rng(seed)

    @property
    def settings(self) -> dict[str, int]:
        """The settings in force, for the manifest of a run."""
        return {"batch_size": self._batch_size}

    def ask(self) -> npt.NDArray[Any]:
        """Propose ``(batch_size, d)`` random valid genomes."""
        return self._workspace.sample(self._batch_size, self._rng)
