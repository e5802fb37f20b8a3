"""Scoring the stages of recorded play, and reading the people in them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.experiments.recorded.sweep import FULL, QUICK, Settings, reading_cells, score_cells
from benchmarks.reports.experiment_report import write_table
from benchmarks.trials import Event, run_cells

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["read_stages", "reproduce", "score_stages"]

Rows = list[dict[str, Any]]


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Event], object] | None = None,
    settings: Settings | None = None,
) -> None:
    """Run what is not there yet, and write ``scores.csv`` and ``readings.csv``; ``sections`` makes tables and figures.

    Args:
        folder: Folder of the experiment.
        quick: Fewer predictors, one split.
        seeds: Repeats of the cross-validation; None for those of the settings.
        workers: See :func:`benchmarks.trials.run_cells`.
        scheduler: See there.
        progress: See there.
        settings: In place of the full or quick ones.

    Raises:
        RecordingsError: The recordings are not there; the message says how to get them.
        CellsFailed: Some cells failed; everything else is finished and on disk.
    """
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories

    settings = settings or (QUICK if quick else FULL)
    if seeds is not None:
        settings = dataclasses.replace(settings, repeats=seeds)
    folder = Path(folder)
    walks = len(recorded_trajectories())
    parts: tuple[tuple[str, Callable[[dict[str, Any]], Rows], Rows], ...] = (
        ("scores", score_stages, score_cells(settings, walks)),
        ("readings", read_stages, reading_cells(settings, walks)),
    )
    for name, function, cells in parts:
        found = run_cells(function, cells, folder, workers=workers, scheduler=scheduler, progress=progress)
        write_table(folder / f"{name}.csv", found.drop(columns=[c for c in found if str(c).startswith("how.")]))


def _walks(cell: dict[str, Any]) -> list[Trajectory]:
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories

    return recorded_trajectories(layouts=[cell["kitchen"]], candidate_set=cell["candidate_set"])


def _stage(walk: Trajectory) -> dict[str, Any]:
    return {"start": walk.start, "goals": " ".join(sorted(walk.candidates)), "goal": walk.goal}


def score_stages(cell: dict[str, Any]) -> Rows:
    """Eq. 2 of every reach that somebody was recorded to make, expected over shortest walks and their prefixes.

    Returns:
        Rows ``start, goals`` (the stage), ``goal, walks, score``; and with an empty ``goal`` the mean over the goals of
        the stage, as in Eq. 3, walked to or not.
    """
    from legible_envs.legibility import From, goal_legibility
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.overcooked.scoring.explanation import grid_graph

    walks = _walks(cell)
    layout = walks[0].layout
    assert isinstance(layout, OvercookedLayout)  # recorded people walked in kitchens
    graph = grid_graph(layout)
    stages: dict[tuple[str, str], list[str]] = {}
    for walk in walks:
        found = _stage(walk)
        stages.setdefault((found["start"], found["goals"]), []).append(found["goal"])
    rows: Rows = []
    for (start, text), taken in sorted(stages.items()):
        goals = text.split(" ")
        scores = {}
        for goal in goals:
            prefixes = goal_legibility(graph, From(start), goal, goals)
            scores[goal] = math.fsum(p.probability * p.weight * p.value for p in prefixes)
        stage = {"start": start, "goals": text, "candidates": len(goals)}
        rows.append(stage | {"goal": "", "walks": len(taken), "score": math.fsum(scores.values()) / len(goals)})
        rows += [stage | {"goal": g, "walks": taken.count(g), "score": scores[g]} for g in goals]
    return rows


def read_stages(cell: dict[str, Any]) -> Rows:
    """How well a predictor reads the people of a kitchen, by cross-validation.

    Returns:
        Rows ``start, goals, goal, participant, walks, correct``: how often right, mean over fractions observed and
        repeats.
    """
    from predictors.evaluation.cross_validation import evaluate
    from predictors.registry import make_predictor

    walks = _walks(cell)
    predictor = make_predictor(cell["how"]["name"], **cell["how"]["parameters"])
    found = evaluate(
        {"it": predictor},
        walks,
        cv=cell["folds"],
        repeats=cell["repeats"],
        cut=cell["cut"],
        rare="keep",
        seed=cell["seed"],
    )
    import pandas as pd

    stages = pd.DataFrame([_stage(walk) | {"trajectory": i} for i, walk in enumerate(walks)])
    table = found.table.drop(columns="goal").merge(stages, on="trajectory")
    keys = ["start", "goals", "goal", "participant"]
    each = table.groupby(keys).agg(walks=("trajectory", "nunique"), correct=("correct", "mean")).reset_index()
    return [{str(k): v for k, v in row.items()} for row in each.to_dict("records")]
