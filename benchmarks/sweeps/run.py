"""Run a sweep: a search per cell, and how well predictors read people in what it found."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.sweeps.analysis import CELL_FUNCTION, write_tables
from benchmarks.sweeps.sweep import Sweep
from benchmarks.trials import CellsFailed, Event, run_cells

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["run_cell", "run_sweep"]


def run_sweep(
    sweep: Sweep,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Event], object] | None = None,
) -> pd.DataFrame:
    """Run every cell that has no result yet; write ``results.csv`` and ``summary.csv``.

    Args:
        sweep: What to run.
        folder: Where results are kept; see :func:`benchmarks.trials.run_cells`.
        workers: Processes on this machine; all cores if None.
        scheduler: Address of a Dask scheduler instead.
        progress: Called whenever something changes.

    Returns:
        A row per cell: its labels, then ``best`` (the objective's value of the best layout), ``legibility``,
        ``distance``, ``qd_score``, ``coverage``, ``scored`` (layouts), ``best_genome`` (JSON) and ``accuracy.NAME`` of
        every predictor.

    Raises:
        CellsFailed: Some cells failed twice; both tables are written all the same.
    """
    cells = [variant.cell for variant in sweep.variants()]
    try:
        run_cells(CELL_FUNCTION, cells, folder, workers=workers, scheduler=scheduler, progress=progress)
    except CellsFailed as error:
        raise CellsFailed(str(error), error.failures, write_tables(sweep, folder)) from error
    return write_tables(sweep, folder)


def run_cell(cell: dict[str, Any]) -> dict[str, Any]:
    """One search of a sweep."""
    from legible_envs.workspace import make_workspace
    from optimizers import search

    workspace = make_workspace(cell["workspace"])
    options = {name: value for name, value in cell["emitter"].items() if name != "emitter"}
    result = search(
        workspace,
        objective=cell["objective"],
        emitter=cell["emitter"]["emitter"],
        emitter_options=options or None,
        evaluations=cell["evaluations"],
        seed=cell["seed"],
        progress=False,
    )
    row: dict[str, Any] = {
        "best": result.best_objective,
        "legibility": None,
        "distance": None,
        "qd_score": result.qd_score,
        "coverage": result.coverage,
        "scored": result.evaluations,
        "best_genome": None,
    }
    if result.best_genome is not None:
        row["legibility"] = float(workspace.legibility(result.best_genome))
        row["distance"] = float(workspace.distance(result.best_genome))
        row["best_genome"] = json.dumps(result.best_genome.tolist())
        row |= _read_people(workspace, result.best_genome, cell)
    return row


def _read_people(workspace: Any, genome: Any, cell: Mapping[str, Any]) -> dict[str, float]:
    """Mean accuracy over 10 to 90 % observed of each predictor on people simulated in the best layout."""
    if not cell.get("predictors"):
        return {}
    from predictors.evaluation.cross_validation import evaluate

    settings = dict(cell["people"])
    participants = int(settings.pop("participants", 8))
    rng = np.random.default_rng(np.random.SeedSequence((cell["seed"], 1)))
    walks = workspace.simulate(genome, participants, rng, **settings)
    found = evaluate(list(cell["predictors"]), walks, rare="keep", seed=cell["seed"])
    means = found.table.groupby("predictor")["correct"].mean()
    return {f"accuracy.{name}": float(value) for name, value in means.items()}
