"""Run folders as written by :func:`optimizers.search`: what one contains, read back with errors that name the file."""

from __future__ import annotations

import csv
import json
import zipfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Run", "RunError", "is_run_folder", "read_config", "read_run"]


class RunError(ValueError):
    """A run folder lacks a file, or a file in it is damaged."""


@dataclass(frozen=True)
class Run:
    """A search that was written to a folder.

    Attributes:
        folder: Where it lies.
        config: The manifest (``config.json``): versions, workspace, objective, emitter, seeds, result.
        history: Columns of ``metrics.csv``, each ``(rows,)`` float; empty arrays where nothing was logged yet.
        solution: ``(n, d)`` genomes of the elites, best first.
        objective: ``(n,)`` their objective values, descending.
        measures: ``(n, 2)`` their measures.
        index: ``(n,)`` their cells in the archive, counted row by row.
    """

    folder: Path
    config: dict[str, Any]
    history: dict[str, npt.NDArray[np.float64]]
    solution: npt.NDArray[Any]
    objective: npt.NDArray[np.float64]
    measures: npt.NDArray[np.float64]
    index: npt.NDArray[np.int64]

    @cached_property
    def workspace(self) -> Any:
        """The workspace that was searched, rebuilt from the manifest."""
        from legible_envs.workspace import make_workspace

        return make_workspace(self.config["workspace"])

    @property
    def best_genome(self) -> npt.NDArray[Any]:
        """``(d,)`` the best genome: pruned, where the search finished, else the archive's best elite.

        Raises:
            RunError: The archive is still empty.
        """
        result = self.config.get("result") or {}
        if result.get("best_genome") is not None:
            return np.asarray(result["best_genome"], dtype=self.solution.dtype)
        if not len(self.solution):
            raise RunError(f"{self.folder}: the archive is empty, so there is no best layout yet; resume the search")
        return np.asarray(self.solution[0])


def is_run_folder(path: str | Path) -> bool:
    """Whether the path is a folder with a run's manifest in it."""
    return (Path(path) / "config.json").is_file()


def read_run(folder: str | Path) -> Run:
    """Read a run folder; a search that is still running or was interrupted may lack ``metrics.csv``.

    Raises:
        RunError: A needed file is missing or damaged; the message names it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise RunError(f"{folder} is not a folder; expected the --out folder of `legible optimize`")
    config = read_config(folder / "config.json")
    arrays = _read_archive(folder / "archive.npz")
    best_first = np.argsort(-arrays["objective"], kind="stable")
    return Run(
        folder=folder,
        config=config,
        history=_read_history(folder / "metrics.csv"),
        solution=arrays["solution"][best_first],
        objective=arrays["objective"][best_first].astype(np.float64),
        measures=arrays["measures"][best_first].astype(np.float64),
        index=arrays["index"][best_first].astype(np.int64),
    )


def read_config(path: Path) -> dict[str, Any]:
    """The manifest of a run.

    Raises:
        RunError: There is none, or it is damaged.
    """
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise RunError(f"{path.parent} is not a run folder: it has no config.json") from error
    except ValueError as error:
        raise RunError(f"{path} is not valid JSON: {error}") from error
    missing = [key for key in ("workspace", "objective", "archive") if key not in config]
    if missing:
        raise RunError(f"{path} is no search manifest: it lacks {missing}")
    return dict(config)


def _read_archive(path: Path) -> dict[str, npt.NDArray[Any]]:
    names = ("solution", "objective", "measures", "index")
    try:
        with np.load(path, allow_pickle=False) as data:
            missing = [name for name in names if name not in data]
            if missing:
                raise RunError(f"{path} lacks the arrays {missing}; it has {sorted(data)}")
            arrays = {name: data[name] for name in names}
    except FileNotFoundError as error:
        raise RunError(
            f"{path.parent} has no archive.npz: its search has not logged anything yet; run it with --resume"
        ) from error
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, RunError):
            raise
        raise RunError(f"{path} is damaged: {error}") from error
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise RunError(f"{path} is damaged: its arrays have different lengths {lengths}")
    return arrays


def _read_history(path: Path) -> dict[str, npt.NDArray[np.float64]]:
    if not path.is_file():
        return {}
    with path.open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    names = [name for name in (rows[0] if rows else {}) if name]
    columns = {name: [row[name] for row in rows] for name in names}
    # A killed process may leave the last line cut off; everything before it still counts.
    whole = next((i for i in range(len(rows)) if any(columns[name][i] is None for name in names)), len(rows))
    return {name: column for name in names if (column := _numbers(columns[name][:whole])) is not None}


def _numbers(texts: list[str]) -> npt.NDArray[np.float64] | None:
    """A column of numbers, or None where it holds words (the phase's name)."""
    try:
        return np.array([float(text or "nan") for text in texts])
    except ValueError:
        return None
