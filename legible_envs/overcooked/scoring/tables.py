"""From a task and an observer to the tables of the score kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.errors import TaskError
from legible_envs.legibility import prefix_weights
from legible_envs.observer import ObserverModel, PrefixSpec, Ties
from legible_envs.overcooked.scoring.exact_kernels import ScoreTables
from legible_envs.subtasks import HUMAN
from legible_envs.tasks import TaskGraph

__all__ = ["check_task", "make_tables"]

MAX_GOALS = 12


def check_task(task: TaskGraph, stations: Sequence[str]) -> None:
    """Check that a task can be done with these types of stations, and scored.

    Raises:
        TaskError: The task names a place that is no station, or has more than 12 goals for the person.
    """
    unknown = [place for place in task.places if place not in stations]
    if unknown:
        raise TaskError(f"the task needs {unknown}, which the kitchen lacks; its stations are {list(stations)}")
    goals = task.goals_of(HUMAN)
    if len(goals) > MAX_GOALS:
        raise TaskError(f"at most {MAX_GOALS} different goals are supported, the task has {len(goals)}")


def make_tables(task: TaskGraph, stations: Sequence[str], observer: ObserverModel, *, num_floor: int) -> ScoreTables:
    """Build the tables of :class:`~legible_envs.overcooked.scoring.exact_kernels.ScoreTables`.

    Args:
        task: The task; its places are station types.
        stations: Station types in genome order.
        observer: How the observer infers goals, which prefixes count, and what errors cost.
        num_floor: Largest possible number of floor cells, which bounds all distances.

    Raises:
        TaskError: See :func:`check_task`.
    """
    check_task(task, stations)
    goals = task.goals_of(HUMAN)
    stages = task.stages()
    starts = sorted({stage.start for stage in stages})
    weights = np.zeros((len(starts), 1 << len(goals)))
    for stage in stages:
        weights[starts.index(stage.start), sum(1 << goals.index(g) for g in stage.goals)] += stage.weight
    legs = np.zeros((len(stations), len(stations)))
    for (a, b), expected in task.legs().items():
        legs[stations.index(a), stations.index(b)] += expected
    return ScoreTables(
        starts=np.array([stations.index(s) for s in starts], dtype=np.int64),
        goals=np.array([stations.index(g) for g in goals], dtype=np.int64),
        stage_weights=weights,
        tie_penalties=_tie_penalties(weights, len(goals), observer.ties),
        discounts=np.exp(-observer.beta * np.arange(2 * num_floor + 3)),
        prefix_weights=_prefix_table(observer.prefix, num_floor + 2),
        legs=legs,
        c=observer.c / observer.unit,
        beta=observer.beta,
        tie_tolerance=observer.tie_tolerance,
    )


def _tie_penalties(weights: npt.NDArray[np.float64], num_goals: int, ties: Ties) -> npt.NDArray[np.float64]:
    penalties = np.zeros((len(weights), num_goals, 1 << num_goals))
    valid_sets = np.arange(1 << num_goals)
    for tied in range(1 << num_goals):
        num_tied = np.array([int(v).bit_count() for v in valid_sets & tied])
        wrong = np.where(num_tied >= 2, 1.0 if ties == "strict" else 1.0 - 1.0 / np.maximum(num_tied, 1), 0.0)
        for goal in range(num_goals):
            if tied >> goal & 1:
                # The true goal is in the valid set whether it is counted among the tied ones or not.
                has_goal = (valid_sets >> goal & 1).astype(bool)
                penalties[:, goal, tied] = weights[:, has_goal] @ wrong[has_goal]
    return penalties


def _prefix_table(prefix: PrefixSpec, longest: int) -> npt.NDArray[np.float64]:
    table = np.zeros((longest + 1, longest + 1))
    for length in range(2, longest + 1):
        table[length, 1:length] = prefix_weights(prefix, length)
    return table
