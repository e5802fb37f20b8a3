"""Scoring the stages of recorded play, and predicting the goals of the participants in them."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from benchmarks.experiments.predictor_settings import predictor_from
from benchmarks.experiments.recorded.sweep import FULL, QUICK, Settings, accuracy_trials, score_trials
from benchmarks.experiments.running import Rows, RunOptions, log_trials
from benchmarks.trials import TrialName, trial_function

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["evaluate_by_stage", "reproduce", "score_stages"]


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    settings: Settings | None = None,
    **how: Unpack[RunOptions],
) -> None:
    """Run the trials that have no result yet; write ``scores.csv`` and ``readings.csv`` (``sections`` shows them).

    Args:
        folder: Folder of the experiment.
        quick: Fewer predictors, one split.
        seeds: Repeats of the cross-validation; None for those of the settings.
        settings: In place of the full or quick ones.
        how: ``workers``, ``scheduler`` and ``progress`` of :func:`benchmarks.trials.run_trials`.

    Raises:
        RecordingsError: The recordings are not there; the message says how to get them.
        TrialsFailed: Some trials failed; everything else is finished and on disk.
    """
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories

    settings = settings or (QUICK if quick else FULL)
    if seeds is not None:
        settings = dataclasses.replace(settings, repeats=seeds)
    folder, count = Path(folder), len(recorded_trajectories())
    log_trials(score_stages, score_trials(settings, count), folder / "scores.csv", **how)
    log_trials(evaluate_by_stage, accuracy_trials(settings, count), folder / "readings.csv", **how)


def _recorded(trial: dict[str, Any]) -> list[Trajectory]:
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories

    return recorded_trajectories(layouts=[trial["kitchen"]], candidate_set=trial["candidate_set"])


def _stage(trajectory: Trajectory) -> dict[str, Any]:
    goals = " ".join(sorted(trajectory.candidates))
    return {"start": trajectory.start, "goals": goals, "goal": trajectory.goal}


@trial_function(TrialName("recorded/score", ("benchmarks.recorded_people.run:score_stages",)))
def score_stages(trial: dict[str, Any]) -> Rows:
    """Legibility (Eq. 2) of every recorded stage and goal, expected over shortest paths and their prefixes.

    Returns:
        Rows ``start, goals`` (the stage), ``goal, walks`` (how many were recorded), ``score``; and with an empty
        ``goal`` the mean over all goals of the stage, as in Eq. 3.
    """
    from legible_envs.legibility import From, goal_legibility
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.overcooked.scoring.explanation import grid_graph

    trajectories = _recorded(trial)
    layout = trajectories[0].layout
    assert isinstance(layout, OvercookedLayout)
    graph = grid_graph(layout)
    stages: dict[tuple[str, str], list[str]] = {}
    for trajectory in trajectories:
        found = _stage(trajectory)
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


@trial_function(TrialName("recorded/accuracy", ("benchmarks.recorded_people.run:read_stages",)))
def evaluate_by_stage(trial: dict[str, Any]) -> Rows:
    """How well a predictor predicts the goals of the participants in a kitchen, by cross-validation.

    Returns:
        Rows ``start, goals, goal, participant, walks, correct``: how many trajectories, and how often predictions are
        right, mean over fractions observed and repeats.
    """
    import pandas as pd

    from predictors.evaluation.cross_validation import evaluate

    trajectories = _recorded(trial)
    found = evaluate(
        {"it": predictor_from(trial["how"])},
        trajectories,
        cv=trial["folds"],
        repeats=trial["repeats"],
        cut=trial["cut"],
        rare="keep",
        seed=trial["seed"],
    )
    stages = pd.DataFrame([_stage(one) | {"trajectory": i} for i, one in enumerate(trajectories)])
    table = found.table.drop(columns="goal").merge(stages, on="trajectory")
    keys = ["start", "goals", "goal", "participant"]
    each = table.groupby(keys).agg(walks=("trajectory", "nunique"), correct=("correct", "mean")).reset_index()
    return [{str(k): v for k, v in row.items()} for row in each.to_dict("records")]
