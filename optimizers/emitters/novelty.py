"""Novelty search with local competition (Lehman & Stanley, 2011) as an emitter."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.validation import integers, real
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.base import AddInfo, Seed, WorkspaceEmitter, read_only
from optimizers.emitters.draws import crossed, draw_elites, perturbed

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["Generation", "NoveltyLocalCompetitionEmitter"]
__all__ += ["crowding_distances", "novelty_and_competition", "pareto_ranks"]

_ARCHIVE_LIMIT = 500
Floats = npt.NDArray[np.float64]


class Generation(NamedTuple):
    """A population, one row per layout, and the past it is compared with.

    Attributes:
        genomes: ``(n, d)`` its layouts, ``n`` at most ``population``.
        scores: ``(n,)`` their scores.
        measures: ``(n, k)`` their measures.
        ranks: ``(n,)`` their Pareto ranks, 0 the best.
        past: ``(m, k)`` measures of the past layouts that novelty is measured from too, oldest first.
    """

    genomes: npt.NDArray[Any]
    scores: Floats
    measures: Floats
    ranks: npt.NDArray[np.int64]
    past: Floats


class NoveltyLocalCompetitionEmitter(WorkspaceEmitter):
    """Novelty search with local competition: be different from others, and better than those that are alike.

    A population is bred as in NSGA-II (Deb et al., 2002) for two objectives (Lehman & Stanley, GECCO 2011): *novelty*,
    the mean distance of a layout's measures to its ``neighbours`` nearest ones in the population and in a list of past
    layouts, and *local competition*, how many of those neighbours it outscores. Parents win binary tournaments by
    Pareto rank, then crowding distance; a child is crossed with probability ``crossover`` and always perturbed. Parents
    and children compete for the places of the next generation. Each child joins the list of past layouts with
    probability ``remember`` (Lehman & Stanley, 2010). Unlike the original, ties within a front are broken by NSGA-II's
    crowding distance and not by genotypic diversity.

    The archive of the search keeps the best layout of every cell as always; the first generation is drawn from it.

    Args:
        archive: Archive of the search.
        workspace: The design problem; must offer ``sample``, ``perturb``, ``phases`` and ``valid``.
        population: Layouts per generation, at least 2. Default 128, but 20 to 128 for 100 generations within
            ``evaluations``.
        neighbours: Nearest neighbours that count.
        crossover: Probability that a child has two parents.
        remember: Probability that a child joins the list of past layouts (at most 500, the oldest make room).
        evaluations: Planned number of evaluations, used only for the default of ``population``.
        seed: Seed of this emitter's draws.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        population: int | None = None,
        neighbours: int = 15,
        crossover: float = 0.5,
        remember: float = 0.05,
        evaluations: int | None = None,
        seed: Seed = None,
    ) -> None:
        integers(2, MOST_GENOMES, population=population)
        integers(1, neighbours=neighbours)
        real("crossover", crossover, 0, 1)
        real("remember", remember, 0, 1)
        super().__init__(archive, workspace, seed=seed)
        planned = 128 if evaluations is None else min(128, max(20, evaluations // 100))
        self.population = planned if population is None else int(population)
        self._neighbours, self._crossover, self._remember = int(neighbours), float(crossover), float(remember)
        ranges = np.asarray(workspace.archive_ranges, dtype=np.float64)
        self._scale = ranges[:, 1] - ranges[:, 0]
        self._genomes = self._blank_genomes()
        self._scores: Floats = np.zeros(0)
        self._measures: Floats = np.zeros((0, len(ranges)))
        self._past: Floats = np.zeros((0, len(ranges)))
        # Selection keys of the population: Pareto rank (0 is best) and crowding distance.
        self._ranks: npt.NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._crowding: Floats = np.zeros(0)

    @property
    def settings(self) -> dict[str, float]:
        """The settings in force, for the manifest of a run."""
        return {
            "population": self.population,
            "neighbours": self._neighbours,
            "crossover": self._crossover,
            "remember": self._remember,
        }

    @property
    def state(self) -> Generation:
        """The population now; a copy. Empty before the first generation."""
        return Generation(*map(read_only, (self._genomes, self._scores, self._measures, self._ranks, self._past)))

    def ask(self) -> npt.NDArray[Any]:
        """Propose ``(population, d)`` children; random layouts while there are no parents."""
        if not len(self._genomes):
            if self.archive.empty:
                return self._workspace.sample(self.population, self._rng)
            genomes, scores = draw_elites(self.archive, self.population, self._rng, replace=False)
            self._survive(genomes, scores, np.asarray(self._workspace.measures(genomes), dtype=np.float64))
        mothers, fathers = self._tournament(), self._tournament()
        mated = self._rng.random(self.population) < self._crossover
        children = self._genomes[mothers]
        children[mated] = crossed(
            self._workspace, self._genomes[mothers[mated]], self._genomes[fathers[mated]], self._rng
        )
        return perturbed(self._workspace, children, self._rng)

    def tell(
        self,
        solution: npt.ArrayLike,
        objective: npt.ArrayLike,
        measures: npt.ArrayLike,
        add_info: AddInfo,
        **fields: npt.ArrayLike,
    ) -> None:
        """Let parents and children compete for the next generation; a child without a score dies."""
        scores = np.asarray(objective, dtype=np.float64)
        scored = ~np.isnan(scores)
        genomes, scores = np.asarray(solution)[scored], scores[scored]
        where = np.asarray(measures, dtype=np.float64)[scored]
        if not len(genomes):
            return
        self._survive(
            np.concatenate([self._genomes, genomes.astype(self._genomes.dtype)]),
            np.concatenate([self._scores, scores]),
            np.concatenate([self._measures, where]),
        )
        remembered = where[self._rng.random(len(where)) < self._remember]
        self._past = np.concatenate([self._past, remembered])[-_ARCHIVE_LIMIT:]

    def _survive(self, genomes: npt.NDArray[Any], scores: Floats, measures: Floats) -> None:
        """Keep the first ``population`` by Pareto rank, then crowding distance."""
        objectives = novelty_and_competition(measures / self._scale, scores, self._past / self._scale, self._neighbours)
        ranks = pareto_ranks(objectives)
        crowding = crowding_distances(objectives, ranks)
        kept = np.lexsort((-crowding, ranks))[: self.population]
        self._genomes, self._scores, self._measures = genomes[kept], scores[kept], measures[kept]
        self._ranks, self._crowding = ranks[kept], crowding[kept]

    def _tournament(self) -> npt.NDArray[np.int64]:
        """``(population,)`` winners of binary tournaments."""
        a, b = self._rng.integers(len(self._genomes), size=(2, self.population))
        tied = self._ranks[a] == self._ranks[b]
        a_wins = np.where(tied, self._crowding[a] >= self._crowding[b], self._ranks[a] < self._ranks[b])
        return np.where(a_wins, a, b)


def novelty_and_competition(measures: Floats, scores: Floats, past: Floats, neighbours: int) -> Floats:
    """Both objectives of every individual.

    Args:
        measures: ``(n, k)`` of the population.
        scores: ``(n,)`` of the population.
        past: ``(m, k)`` measures of past layouts; they count for novelty only, as they have no score any more.
        neighbours: How many nearest ones count; all others, if there are fewer.

    Returns:
        ``(n, 2)``: mean distance to the nearest of population and past, itself left out; and how many of the nearest in
        the population score lower. Of several equally near ones the first count, on every processor.
    """
    n = len(measures)
    if n == 1:
        return np.zeros((1, 2))
    population_and_past = np.concatenate([measures, past])
    squares = np.zeros((n, len(population_and_past)))
    for mine, theirs in zip(measures.T, population_and_past.T, strict=True):
        squares += (mine[:, None] - theirs) ** 2
    np.fill_diagonal(squares, np.inf)
    k = min(neighbours, n - 1)
    outscored = (first_nearest(squares[:, :n], k) & (scores < scores[:, None])).sum(axis=1)
    k = min(neighbours, len(population_and_past) - 1)
    # In order: a partition leaves them as the processor likes, and sums of the same terms in another order differ.
    novelty = np.sqrt(np.sort(np.partition(squares, k - 1, axis=1)[:, :k], axis=1)).mean(axis=1)
    return np.column_stack([novelty, outscored])


def first_nearest(distances: Floats, k: int) -> npt.NDArray[np.bool_]:
    """``(n, m)`` the ``k`` smallest of every row of ``(n, m)`` distances; of equal ones the first."""
    farthest = np.partition(distances, k - 1, axis=1)[:, k - 1 : k]
    nearer, as_near = distances < farthest, distances == farthest
    left = k - nearer.sum(axis=1, keepdims=True)
    nearer |= as_near & (np.cumsum(as_near, axis=1, dtype=np.int32) <= left)
    return nearer


def pareto_ranks(objectives: Floats) -> npt.NDArray[np.int64]:
    """Non-dominated sorting of two objectives, both maximised.

    Taken by descending first objective, an individual belongs to the first front without a member that dominates it.
    Of each front only the greatest second objective so far has to be known, and fronts are ordered by it, so that the
    front is found by bisection (Jensen, 2003): ``O(n log n)``.

    Args:
        objectives: ``(n, 2)``.

    Returns:
        ``(n,)`` rank: 0 where no other dominates it, 1 where only rank 0 does, and so on.
    """
    first, second = objectives[:, 0], objectives[:, 1]
    order = np.lexsort((-second, -first))
    ranks = np.zeros(len(objectives), dtype=np.int64)
    tops: list[float] = []  # negated greatest second objective of each front: ascending
    previous: tuple[float, float] | None = None
    last = 0
    for i in order:
        point = (float(first[i]), float(second[i]))
        if point == previous:  # equals do not dominate one another
            ranks[i] = ranks[last]
            continue
        # All before have a first objective at least as great, so a front dominates where its top is as high.
        rank = bisect_right(tops, -point[1])
        if rank == len(tops):
            tops.append(-point[1])
        else:
            tops[rank] = -point[1]
        ranks[i], previous, last = rank, point, i
    return ranks


def crowding_distances(objectives: Floats, ranks: npt.NDArray[np.int64]) -> Floats:
    """``(n,)`` NSGA-II's crowding distance within each front: how far apart one's neighbours are, infinite at its ends.

    Args:
        objectives: ``(n, k)``.
        ranks: ``(n,)`` the front of each.
    """
    distances = np.zeros(len(objectives))
    for values in objectives.T:
        span = float(values.max() - values.min()) or 1.0
        order = np.lexsort((values, ranks))
        ordered, fronts = values[order], ranks[order]
        gaps = np.full(len(order), np.inf)
        inner = (fronts[1:-1] == fronts[:-2]) & (fronts[1:-1] == fronts[2:])
        gaps[1:-1][inner] = (ordered[2:] - ordered[:-2])[inner] / span
        distances[order] += gaps
    return distances
