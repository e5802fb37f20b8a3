"""Climbing gradients of score and measures (DQD): pyribs' gradient arborescence on workspaces that have them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
import numpy.typing as npt
from ribs.emitters import GradientArborescenceEmitter as RibsGradientArborescenceEmitter

from legible_envs.support.validation import integers, real
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.adapter import FloatArchiveView, GenomeAdapter
from optimizers.emitters.base import Seed, seed_sequence

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["DifferentiableWorkspace", "GradientArborescenceEmitter"]


class DifferentiableWorkspace(Protocol):
    """What a :class:`~legible_envs.workspace.Workspace` offers beyond its contract to be climbed by gradients."""

    @property
    def lower_bounds(self) -> npt.NDArray[Any]:
        """``(d,)`` least value of each gene."""

    @property
    def upper_bounds(self) -> npt.NDArray[Any]:
        """``(d,)`` greatest value of each gene."""

    def gradients(self, genomes: npt.NDArray[Any], objective: str) -> npt.NDArray[np.float64]:
        """``(n, 1 + measures, d)`` gradients of the objective, then of each measure, at ``(n, d)`` genomes."""


class GradientArborescenceEmitter(GenomeAdapter):
    """CMA-MEGA: branches along gradients of score and measures, whose lengths an evolution strategy adapts.

    Differentiable quality diversity (Fontaine & Nikolaidis, 2021), by pyribs' ``GradientArborescenceEmitter``: from a
    point it proposes steps that are random combinations of the gradients there, moves the point toward those that the
    archive took, and begins at a random elite anew when it took none. The point itself is the first of every batch.

    The workspace must offer ``gradients(genomes, objective) -> (n, 1 + measures, d)``, such as
    ``TabletopWorkspace(condition="placement", second_measure="mean x")``. Its gradients need not know of rules or of a
    distance cap: the archive takes no layout that is not allowed, and the point does not follow it.

    Args:
        archive: Archive of the search; genomes must be real numbers.
        workspace: The design problem; must offer ``gradients``, ``sample`` and ``valid``.
        objective: Whose gradient is climbed; name the one the search maximises.
        sigma0: First standard deviation of the lengths of steps along unit gradients, in units of the genome.
        lr: Learning rate of the point (Adam), in units of the genome.
        batch_size: Proposals besides the point.
        initial: Random layouts proposed while the archive is empty.
        seed: Seed of this emitter's draws.

    Raises:
        ValueError: The workspace has no gradients, or another argument is out of range.
        ImportError: A package that the workspace computes gradients with is missing.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        objective: str = "legibility",
        sigma0: float = 0.02,
        lr: float = 0.02,
        batch_size: int = 35,
        initial: int = 1000,
        seed: Seed = None,
    ) -> None:
        if not callable(getattr(workspace, "gradients", None)):
            raise ValueError(
                f"{type(workspace).__name__} offers no gradients(genomes, objective); "
                "a table does: TabletopWorkspace(condition='placement', second_measure='mean x')"
            )
        if not np.issubdtype(workspace.genome_dtype, np.floating):
            raise ValueError(
                f"gradients need genomes of real numbers, those of the workspace are {workspace.genome_dtype}"
            )
        real("sigma0", sigma0, 0, closed="neither")
        real("lr", lr, 0, closed="neither")
        integers(1, MOST_GENOMES, batch_size=batch_size, initial=initial)
        # Whether there are gradients, and of this objective, shows before anything is scored.
        differentiable = cast("DifferentiableWorkspace", workspace)
        differentiable.gradients(np.empty((0, archive.solution_dim)), objective)
        own, seeds = seed_sequence(seed).spawn(2)
        tree = _Tree(archive, differentiable, objective, float(sigma0), float(lr), int(batch_size), seeds)
        super().__init__(archive, workspace, tree, name="gradient-arborescence", seed=own, initial=initial)


class _Tree:
    """pyribs' emitter, begun at an elite once there is one, and told of gradients before it proposes."""

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: DifferentiableWorkspace,
        objective: str,
        sigma0: float,
        lr: float,
        batch_size: int,
        seed: np.random.SeedSequence,
    ) -> None:
        self.settings: dict[str, Any] = {"objective": objective, "sigma0": sigma0, "lr": lr, "batch_size": batch_size}
        self._archive, self._workspace, self._seed = archive, workspace, seed
        self._emitter: RibsGradientArborescenceEmitter | None = None

    def ask(self) -> npt.NDArray[Any]:
        """``(1 + batch_size, d)`` the point, and steps from it; within the bounds of the genome."""
        if self._emitter is None:
            self._emitter = self._begin()
        point = self._inside(self._emitter.ask_dqd())
        gradients = np.asarray(self._workspace.gradients(point, self.settings["objective"]), dtype=np.float64)
        # Score and measures of the point are the archive's affair: pyribs' emitter looks at the gradients alone.
        self._emitter.tell_dqd(point, np.zeros(1), np.zeros((1, gradients.shape[1] - 1)), gradients, {})
        return np.concatenate([point, self._inside(self._emitter.ask())])

    def tell(self, solution: Any, objective: Any, measures: Any, add_info: dict[str, Any]) -> None:
        """Tell it of the steps; the point was not its proposal."""
        assert self._emitter is not None
        steps = {name: np.asarray(values)[1:] for name, values in add_info.items()}
        self._emitter.tell(solution[1:], objective[1:], measures[1:], steps)

    def _inside(self, points: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.clip(points, self._workspace.lower_bounds, self._workspace.upper_bounds)

    def _begin(self) -> RibsGradientArborescenceEmitter:
        view = FloatArchiveView(self._archive)
        return RibsGradientArborescenceEmitter(
            view,
            x0=view.sample_elites(1)["solution"][0],
            sigma0=self.settings["sigma0"],
            lr=self.settings["lr"],
            batch_size=self.settings["batch_size"],
            seed=self._seed,
        )
