"""Searching tables, simulating participants at them, predicting their goals, and letting them work with a robot."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from benchmarks.experiments.predictor_settings import predictor_from
from benchmarks.experiments.running import Rows, RunOptions, log_trials, with_layouts
from benchmarks.experiments.tabletop.sweep import (
    DESIGNS,
    FULL,
    QUICK,
    Settings,
    accuracy_trials,
    curve_trials,
    layout_trials,
    spread_trials,
    team_trials,
)
from benchmarks.experiments.trial_rows import accuracy_rows, curve_rows
from benchmarks.presenters.panels import median_of_random
from benchmarks.trials import TrialName, trial_function

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.tabletop import TabletopLayout, TabletopTask
    from legible_envs.tabletop.humans.simulation import Person

__all__ = [
    "covariance_rows",
    "evaluate_predictor",
    "find_table",
    "play_with_robot",
    "reproduce",
    "simulate",
    "spread_of_reaches",
    "trace_learning_curve",
]

TASK = "columns"

_FORMER = "benchmarks.tabletop_conditions.run"


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
        folder: Folder of the experiment. ``layouts.csv``, ``readings.csv``, ``curves.csv``, ``spreads.csv`` and
            ``teams.csv`` hold the results.
        quick: Fewer layouts, evaluations and repeats, no neural predictor.
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

    places: Rows = log("layouts", find_table, layout_trials(settings)).to_dict("records")  # type: ignore[assignment]
    log("readings", evaluate_predictor, accuracy_trials(settings, places), "json")
    log("curves", trace_learning_curve, curve_trials(settings, places), "json")
    log("spreads", spread_of_reaches, spread_trials(settings, places), "json")
    log("teams", play_with_robot, team_trials(settings, places), "json")


# -- trials ------------------------------------------------------------------------------------------------------------


@trial_function(TrialName("tabletop/layout", (f"{_FORMER}:find_table",)))
def find_table(trial: dict[str, Any]) -> dict[str, Any]:
    """One table of a condition, and what it scores.

    The random one is the median by legibility of as many random tables as a search begins with.
    """
    from legible_envs.tabletop import TabletopWorkspace
    from optimizers import search

    workspace = TabletopWorkspace(TASK, DESIGNS.get(trial["condition"], "both"))  # type: ignore[arg-type]
    evaluations = 0
    if trial["condition"] == "Baseline":
        layout = workspace.baseline
    elif trial["condition"] == "Random":
        evaluations = trial["initial"]
        layout = workspace.decode(median_of_random(workspace, evaluations, np.random.default_rng(trial["layout"])))
    else:
        found = search(
            workspace,
            objective="legibility",
            evaluations=trial["evaluations"],
            initial=trial["initial"],
            seed=trial["layout"],
            progress=False,
        )
        if found.best_genome is None:
            raise ValueError(f"the search found no table that scores in {found.evaluations:,} evaluations")
        layout, evaluations = found.best_layout, found.evaluations
    summary = workspace.summary(layout)
    keys = ("score", "objective", "normalised", "distance", "mean_detour", "max_detour", "num_obstacles")
    row: dict[str, Any] = {"found_after": evaluations, **{key: summary[key] for key in keys}}
    return {**row, "layout_id": summary["layout_id"], "json": json.dumps(layout.to_dict())}


def _task() -> TabletopTask:
    from legible_envs.tabletop.task import read_task

    return read_task(TASK)


def _layout(trial: dict[str, Any]) -> TabletopLayout:
    from legible_envs.tabletop import TabletopLayout

    return TabletopLayout.from_json(trial["json"])


def _people(trial: dict[str, Any]) -> Iterator[tuple[str, Person, np.random.Generator]]:
    """Name, habits and source of randomness of each participant; the same ones whether or not they comply."""
    from legible_envs.tabletop.humans.simulation import Person, ReachModel, sample_person

    population = ReachModel(Person(crossing_rate=trial["crossing"]))
    for number, source in enumerate(np.random.SeedSequence(trial["seed"]).spawn(trial["participants"])):
        rng = np.random.default_rng(source)
        yield f"{trial['condition']}/{trial['layout']}/{number}", sample_person(rng, population), rng


def simulate(trial: dict[str, Any]) -> list[Trajectory]:
    """The reaches of a trial's participants that have something to predict: two goals or more to choose from."""
    from legible_envs.tabletop.humans.simulation import simulate_task

    task, layout = _task(), _layout(trial)
    labels = {"condition": trial["condition"], "layout_name": f"{trial['condition']}/{trial['layout']}"}
    found = []
    for name, person, rng in _people(trial):
        found += simulate_task(layout, person, rng, task=task, participant=name, **labels)
    return [reach for reach in found if len(reach.candidates) > 1]


