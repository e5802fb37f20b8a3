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
from optimizers.cluster import connect, wait_for_workers

__all__ = ["LEAST", "ClusterObjective", "Evaluator", "Objective"]

Objective = Callable[[npt.NDArray[Any]], npt.NDArray[np.float64]]

LEAST: Final = 256
"""A batch is split only into parts of at least so many genomes: fewer are not worth a message."""


class Evaluator:
    """Score and measure genomes of one workspace.

    Args:
        workspace: The design problem.
        objective: Name known to ``workspace.objective``, or any callable from ``(n, d)`` genomes to ``(n,)`` numbers to
            be maximised. NaN and negative infinity mean "not allowed": such a layout never enters an archive.
        max_distance: Layouts whose expected distance over one task execution (floor moves, metres) is greater
            score NaN.
        scheduler: Address of a Dask scheduler whose workers share the scoring; None scores in this process.

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
        self._cluster = None if scheduler is None else ClusterObjective(self._score, scheduler)

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
        scheduler: Address of a Dask scheduler whose workers have this package.
    """

    def __init__(self, objective: Objective, scheduler: str) -> None:
        self._client = connect(scheduler)
        wait_for_workers(self._client, scheduler)
        # A task, not scattered data: where a worker is lost that held it, it is made again.
        self._objective = self._client.submit(_same, objective)

    def __call__(self, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """``(n,)`` scores of ``(n, d)`` genomes."""
        threads = max(1, sum(self._client.nthreads().values()))
        count = max(1, min(threads, len(genomes) // LEAST))
        parts = [
            self._client.submit(_score, self._objective, part, pure=False) for part in np.array_split(genomes, count)
        ]
        return np.concatenate(self._client.gather(parts))

    def close(self) -> None:
        """Leave the cluster."""
        self._client.close()


def _same(objective: Objective) -> Objective:
    return objective


def _score(objective: Objective, genomes: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    return np.asarray(objective(genomes), dtype=np.float64)
