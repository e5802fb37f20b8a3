"""CMA-ME and CMA-MAE: pyribs' evolution strategies on the random keys of layouts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from ribs.archives import GridArchive
from ribs.emitters import EvolutionStrategyEmitter

from legible_envs.random_keys import KeyDecoder
from legible_envs.support.validation import integers, real
from legible_envs.workspace import MOST_GENOMES, Workspace
from optimizers.emitters.adapter import FloatArchiveView, GenomeAdapter
from optimizers.emitters.base import Seed, read_only, seed_sequence
from optimizers.emitters.draws import draw_elites

if TYPE_CHECKING:
    from ribs.archives import ArchiveBase

__all__ = ["CmaMaeEmitter", "CmaMeEmitter", "Strategies"]

_ROUNDS = 100
_MOST = 15


class Strategies(NamedTuple):
    """How far evolution strategies are, one row per strategy; no rows before the first proposal.

    Attributes:
        starts: ``(strategies, d)`` the elite each began from last.
        restarts: ``(strategies,)`` how often each has begun anew.
        thresholds: ``(cells,)`` CMA-MAE's threshold of every archive cell met so far; empty for CMA-ME.
        bests: ``(cells,)`` the best score met in that cell.
    """

    starts: npt.NDArray[Any]
    restarts: npt.NDArray[np.int64]
    thresholds: npt.NDArray[np.float64]
    bests: npt.NDArray[np.float64]


class _KeyStrategies(GenomeAdapter):
    """Several of pyribs' evolution strategies on the random keys of layouts; arguments as in CMA-ME and CMA-MAE."""

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        name: str,
        learning_rate: float | None,
        strategies: int | None,
        batch_size: int,
        sigma0: float,
        evaluations: int | None,
        initial: int,
        seed: Seed,
    ) -> None:
        integers(1, MOST_GENOMES, strategies=strategies, batch_size=batch_size, initial=initial)
        real("sigma0", sigma0, 0, closed="neither")
        if strategies is None:
            planned = _MOST if evaluations is None else evaluations // (_ROUNDS * batch_size)
            strategies = max(1, min(_MOST, planned))
        team_seed, own_seed = seed_sequence(seed).spawn(2)
        team = _Team(archive, workspace, strategies, batch_size, float(sigma0), learning_rate, team_seed)
        super().__init__(archive, workspace, team, name=name, seed=own_seed, initial=initial)

    @property
    def state(self) -> Strategies:
        """Where every strategy began, and what it has to pass; a copy."""
        return self.emitter.state

    def to_genomes(self, raw: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The layouts that ``(n, d)`` keys stand for."""
        return self.emitter.decoder.decode(raw, self.emitter.anchors, self._rng)


class CmaMeEmitter(_KeyStrategies):
    """CMA-ME: covariance matrix adaptation toward what is new to the archive or improves it, on random keys.

    Several of pyribs' ``EvolutionStrategyEmitter`` (ranked by two-stage improvement; Fontaine et al., 2020) side by
    side, each from a random elite and, when a batch of it adds nothing, from another. They adapt real vectors, which
    the workspace decodes as random keys (:meth:`~legible_envs.workspace.Workspace.key_decoder`).

    Args:
        archive: Archive of the search.
        workspace: The design problem; must offer ``sample`` and ``valid``.
        strategies: How many evolution strategies. Default 15 (as pyribs' examples), but few enough for 100 batches
            each within ``evaluations``.
        batch_size: Layouts per strategy and batch.
        sigma0: First step size; keys lie in [0, 1].
        evaluations: Planned number of evaluations, used only for the default of ``strategies``.
        initial: Random layouts proposed while the archive is empty.
        seed: Seed of this emitter's draws.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        strategies: int | None = None,
        batch_size: int = 36,
        sigma0: float = 0.2,
        evaluations: int | None = None,
        initial: int = 1000,
        seed: Seed = None,
    ) -> None:
        super().__init__(
            archive,
            workspace,
            name="cma-me",
            learning_rate=None,
            strategies=strategies,
            batch_size=batch_size,
            sigma0=sigma0,
            evaluations=evaluations,
            initial=initial,
            seed=seed,
        )


class CmaMaeEmitter(_KeyStrategies):
    """CMA-MAE: CMA-ME on random keys that climbs above a threshold, which rises slowly in each cell.

    A private archive keeps, for each cell, a threshold that moves by ``learning_rate`` of the difference toward
    each score above it (Fontaine & Nikolaidis, 2023); strategies rank by how far a layout is above it, take the better
    half as parents, and start again from a random elite only when they have converged. Thresholds begin at the median
    score of the elites found when the emitter first proposes.

    Args:
        archive: Archive of the search; keeps the best of every cell as always.
        workspace: The design problem; must offer ``sample`` and ``valid``.
        learning_rate: How fast thresholds rise: 1 is CMA-ME's archive, 0 never.
        strategies: How many evolution strategies; default as in CMA-ME: 15, but few enough for 100 batches each within
            ``evaluations``.
        batch_size: Layouts per strategy and batch.
        sigma0: First step size; keys lie in [0, 1].
        evaluations: Planned number of evaluations, used only for the default of ``strategies``.
        initial: Random layouts proposed while the archive is empty.
        seed: Seed of this emitter's draws.
    """

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        *,
        learning_rate: float = 0.01,
        strategies: int | None = None,
        batch_size: int = 36,
        sigma0: float = 0.2,
        evaluations: int | None = None,
        initial: int = 1000,
        seed: Seed = None,
    ) -> None:
        super().__init__(
            archive,
            workspace,
            name="cma-mae",
            learning_rate=real("learning_rate", learning_rate, 0, 1),
            strategies=strategies,
            batch_size=batch_size,
            sigma0=sigma0,
            evaluations=evaluations,
            initial=initial,
            seed=seed,
        )


