"""Run a sweep: a search per trial, and how well predictors predict goals in the best layout that it found."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.sweeps.analysis import SEARCH, write_tables
from benchmarks.sweeps.sweep import Sweep
from benchmarks.trials import Event, TrialsFailed, run_trials, trial_function

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.workspace import Workspace

__all__ = ["run_search", "run_sweep"]


def run_sweep(
    sweep: Sweep,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    worker_timeout: float = 60.0,
    progress: Callable[[Event], object] | None = None,
) -> pd.DataFrame:
    """Run every trial that has no result yet; write ``results.csv`` and ``summary.csv``.

    Args:
        sweep: What to run.
        folder: Where results are kept; see :func:`benchmarks.trials.run_trials`.
        workers: Processes on this machine; all cores if None.
        scheduler: Address of a Dask scheduler instead.
        worker_timeout: Seconds to wait for a worker of the cluster where there is none.
        progress: Called whenever something changes.

    Returns:
        A row per trial: its labels, then ``best`` (the objective's value of the best layout), ``legibility``,
        ``distance``, ``qd_score``, ``coverage``, ``scored`` (layouts), ``best_genome`` (JSON) and ``accuracy.NAME`` of
        every predictor (NaN where it could not be evaluated, with the reason in ``omitted.NAME``).

    Raises:
        TrialsFailed: Some trials failed twice; both tables are written all the same.
        TrialsStopped: The cluster was lost, or no worker came in time; what was finished is on disk.
    """
    trials = [variant.trial for variant in sweep.variants()]
    try:
        run_trials(
            run_search,
            trials,
            folder,
            workers=workers,
            scheduler=scheduler,
            worker_timeout=worker_timeout,
            progress=progress,
        )
    except TrialsFailed as error:
        raise TrialsFailed(str(error), error.failures, write_tables(sweep, folder)) from error
    return write_tables(sweep, folder)


@trial_function(SEARCH)
def run_search(trial: dict[str, Any]) -> dict[str, Any]:
    """One search of a sweep."""
    from legible_envs.workspace import make_workspace
    from optimizers import search

    workspace = make_workspace(trial["workspace"])
    options = {name: value for name, value in trial["emitter"].items() if name != "emitter"}
    result = search(
        workspace,
        objective=trial["objective"],
        emitter=trial["emitter"]["emitter"],
        emitter_options=options or None,
        evaluations=trial["evaluations"],
        seed=trial["seed"],
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
        row |= _accuracies(workspace, result.best_genome, trial)
    return row


def _accuracies(workspace: Workspace, genome: np.ndarray[Any, Any], trial: Mapping[str, Any]) -> dict[str, Any]:
    """Mean accuracy over 10 to 90 % observed of each predictor on participants simulated in the best layout.

    A predictor that could not be evaluated has no number, and its reason as ``omitted.NAME``.
    """
    if not trial.get("predictors"):
        return {}
    from predictors.evaluation.cross_validation import evaluate
    from predictors.evaluation.omissions import NothingEvaluatedError

    settings = dict(trial["people"])
    participants = int(settings.pop("participants", 8))
    rng = np.random.default_rng(np.random.SeedSequence((trial["seed"], 1)))
    trajectories = workspace.simulate(genome, participants, rng, **settings)
    means: dict[Any, float] = {}
    try:
        found = evaluate(list(trial["predictors"]), trajectories, rare="keep", seed=trial["seed"])
        means = found.table.groupby("predictor")["correct"].mean().to_dict()
        reasons = dict(zip(found.omitted["predictor"], found.omitted["reason"], strict=True))
    except NothingEvaluatedError as error:
        reasons = {each.predictor: each.reason for each in error.omissions}
    accuracies = {f"accuracy.{name}": float(means[name]) if name in means else None for name in trial["predictors"]}
    return accuracies | {f"omitted.{name}": str(reason) for name, reason in reasons.items()}
