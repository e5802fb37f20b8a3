"""Population annealing in cycles: our own emitter, made to find better layouts than climbs do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import integers, real
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import AddInfo, Seed, WorkspaceEmitter, read_only
from optimizers.emitters.draws import draw_elites, perturbed

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["AnnealingEmitter", "Chains"]

_CALIBRATION = 1000
_PER_GENE_PAIR = 16
_STEPS = 600
_CHAINS = 16
_GROUPS = 8
Array = npt.NDArray[np.float64]


class Chains(NamedTuple):
    """Where annealed chains stand, group by group.

    Attributes:
        genomes: ``(groups, chains, d)`` the layout each has reached.
        scores: ``(groups, chains)`` its score.
        temperature: The temperature at which each accepts or rejects its next step, in the unit of the objective.
    """

    genomes: npt.NDArray[Any]
    scores: Array
    temperature: float


class AnnealingEmitter(WorkspaceEmitter):
    """Population annealing from random elites: chains that cool together and are replaced by better ones, in cycles.

    A climb that only ever accepts better layouts ends where every single change is for the worse, and most changes to a
    good kitchen are: a wall has to open before it can close elsewhere. An annealed chain (Kirkpatrick et al., 1983)
    makes one random change at a time and accepts a loss ``d`` with probability ``exp(-d / temperature)``; as it cools
    it settles in ever deeper valleys. One evaluation buys one step, where a climb pays for a whole fan of perturbations
    to take one. The archive gets every layout on the path, so that hot chains explore it and cold ones
    refine it. ``resamplings`` times a cycle, chains are drawn anew among themselves in proportion to how much the lower
    temperature favours where they stand (Hukushima & Iba, 2003; here by systematic resampling): those in hopeless
    valleys give their evaluations to those in promising ones.

    ``chains`` of them start from random elites, every archive cell equally likely, and cool together over ``cycle``
    evaluations; then others start. Several such groups run side by side and know nothing of one another: each may end
    in another valley, and batches are larger. The temperature falls linearly from ``heat`` to ``heat * cold`` times the
    typical change of score: the median absolute difference between a layout and its perturbation, taken over the first
    thousand that differ. The emitter thus knows nothing of the unit of the objective.

    Measured with ``prefix="sum"``, mean best score (standard deviation) against that of ``"improve"``, over the same
    seeds: at 200,000 evaluations 176.6 (5.4) against 163.0 (3.9) on 9x9 (ten seeds, p = 2e-4) and 55.2 (2.5) against
    53.2 (4.0) on 5x9 (sixty seeds, p = 3e-3); at a million 183.5 (4.7) against 169.8 (4.9) on 9x9. Drawing chains anew
    matters on 9x9: one cycle of 50,000 evaluations ends at 173.5 (5.8), without it at 163.1 (7.7). Chains refine
    more than they spread: ``"mutation"`` and ``"nslc"`` fill the archive further, to a higher QD score.

    Args:
        archive: Archive of the search.
        workspace: The design problem; must offer ``sample``, ``perturb`` and ``phases``. Where it has several phases,
            each step is made in one drawn at random.
        chains: Chains of a group. Default one for each 600 evaluations of a cycle, 4 to 16.
        cycle: Evaluations of a group from hot to cold. Default 16 for each pair of genes (50,000 in a 9x9 kitchen), or
            what makes whole cycles of at least that within ``evaluations`` (a smaller budget is one cycle).
        groups: Groups side by side. Default as many as there are cycles within ``evaluations``, at most 8.
        resamplings: How often in a cycle chains are drawn anew; 0 leaves plain simulated annealing.
        heat: First temperature, in typical changes of score.
        cold: Last temperature, as a share of the first.
        evaluations: Planned number of evaluations, used only for the defaults of ``cycle`` and ``groups``.
        initial: Random layouts that come first: they are proposed while the archive is empty, and taken to be part of
            ``evaluations``.
        seed: Seed of this emitter's draws.

    Attributes:
        chains: Chains of a group.
        cycle: Evaluations of a group from hot to cold.
        groups: Groups side by side.
        cycles: Cycles begun so far, those side by side as one.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        chains: int | None = None,
        cycle: int | None = None,
        groups: int | None = None,
        resamplings: int = 30,
        heat: float = 0.35,
        cold: float = 0.03,
        evaluations: int | None = None,
        initial: int = 1000,
        seed: Seed = None,
    ) -> None:
        integers(1, MOST_GENOMES, chains=chains, groups=groups, initial=initial)
        integers(1, cycle=cycle)
        integers(0, resamplings=resamplings)
        real("heat", heat, 0, closed="neither")
        real("cold", cold, 0, 1, closed="right")
        super().__init__(archive, workspace, seed=seed)
        size = int(archive.solution_dim)
        planned_cycle, planned_groups = _plan(evaluations, int(initial), size)
        self.cycle = planned_cycle if cycle is None else int(cycle)
        self.groups = planned_groups if groups is None else int(groups)
        self.chains = max(4, min(_CHAINS, self.cycle // _STEPS)) if chains is None else int(chains)
        self.cycles = 0
        self._heat, self._cold, self._resamplings = float(heat), float(cold), int(resamplings)
        self._initial = int(initial)
        # One row per chain, group by group: where it stands and what that scores.
        self._genomes = self._blank_genomes(self.groups * self.chains)
        self._scores: Array = np.zeros(self.groups * self.chains)
        self._steps = max(1, self.cycle // self.chains)
        self._step = 0
        self._every = max(1, self._steps // resamplings) if resamplings else self._steps
        self._changes: Array = np.zeros(0)
        self._asked = False

    @property
    def settings(self) -> dict[str, float]:
        """The settings in force, defaults resolved, for the manifest of a run."""
        return {
            "chains": self.chains,
            "cycle": self.cycle,
            "groups": self.groups,
            "resamplings": self._resamplings,
            "heat": self._heat,
            "cold": self._cold,
        }

    @property
    def state(self) -> Chains:
        """Where every chain stands now; a copy."""
        shape = self.groups, self.chains
        return Chains(
            read_only(self._genomes.reshape(*shape, -1)), read_only(self._scores.reshape(shape)), self.temperature
        )

    @property
    def temperature(self) -> float:
        """The temperature now, in the unit of the objective; infinite before any change of score was seen."""
        return self._temperature(self._step)

    def _temperature(self, step: int) -> float:
        if not self._changes.size:
            return np.inf
        share = step / self._steps
        return self._heat * float(np.median(self._changes)) * (1.0 - share * (1.0 - self._cold))

    def ask(self) -> npt.NDArray[Any]:
        """Propose the next step of every chain: ``(groups * chains, d)`` valid genomes."""
        self._asked = not self.archive.empty
        if not self._asked:
            return self._workspace.sample(self._initial, self._rng)
        if self._step == 0:
            self._genomes, self._scores = draw_elites(self.archive, len(self._scores), self._rng)
            self.cycles += 1
        elif self._step % self._every == 0 and self.chains > 1:
            self._resample()
        return perturbed(self._workspace, self._genomes, self._rng)

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Let every chain accept its step or stay; no chain goes where the score is NaN."""
        if not self._asked:
            return
        scores = np.asarray(objective, dtype=np.float64)
        change = np.where(np.isnan(scores), -np.inf, scores - self._scores)
        if len(self._changes) < _CALIBRATION:
            self._changes = np.concatenate([self._changes, np.abs(change[np.isfinite(change) & (change != 0)])])
        odds = np.where(np.isinf(change), 0.0, np.exp(np.minimum(change, 0.0) / self.temperature))
        accepted = self._rng.random(len(scores)) < odds
        self._genomes[accepted] = np.asarray(solution)[accepted]
        self._scores[accepted] = scores[accepted]
        self._step = (self._step + 1) % self._steps

    def _resample(self) -> None:
        """Draw the chains of each group anew, each in proportion to how its odds changed with the temperature."""
        before, now = self._temperature(self._step - self._every), self.temperature
        scores = self._scores.reshape(self.groups, self.chains)
        weights = np.exp((scores - scores.max(axis=1, keepdims=True)) * (1.0 / now - 1.0 / before))
        ends = np.cumsum(weights, axis=1) / weights.sum(axis=1, keepdims=True)
        at = (self._rng.random((self.groups, 1)) + np.arange(self.chains)) / self.chains
        drawn = np.stack([np.searchsorted(*pair) for pair in zip(ends, at, strict=True)])
        rows = (np.minimum(drawn, self.chains - 1) + self.chains * np.arange(self.groups)[:, None]).ravel()
        self._genomes, self._scores = self._genomes[rows], self._scores[rows]


def _plan(evaluations: int | None, initial: int, genome_size: int) -> tuple[int, int]:
    """Length of a cycle, and groups side by side: whole cycles in what follows the initial layouts."""
    least = _PER_GENE_PAIR * genome_size**2
    if evaluations is None:
        return least, 1
    left = max(1, evaluations - min(initial, evaluations // 2))
    cycles = max(1, left // least)
    groups = min(_GROUPS, cycles)
    return left // (groups * (cycles // groups)), groups
