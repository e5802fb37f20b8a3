"""The score of one table by the readable definition, and how every stage, goal and prefix adds to it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.legibility import env_legibility, posterior, tied_goals
from legible_envs.observer import ObserverModel
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.scoring.tables import observed_fractions
from legible_envs.tabletop.task import TabletopTask
from legible_envs.tasks import TaskGraph

__all__ = ["as_task", "check_points", "explain_layout", "path_lengths", "points_along", "score_layout", "summarise"]

Floats = npt.NDArray[np.float64]


def points_along(path: Floats, fractions: Sequence[float]) -> tuple[Floats, float]:
    """``(k, 2)`` points at shares of the length of a ``(j, 2)`` polyline, and that length."""
    steps = [math.dist(a, b) for a, b in itertools.pairwise(path.tolist())]
    ends = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.array(fractions) * ends[-1]
    return np.column_stack([np.interp(at, ends, path[:, axis]) for axis in (0, 1)]), float(ends[-1])


def check_points(layout: TabletopLayout, task: TabletopTask) -> None:
    """Whether a layout has the objects and starts of a task, by name.

    Raises:
        LayoutError: It has others.
    """
    expected, got = task.layout.place_names, layout.place_names
    if got != expected:
        raise LayoutError(f"task {task.name!r} is about {list(expected)}, the layout has {list(got)}", rule="object")


def path_lengths(layout: TabletopLayout, pairs: Sequence[tuple[str, str]]) -> dict[tuple[str, str], float]:
    """Metres of the shortest path between the two places of each pair, objects or starts.

    Raises:
        LayoutError: There is no path; the message names both places.
    """
    names, places = layout.place_names, layout.points
    metres = ShortestPaths.of(layout, places, names).lengths(places)
    lengths = {(a, b): float(metres[names.index(a), names.index(b)]) for a, b in pairs}
    for (a, b), length in lengths.items():
        if math.isinf(length):
            raise LayoutError(f"the task cannot be done on this table: no path from {a} to {b}", rule="reachable")
    return lengths


def score_layout(
    layout: TabletopLayout,
    task: TabletopTask | str | None = None,
    *,
    observer: ObserverModel = ObserverModel.in_metres(),
) -> dict[str, Any]:
    """Score any table.

    The readable definition; :meth:`.TabletopScorer.score_layout` computes the same by compiled code.

    Args:
        layout: The table, with the objects and starts of the task.
        task: The task, or the name of one that comes with the package; ``"columns"`` if None.
        observer: How the observer infers goals, which prefixes count, and what errors cost, in metres.

    Returns:
        ``score`` (Eq. 3 per sequence); ``distance`` (metres per execution); ``normalised``, the score over the expected
        number of (stage, goal) pairs, at most 1; ``single_goal_share``, the part of the score that comes from stages
        with one valid goal, and ``single_goal_score``; ``mean_detour`` and ``max_detour`` (shortest path over straight
        line, over all trajectories to goals); ``num_obstacles``; ``candidate_set`` (``"task"``: valid by precedence);
        ``num_sequences``; ``num_stages``; ``layout_id``.

    Raises:
        LayoutError: The layout has other objects than the task, or a place the task needs cannot be reached.
    """
    task = as_task(task)
    check_points(layout, task)
    legs = task.graph.legs()
    distance = math.fsum(legs[pair] * metres for pair, metres in path_lengths(layout, list(legs)).items())
    reaches: dict[tuple[str, str], float] = {}
    for t in task.graph.transitions():
        reaches[t.start, t.goal] = reaches.get((t.start, t.goal), 0.0) + t.weight
    detours = {
        (start, goal): _detour(metres, layout.place(start), layout.place(goal))
        for (start, goal), metres in path_lengths(layout, list(reaches)).items()
    }
    return summarise(
        layout,
        task.graph,
        score=math.fsum(row["contribution"] for row in explain_layout(layout, task, observer=observer)),
        distance=distance,
        mean_detour=math.fsum(reaches[pair] * detours[pair] for pair in reaches) / math.fsum(reaches.values()),
        max_detour=max(1.0, *detours.values()),
    )


def summarise(
    layout: TabletopLayout, task: TaskGraph, *, score: float, distance: float, mean_detour: float, max_detour: float
) -> dict[str, Any]:
    """The scores of a layout with what belongs beside them; see :func:`score_layout`."""
    stages = task.stages()
    # Where one goal is valid, p(2) = 0 and every prefix has the margin 1.
    single = math.fsum(stage.weight for stage in stages if len(stage.goals) == 1)
    return {
        "score": score,
        "distance": distance,
        "normalised": score / sum(stage.weight * len(stage.goals) for stage in stages),
        "single_goal_score": single,
        "single_goal_share": single / score if score else math.nan,
        "mean_detour": mean_detour,
        "max_detour": max_detour,
        "num_obstacles": len(layout.obstacles),
        "candidate_set": "task",
        "num_sequences": task.num_sequences,
        "num_stages": len(stages),
        "layout_id": layout.layout_id,
    }


def explain_layout(
    layout: TabletopLayout,
    task: TabletopTask | str | None = None,
    *,
    observer: ObserverModel = ObserverModel.in_metres(),
) -> list[dict[str, Any]]:
    """Which stages, goals and prefixes win or lose the score of a table.

    Args:
        layout: The table, with the objects and starts of the task.
        task: The task, or the name of one that comes with the package; ``"columns"`` if None.
        observer: How the observer infers goals, which prefixes count, and what errors cost, in metres.

    Returns:
        A row for every stage and goal, the greatest loss first: ``start``, ``goals`` (valid), ``goal`` (true),
        ``weight`` (expected number of such stages), ``score`` (expected legibility of the trajectory), ``contribution``
        (weight times score; contributions sum to the layout's score), ``length`` and ``detour`` of the trajectory,
        ``ties_with`` (share of the prefixes at which each other goal ties with the true one), ``belief`` (how probable
        the observer finds each goal by Eq. 1, the mean over the prefixes), and ``prefixes``: a row for every prefix
        with the observed ``fraction``, ``t`` in the observer's units, its ``weight``, ``value`` of Eq. 2,
        ``ties_with`` and ``belief``.

    Raises:
        LayoutError: The layout has other objects than the task, or a goal cannot be reached.
    """
    task = as_task(task)
    check_points(layout, task)
    fractions = observed_fractions(observer.prefix)
    costs: dict[tuple[float, float], dict[str, float]] = {}

    def costs_from(x: float, y: float) -> dict[str, float]:
        if (x, y) not in costs:
            costs[x, y] = dict(zip(layout.goals, layout.paths.lengths([(x, y)])[0].tolist(), strict=True))
        return costs[x, y]

    rows = []
    for stage in task.graph.stages():
        home = layout.place(stage.start)
        optimal = {goal: costs_from(*home)[goal] for goal in stage.goals}
        for goal in stage.goals:
            if math.isinf(optimal[goal]):
                raise LayoutError(f"no path from {stage.start} to {goal}", rule="reachable")
            points, length = points_along(layout.paths.polyline(home, goal), fractions)
            prefixes: list[dict[str, Any]] = []
            for fraction, (x, y) in zip(fractions, points.tolist(), strict=True):
                remaining = {g: costs_from(x, y)[g] for g in stage.goals}
                observed = fraction * length
                others = [g for g in tied_goals(remaining, optimal, observer.tie_tolerance) if g != goal]
                prefixes.append(
                    {
                        "fraction": fraction,
                        "t": observed / observer.unit,
                        "weight": 1 / len(fractions),
                        "value": env_legibility(goal, remaining, optimal, observed, observer),
                        "ties_with": others,
                        "belief": posterior(remaining, optimal, observer.beta),
                    }
                )
            score = math.fsum(p["value"] for p in prefixes) / len(fractions)
            rows.append(
                {
                    "start": stage.start,
                    "goals": list(stage.goals),
                    "goal": goal,
                    "weight": stage.weight,
                    "score": score,
                    "contribution": stage.weight * score,
                    "length": length,
                    "detour": _detour(length, home, layout.place(goal)),
                    "ties_with": _shares(prefixes),
                    "belief": {g: math.fsum(p["belief"][g] for p in prefixes) / len(prefixes) for g in stage.goals},
                    "prefixes": [{**p, "ties_with": dict.fromkeys(p["ties_with"], 1.0)} for p in prefixes],
                }
            )
    return sorted(rows, key=lambda row: float(row["contribution"]))


def as_task(task: TabletopTask | str | None) -> TabletopTask:
    """A task, or the one of that name that comes with the package; ``"columns"`` for None."""
    return task if isinstance(task, TabletopTask) else TabletopTask.named(task or "columns")


def _detour(length: float, start: tuple[float, float], goal: tuple[float, float]) -> float:
    """A path's length over that of the straight line; 1 where start and goal are one place."""
    straight = math.dist(start, goal)
    return length / straight if straight else 1.0


def _shares(prefixes: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Share of the prefixes at which each goal ties."""
    shares: dict[str, float] = {}
    for prefix in prefixes:
        for goal in prefix["ties_with"]:
            shares[goal] = shares.get(goal, 0.0) + prefix["weight"]
    return shares
