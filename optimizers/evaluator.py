"""The seam between searching and scoring: genomes in, objective and measures out.

Everything that proposes layouts stands on one side of :class:`Evaluator`, everything that scores them on the other,
so that scoring can be spread over machines without an emitter noticing.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final, cast

import numpy as np
import numpy.typing as npt

from legible_envs.workspace import ObjectiveName, Workspace
from optimizers.cluster import WORKERS, Cluster, Process
from optimizers.errors import ClusterError
from optimizers.fingerprint import OtherCodeError, expect, package_of

__all__ = ["LEAST", "ClusterObjective", "Evaluator", "Objective"]

Objective = Callable[[npt.NDArray[Any]], npt.NDArray[np.float64]]

LEAST: Final = 256
"""A batch is split only into parts of at least so many genomes: fewer are not worth a message."""

_TIMES: Final = 3
"""A batch is given to new workers so often where all that had it were lost."""

_LOOK: Final = 0.5
"""Seconds after which it is looked whether the workers are still there."""


class Evaluator:
    """Score and measure genomes of one workspace.

    Args:
        workspace: The design problem.
        objective: Name known to ``workspace.objective``, or any callable from ``(n, d)`` genomes to ``(n,)`` numbers to
            be maximised. NaN and negative infinity mean "not allowed": such a layout never enters an archive.
        max_distance: Layouts whose expected distance over one task execution (floor moves, metres) is greater
            score NaN.
        scheduler: Address of a Dask scheduler whose workers share the scoring; None scores in this process.
        worker_timeout: Seconds to wait for a worker where the cluster has none that may be used.
        deadline: ``time.monotonic()`` at which that waiting ends in any case.

    Raises:
        ClusterError: No scheduler answers, or no worker came in time.

    Attributes:
        name: Name of the objective.
        seconds: Wall time spent in the objective so far (measures not included).
    """

    def __init__(
        self,
        workspace: Workspace,
        objective: str | Objective = "legibility",
        max_distance: float | None = None,
        scheduler: str | None = None,
        *,
        worker_timeout: float = WORKERS,
        deadline: float | None = None,
    ) -> None:
        self.workspace = workspace
        self.max_distance = max_distance
        self.seconds = 0.0
        if isinstance(objective, str):
            self.name = objective
            self._score: Objective = workspace.objective(cast("ObjectiveName", objective), max_distance=max_distance)
            self._cap_here = False
        elif callable(objective):
            self.name = _name_of(objective)
            self._score = objective
            self._cap_here = max_distance is not None
            self.max_distance = getattr(objective, "max_distance", None) if max_distance is None else max_distance
        else:
            raise TypeError(f"objective must be a name or a callable on genomes, got {type(objective).__name__}")
        self._cluster: ClusterObjective | None = None
        if scheduler is not None:
            packages = ("legible_envs", "optimizers", package_of(workspace), package_of(self._score))
            cluster = Cluster(scheduler, packages, worker_timeout, deadline)
            self._cluster = ClusterObjective(self._score, cluster)

    def close(self) -> None:
        """Leave the cluster, if there is one."""
        if self._cluster is not None:
            self._cluster.close()

    @property
    def score_floor(self) -> float:
        """A value no score lies below, as far as the objective or the workspace knows one."""
        floor = getattr(self._score, "floor", None)
        return float(self.workspace.score_floor if floor is None else floor)

    def score(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """The objective alone.

        Args:
            genomes: ``(n, d)``.

        Returns:
            ``(n,)`` scores, NaN where not allowed.

        Raises:
            ValueError: The objective returned another shape, or positive infinity.
        """
        started = time.perf_counter()
        scores = np.asarray((self._cluster or self._score)(genomes), dtype=np.float64)
        if scores.shape != (len(genomes),):
            raise ValueError(
                f"objective {self.name!r} must return one number per genome, shape ({len(genomes)},); "
                f"it returned shape {scores.shape}"
            )
        if np.isposinf(scores).any():
            raise ValueError(f"objective {self.name!r} returned +inf; a score must be finite, or NaN where not allowed")
        scores = np.where(np.isneginf(scores), np.nan, scores)
        if self._cap_here:
            too_far = ~(self.workspace.distance(genomes) <= self.max_distance)
            scores = np.where(too_far, np.nan, scores)
        self.seconds += time.perf_counter() - started
        return scores

    def __call__(self, genomes: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Score and measure.

        Args:
            genomes: ``(n, d)``.

        Returns:
            ``(n,)`` scores and ``(n, k)`` measures; measures of layouts that score NaN are to be ignored.

        Raises:
            ValueError: The objective or the measures have a wrong shape, or a scored layout has no finite measures.
        """
        scores = self.score(genomes)
        measures = np.asarray(self.workspace.measures(genomes), dtype=np.float64)
        shape = (len(genomes), len(self.workspace.archive_dims))
        if measures.shape != shape:
            raise ValueError(f"workspace.measures must return shape {shape}, it returned {measures.shape}")
        if not np.isfinite(measures[~np.isnan(scores)]).all():
            raise ValueError("workspace.measures returned NaN or infinity for a layout that has a score")
        return scores, measures


