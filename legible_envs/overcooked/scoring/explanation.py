"""The score of any one kitchen, explained: recorded ones, Overcooked-AI's, and those no genome can express.

These functions follow the readable definition, so stations may repeat, stand inside and have several access cells.
Where a type repeats, each of its stations is a goal, the person leaves from each of them equally often, and the legs
that follow a goal (to the pot, to serving) lead to the nearest.

A score is of a person, player 1 unless another is asked for. Stations out of their reach
(:mod:`legible_envs.overcooked.reach`) are no goals, and the score is that of the same kitchen with a counter in place
of each; it is an error only if the task cannot be done with those in reach.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from legible_envs.legibility import From, Node, PrefixScore, goal_legibility
from legible_envs.observer import ObserverModel
from legible_envs.overcooked.grid import NEIGHBOURS
from legible_envs.overcooked.layout import FLOOR, OvercookedLayout
from legible_envs.overcooked.reach import Reach, reach_of
from legible_envs.overcooked.recipes import soup_task
from legible_envs.overcooked.scoring.boltzmann import (
    BoltzmannTrajectories,
    HumanModel,
    HumanName,
    boltzmann_legibility,
    boltzmann_trajectories,
)
from legible_envs.subtasks import HUMAN
from legible_envs.support.validation import shown
from legible_envs.tasks import TaskGraph

__all__ = ["ambiguity", "explain_layout", "grid_graph", "layout_distance", "score_layout"]


def grid_graph(
    layout: OvercookedLayout, cell_costs: npt.NDArray[np.float64] | None = None, *, reach: Reach | None = None
) -> dict[Node, dict[Node, float]]:
    """The kitchen as a graph for :mod:`legible_envs.legibility`.

    Nodes are floor cells ``(row, col)``, every station by name as somewhere to arrive, and ``From(name)`` as somewhere
    to leave. Stepping on a cell costs what ``cell_costs`` says (1 by default), arriving at a station 1.

    Args:
        layout: The kitchen.
        cell_costs: ``(H, W)`` cost of stepping on each cell; None for 1.
        reach: Only floor and stations in a person's reach; None for all.
    """
    floor = layout.cells == FLOOR if reach is None else reach.floor
    stations = layout.stations if reach is None else reach.stations

    def cost(cell: tuple[int, int]) -> float:
        return 1.0 if cell_costs is None else float(cell_costs[cell])

    graph: dict[Node, dict[Node, float]] = {}
    for row, col in np.argwhere(floor).tolist():
        around = [(row + dr, col + dc) for dr, dc in NEIGHBOURS]
        graph[row, col] = {cell: cost(cell) for cell in around if layout.is_floor(cell)}
    for name in stations:
        access = layout.access(name) if reach is None else reach.access(name)
        graph[name] = {}
        graph[From(name)] = {cell: cost(cell) for cell in access}
        for cell in access:
            graph[cell][name] = 1.0
    return graph


class _StageGoal(NamedTuple):
    """A stage and its true goal: from where, among which goals, how often, and what an observer may see of it."""

    start: str
    goals: tuple[str, ...]
    goal: str
    weight: float
    scores: list[PrefixScore]
    truncated_probability: float = 0.0


def _stage_goals(
    layout: OvercookedLayout,
    task: TaskGraph,
    observer: ObserverModel,
    human: HumanModel | HumanName,
    cell_costs: npt.NDArray[np.float64] | None,
    player: int,
) -> Iterator[_StageGoal]:
    """Every stage of the task with each of its goals in a player's reach, scored by the readable definition."""
    reach = reach_of(layout, player)
    reach.check_task(task)
    if not isinstance(observer, ObserverModel):
        raise ValueError(f"`observer` must be an ObserverModel, got {shown(observer)}")
    human = human_model(layout, human)
    graph = grid_graph(layout, _checked_costs(reach, cell_costs, observer.tie_tolerance), reach=reach)
    followed: dict[tuple[str, str], BoltzmannTrajectories] = {}
    for stage in task.stages():
        starts = reach.named(stage.start)
        goals = tuple(name for kind in stage.goals for name in reach.named(kind))
        for start in starts:
            for goal in goals:
                truncated = 0.0
                if human.rationality is None or human.horizon is None:
                    scores = goal_legibility(graph, From(start), goal, goals, observer)
                else:
                    if (start, goal) not in followed:
                        followed[start, goal] = boltzmann_trajectories(
                            graph,
                            From(start),
                            goal,
                            rationality=human.rationality,
                            horizon=human.horizon,
                            prefix=observer.prefix,
                        )
                    truncated = followed[start, goal].truncated_probability
                    scores = boltzmann_legibility(graph, From(start), goals, followed[start, goal], observer)
                yield _StageGoal(start, goals, goal, stage.weight / len(starts), scores, truncated)


