"""Algorithm 1 of the paper, "improve workspace", as a pyribs emitter that runs many climbs in lockstep."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import integers
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import AddInfo, CountingEmitter, Seed, check_batch, read_only
from optimizers.emitters.draws import draw_elites

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["Climbs", "ImproveWorkspaceEmitter"]

_BATCH = 2048
_ROUNDS = 40


class Climbs(NamedTuple):
    """Where climbs stand, one row per climb.

    Attributes:
        genomes: ``(climbs, d)`` the layout each has reached.
        scores: ``(climbs,)`` its score.
        phases: ``(climbs,)`` the phase of the workspace each is in; the number of phases once a climb has ended.
        climbing: ``(climbs,)`` bool, whether each is under way; the others wait for an elite to begin from.
    """

    genomes: npt.NDArray[Any]
    scores: npt.NDArray[np.float64]
    phases: npt.NDArray[np.int64]
    climbing: npt.NDArray[np.bool_]


class ImproveWorkspaceEmitter(CountingEmitter):
    """Hill climbs from random elites, each step to the best of a set of perturbations (Tung et al., HRI 2024).

    Algorithm 2 of the paper draws a random elite and hands it to Algorithm 1: perturb the layout, offer every
    perturbation to the archive, continue from the best one if it is strictly better, else stop. Here ``climbs`` such
    climbs take one step per ``ask``/``tell``, so that layouts are scored and archived in large batches; with
    ``climbs=1`` this is the literal algorithm. A workspace with several phases (cubes first, then obstacles) is climbed
    in one phase until nothing is better, then in the next.

    On an empty archive ``ask`` proposes random layouts instead (the initialisation of Algorithm 2).

    Args:
        archive: Archive the elites are drawn from.
        workspace: The design problem; must offer ``sample``, ``perturb`` and ``phases``.
        climbs: Climbs in lockstep. Default: as many as make batches of about 2,048 layouts, but few enough for 40
            rounds within ``evaluations`` and for ten climbs one after the other within ``iterations``.
        fanout: Perturbations per climb and step.
        iterations: Climbs to run in all; ``done`` is true after that. None: no end.
        evaluations: Planned number of evaluations, used only for the default of ``climbs``.
        initial: Random layouts proposed while the archive is empty.
        seed: Seed of this emitter's draws: elites, perturbations, random layouts.

    Attributes:
        climbs: Climbs in lockstep.
        fanout: Perturbations per climb and step.
        started: Climbs begun so far.
        finished: Climbs that have ended so far.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        climbs: int | None = None,
        fanout: int = 24,
        iterations: int | None = None,
        evaluations: int | None = None,
        initial: int = 1000,
        seed: Seed = None,
    ) -> None:
        integers(1, MOST_GENOMES, climbs=climbs, fanout=fanout, initial=initial)
        super().__init__(archive, workspace, iterations=iterations, seed=seed)
        self.climbs = int(climbs) if climbs is not None else _default_climbs(fanout, evaluations, iterations)
        self.fanout = int(fanout)
        check_batch(self.climbs * self.fanout, int(archive.solution_dim))
        self.started = 0
        self._initial = int(initial)
        # One row per climb, see Climbs.
        self._genomes = self._blank_genomes(self.climbs)
        self._scores = np.zeros(self.climbs)
        self._phase = np.zeros(self.climbs, dtype=np.int64)
        self._climbing = np.zeros(self.climbs, dtype=bool)
        self._asked: npt.NDArray[np.int64] | None = None

    @property
    def state(self) -> Climbs:
        """Where every climb stands now; a copy."""
        return Climbs(*map(read_only, (self._genomes, self._scores, self._phase, self._climbing)))

    @property
    def settings(self) -> dict[str, int]:
        """The settings in force, defaults resolved, for the manifest of a run."""
        return {"climbs": self.climbs, "fanout": self.fanout}

    def ask(self) -> npt.NDArray[Any]:
        """Propose the next step of every climb.

        Returns:
            ``(m * fanout, d)`` valid genomes grouped by climb, ``m`` the number of climbs under way; empty when done.
        """
        if self.archive.empty:
            self._asked = None
            return self._workspace.sample(self._initial, self._rng)
        self._begin_climbs()
        self._asked = np.flatnonzero(self._climbing)
        children = np.empty((len(self._asked), self.fanout, self._genomes.shape[1]), dtype=self._genomes.dtype)
        for phase in range(int(self._workspace.phases)):
            members = self._phase[self._asked] == phase
            if members.any():
                parents = self._genomes[self._asked[members]]
                proposed = self._workspace.perturb(parents, self.fanout, self._rng, phase=phase)
                children[members] = proposed.reshape(len(parents), self.fanout, -1)
        return children.reshape(-1, self._genomes.shape[1])

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Move every climb to its best strictly better perturbation, into its next phase, or to its end."""
        rows = self._asked
        if rows is None or not rows.size:
            return
        scores = np.asarray(objective, dtype=np.float64).reshape(len(rows), self.fanout)
        scores = np.where(np.isnan(scores), -np.inf, scores)
        children = np.asarray(solution).reshape(len(rows), self.fanout, -1)
        each = np.arange(len(rows))
        best = scores.argmax(axis=1)
        better = scores[each, best] > self._scores[rows]
        self._genomes[rows[better]] = children[each, best][better]
        self._scores[rows[better]] = scores[each, best][better]
        stuck = rows[~better]
        self._phase[stuck] += 1
        over = stuck[self._phase[stuck] >= self._workspace.phases]
        self._climbing[over] = False
        self.finished += len(over)

    def _begin_climbs(self) -> None:
        """Give every idle climb a random elite, as far as ``iterations`` allows."""
        idle = np.flatnonzero(~self._climbing)
        if self._limit is not None:
            idle = idle[: self._limit - self.started]
        if not idle.size:
            return
        self._genomes[idle], self._scores[idle] = draw_elites(self.archive, len(idle), self._rng)
        self._phase[idle] = 0
        self._climbing[idle] = True
        self.started += len(idle)


def _default_climbs(fanout: int, evaluations: int | None, iterations: int | None) -> int:
    """Climbs for batches of about ``_BATCH``, but few enough for each to make ``_ROUNDS`` steps within the budget."""
    climbs = _BATCH // fanout
    if evaluations is not None:
        climbs = min(climbs, evaluations // (_ROUNDS * fanout))
    if iterations is not None:
        climbs = min(climbs, iterations // 10)
    return max(1, climbs)