def _name_of(objective: Objective) -> str:
    """``objective.name`` where it has one, else where it was defined."""
    name = getattr(objective, "name", None)
    if isinstance(name, str):
        return name
    kind = objective if hasattr(objective, "__qualname__") else type(objective)
    return f"{kind.__module__}:{kind.__qualname__}"


class ClusterObjective:
    """An objective that scores parts of every batch on the workers of a cluster.

    The scores are those of the objective itself; a lost worker's part is scored elsewhere.

    Args:
        objective: From ``(n, d)`` genomes to ``(n,)`` scores; must pickle, and score each genome by itself.
        cluster: Its workers share the work.

    Raises:
        ClusterError: No worker came in time.
    """

    def __init__(self, objective: Objective, cluster: Cluster) -> None:
        self._cluster = cluster
        self._objective = objective
        self._sent: Any = None
        self._holders: set[Process] = set()
        try:
            self._cluster.wait()
        except BaseException:
            self._cluster.close()
            raise

    def __call__(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """``(n,)`` scores of ``(n, d)`` genomes.

        Raises:
            ClusterError: The scheduler was lost, or all workers were and no other came in time.
        """
        for _ in range(_TIMES):
            scores = self._scored(genomes, self._cluster.wait())
            if scores is not None:
                return scores
        raise ClusterError(
            f"the workers of the scheduler at {self._cluster.scheduler} were lost {_TIMES} times while they scored one "
            "batch (out of memory?)"
        )

    def _scored(self, genomes: npt.NDArray[Any], workers: dict[Process, int]) -> npt.NDArray[np.float64] | None:
        """The scores; None where all workers that were asked are gone."""
        if self._sent is None or workers.keys() != self._holders:
            # A task, not scattered data: where a worker is lost that held it, it is made again.
            self._sent, self._holders = self._cluster.submit(_same, self._objective, workers=workers), set(workers)
        digests, sent = self._cluster.digests, self._sent
        count = max(1, min(sum(workers.values()), len(genomes) // LEAST))
        parts = [
            self._cluster.submit(_score, digests, sent, part, workers=workers)
            for part in np.array_split(genomes, count)
        ]
        try:
            while any(map(self._cluster.there, workers)):
                if len(self._cluster.ended(parts, _LOOK)) == count and (scores := self._cluster.results(parts)):
                    return np.concatenate(scores)
                self._cluster.workers()
        except OtherCodeError:
            self._cluster.forget()
        except Exception as error:
            if type(error).__name__ != "KilledWorker":
                raise
        self._cluster.cancel(parts)
        self._sent = None
        return None

    def close(self) -> None:
        """Leave the cluster."""
        self._cluster.close()


def _same(objective: Objective) -> Objective:
    return objective


def _score(digests: dict[str, str], objective: Objective, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    expect(digests)
    return np.asarray(objective(genomes), dtype=np.float64)