def _checked_costs(
    reach: Reach, cell_costs: npt.NDArray[np.float64] | None, tie_tolerance: float
) -> npt.NDArray[np.float64] | None:
    """``(H, W)`` costs of stepping on cells, those of the floor in reach finite and greater than what counts as a tie.

    Raises:
        ValueError: No numbers, another shape, or a cost out of range (naming the cell).
    """
    if cell_costs is None:
        return None
    shape = reach.layout.shape
    try:
        costs = np.array(cell_costs, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"`cell_costs` must be an array of numbers of shape {shape}: {error}") from error
    if costs.shape != shape:
        raise ValueError(f"`cell_costs` must have the kitchen's shape {shape}, got {costs.shape}")
    least = max(1e-6, 2 * tie_tolerance)
    wrong = np.argwhere(reach.floor & ~(np.isfinite(costs) & (costs >= least)))
    if len(wrong):
        row, col = wrong[0]
        raise ValueError(
            f"`cell_costs` of floor cells must be finite and at least {least:g}; row {row}, column {col} is "
            f"{costs[row, col]}"
        )
    return costs


def human_model(layout: OvercookedLayout, human: HumanModel | HumanName) -> HumanModel:
    """The model of motion of that name, with a horizon that suits one kitchen.

    Raises:
        ValueError: An unknown name, or a horizon too short for this kitchen.
    """
    human = human if isinstance(human, HumanModel) else HumanModel(human)
    return human.within(int(np.count_nonzero(layout.cells == FLOOR)))


def layout_distance(layout: OvercookedLayout, task: TaskGraph, *, player: int = 1) -> float:
    """Expected number of a person's floor moves in one task execution, in a uniformly random valid sequence.

    Where a type repeats: a goal is any of its stations, equally likely; every other stop is the nearest of its type.

    Args:
        layout: The kitchen.
        task: The task, over station types.
        player: Whose distance; stations out of this player's reach do not count.

    Raises:
        LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
    """
    reach = reach_of(layout, player)
    reach.check_task(task)
    goals = set(task.goals_of(HUMAN))
    total = []
    for (a, b), expected in task.legs().items():
        moves = []
        for start in reach.named(a):
            field = layout.distances_from(reach.access(start))
            reached = [min(int(field[cell]) for cell in reach.access(name)) for name in reach.named(b)]
            moves.append(sum(reached) / len(reached) if b in goals else min(reached))
        total.append(expected * (sum(moves) / len(moves)))
    return math.fsum(total)