@trial_function(TrialName("tabletop/accuracy", (f"{_FORMER}:read_people",)))
def evaluate_predictor(trial: dict[str, Any]) -> Rows:
    """How well a predictor predicts the goals of a trial's participants; the rows of :func:`.accuracy_rows`."""
    validation = {"folds": trial["folds"], "repeats": trial["repeats"], "seed": trial["seed"]}
    return accuracy_rows(predictor_from(trial["how"]), simulate(trial), **validation)


@trial_function(TrialName("tabletop/curve", (f"{_FORMER}:learn_people",)))
def trace_learning_curve(trial: dict[str, Any]) -> Rows:
    """A predictor's learning curve on a trial's participants; the rows of :func:`.curve_rows`.

    Splits whose smallest training set never mentions some goal, which could then not even be named, are drawn anew.
    """
    splits = {"shares": trial["shares"], "repeats": trial["repeats"], "seed": trial["seed"]}
    return curve_rows(predictor_from(trial["how"]), simulate(trial), **splits, rare="redraw")


@trial_function(TrialName("tabletop/spread", (f"{_FORMER}:spread_of_reaches",)))
def spread_of_reaches(trial: dict[str, Any]) -> Rows:
    """Mean and covariance of the reaches to each goal, step by step; the rows of :func:`covariance_rows`.

    Every participant reaches for every cube once from where they place them, so that the number of reaches behind each
    covariance is the number of participants, in every condition.
    """
    return covariance_rows(_balanced_reaches(trial), trial["samples"])


def covariance_rows(reaches: Sequence[Trajectory], samples: int) -> Rows:
    """Mean and covariance of reaches to each goal, step by step.

    Covariances of the same number of steps are taken with and without warping inside the same band. The floor that
    predictors add is taken off.

    Args:
        reaches: At one table, two or more to a goal.
        samples: Steps of a mean reach.

    Returns:
        A row per alignment, goal and step: ``time`` (share of the reach), ``x, y`` (mean from the start, metres) and
        ``xx, xy, yy`` (covariance, m^2), ``reaches``.
    """
    from predictors.reaching.gaussian import TimeSeriesGaussian

    rows: Rows = []
    for alignment in ("none", "mean"):
        fitted = TimeSeriesGaussian(samples, alignment=alignment).fit(reaches)  # type: ignore[arg-type]
        covariances = fitted.covariances_ - np.eye(2) * fitted.floor**2
        times = np.linspace(0.0, 1.0, samples)
        for goal, count, means, sizes in zip(fitted.goals_, fitted.counts_, fitted.means_, covariances, strict=True):
            for step, (time, mean, size) in enumerate(zip(times, means, sizes, strict=True)):
                row = {"alignment": alignment, "goal": str(goal), "reaches": int(count), "step": step, "time": time}
                row |= {"x": mean[0], "y": mean[1], "xx": size[0, 0], "xy": size[0, 1], "yy": size[1, 1]}
                rows.append(row)
    return rows


def _balanced_reaches(trial: dict[str, Any]) -> list[Trajectory]:
    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.tabletop.humans.simulation import simulate_reach

    layout = _layout(trial)
    found = []
    for _, person, rng in _people(trial):
        for goal in layout.goals:
            times, states = simulate_reach(layout, "assembly", goal, person, rng)
            found.append(Trajectory(states, times, start="assembly", goal=goal, candidates=layout.goals))
    return found


@trial_function(TrialName("tabletop/team", (f"{_FORMER}:play_with_robot",)))
def play_with_robot(trial: dict[str, Any]) -> Rows:
    """Each participant at work: a row per participant and round, with the measures of :mod:`.fluency`.

    Without a robot the only measure is the time until the task is done.
    """
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers the environment)
    from legible_envs.tabletop.policies import ReachingPlayer

    robot: dict[str, Any] = {}
    if trial["robot"]:
        robot = {"partner": "robot", "predictor": trial["robot"], "threshold": trial["threshold"]}
    env = gym.make("LegibleTabletop-v0", task=TASK, layout=_layout(trial), **robot)
    rows: Rows = []
    for name, person, rng in _people(trial):
        for turn in range(trial["rounds"]):
            player, over = ReachingPlayer(env, person, rng), False
            obs, info = env.reset(seed=turn)
            while not over:
                obs, _, terminated, truncated, info = env.step(player(obs, info))
                over = terminated or truncated
            measures = dict(env.unwrapped.team_measures()) if robot else {}  # type: ignore[attr-defined]
            if not robot:
                measures["completion_time"] = info["time"] if terminated else None
            who = {"participant": name, "round": turn, "done": info["num_done"], "path_length": info["path_length"]}
            rows.append(who | measures)
    env.close()
    return rows
