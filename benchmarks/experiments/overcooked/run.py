"""Searching layouts, simulating people in them, and reading these people with every predictor."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.experiments.overcooked.sweep import (
    FULL,
    OBJECTIVES,
    QUICK,
    Settings,
    curve_cells,
    layout_cells,
    people_cells,
    people_of,
    reading_cells,
)
from benchmarks.experiments.trial_rows import judged_rows, labelled, make_judge
from benchmarks.reports.experiment_report import write_table
from benchmarks.trials import Event, run_cells

if TYPE_CHECKING:
    import pandas as pd

    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["find_layout", "fit_people", "learn_people", "read_people", "reproduce", "simulate"]

Rows = list[dict[str, Any]]
Progress = Callable[[Event], object] | None


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
        folder: Folder of the experiment. ``layouts.csv``, ``people.csv``, ``readings.csv`` and ``curves.csv`` hold the
            results.
        quick: Fewer layouts, people and searches.
        seeds: Layouts per condition, each searched anew; None for those of the settings.
        workers: See :func:`benchmarks.trials.run_cells`.
        scheduler: See there.
        progress: See there; called for each of the four parts in turn.
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
        write_table(
            folder / f"{name}.csv", found.drop(columns=[c for c in found if str(c).startswith(("people.", "how."))])
        )
        return found

    layouts = run(find_layout, layout_cells(settings), "layouts")
    fits = run(fit_people, people_cells(_recorded_walks()), "people")
    people = people_of(fits)
    places: Rows = layouts[layouts["table"] == "layout"].to_dict("records")  # type: ignore[assignment]
    run(read_people, reading_cells(settings, places, people), "readings")
    run(learn_people, curve_cells(settings, places, people), "curves")


def _recorded_walks() -> int:
    """How many walks there are to fit people to."""
    from legible_envs.datasets.overcooked_2019 import RecordingsError, recorded_trajectories

    try:
        return len(recorded_trajectories())
    except RecordingsError:
        return 0


# -- cells ------------------------------------------------------------------------------------------------------------


def find_layout(cell: dict[str, Any]) -> Rows:
    """One layout of a condition: a row about it, and one for each elite of the search.

    The random one is the median by legibility of as many random layouts as a search begins with.
    """
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace
    from optimizers import search

    workspace = OvercookedWorkspace(shape=tuple(cell["shape"]))
    elites: Rows = []
    if cell["condition"] == "Random":
        genomes = workspace.sample(cell["initial"], np.random.default_rng(cell["layout"]))
        order = np.argsort(workspace.legibility(genomes), kind="stable")
        genome, evaluations = genomes[order[len(order) // 2]], cell["initial"]
    else:
        found = search(
            workspace,
            objective=OBJECTIVES[cell["condition"]],
            iterations=(cell["initial"], cell["improvements"]),
            seed=cell["layout"],
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


def fit_people(cell: dict[str, Any]) -> Rows:
    """One kind of walker fitted to the recorded people: a row for all of them, and one for each."""
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories
    from legible_envs.overcooked.humans.planner_fitting import fit_boltzmann, fit_planner

    walks = recorded_trajectories()
    if cell["walker"] == "boltzmann":
        return [{k: v for k, v in row.items() if k != "walker"} for row in fit_boltzmann(walks)]
    fit = fit_planner(walks)
    whole = {key: getattr(fit, key) for key in ("depth", "turn_cost", "recency", "fade", "slip", "log_likelihood")}
    each = [{"participant": name, "turn_cost": t, "slip": s} for name, (t, s) in fit.people.items()]
    return [{"participant": "", "steps": fit.num_steps, "walks": len(walks), "people": len(fit.people)} | whole, *each]


def simulate(cell: dict[str, Any]) -> list[Trajectory]:
    """The walks of a cell's people in its layout that have something to predict: two goals or more to choose from."""
    from legible_envs.overcooked import OvercookedLayout
    from legible_envs.overcooked.humans.planner_fitting import draw_person
    from legible_envs.overcooked.humans.simulation import simulate_participants

    label = f"{cell['condition']}/{cell['layout']}"
    walks = simulate_participants(
        OvercookedLayout.from_ascii(cell["drawing"]),
        cell["participants"],
        np.random.default_rng(cell["seed"]),
        population=draw_person(cell["people"]),
        participant=label,
        condition=cell["condition"],
        layout_name=label,
    )
    return [walk for walk in walks if len(walk.candidates) > 1]


def read_people(cell: dict[str, Any]) -> Rows:
    """How well a predictor reads a cell's people, by cross-validation.

    Returns:
        Rows of four tables, told apart by ``table``: ``accuracy`` (per participant and fraction observed), ``metrics``
        (per fraction), ``confusion`` (in walks, summed over fractions, repeats averaged) and, for a predictor that
        learns costs, ``cost`` (of each cell, learned from all walks).
    """
    walks, predictor = simulate(cell), make_judge(cell["how"])
    judging = {"folds": cell["folds"], "repeats": cell["repeats"], "seed": cell["seed"]}
    rows = judged_rows(predictor, walks, **judging, starts=False, confusion_over="sum")
    return [*rows, *_costs(predictor, walks)]


def _costs(predictor: Any, walks: list[Trajectory]) -> Rows:
    """The cost of each cell that a predictor learns from all walks; nothing for those that learn none."""
    from sklearn.base import clone

    if getattr(predictor, "cell_costs", None) != "learned":
        return []
    cost = clone(predictor).fit(walks).irl_.cost_
    return [
        {"table": "cost", "row": int(row), "column": int(column), "cost": float(cost[row, column])}
        for row, column in np.argwhere(np.isfinite(cost))
    ]


def learn_people(cell: dict[str, Any]) -> Rows:
    """A predictor's learning curve on a cell's people: accuracy (mean over fractions) per repeat and training share."""
    from predictors.evaluation.cross_validation import learning_curve

    judged = {"it": make_judge(cell["how"])}
    curve = learning_curve(judged, simulate(cell), sizes=cell["shares"], repeats=cell["repeats"], seed=cell["seed"])
    rows = curve.table.groupby(["repeat", "size"], as_index=False)["accuracy"].mean()
    share = dict(zip(sorted(rows["size"].unique()), sorted(cell["shares"]), strict=True))
    return labelled("curve", rows.assign(share=rows["size"].map(share)).rename(columns={"repeat": "split"}))