def score_layout(
    layout: OvercookedLayout,
    task: TaskGraph | None = None,
    *,
    observer: ObserverModel = ObserverModel(),
    human: HumanModel | HumanName = "shortest",
    cell_costs: npt.NDArray[np.float64] | None = None,
    player: int = 1,
) -> dict[str, Any]:
    """Score any kitchen.

    Args:
        layout: The kitchen.
        task: The task, over station types; the paper's three soups if None.
        observer: How the observer infers goals, which prefixes count, and what errors cost.
        human: How people move: a model, or ``"shortest"`` or ``"boltzmann"`` with its default settings.
        cell_costs: ``(H, W)`` cost of stepping on each cell, for people and observer alike; None for 1.
        player: Number of the player whose score it is, from 1; what is out of their reach is no goal.

    Returns:
        ``score`` (Eq. 3 per sequence); ``distance`` (floor moves per execution); ``normalised``, the score over the
        expected number of (stage, goal) pairs, at most 1 for ``prefix="mean"``; ``single_goal_share``, the part of the
        score that comes from stages with one valid goal, and ``single_goal_score``; ``num_obstacles``;
        ``candidate_set`` (``"task"``: valid by precedence); ``num_sequences``; ``num_stages``; ``layout_id``;
        ``human``; ``player``; ``out_of_reach``, the names of the stations that were left out. For ``"boltzmann"`` also
        ``rationality``, ``horizon``, ``truncated_probability`` (that a trajectory of the task does not arrive within
        the horizon; the score is that of those that do) and ``largest_truncated_probability`` of all starts and goals.

    Raises:
        LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
        ValueError: Costs of another shape, or not finite and greater than 0 on the floor.
    """
    task = task or soup_task()
    reach = reach_of(layout, player)
    human = human_model(layout, human)
    parts, single, pairs, truncated = [], [], [], []
    for part in _stage_goals(layout, task, observer, human, cell_costs, player):
        value = part.weight * math.fsum(s.probability * s.weight * s.value for s in part.scores)
        parts.append(value)
        pairs.append(part.weight)
        truncated.append(part.truncated_probability)
        if len(part.goals) == 1:
            single.append(value)
    score = math.fsum(parts)
    result = {
        "score": score,
        "distance": layout_distance(layout, task, player=player),
        "normalised": score / math.fsum(pairs),
        "single_goal_score": math.fsum(single),
        "single_goal_share": math.fsum(single) / score if score else math.nan,
        "num_obstacles": layout.num_obstacles,
        "candidate_set": "task",
        "num_sequences": task.num_sequences,
        "num_stages": len(task.stages()),
        "layout_id": layout.layout_id,
        "human": human.name,
        "player": reach.player,
        "out_of_reach": list(reach.out_of_reach),
    }
    if human.name == "boltzmann":
        result["rationality"], result["horizon"] = human.rationality, human.horizon
        result["truncated_probability"] = math.fsum(w * x for w, x in zip(pairs, truncated, strict=True)) / math.fsum(
            pairs
        )
        result["largest_truncated_probability"] = max(truncated)
    return result


def explain_layout(
    layout: OvercookedLayout,
    task: TaskGraph | None = None,
    *,
    observer: ObserverModel = ObserverModel(),
    human: HumanModel | HumanName = "shortest",
    cell_costs: npt.NDArray[np.float64] | None = None,
    player: int = 1,
) -> list[dict[str, Any]]:
    """Which stages, goals and prefixes win or lose the score of a kitchen.

    Args:
        layout: The kitchen.
        task: The task, over station types; the paper's three soups if None.
        observer: How the observer infers goals, which prefixes count, and what errors cost.
        human: How people move: a model, or ``"shortest"`` or ``"boltzmann"`` with its default settings.
        cell_costs: ``(H, W)`` cost of stepping on each cell, for people and observer alike; None for 1.
        player: Number of the player whose score it is, from 1; what is out of their reach is no goal.

    Returns:
        A row for every stage and goal, the greatest loss first: ``start``, ``goals`` (valid), ``goal`` (true),
        ``weight`` (expected number of such stages), ``score`` (expected legibility of its trajectories),
        ``contribution`` (weight times score; contributions sum to the layout's score), ``ties_with`` (probability that
        each other goal is at the top, averaged over the weighted prefixes: together with the true one, or instead of
        it where people leave the shortest paths), ``belief`` (how probable the observer finds each goal by Eq. 1, the
        mean over the weighted prefixes), and ``prefixes``: a row for every step ``t`` with the mean ``value``
        of Eq. 2, its ``weight`` and ``ties_with`` at that step.

    Raises:
        LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
    """
    rows = []
    parts = _stage_goals(layout, task or soup_task(), observer, human, cell_costs, player)
    for start, goals, goal, weight, scores, _ in parts:
        score = math.fsum(s.probability * s.weight * s.value for s in scores)
        rows.append(
            {
                "start": start,
                "goals": list(goals),
                "goal": goal,
                "weight": weight,
                "score": score,
                "contribution": weight * score,
                "ties_with": _tie_shares(goal, scores),
                "belief": _mean_belief(scores),
                "prefixes": [_prefix_row(goal, t, scores) for t in sorted({s.step for s in scores})],
            }
        )
    return sorted(rows, key=lambda row: row["contribution"])


