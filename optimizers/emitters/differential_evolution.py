"""Differential evolution (Storn & Price, 1997) of random keys, as an emitter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import choice, integers, real
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import AddInfo, CountingEmitter, Seed, read_only
from optimizers.emitters.draws import draw_elites

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["STRATEGIES", "DifferentialEvolutionEmitter", "Population"]

STRATEGIES = ("best1bin", "rand1bin", "currenttobest1bin")
Array = npt.NDArray[np.float64]


class Population(NamedTuple):
    """The members of a population, one row each; row ``i`` of the next batch is the rival of member ``i``.

    Attributes:
        genomes: ``(population, d)`` their layouts.
        keys: ``(population, m)`` the random keys of these.
        scores: ``(population,)`` their scores; negative infinity where a layout was not scored yet.
    """

    genomes: npt.NDArray[Any]
    keys: Array
    scores: Array


class DifferentialEvolutionEmitter(CountingEmitter):
    """Differential evolution of vectors in [0, 1] that stand for layouts as random keys.

    Each generation offers a rival to every member of the population: a base vector plus a scaled difference of two
    others, mixed with the member gene by gene; the better of the two stays. Names, defaults and details are those of
    ``scipy.optimize.differential_evolution`` with ``updating="deferred"``: mutation dithers in [0.5, 1) once a
    generation, recombination is 0.7, at least one gene is the mutant's, genes out of bounds are drawn anew. There is no
    polishing. How vectors become layouts, the workspace says (:meth:`~legible_envs.workspace.Workspace.key_decoder`).

    The population begins as elites of the archive (drawn without replacement), and random layouts where these are too
    few; the latter are scored only through their rivals, who replace them.

    Args:
        archive: Archive of the search.
        workspace: The design problem; must offer ``sample`` and ``valid``.
        population: Members, at least 5. Default 15 per key, but few enough for 100 generations within ``evaluations``
            (20 at least).
        strategy: ``"best1bin"``, ``"rand1bin"`` or ``"currenttobest1bin"``.
        mutation: Scale of differences, or the two ends it is drawn between.
        recombination: Probability of each gene to be the mutant's.
        iterations: Generations to run in all; ``done`` is true after that. None: no end.
        evaluations: Planned number of evaluations, used only for the default of ``population``.
        seed: Seed of this emitter's draws.

    Attributes:
        finished: Generations so far.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        population: int | None = None,
        strategy: str = "best1bin",
        mutation: float | tuple[float, float] = (0.5, 1.0),
        recombination: float = 0.7,
        iterations: int | None = None,
        evaluations: int | None = None,
        seed: Seed = None,
    ) -> None:
        integers(5, MOST_GENOMES, population=population)
        choice("strategy", strategy, STRATEGIES)
        real("recombination", recombination, 0, 1)
        super().__init__(archive, workspace, iterations=iterations, seed=seed)
        self._decoder = workspace.key_decoder()
        self.population = _default_population(self._decoder.size, evaluations) if population is None else population
        self._strategy, self._recombination = strategy, float(recombination)
        low, high = (mutation, mutation) if isinstance(mutation, int | float) else mutation
        self._mutation = float(low), float(high)
        self._keys: Array = np.zeros((0, self._decoder.size))
        self._genomes = self._blank_genomes()
        self._scores: Array = np.zeros(0)
        self._trials: Array | None = None

    @property
    def state(self) -> Population:
        """The members now; a copy. Empty before the first generation."""
        return Population(read_only(self._genomes), read_only(self._keys), read_only(self._scores))

    @property
    def settings(self) -> dict[str, Any]:
        """The settings in force, defaults resolved, for the manifest of a run."""
        return {
            "population": self.population,
            "strategy": self._strategy,
            "mutation": list(self._mutation),
            "recombination": self._recombination,
        }

    def ask(self) -> npt.NDArray[Any]:
        """Propose the ``(population, d)`` layouts of one generation of rivals; empty when done."""
        self._trials = None
        if self.done:
            return self._genomes[:0]
        if self.archive.empty:
            return self._workspace.sample(self.population, self._rng)
        if not len(self._keys):
            self._begin()
        self._trials = self._rivals()
        return self._decoder.decode(self._trials, self._genomes, self._rng)

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Put every rival that is at least as good in the place of its member; a rival without a score loses."""
        if self._trials is None:
            return
        scores = np.asarray(objective, dtype=np.float64)
        wins = scores >= self._scores
        self._keys[wins] = self._trials[wins]
        self._genomes[wins] = np.asarray(solution)[wins]
        self._scores[wins] = scores[wins]
        self.finished += 1

    def _begin(self) -> None:
        """Draw the first population."""
        genomes, scores = draw_elites(self.archive, self.population, self._rng, replace=False)
        missing = self.population - len(genomes)
        if missing:
            genomes = np.concatenate([genomes, self._workspace.sample(missing, self._rng)])
            scores = np.concatenate([scores, np.full(missing, -np.inf)])
        self._genomes, self._scores = genomes, np.asarray(scores, dtype=np.float64)
        self._keys = self._decoder.encode(genomes)

    def _rivals(self) -> Array:
        """``(population, m)`` mutants crossed with the members they challenge."""
        n, size = self._keys.shape
        scale = self._rng.uniform(*self._mutation)
        a, b, c = (self._keys[others] for others in self._three_others(n))
        best = self._keys[int(np.argmax(self._scores))]
        if self._strategy == "rand1bin":
            mutants = a + scale * (b - c)
        elif self._strategy == "best1bin":
            mutants = best + scale * (a - b)
        else:
            mutants = self._keys + scale * (best - self._keys + a - b)
        from_mutant = self._rng.random((n, size)) < self._recombination
        from_mutant[np.arange(n), self._rng.integers(size, size=n)] = True
        trials = np.where(from_mutant, mutants, self._keys)
        outside = (trials < 0.0) | (trials > 1.0)
        trials[outside] = self._rng.random(int(outside.sum()))
        return trials

    def _three_others(self, n: int) -> list[npt.NDArray[np.int64]]:
        """For each of ``n`` members three others, different from it and from one another."""
        taken = [np.arange(n)]
        for already in range(1, 4):
            drawn = self._rng.integers(n - already, size=n)
            for smaller in np.sort(taken, axis=0):
                drawn += drawn >= smaller
            taken.append(drawn)
        return taken[1:]


def _default_population(size: int, evaluations: int | None) -> int:
    """Fifteen per key as scipy's, but few enough for a hundred generations."""
    population = 15 * size
    return population if evaluations is None else min(population, max(20, evaluations // 100))
