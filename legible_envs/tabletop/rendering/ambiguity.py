"""Where along its path the goal of a reach is still ambiguous."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.legibility import posterior
from legible_envs.tabletop.layout import TabletopLayout
from legible_envs.tabletop.task import TabletopTask

__all__ = ["AmbiguousReach", "ambiguous_reaches", "points_along"]

Floats = npt.NDArray[np.float64]


class AmbiguousReach(NamedTuple):
    """A shortest reach, and how unsure an observer is of its goal along the path.

    Attributes:
        start: Where it starts.
        goal: Where it ends.
        weight: How often it happens in one task.
        points: ``(k, 2)`` points at equal distances, both ends included.
        ambiguity: ``(k - 1,)`` for the middle of each piece between them, 1 less the probability of the true goal
            (Bayesian goal inference, Eq. 1), the mean over the stages in which the reach happens.
    """

    start: str
    goal: str
    weight: float
    points: Floats
    ambiguity: Floats


def points_along(path: Floats, pieces: int) -> Floats:
    """``(pieces + 1, 2)`` points at equal distances along a ``(j, 2)`` polyline."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    at = np.linspace(0.0, lengths[-1], pieces + 1)
    return np.column_stack([np.interp(at, lengths, path[:, i]) for i in (0, 1)])


def ambiguous_reaches(
    layout: TabletopLayout, task: TabletopTask, *, beta: float = 20.0, pieces: int = 40
) -> list[AmbiguousReach]:
    """All reaches of a task along shortest paths, and how ambiguous their goals are at each point.

    Args:
        layout: The table.
        task: The task.
        beta: Rationality per metre.
        pieces: Pieces of a reach.
    """
    # The straight piece between two samples may cut a corner by less than the drawing shows: ask where the hand can be.
    found: dict[tuple[str, str], tuple[float, Floats]] = {}
    points: dict[tuple[str, str], Floats] = {}
    for stage in task.graph.stages():
        start = layout.place(stage.start)
        columns = [layout.index(goal) for goal in stage.goals]
        optimal = layout.paths.lengths(np.array([start]))[0, columns]
        for goal, path in zip(stage.goals, [layout.paths.polylines(start)[i] for i in columns], strict=True):
            if path is None:
                continue
            pair = (stage.start, goal)
            points[pair] = points_along(path, pieces)
            middles = layout.paths.nearest_free((points[pair][:-1] + points[pair][1:]) / 2)
            remaining = layout.paths.lengths(middles)[:, columns]
            ambiguity = np.array(
                [
                    1.0 - posterior(dict(zip(stage.goals, row, strict=True)), ends, beta)[goal]
                    for ends in [dict(zip(stage.goals, optimal.tolist(), strict=True))]
                    for row in remaining.tolist()
                ]
            )
            weight, total = found.get(pair, (0.0, np.zeros(pieces)))
            found[pair] = weight + stage.weight, total + stage.weight * ambiguity
    return [
        AmbiguousReach(*pair, weight, points[pair], total / weight)
        for pair, (weight, total) in found.items()
        if weight > 0
    ]
