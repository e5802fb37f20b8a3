"""What a search returns, and reading it back from a run's folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from optimizers.archives import WorkspaceArchive, make_archive, read_archive
from optimizers.runs.folder import RunFolder

__all__ = ["SearchResult", "load_run"]


@dataclass
class SearchResult:
    """The outcome of a search, whole or as far as it came.

    Attributes:
        workspace: The design problem.
        archive: The archive, a pyribs ``GridArchive``.
        best_genome: ``(d,)`` genome of the best layout, without obstacles that do nothing; None if no layout scored.
        best_objective: Its score, at least that of the archive's best elite; None if no layout scored.
        history: One dict per logged iteration, the columns of ``metrics.csv``.
        evaluations: Layouts scored.
        iterations: Batches after the initial random one.
        seconds: Wall time of the search, all sessions together.
        evaluation_seconds: Part of it spent in the objective.
        stopped: Why it ended: ``"evaluations"``, ``"iterations"``, ``"time limit"``, ``"callback"``, ``"interrupted"``
            or ``"error"``.
        config: The manifest of the run, as in ``config.json``.
        folder: Where it lies, or None.
    """

    workspace: Any
    archive: WorkspaceArchive
    best_genome: npt.NDArray[Any] | None
    best_objective: float | None
    history: list[dict[str, Any]]
    evaluations: int
    iterations: int
    seconds: float
    evaluation_seconds: float
    stopped: str
    config: dict[str, Any] = field(repr=False)
    folder: Path | None = None

    @property
    def best_layout(self) -> Any:
        """The best layout found, without obstacles that do nothing; None if no layout scored."""
        return None if self.best_genome is None else self.workspace.decode(self.best_genome)

    @property
    def qd_score(self) -> float:
        """Sum of all elites' scores above the archive's offset."""
        return float(self.archive.stats.qd_score)

    @property
    def coverage(self) -> float:
        """Share of the archive's cells that hold an elite."""
        return float(self.archive.stats.coverage)

    @property
    def overhead(self) -> float:
        """Share of the wall time that was not spent in the objective."""
        return 1.0 - self.evaluation_seconds / self.seconds if self.seconds > 0 else 0.0


def load_run(folder: str | Path, workspace: Any = None) -> SearchResult:
    """Read a run back from its published files; nothing is unpickled.

    Args:
        folder: A run's folder, finished or not.
        workspace: The workspace, for one that ``legible_envs.workspace.make_workspace`` cannot rebuild.

    Returns:
        The result; its archive holds the same elites.

    Raises:
        SearchError: The folder holds no run.
        ValueError: One of its files is damaged.
    """
    run = RunFolder(Path(folder))
    config = run.read_config()
    if workspace is None:
        from legible_envs.workspace import make_workspace

        workspace = make_workspace(config["workspace"])
    shape = config["archive"]
    archive = make_archive(
        workspace,
        seed=config["seed"],
        dims=shape["dims"],
        ranges=[tuple(ends) for ends in shape["ranges"]],
        score_floor=shape["score_floor"],
    )
    try:
        arrays = read_archive(run.archive)
    except FileNotFoundError:
        arrays = None
    if arrays is not None and len(arrays["objective"]):
        archive.add(arrays["solution"], arrays["objective"], arrays["measures"])
    history = run.read_metrics()
    last = history[-1] if history else {"evaluations": 0, "iteration": 0, "seconds": 0.0}
    finished = config.get("result") or {}
    genome, objective = finished.get("best_genome"), finished.get("best_objective")
    if genome is None and archive.best_elite is not None:
        genome, objective = archive.best_elite["solution"], float(archive.best_elite["objective"])
    return SearchResult(
        workspace=workspace,
        archive=archive,
        best_genome=None if genome is None else np.asarray(genome, dtype=workspace.genome_dtype),
        best_objective=objective,
        history=history,
        evaluations=int(finished.get("evaluations", last["evaluations"])),
        iterations=int(finished.get("iterations", last["iteration"])),
        seconds=float(finished.get("seconds", last["seconds"])),
        evaluation_seconds=float(finished.get("evaluation_seconds", 0.0)),
        stopped=finished.get("stopped", "interrupted"),
        config=config,
        folder=run.path,
    )
