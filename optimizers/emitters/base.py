"""What emitters of this package have in common: a workspace, bounds, a random generator, and a budget of iterations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from ribs.emitters import EmitterBase

from legible_envs.support.validation import integers
from legible_envs.workspace import MOST_GENOMES, MOST_NUMBERS, Workspace

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["AddInfo", "CountingEmitter", "Seed", "WorkspaceEmitter", "check_batch", "read_only", "seed_sequence"]

Seed = int | np.random.SeedSequence | None
AddInfo = dict[str, npt.NDArray[Any]]


class WorkspaceEmitter(EmitterBase):
    """An emitter that knows the design problem; subclasses implement :meth:`ask`, and :meth:`tell` if they learn.

    Subclasses find the workspace in ``self._workspace`` and draw everything random from ``self._rng``; the archive and
    the bounds of genomes are pyribs' ``archive``, ``lower_bounds`` and ``upper_bounds``. A subclass whose proposals
    are sometimes invalid sets ``emits_valid = False``: the search then leaves the invalid ones out.

    Args:
        archive: Archive of the search; gives the size and type of genomes.
        workspace: The design problem.
        seed: Seed of everything random.

    Attributes:
        emits_valid: Whether every proposal is a valid genome of the workspace's type.
    """

    emits_valid = True

    def __init__(self, archive: ArchiveBase, workspace: Workspace, *, seed: Seed = None) -> None:
        super().__init__(
            archive,
            solution_dim=archive.solution_dim,
            bounds=None,
            lower_bounds=workspace.lower_bounds,
            upper_bounds=workspace.upper_bounds,
        )
        self._workspace = workspace
        self._rng = np.random.default_rng(seed)

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Learn from the results of the last :meth:`ask`; does nothing unless a subclass does.

        Args:
            solution: ``(n, d)`` what ``ask`` proposed, in that order.
            objective: ``(n,)`` scores, NaN where a layout is not allowed.
            measures: ``(n, k)`` measures; meaningless where the score is NaN.
            add_info: ``status`` and ``value`` of each, ``(n,)``, as the archive's ``add`` returned them.
            **fields: Further fields of the archive, ``(n, ...)`` each.
        """

    def _blank_genomes(self, n: int = 0) -> npt.NDArray[Any]:
        """``(n, d)`` zeros of the type of genomes: a population before it begins.

        Raises:
            ValueError: More than a million, or more than 2**27 numbers.
        """
        check_batch(n, int(self.solution_dim))
        return np.zeros((n, int(self.solution_dim)), dtype=self.archive.dtypes["solution"])


class CountingEmitter(WorkspaceEmitter):
    """A :class:`WorkspaceEmitter` with iterations of its own (climbs, generations) that ends after a number of them.

    Args:
        archive: Archive of the search.
        workspace: The design problem.
        iterations: Iterations to run in all; ``done`` is true after that. None: no end.
        seed: Seed of everything random.

    Attributes:
        finished: Iterations that have ended so far; subclasses count them up in :meth:`tell`.

    Raises:
        ValueError: ``iterations`` is negative.
    """

    def __init__(
        self, archive: ArchiveBase, workspace: Workspace, *, iterations: int | None = None, seed: Seed = None
    ) -> None:
        integers(0, iterations=iterations)
        super().__init__(archive, workspace, seed=seed)
        self.finished = 0
        self._limit = iterations

    @property
    def done(self) -> bool:
        """Whether all ``iterations`` have ended."""
        return self._limit is not None and self.finished >= self._limit


def check_batch(rows: int, size: int) -> None:
    """Refuse settings with which one batch of an emitter would be larger than workspaces draw.

    Args:
        rows: Genomes of a batch.
        size: Numbers in a genome.

    Raises:
        ValueError: They are too many.
    """
    if rows > (most := min(MOST_GENOMES, MOST_NUMBERS // max(1, size))):
        raise ValueError(
            f"these settings make batches of {rows:,} layouts; expected at most {most:,} of {size} numbers"
        )


def seed_sequence(seed: Seed) -> np.random.SeedSequence:
    """A seed as a sequence, to spawn others from."""
    return seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)


def read_only(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """A copy that cannot be written to."""
    copy = values.copy()
    copy.setflags(write=False)
    return copy
