"""One search, its evaluations spread over a Dask cluster."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from distributed import Client

    from optimizers.evaluate import Objective

__all__ = ["ClusterObjective", "connect"]

LEAST: Final = 256
"""Fewer genomes than this are not worth a message."""


def connect(scheduler: str, timeout: float = 10.0) -> Client:
    """A client of a running scheduler.

    Args:
        scheduler: Its address, such as ``"tcp://10.0.0.1:8786"``.
        timeout: Seconds to wait for it.

    Raises:
        ImportError: Dask is not installed; the message says how to get it.
        ConnectionError: Nobody answers at that address.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError("a cluster needs Dask: pip install 'legible-envs[distributed]'") from error
    try:
        return Client(scheduler, timeout=timeout, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConnectionError(
            f"no Dask scheduler answers at {scheduler!r} ({error}); start one with `dask scheduler` and workers with "
            "`dask worker ADDRESS`"
        ) from error


class ClusterObjective:
    """An objective that scores parts of every batch on the workers of a cluster.

    The scores are those of the objective itself; a lost worker's part is scored elsewhere.

    Args:
        objective: From ``(n, d)`` genomes to ``(n,)`` scores; must pickle, and score each genome by itself.
        scheduler: Address of a Dask scheduler whose workers have this package.
    """

    def __init__(self, objective: Objective, scheduler: str) -> None:
        self._client = connect(scheduler)
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