def _tie_shares(goal: str, scores: list[PrefixScore]) -> dict[str, float]:
    total = math.fsum(s.probability * s.weight for s in scores)
    shares: dict[str, float] = defaultdict(float)
    for s in scores:
        for other in s.tied:
            if other != goal and total:
                shares[str(other)] += s.probability * s.weight / total
    return dict(shares)


def _mean_belief(scores: list[PrefixScore]) -> dict[str, float]:
    """How probable an observer finds each goal (Eq. 1), the mean over the weighted prefixes."""
    total = math.fsum(s.probability * s.weight for s in scores)
    if not scores or not total:
        return {}
    return {
        str(goal): math.fsum(s.probability * s.weight * s.belief[goal] for s in scores) / total
        for goal in scores[0].belief
    }


def _prefix_row(goal: str, step: int, scores: list[PrefixScore]) -> dict[str, Any]:
    here = [s for s in scores if s.step == step]
    mass = math.fsum(s.probability for s in here)
    ties: dict[str, float] = defaultdict(float)
    for s in here:
        for other in s.tied:
            if other != goal:
                ties[str(other)] += s.probability / mass
    return {
        "t": step,
        "weight": math.fsum(s.probability * s.weight for s in here) / mass,
        "value": math.fsum(s.probability * s.value for s in here) / mass,
        "ties_with": dict(ties),
    }


def ambiguity(
    layout: OvercookedLayout,
    task: TaskGraph | None = None,
    *,
    observer: ObserverModel = ObserverModel(),
    human: HumanModel | HumanName = "shortest",
    cell_costs: npt.NDArray[np.float64] | None = None,
    player: int = 1,
) -> npt.NDArray[np.float64]:
    """How often an observer who sees the person on a cell would predict a wrong goal.

    Averaged over all trajectories of the task that pass the cell, each as often as it happens.

    Args:
        layout: The kitchen.
        task: The task, over station types; the paper's three soups if None.
        observer: How the observer infers goals, which prefixes count, and what errors cost.
        human: How people move: a model, or ``"shortest"`` or ``"boltzmann"`` with its default settings.
        cell_costs: ``(H, W)`` cost of stepping on each cell, for people and observer alike; None for 1.
        player: Number of the player whose score it is, from 1; what is out of their reach is no goal.

    Returns:
        ``(H, W)`` probabilities; NaN on cells that no trajectory of this player passes.

    Raises:
        LayoutError: A station the task needs is missing or out of the player's reach, or there is no such player.
    """
    wrong = np.zeros(layout.shape)
    visits = np.zeros(layout.shape)
    parts = _stage_goals(layout, task or soup_task(), observer, human, cell_costs, player)
    for _, goals, goal, weight, scores, _ in parts:
        for s in scores:
            cell = cast("tuple[int, int]", s.node)
            visits[cell] += weight / len(goals) * s.probability
            wrong[cell] += weight / len(goals) * s.probability * (1 - (goal in s.tied) / len(s.tied))
    with np.errstate(invalid="ignore"):
        return np.where(visits > 0, wrong / visits, np.nan)
