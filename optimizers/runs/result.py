"""What a search returns, and reading it back from a run's folder; nothing else reads these folders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from legible_envs.workspace import Workspace, make_workspace
from optimizers.archives import WorkspaceArchive, archive_arrays, make_archive, read_archive
from optimizers.errors import SearchError
from optimizers.runs.folder import COLUMNS, RunFolder
from optimizers.runs.manifest import digests_of

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Elites", "SearchResult", "load_run"]

_READINGS = 5
"""How often a run is read again that changes while it is read."""


@dataclass(frozen=True)
class Elites:
    """The layouts of an archive as arrays, one row per layout.

    Attributes:
        solution: ``(n, d)`` genomes.
        objective: ``(n,)`` scores.
        measures: ``(n, k)`` measures.
        index: ``(n,)`` cells of the archive, counted row by row.
    """

    solution: npt.NDArray[Any]
    objective: npt.NDArray[np.float64]
    measures: npt.NDArray[np.float64]
    index: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.objective)


@dataclass
class SearchResult:
    """The outcome of a search, whole or as far as it came.

    Attributes:
        workspace: The design problem.
        archive: The archive, a pyribs ``GridArchive``.
        best_genome: ``(d,)`` genome of the best layout, without obstacles that do nothing; None if no layout scored.
        best_objective: Its score, at least that of the archive's best elite; None if no layout scored.
        history: One dict per logged iteration, the columns of ``metrics.csv``; :meth:`metrics` has it as a table.
        evaluations: Layouts scored.
        iterations: Batches after the initial random one.
        seconds: Wall time of the search, all sessions together.
        evaluation_seconds: Part of it spent in the objective.
        stopped: Why it ended: ``"evaluations"``, ``"iterations"``, ``"time limit"``, ``"callback"``, ``"interrupted"``
            or ``"error"``.
        config: The manifest of the run, as in ``config.json``.
        folder: Where it lies, or None.
    """

    workspace: Workspace
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

    def elites(self, *, best_first: bool = True) -> Elites:
        """The layouts of the archive.

        Args:
            best_first: Whether they come by descending score (equal ones by cell); else they come by cell.
        """
        arrays = archive_arrays(self.archive)
        order: Any = np.argsort(-arrays["objective"], kind="stable") if best_first else slice(None)
        return Elites(**{name: values[order] for name, values in arrays.items()})

    def metrics(self) -> pd.DataFrame:
        """The history as a table, one row per logged iteration, with the columns of ``metrics.csv``."""
        import pandas as pd

        return pd.DataFrame(self.history, columns=list(COLUMNS))

    def require_genome(self) -> npt.NDArray[Any]:
        """``(d,)`` the best genome, where going on without one makes no sense.

        Raises:
            SearchError: No layout has scored yet.
        """
        if self.best_genome is None:
            where = "" if self.folder is None else f"{self.folder}: "
            raise SearchError(f"{where}the archive is empty, so there is no best layout yet; resume the search")
        return self.best_genome


def load_run(folder: str | Path, workspace: Workspace | None = None) -> SearchResult:
    """Read a run back from its published files; nothing is unpickled.

    Args:
        folder: A run's folder, finished or not.
        workspace: The workspace, for one that ``legible_envs.workspace.make_workspace`` cannot rebuild.

    Returns:
        The result; its archive holds the same elites.

    Raises:
        SearchError: The folder holds no run, or one of its files is damaged or was changed; the message names the file
            and, in the manifest, the key.
        ValueError: The workspace of the run is not known here, or does not take its settings.
    """
    run = RunFolder(Path(folder))
    if not run.path.is_dir():
        raise SearchError(f"{folder} is not a folder; expected the folder of a search")
    for _ in range(_READINGS):
        config = run.read_config()
        try:
            return _read_run(run, config, workspace)
        except SearchError:
            # A search that went on meanwhile has written files that the manifest read before does not know.
            if run.read_config() == config:
                raise
    raise SearchError(f"{run.path} cannot be read: the search there changes it all the time")


def _read_run(run: RunFolder, config: dict[str, Any], workspace: Workspace | None) -> SearchResult:
    if workspace is None:
        workspace = _workspace_of(run, config)
    archive = _read_archive(run, workspace, config)
    history = _rows(run.read_metrics())
    _check_digests(run, config, archive, history)
    last = history[-1] if history else {"evaluations": 0, "iteration": 0, "seconds": 0.0}
    finished = config.get("result") or {}
    genome, objective = _best_genome(run, finished, workspace), finished.get("best_objective")
    if genome is None and archive.best_elite is not None:
        genome, objective = archive.best_elite["solution"], float(archive.best_elite["objective"])
    return SearchResult(
        workspace=workspace,
        archive=archive,
        best_genome=genome,
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


def _workspace_of(run: RunFolder, config: Mapping[str, Any]) -> Workspace:
    """The workspace that a manifest describes.

    Raises:
        ValueError: It cannot be made; names the file.
    """
    try:
        return make_workspace(config["workspace"])
    except (ValueError, TypeError) as error:
        raise ValueError(f"{run.config}, `workspace`: {error}") from error


def _best_genome(run: RunFolder, result: Mapping[str, Any], workspace: Workspace) -> npt.NDArray[Any] | None:
    """The genome of a result, in the type of the workspace; None where there is none.

    Raises:
        SearchError: The numbers are no genome of the workspace.
    """
    values = result.get("best_genome")
    if values is None:
        return None
    given = np.asarray(values, dtype=np.float64)
    if given.shape != (workspace.genome_size,):
        raise SearchError(
            f"{run.config}: `result.best_genome` must have {workspace.genome_size} numbers, got {given.size}"
        )
    whole = np.issubdtype(workspace.genome_dtype, np.integer)
    wrong = (given < workspace.lower_bounds) | (given > workspace.upper_bounds) | (whole & (given != np.rint(given)))
    if wrong.any():
        gene = int(np.argmax(wrong))
        low, high = workspace.lower_bounds[gene], workspace.upper_bounds[gene]
        raise SearchError(
            f"{run.config}: `result.best_genome[{gene}]` must be {'an integer' if whole else 'a number'} from {low} to "
            f"{high}, got {values[gene]}"
        )
    return np.asarray(values, dtype=workspace.genome_dtype)


def _read_archive(run: RunFolder, workspace: Workspace, config: dict[str, Any]) -> WorkspaceArchive:
    """The archive as the run's manifest describes it, with the elites of its file."""
    shape = config["archive"]
    try:
        archive = make_archive(
            workspace,
            seed=config.get("seed"),
            dims=shape["dims"],
            ranges=[tuple(ends) for ends in shape["ranges"]],
            score_floor=shape["score_floor"],
        )
    except ValueError as error:
        raise SearchError(f"{run.config}, `archive`: {error}") from error
    try:
        arrays = read_archive(run.archive)
    except FileNotFoundError as error:
        raise SearchError(
            f"{run.path} has no archive.npz: its search has not saved anything yet; continue it with resume=True "
            "(`legible optimize --resume`)"
        ) from error
    if len(arrays["objective"]):
        try:
            archive.add(arrays["solution"], arrays["objective"], arrays["measures"])
        except (ValueError, TypeError, IndexError) as error:
            raise SearchError(f"{run.archive} does not fit the manifest beside it: {error}") from error
    return archive


def _check_digests(
    run: RunFolder, config: Mapping[str, Any], archive: WorkspaceArchive, history: list[dict[str, Any]]
) -> None:
    """Refuse files that are not those that a finished search left.

    Raises:
        SearchError: One is not; names it.
    """
    known = config.get("digests") or {}
    found = digests_of(archive_arrays(archive), history) if known else {}
    for name, file in (("archive", run.archive), ("metrics", run.metrics)):
        if known and known[name] != found[name]:
            raise SearchError(
                f"{file} is not what the search left there: its content has the SHA-256 {found[name][:12]}…, the "
                f"manifest names {known[name][:12]}…. It was changed since, or damaged: restore it; a search "
                "with a checkpoint writes it anew when resumed"
            )


def _rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    """A table as one dict per row, with None where nothing was written."""
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    return [{str(name): value for name, value in row.items()} for row in rows]
