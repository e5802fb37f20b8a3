"""Run every search of the comparison; nothing that has finished is run again."""

from __future__ import annotations

import dataclasses
import json
import warnings
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Unpack

from benchmarks.experiments.optimizers.sweep import FULL, LEARNED, QUICK, Settings, trials_of
from benchmarks.experiments.running import Rows, RunOptions, log_trials
from benchmarks.trials import TrialName, trial_function

if TYPE_CHECKING:
    from legible_envs.workspace import Workspace

__all__ = ["reproduce", "run_search"]

_HIDDEN: Final = ("workspace", "iterations", "options", "evaluations")


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    settings: Settings | None = None,
    **how: Unpack[RunOptions],
) -> None:
    """Run the trials that have no result yet, and write ``searches.csv``; ``sections`` makes tables and figures of it.

    Args:
        folder: Folder of the experiment.
        quick: Small grids, few seeds and small budgets.
        seeds: Searches of each kind, of large budgets at most as many as planned; None for those of the settings.
        settings: In place of the full or quick ones.
        how: ``workers``, ``scheduler`` and ``progress`` of :func:`benchmarks.trials.run_trials`.

    Warns:
        UserWarning: PyTorch is not installed: designers that learn are left out.

    Raises:
        TrialsFailed: Some trials failed; everything else is finished and on disk.
        ValueError: Fewer than two seeds: nothing could be said about methods.
    """
    settings = settings or (QUICK if quick else FULL)
    if seeds is not None:
        settings = settings.with_seeds(seeds)
    if settings.seeds < 2:
        raise ValueError(f"methods are compared by their searches: 2 seeds or more are needed, got {settings.seeds}")
    if settings.learned_budgets and find_spec("torch") is None:
        settings = dataclasses.replace(settings, learned_budgets=())
        warnings.warn(
            f'left out of the comparison: {", ".join(LEARNED)}, which needs PyTorch: pip install "legible-envs[torch]"',
            stacklevel=2,
        )
    log_trials(run_search, trials_of(settings), Path(folder) / "searches.csv", hidden=_HIDDEN, **how)


@trial_function(TrialName("optimizers/search", ("benchmarks.optimizer_comparison.run:run_cell",)))
def run_search(trial: dict[str, Any]) -> Rows:
    """One search: a row for each logged moment, and one for its end.

    Columns: ``moment`` (``"running"`` or ``"end"``), ``scored`` layouts so far, ``best``, ``qd_score``, ``coverage``;
    the last row also has ``drawing``, the best kitchen without obstacles that do nothing.
    """
    from optimizers import search

    iterations = trial["iterations"]
    found = search(
        _workspace(json.dumps(trial["workspace"])),
        emitter=trial["method"],
        emitter_options=trial["options"] or None,
        evaluations=trial["evaluations"],
        iterations=None if iterations is None else (iterations[0], iterations[1]),
        seed=trial["seed"],
        progress=False,
    )
    rows: Rows = [
        {"moment": "running", "scored": row["evaluations"], "drawing": None}
        | {key: row[key] for key in ("best", "qd_score", "coverage")}
        for row in _thinned(found.history)
    ]
    if found.best_layout is None:
        raise ValueError(f"no layout scored in {found.evaluations:,} evaluations of {json.dumps(trial)}")
    rows.append(
        {
            "moment": "end",
            "scored": found.evaluations,
            "drawing": found.best_layout.to_ascii(),
            "best": found.best_objective,
            "qd_score": found.qd_score,
            "coverage": found.coverage,
        }
    )
    return rows


@cache
def _workspace(config: str) -> Workspace:
    """A workspace, made once in each process: its tables and calibration take longer than a small search."""
    from legible_envs.workspace import make_workspace

    return make_workspace(json.loads(config))


def _thinned(history: Rows, most: int = 40) -> Rows:
    """At most ``most`` rows at evenly spaced ratios of evaluations: curves are drawn on a logarithmic axis."""
    if len(history) <= most:
        return history
    first, last = history[0]["evaluations"], history[-1]["evaluations"]
    kept, target = [], float(first)
    for row in history:
        if row["evaluations"] >= target:
            kept.append(row)
            while target <= row["evaluations"]:
                target *= (last / first) ** (1 / (most - 1))
    return kept if kept[-1] is history[-1] else [*kept, history[-1]]
