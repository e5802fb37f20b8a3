"""Searching tables, simulating people at them, reading these people, and letting them work with a robot."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.experiments.tabletop.sweep import (
    DESIGNS,
    FULL,
    QUICK,
    Settings,
    curve_cells,
    layout_cells,
    reading_cells,
    spread_cells,
    team_cells,
)
from benchmarks.experiments.trial_rows import curve_rows, judged_rows, make_judge
from benchmarks.reports.experiment_report import write_table
from benchmarks.trials import Event, run_cells

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.tabletop import TabletopLayout, TabletopTask
    from legible_envs.tabletop.humans.simulation import Person

__all__ = ["find_table", "learn_people", "play_with_robot", "read_people", "reproduce", "simulate", "spread_of_reaches"]

Rows = list[dict[str, Any]]
Progress = Callable[[Event], object] | None

TASK = "columns"


def reproduce(
    folder: str | Path,
    *,
    quick: bool = False,
    seeds: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = None,
    settings: Settings | None = None,
) -> None:
    """Run what is not there yet, and write result files; tables and figures are made of them by ``sections``.

    Args:
        folder: Folder of the experiment. ``layouts.csv``, ``readings.csv``, ``curves.csv``, ``spreads.csv`` and
            ``teams.csv`` hold the results.
        quick: Fewer layouts, evaluations and repeats, no neural predictor.
        seeds: Layouts per condition, each searched anew; None for those of the settings.
        workers: See :func:`benchmarks.trials.run_cells`.
        scheduler: See there.
        progress: See there; called for each of the five parts in turn.
        settings: In place of the full or quick ones.

    Raises:
        CellsFailed: Some cells failed; everything else is finished and on disk.
        ValueError: Fewer than two layouts per condition: nothing could be said about conditions.
    """
    settings = settings or (QUICK if quick else FULL)
    if seeds is not None:
        settings = dataclasses.replace(settings, layouts=seeds)
    if settings.layouts < 2:
        raise ValueError(
            f"conditions are compared by layouts: 2 or more per condition are needed, got {settings.layouts}"
        )
    folder = Path(folder)

    def run(function: Callable[[dict[str, Any]], Any], cells: Rows, name: str) -> pd.DataFrame:
        found = run_cells(function, cells, folder, workers=workers, scheduler=scheduler, progress=progress)
        hidden = [c for c in map(str, found) if c.startswith("how.") or (c == "json" and name != "layouts")]
        write_table(folder / f"{name}.csv", found.drop(columns=hidden))
        return found

    places: Rows = run(find_table, layout_cells(settings), "layouts").to_dict("records")  # type: ignore[assignment]
    run(read_people, reading_cells(settings, places), "readings")
    run(learn_people, curve_cells(settings, places), "curves")
    run(spread_of_reaches, spread_cells(settings, places), "spreads")
    run(play_with_robot, team_cells(settings, places), "teams")


# -- cells ------------------------------------------------------------------------------------------------------------


def find_table(cell: dict[str, Any]) -> dict[str, Any]:
    """One table of a condition, and what it scores.

    The random one is the median by legibility of as many random tables as a search begins with.
    """
    from legible_envs.tabletop import TabletopWorkspace
    from optimizers import search

    workspace = TabletopWorkspace(TASK, DESIGNS.get(cell["condition"], "both"))  # type: ignore[arg-type]
    evaluations = 0
    if cell["condition"] == "Baseline":
        layout = workspace.baseline
    elif cell["condition"] == "Random":
        genomes = workspace.sample(cell["initial"], np.random.default_rng(cell["layout"]))
        order = np.argsort(workspace.legibility(genomes), kind="stable")
        layout, evaluations = workspace.decode(genomes[order[len(order) // 2]]), len(genomes)
    else:
        found = search(
            workspace,
            objective="legibility",
            evaluations=cell["evaluations"],
            initial=cell["initial"],
            seed=cell["layout"],
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
    from legible_envs.tabletop.settings import read_task

    return read_task(TASK)


def _layout(cell: dict[str, Any]) -> TabletopLayout:
    from legible_envs.tabletop import TabletopLayout

    return TabletopLayout.from_json(cell["json"])


def _people(cell: dict[str, Any]) -> Iterator[tuple[str, Person, np.random.Generator]]:
    """Name, habits and source of randomness of each person; the same ones whether or not they comply."""
    from legible_envs.tabletop.humans.simulation import Person, ReachModel, sample_person

    population = ReachModel(Person(crossing_rate=cell["crossing"]))
    for number, source in enumerate(np.random.SeedSequence(cell["seed"]).spawn(cell["participants"])):
        rng = np.random.default_rng(source)
        yield f"{cell['condition']}/{cell['layout']}/{number}", sample_person(rng, population), rng


def simulate(cell: dict[str, Any]) -> list[Trajectory]:
    """The reaches of a cell's people that have something to predict: two goals or more to choose from."""
    from legible_envs.tabletop.humans.simulation import simulate_task

    task, layout = _task(), _layout(cell)
    labels = {"condition": cell["condition"], "layout_name": f"{cell['condition']}/{cell['layout']}"}
    found = []
    for name, person, rng in _people(cell):
        found += simulate_task(layout, person, rng, task=task, participant=name, **labels)
    return [reach for reach in found if len(reach.candidates) > 1]


