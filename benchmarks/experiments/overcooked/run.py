"""Searching layouts, simulating participants in them, and predicting their goals with every predictor."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from benchmarks.experiments.overcooked.sweep import (
    FULL,
    OBJECTIVES,
    QUICK,
    Settings,
    accuracy_trials,
    curve_trials,
    fit_trials,
    layout_trials,
    people_of,
)
from benchmarks.experiments.overcooked.teams import play_with_robot, team_trials
from benchmarks.experiments.predictor_settings import predictor_from
from benchmarks.experiments.running import Rows, RunOptions, log_trials, with_layouts
from benchmarks.experiments.trial_rows import accuracy_rows, curve_rows
from benchmarks.presenters.panels import median_of_random
from benchmarks.trials import TrialName, trial_function

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["evaluate_predictor", "find_layout", "fit_people", "reproduce", "simulate", "trace_learning_curve"]

_FORMER = "benchmarks.overcooked_conditions.run"


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    settings: Settings | None = None,
    **how: Unpack[RunOptions],
) -> None:
    """Run the trials that have no result yet, and write result files; ``sections`` makes tables and figures of them.

    Args:
        folder: Folder of the experiment. ``layouts.csv``, ``people.csv``, ``readings.csv``, ``curves.csv`` and
            ``teams.csv`` hold the results.
        quick: Fewer layouts, participants and searches.
        seeds: Layouts per condition, each searched anew; None for those of the settings.
        settings: In place of the full or quick ones.
        how: ``workers``, ``scheduler`` and ``progress`` of :func:`benchmarks.trials.run_trials`, for each of the five
            parts in turn.

    Raises:
        TrialsFailed: Some trials failed; everything else is finished and on disk.
        ValueError: Fewer than two layouts per condition: nothing could be said about conditions.
    """
    settings, folder = with_layouts(settings or (QUICK if quick else FULL), seeds), Path(folder)

    def log(name: str, function: Callable[[dict[str, Any]], Any], trials: Rows, *hidden: str) -> pd.DataFrame:
        return log_trials(function, trials, folder / f"{name}.csv", hidden=("how", *hidden), **how)

    layouts = log("layouts", find_layout, layout_trials(settings))
    people = people_of(log("people", fit_people, fit_trials(_num_recorded())))
    places: Rows = layouts[layouts["table"] == "layout"].to_dict("records")  # type: ignore[assignment]
    log("readings", evaluate_predictor, accuracy_trials(settings, places, people), "people")
    log("curves", trace_learning_curve, curve_trials(settings, places, people), "people")
    if settings.team_participants:
        log("teams", play_with_robot, team_trials(settings, places, people), "people")


def _num_recorded() -> int:
    """How many recorded trajectories there are to fit participants to."""
    from legible_envs.datasets.overcooked_2019 import RecordingsError, recorded_trajectories

    try:
        return len(recorded_trajectories())
    except RecordingsError:
        return 0


# -- trials ------------------------------------------------------------------------------------------------------------


@trial_function(TrialName("overcooked/layout", (f"{_FORMER}:find_layout",)))
def find_layout(trial: dict[str, Any]) -> Rows:
    """One layout of a condition: a row about it, and one for each elite of the search.

    The random one is the median by legibility of as many random layouts as a search begins with.
    """
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace
    from optimizers import search

    workspace = OvercookedWorkspace(shape=tuple(trial["shape"]))
    elites: Rows = []
    if trial["condition"] == "Random":
        evaluations = trial["initial"]
        genome = median_of_random(workspace, evaluations, np.random.default_rng(trial["layout"]))
    else:
        found = search(
            workspace,
            objective=OBJECTIVES[trial["condition"]],
            iterations=(trial["initial"], trial["improvements"]),
            seed=trial["layout"],
            progress=False,
        )
        if found.best_genome is None:
            raise ValueError(f"the search found no layout that scores in {found.evaluations:,} evaluations")
        genome, evaluations = found.best_genome, found.evaluations
        data = found.archive.data(["measures", "objective"])
        elites = [
            {"table": "elite", "obstacles": int(a), "order": workspace.order_names[int(b)], "objective": float(value)}
            for (a, b), value in zip(data["measures"], data["objective"], strict=True)
        ]
    summary = workspace.summary(genome)
    row = {"table": "layout", "drawing": workspace.decode(genome).to_ascii(), "evaluations": evaluations}
    keys = ("score", "normalised", "distance", "num_obstacles", "single_goal_share")
    return [row | {key: summary[key] for key in keys}, *elites]


@trial_function(TrialName("overcooked/people", (f"{_FORMER}:fit_people",)))
def fit_people(trial: dict[str, Any]) -> Rows:
    """One kind of walker fitted to the recorded participants: a row for all of them, and one for each."""
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories
    from legible_envs.overcooked.humans.planner_fitting import fit_boltzmann, fit_planner

    trajectories = recorded_trajectories()
    if trial["walker"] == "boltzmann":
        return [{k: v for k, v in row.items() if k != "walker"} for row in fit_boltzmann(trajectories)]
    fit = fit_planner(trajectories)
    whole = {key: getattr(fit, key) for key in ("depth", "turn_cost", "recency", "fade", "slip", "log_likelihood")}
    each = [{"participant": name, "turn_cost": t, "slip": s} for name, (t, s) in fit.people.items()]
    counts = {"steps": fit.num_steps, "walks": len(trajectories), "people": len(fit.people)}
    return [{"participant": "", **counts, **whole}, *each]


def simulate(trial: dict[str, Any]) -> list[Trajectory]:
    """The trajectories of a trial's participants that have something to predict: two goals or more to choose from."""
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.humans.planner_fitting import draw_person
    from legible_envs.overcooked.humans.simulation import simulate_participants

    label = f"{trial['condition']}/{trial['layout']}"
    trajectories = simulate_participants(
        OvercookedLayout.from_ascii(trial["drawing"]),
        trial["participants"],
        np.random.default_rng(trial["seed"]),
        population=draw_person(trial["people"]),
        participant=label,
        condition=trial["condition"],
        layout_name=label,
    )
    return [trajectory for trajectory in trajectories if len(trajectory.candidates) > 1]


