"""From a task on a table and an observer to the arrays of the score kernel."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from legible_envs.errors import TaskError
from legible_envs.observer import ObserverModel, PrefixSpec
from legible_envs.subtasks import HUMAN
from legible_envs.tabletop.scoring.exact_kernels import ReachTables
from legible_envs.tasks import Stage, TaskGraph

__all__ = ["make_tables", "observed_fractions"]

MAX_GOALS = 12
POINTS = 10


def observed_fractions(prefix: PrefixSpec) -> tuple[float, ...]:
    """Which shares of a trajectory are observed: ten midpoints for ``"mean"``, or the given fractions, ascending.

    Raises:
        ValueError: ``"sum"``: a trajectory on a table has no steps to sum over.
    """
    if prefix == "mean":
        return tuple((i + 0.5) / POINTS for i in range(POINTS))
    if isinstance(prefix, str):
        raise ValueError(f"on a table, `prefix` must be 'mean' or fractions in (0, 1], got {prefix!r}")
    return tuple(sorted(prefix))


def make_tables(task: TaskGraph, points: Sequence[str], observer: ObserverModel) -> ReachTables:
    """Build the tables of :class:`~legible_envs.tabletop.scoring.exact_kernels.ReachTables`.

    Args:
        task: The task; its places are names of points.
        points: Names of all points: objects, then starts.
        observer: How the observer infers goals, which prefixes count, and what errors cost, in metres.

    Raises:
        TaskError: The task names a place the table lacks, or has more than 12 goals that are candidates together.
        ValueError: The observer's ``prefix`` is ``"sum"``.
    """
    fractions = observed_fractions(observer.prefix)
    unknown = [place for place in task.places if place not in points]
    if unknown:
        raise TaskError(f"the task needs {unknown}, which the table lacks; it has {list(points)}")
    groups = _groups(task.stages())
    largest = max(len(goals) for _, goals, _ in groups)
    if largest > MAX_GOALS:
        raise TaskError(f"at most {MAX_GOALS} goals may be candidates together, the task has {largest}")
    legs = _legs(task)
    targets = sorted({*task.goals_of(HUMAN), *(end for _, end in legs)}, key=points.index)
    reaches: dict[tuple[str, str], float] = defaultdict(float)
    for transition in task.transitions():
        reaches[transition.start, transition.goal] += transition.weight
    goals = [(start, goal) for start, members, _ in groups for goal in members]
    return ReachTables(
        targets=_ints(points.index(t) for t in targets),
        group_start=_ints(points.index(start) for start, _, _ in groups),
        group_offset=_ints(np.cumsum([0, *(len(members) for _, members, _ in groups)])),
        goal_target=_ints(targets.index(goal) for _, goal in goals),
        reach_weight=np.array([reaches[key] for key in goals]) / sum(reaches.values()),
        stage_weights=_stage_weights(groups, len(fractions)),
        leg_from=_ints(points.index(a) for a, _ in legs),
        leg_target=_ints(targets.index(b) for _, b in legs),
        leg_weight=np.array(list(legs.values()), dtype=np.float64),
        fractions=np.array(fractions, dtype=np.float64),
        beta=observer.beta,
        penalty=observer.c / observer.unit,
        tie_tolerance=observer.tie_tolerance,
        strict=observer.ties == "strict",
    )


def _groups(stages: Sequence[Stage]) -> list[tuple[str, list[str], list[Stage]]]:
    """``(start, goals, stages)``: stages of one start that share goals, directly or through one another."""
    groups: list[tuple[str, set[str], list[Stage]]] = []
    for stage in stages:
        together = [g for g in groups if g[0] == stage.start and g[1] & set(stage.goals)]
        merged = (
            stage.start,
            set(stage.goals).union(*(g[1] for g in together)),
            [*(s for g in together for s in g[2]), stage],
        )
        groups = [g for g in groups if g not in together] + [merged]
    return [(start, sorted(goals), held) for start, goals, held in groups]


def _stage_weights(groups: Sequence[tuple[str, list[str], list[Stage]]], num_points: int) -> npt.NDArray[np.float64]:
    """See :class:`~legible_envs.tabletop.scoring.exact_kernels.ReachTables`."""
    sizes = [(1 << len(members)) * len(members) * num_points for _, members, _ in groups]
    weights = np.zeros((len(groups), max(sizes)))
    for row, size, (_, members, held) in zip(weights, sizes, groups, strict=True):
        by_mask = row[:size].reshape(-1, len(members), num_points)
        for stage in held:
            valid = [members.index(goal) for goal in stage.goals]
            by_mask[sum(1 << g for g in valid), valid] += stage.weight / num_points
    return weights


def _legs(task: TaskGraph) -> dict[tuple[str, str], float]:
    """Expected legs, both directions of a path together; the second end is a goal wherever one is."""
    legs: dict[tuple[str, str], float] = defaultdict(float)
    goals = set(task.goals_of(HUMAN))
    for (a, b), weight in task.legs().items():
        key = (b, a) if (a in goals, b) > (b in goals, a) else (a, b)
        legs[key] += weight
    return dict(legs)


def _ints(values: Iterable[int]) -> npt.NDArray[np.int64]:
    return np.array(list(values), dtype=np.int64)
