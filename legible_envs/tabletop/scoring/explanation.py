"""The score of one table, explained: every stage, goal and observed share of a reach, by the readable definition."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.legibility import Ties, env_legibility, tied_goals
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tasks import TaskGraph

__all__ = ["explain_table", "points_along"]

Floats = npt.NDArray[np.float64]


def points_along(path: Floats, fractions: Sequence[float]) -> tuple[Floats, float]:
    """``(k, 2)`` points at shares of the length of a ``(j, 2)`` polyline, and that length."""
    steps = [math.dist(a, b) for a, b in itertools.pairwise(path.tolist())]
    ends = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.array(fractions) * ends[-1]
    return np.column_stack([np.interp(at, ends, path[:, axis]) for axis in (0, 1)]), float(ends[-1])


def explain_table(
    layout: TabletopLayout,
    task: TaskGraph,
    *,
    fractions: Sequence[float],
    beta: float = 20.0,
    c: float = 1.0,
    unit: float = 0.05,
    ties: Ties = "expected",
    tie_tolerance: float = 1e-9,
) -> list[dict[str, Any]]:
    """Which stages, goals and prefixes win or lose the score of a table.

    Args:
        layout: The table, in which every reach of the task has a way.
        task: The precedence of the reaches.
        fractions: Observed shares of a reach; each weighs the same.
        beta: Rationality per metre (Eq. 1).
        c: Cost per ``unit`` observed in doubt (Eq. 2).
        unit: Metres.
        ties: ``"expected"`` or ``"strict"``, see :func:`~legible_envs.legibility.env_legibility`.
        tie_tolerance: Excess costs up to this tie, in metres.

    Returns:
        A row for every stage and goal, the greatest loss first: ``start``, ``goals`` (valid), ``goal`` (true),
        ``weight`` (expected number of such stages), ``score`` (expected legibility of the reach), ``contribution``
        (weight times score; contributions sum to the layout's score), ``length`` and ``detour`` of the reach,
        ``ties_with`` (share of the prefixes at which each other goal ties with the true one), and ``prefixes``: a row
        for every prefix with the observed ``fraction``, ``t`` in units, its ``weight``, ``value`` of Eq. 2 and
        ``ties_with``.

    Raises:
        LayoutError: A reach has no way.
    """
    costs: dict[tuple[float, float], dict[str, float]] = {}

    def costs_from(x: float, y: float) -> dict[str, float]:
        if (x, y) not in costs:
            costs[x, y] = dict(zip(layout.goals, layout.paths.lengths([(x, y)])[0].tolist(), strict=True))
        return costs[x, y]

    rows = []
    for stage in task.stages():
        home = layout.place(stage.start)
        optimal = {goal: costs_from(*home)[goal] for goal in stage.goals}
        for goal in stage.goals:
            if math.isinf(optimal[goal]):
                raise LayoutError(f"no way from {stage.start} to {goal}", rule="reachable")
            points, length = points_along(layout.paths.polyline(home, goal), fractions)
            prefixes: list[dict[str, Any]] = []
            for fraction, (x, y) in zip(fractions, points.tolist(), strict=True):
                remaining = {g: costs_from(x, y)[g] for g in stage.goals}
                t = fraction * length / unit
                value = env_legibility(
                    goal, remaining, optimal, t, beta=beta, c=c, ties=ties, tie_tolerance=tie_tolerance
                )
                others = [g for g in tied_goals(remaining, optimal, tie_tolerance) if g != goal]
                prefixes.append(
                    {"fraction": fraction, "t": t, "weight": 1 / len(fractions), "value": value, "ties_with": others}
                )
            score = math.fsum(p["value"] for p in prefixes) / len(fractions)
            straight = math.dist(home, layout.place(goal))
            rows.append(
                {
                    "start": stage.start,
                    "goals": list(stage.goals),
                    "goal": goal,
                    "weight": stage.weight,
                    "score": score,
                    "contribution": stage.weight * score,
                    "length": length,
                    "detour": length / straight if straight else 1.0,
                    "ties_with": _shares(prefixes),
                    "prefixes": [{**p, "ties_with": dict.fromkeys(p["ties_with"], 1.0)} for p in prefixes],
                }
            )
    return sorted(rows, key=lambda row: float(row["contribution"]))


def _shares(prefixes: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Share of the prefixes at which each goal ties."""
    shares: dict[str, float] = {}
    for prefix in prefixes:
        for goal in prefix["ties_with"]:
            shares[goal] = shares.get(goal, 0.0) + prefix["weight"]
    return shares