@trial_function(TrialName("overcooked/accuracy", (f"{_FORMER}:read_people",)))
def evaluate_predictor(trial: dict[str, Any]) -> Rows:
    """How well a predictor predicts the goals of a trial's participants, by cross-validation.

    Returns:
        Rows of four tables, told apart by ``table``: ``accuracy`` (per participant and fraction observed), ``metrics``
        (per fraction), ``confusion`` (in trajectories, summed over fractions, repeats averaged) and, for a predictor
        that learns costs, ``cost`` (of each cell of the kitchen, learned from all trajectories).
    """
    trajectories, predictor = simulate(trial), predictor_from(trial["how"])
    validation = {"folds": trial["folds"], "repeats": trial["repeats"], "seed": trial["seed"]}
    rows = accuracy_rows(predictor, trajectories, **validation, starts=False, confusion_over="sum")
    return [*rows, *_costs(predictor, trajectories)]


def _costs(predictor: Any, trajectories: list[Trajectory]) -> Rows:
    """The cost of each cell that a predictor learns from all trajectories; nothing for those that learn none."""
    from sklearn.base import clone

    if getattr(predictor, "cell_costs", None) != "learned":
        return []
    cost = clone(predictor).fit(trajectories).irl_.cost_
    return [
        {"table": "cost", "row": int(row), "column": int(column), "cost": float(cost[row, column])}
        for row, column in np.argwhere(np.isfinite(cost))
    ]


@trial_function(TrialName("overcooked/curve", (f"{_FORMER}:learn_people",)))
def trace_learning_curve(trial: dict[str, Any]) -> Rows:
    """A predictor's learning curve on a trial's participants: accuracy (mean over fractions) per split and share."""
    splits = {"shares": trial["shares"], "repeats": trial["repeats"], "seed": trial["seed"]}
    curve = curve_rows(predictor_from(trial["how"]), simulate(trial), **splits)
    return [{"table": "curve", **row} for row in curve]