class _KeyArchiveView(FloatArchiveView):
    """An archive seen by an evolution strategy: elites as keys; remembers the elite it began from last."""

    def __init__(self, archive: ArchiveBase, decoder: KeyDecoder, rng: np.random.Generator) -> None:
        super().__init__(archive)
        self._decoder = decoder
        self._rng = rng
        self.start: npt.NDArray[Any] = np.zeros(0)

    def sample_elites(self, n: int, replace: bool = True) -> dict[str, Any]:
        """Draw ``n`` elites, as keys."""
        genomes, scores = draw_elites(self._archive, n, self._rng, replace=replace)
        self.start = genomes[0]
        return {"solution": self._decoder.encode(genomes), "objective": scores}


class _Team:
    """Evolution strategies side by side, made when there are elites to begin from."""

    def __init__(
        self,
        archive: ArchiveBase,
        workspace: Workspace,
        strategies: int,
        batch_size: int,
        sigma0: float,
        learning_rate: float | None,
        seed: np.random.SeedSequence,
    ) -> None:
        self.decoder = workspace.key_decoder()
        self.settings: dict[str, float] = {"strategies": strategies, "batch_size": batch_size, "sigma0": sigma0}
        if learning_rate is not None:
            self.settings["learning_rate"] = learning_rate
        self._archive, self._seed = archive, seed
        self._learning_rate = learning_rate
        self._members: list[EvolutionStrategyEmitter] = []
        self._soft: GridArchive | None = None

    @property
    def state(self) -> Strategies:
        """See :class:`Strategies`."""
        starts = [member.archive.start for member in self._members]
        soft = {"threshold": np.zeros(0), "objective": np.zeros(0)}
        if self._soft is not None:
            soft = self._soft.data(list(soft))
        arrays = (
            np.array(starts) if starts else np.zeros((0, self._archive.solution_dim)),
            np.array([member.restarts for member in self._members], dtype=np.int64),
            soft["threshold"],
            soft["objective"],
        )
        return Strategies(*map(read_only, arrays))

    @property
    def anchors(self) -> npt.NDArray[Any]:
        """``(n, d)`` the elite from which the strategy behind each row began."""
        starts = np.stack([member.archive.start for member in self._members])
        return np.repeat(starts, int(self.settings["batch_size"]), axis=0)

    def ask(self) -> npt.NDArray[Any]:
        """``(n, d)`` keys."""
        if not self._members:
            self._begin()
        return np.concatenate([member.ask() for member in self._members])

    def tell(self, solution: Any, objective: Any, measures: Any, add_info: dict[str, Any]) -> None:
        """Tell each its own."""
        if self._soft is not None:
            add_info = self._soft.add(solution, objective, measures)
        parts = zip(
            *(
                np.split(np.asarray(values), len(self._members))
                for values in (solution, objective, measures, add_info["status"], add_info["value"])
            ),
            strict=True,
        )
        for member, (keys, scores, where, status, value) in zip(self._members, parts, strict=True):
            member.tell(keys, scores, where, {"status": status, "value": value})

    def _begin(self) -> None:
        options: dict[str, Any] = {"ranker": "2imp", "selection_rule": "filter", "restart_rule": "no_improvement"}
        archive = self._archive
        if self._learning_rate is not None:
            options = {"ranker": "imp", "selection_rule": "mu", "restart_rule": "basic"}
            self._soft = GridArchive(
                solution_dim=self.decoder.size,
                dims=archive.dims,
                ranges=list(zip(archive.lower_bounds, archive.upper_bounds, strict=True)),
                learning_rate=self._learning_rate,
                threshold_min=float(np.median(archive.data("objective"))),
            )
        for child in self._seed.spawn(int(self.settings["strategies"])):
            own, strategy = child.spawn(2)
            view = _KeyArchiveView(archive, self.decoder, np.random.default_rng(own))
            start = view.sample_elites(1)["solution"][0]
            self._members.append(
                EvolutionStrategyEmitter(
                    view,
                    x0=start,
                    sigma0=self.settings["sigma0"],
                    batch_size=int(self.settings["batch_size"]),
                    seed=strategy,
                    **options,
                )
            )