def read_people(cell: dict[str, Any]) -> Rows:
    """How well a predictor reads a cell's people; see :func:`benchmarks.experiments.trial_rows.judged_rows`."""
    predictor = make_judge(cell["how"])
    return judged_rows(predictor, simulate(cell), folds=cell["folds"], repeats=cell["repeats"], seed=cell["seed"])


def learn_people(cell: dict[str, Any]) -> Rows:
    """A predictor's learning curve on a cell's people; see :func:`benchmarks.experiments.trial_rows.curve_rows`."""
    predictor = make_judge(cell["how"])
    return curve_rows(predictor, simulate(cell), shares=cell["shares"], repeats=cell["repeats"], seed=cell["seed"])


def spread_of_reaches(cell: dict[str, Any]) -> Rows:
    """Mean and covariance of the reaches to each goal, step by step.

    Every person reaches for every cube once from where they place them, so that the number of reaches behind each
    covariance is the number of people, in every condition; and covariances of the same number of steps are taken with
    and without warping inside the same band. The floor that predictors add is taken off.

    Returns:
        A row per alignment, goal and step: ``time`` (share of the reach), ``x, y`` (mean from the start, metres) and
        ``xx, xy, yy`` (covariance, m^2), ``reaches``.
    """
    from predictors.reaching.gaussian import TimeSeriesGaussian

    reaches = _balanced_reaches(cell)
    rows: Rows = []
    for alignment in ("none", "mean"):
        fitted = TimeSeriesGaussian(cell["samples"], alignment=alignment).fit(reaches)  # type: ignore[arg-type]
        covariances = fitted.covariances_ - np.eye(2) * fitted.floor**2
        times = np.linspace(0.0, 1.0, cell["samples"])
        for goal, count, means, sizes in zip(fitted.goals_, fitted.counts_, fitted.means_, covariances, strict=True):
            for step, (time, mean, size) in enumerate(zip(times, means, sizes, strict=True)):
                row = {"alignment": alignment, "goal": str(goal), "reaches": int(count), "step": step, "time": time}
                row |= {"x": mean[0], "y": mean[1], "xx": size[0, 0], "xy": size[0, 1], "yy": size[1, 1]}
                rows.append(row)
    return rows


def _balanced_reaches(cell: dict[str, Any]) -> list[Trajectory]:
    from legible_envs.rollouts.trajectory import Trajectory
    from legible_envs.tabletop.humans.simulation import simulate_reach

    layout = _layout(cell)
    found = []
    for _, person, rng in _people(cell):
        for goal in layout.goals:
            times, states = simulate_reach(layout, "assembly", goal, person, rng)
            found.append(Trajectory(states, times, start="assembly", goal=goal, candidates=layout.goals))
    return found


def play_with_robot(cell: dict[str, Any]) -> Rows:
    """Each person at work: a row per person and round, with the measures of :mod:`.fluency`.

    Without a robot only the time until all is done is known, and that the person never waits for anybody.
    """
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers the environment)
    from legible_envs.tabletop.policies import ReachingPlayer

    robot: dict[str, Any] = {}
    if cell["robot"]:
        robot = {"partner": "robot", "predictor": cell["robot"], "threshold": cell["threshold"]}
    env = gym.make("LegibleTabletop-v0", task=TASK, layout=_layout(cell), **robot)
    rows: Rows = []
    for name, person, rng in _people(cell):
        for turn in range(cell["rounds"]):
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
