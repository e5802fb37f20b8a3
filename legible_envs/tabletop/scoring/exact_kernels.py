"""Kernels: Eq. 2 and Eq. 3 on a table, for whole batches of layouts.

The definition is :mod:`legible_envs.legibility`; on a table a reach follows the shortest path among grown obstacles,
is observed at fixed fractions of its length, and costs are metres. Reaches that are ever candidates together and leave
from one start form a *group*; all stages of a group share its paths, points and distances. On its own shortest path
the true goal always has the least excess cost, so the observer is wrong only where goals tie.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.geometry.visibility_kernels import (
    Floats,
    Ints,
    block,
    corners_between,
    first_corner,
    grow,
    into_box,
    is_free,
    keep_corners,
    norm,
    path_tables,
    write_path,
)
from legible_envs.tabletop.scoring.posterior_kernels import add_weighted, exponentials, settle_ties, sum_candidates

__all__ = ["OUTPUTS", "ReachTables", "Scratch", "make_scratch", "score_genomes", "score_table"]

OUTPUTS = 4
"""Numbers per layout: legibility, distance, mean detour, greatest detour."""


class ReachTables(NamedTuple):
    """A task, as arrays over the points of a table: its ``n`` objects, then its starts.

    Attributes:
        targets: ``[T]`` points that path tables lead to.
        group_start: ``[Q]`` point each group's reaches leave from.
        group_offset: ``[Q + 1]`` where each group's goals begin in the arrays below.
        goal_target: ``[R]`` each goal of each group, as a position in ``targets``.
        reach_weight: ``[R]`` expected number of such reaches, divided by that of all reaches.
        stage_weights: ``[Q, 2^G * P]`` for each group, set of candidates and point: the expected visits of that stage,
            divided by ``K``; 0 where the point's true goal is no candidate. ``P`` is the group's number of points.
        leg_from: ``[L]`` point each leg of the task leaves from.
        leg_target: ``[L]`` position in ``targets`` of the point it leads to.
        leg_weight: ``[L]`` expected number of such legs.
        fractions: ``[K]`` observed shares of a reach.
        beta: Rationality per metre.
        penalty: Cost of a metre observed while the prediction is wrong.
        tie_tolerance: Excess costs up to this tie.
        strict: Whether a tie counts as wrong rather than as a uniform guess.
    """

    targets: Ints
    group_start: Ints
    group_offset: Ints
    goal_target: Ints
    reach_weight: Floats
    stage_weights: Floats
    leg_from: Ints
    leg_target: Ints
    leg_weight: Floats
    fractions: Floats
    beta: float
    penalty: float
    tie_tolerance: float
    strict: bool


class Scratch(NamedTuple):
    """Room to work in: ``m`` obstacles, ``T`` targets, groups of at most ``G`` goals, ``P = G * K`` points."""

    boxes: Floats
    corners: Floats
    between: Floats
    target_points: Floats
    lengths: Floats
    path: Floats
    x: Floats
    y: Floats
    observed: Floats
    excess: Floats
    evidence: Floats
    blocking: Floats
    most: Floats
    box_u: Floats
    box_v: Floats
    blocked: Ints
    near_x: Floats
    near_y: Floats
    away: Floats
    detours: Floats
    value: Floats
    total: Floats
    sums: Floats


@kernel
def make_scratch(num_obstacles: int, tables: ReachTables) -> Scratch:
    """Allocate what :func:`score_table` needs."""
    most = 0
    for q in range(len(tables.group_start)):
        most = max(most, tables.group_offset[q + 1] - tables.group_offset[q])
    k = len(tables.fractions)
    corners = 4 * num_obstacles
    return Scratch(
        np.empty((num_obstacles, 6)),
        np.empty((corners, 2)),
        np.empty((corners, corners)),
        np.empty((len(tables.targets), 2)),
        np.empty((len(tables.targets), corners)),
        np.empty((corners + 2, 2)),
        np.empty(most * k),
        np.empty(most * k),
        np.empty(most * k),
        np.empty((most, most * k)),
        np.empty((most, most * k)),
        np.empty((most, most * k)),
        np.empty(most * k),
        np.empty((num_obstacles, most * k)),
        np.empty((num_obstacles, most * k)),
        np.empty(most * k, dtype=np.int64),
        np.empty(most * k),
        np.empty(most * k),
        np.empty(most * k),
        np.empty((most, most * k)),
        np.empty(tables.stage_weights.shape[1]),
        np.empty(tables.stage_weights.shape[1]),
        np.empty(tables.stage_weights.shape[1]),
    )


@kernel
def place_reach(path: Floats, count: int, length: float, fractions: Floats, x: Floats, y: Floats, seen: Floats) -> None:
    """Write the points at ``fractions [K]`` (ascending) of a path of ``count`` points to ``x``, ``y``, ``seen [K]``."""
    leg = 0
    before = 0.0
    step = norm(path[1, 0] - path[0, 0], path[1, 1] - path[0, 1])
    for k in range(len(fractions)):
        at = fractions[k] * length
        while leg < count - 2 and before + step < at:
            before += step
            leg += 1
            step = norm(path[leg + 1, 0] - path[leg, 0], path[leg + 1, 1] - path[leg, 1])
        share = min((at - before) / step, 1.0) if step > 0.0 else 0.0
        x[k] = path[leg, 0] + share * (path[leg + 1, 0] - path[leg, 0])
        y[k] = path[leg, 1] + share * (path[leg + 1, 1] - path[leg, 1])
        seen[k] = at


@kernel
def raise_to(values: Floats, most: Floats) -> None:
    """``most = max(most, values)``."""
    for p in range(len(values)):
        most[p] = values[p] if values[p] > most[p] else most[p]


@kernel
def straight_excess(x: Floats, y: Floats, seen: Floats, goal: Floats, optimal: float, excess: Floats) -> None:
    """``C(S->Q) + C*(Q->G) - C*(S->G)`` of points from which the goal is reached straight."""
    for p in range(len(x)):
        dx, dy = goal[0] - x[p], goal[1] - y[p]
        excess[p] = np.sqrt(dx * dx + dy * dy) + seen[p] - optimal


@kernel
def find_blocked(
    boxes: Floats, tables: ReachTables, first: int, num_goals: int, num_points: int, scratch: Scratch
) -> None:
    """Write to ``scratch.blocking [G, P]`` a number >= 0 where a box lies across the straight line from point to goal.

    A reach's own path is known and never counts. ``scratch.most [P]`` is the greatest number of each point.
    """
    per_goal = len(tables.fractions)
    x, y, most = scratch.x[:num_points], scratch.y[:num_points], scratch.most[:num_points]
    most[:] = -1.0
    for i in range(len(boxes)):
        into_box(boxes[i], x, y, scratch.box_u[i, :num_points], scratch.box_v[i, :num_points])
    for g in range(num_goals):
        blocking = scratch.blocking[g, :num_points]
        blocking[:] = -1.0
        goal = scratch.target_points[tables.goal_target[first + g]]
        for i in range(len(boxes)):
            block(boxes[i], scratch.box_u[i, :num_points], scratch.box_v[i, :num_points], goal[0], goal[1], blocking)
        blocking[g * per_goal : (g + 1) * per_goal] = -1.0
        raise_to(blocking, most)


@kernel
def gather_blocked(num_boxes: int, num_points: int, scratch: Scratch) -> int:
    """Move the points with any blocked goal to the front of ``near_x``, ``near_y``, ``box_u`` and ``box_v``.

    Returns:
        How many there are; ``scratch.blocked`` says which.
    """
    count = 0
    for p in range(num_points):
        if scratch.most[p] >= 0.0:
            scratch.blocked[count] = p
            scratch.near_x[count] = scratch.x[p]
            scratch.near_y[count] = scratch.y[p]
            for i in range(num_boxes):
                scratch.box_u[i, count] = scratch.box_u[i, p]
                scratch.box_v[i, count] = scratch.box_v[i, p]
            count += 1
    return count


@kernel
def reach_corner(x: Floats, y: Floats, corner: Floats, blocking: Floats, away: Floats) -> None:
    """``away`` = distance of each point to a corner, inf where ``blocking`` says that a box lies between."""
    for p in range(len(x)):
        dx, dy = corner[0] - x[p], corner[1] - y[p]
        distance = np.sqrt(dx * dx + dy * dy)
        away[p] = distance if blocking[p] < 0.0 else np.inf


@kernel
def shorten(away: Floats, rest: float, detours: Floats) -> None:
    """``detours = min(detours, away + rest)``."""
    for p in range(len(away)):
        length = away[p] + rest
        detours[p] = length if length < detours[p] else detours[p]


@kernel
def detour_excess(
    boxes: Floats,
    count: int,
    tables: ReachTables,
    first: int,
    num_goals: int,
    num_points: int,
    optimal: Floats,
    scratch: Scratch,
) -> None:
    """Replace the excess of blocked pairs of point and goal by that of the shortest path round a corner.

    All corners are tried for all blocked points, in loops without branches: that is faster than to look for the few
    that matter.
    """
    find_blocked(boxes, tables, first, num_goals, num_points, scratch)
    n = gather_blocked(len(boxes), num_points, scratch)
    if n == 0:
        return
    x, y, blocking, away = scratch.near_x[:n], scratch.near_y[:n], scratch.most[:n], scratch.away[:n]
    for g in range(num_goals):
        scratch.detours[g, :n] = np.inf
    for c in range(count):
        corner = scratch.corners[c]
        blocking[:] = -1.0
        for i in range(len(boxes)):
            block(boxes[i], scratch.box_u[i, :n], scratch.box_v[i, :n], corner[0], corner[1], blocking)
        reach_corner(x, y, corner, blocking, away)
        for g in range(num_goals):
            shorten(away, scratch.lengths[tables.goal_target[first + g], c], scratch.detours[g, :n])
    for g in range(num_goals):
        for k in range(n):
            p = scratch.blocked[k]
            if scratch.blocking[g, p] >= 0.0:
                scratch.excess[g, p] = scratch.detours[g, k] + (scratch.observed[p] - optimal[g])


@kernel
def group_value(q: int, num_goals: int, tables: ReachTables, scratch: Scratch) -> float:
    """Sum over the stages of one group, and over their valid goals, of weight times E[EnvLegibility] (Eq. 2)."""
    per_goal = len(tables.fractions)
    n = num_goals * per_goal
    for g in range(num_goals):
        exponentials(tables.beta, scratch.excess[g, :n], scratch.evidence[g, :n])
        scratch.evidence[g, g * per_goal : (g + 1) * per_goal] = 0.0
    sum_candidates(num_goals, n, scratch.evidence, scratch.value, scratch.total)
    settle_ties(
        num_goals,
        n,
        per_goal,
        scratch.excess,
        tables.tie_tolerance,
        scratch.observed,
        tables.penalty,
        tables.strict,
        scratch.value,
        scratch.total,
    )
    sums = scratch.sums[:n]
    sums[:] = 0.0
    for mask in range(1, 1 << num_goals):
        row = slice(mask * n, (mask + 1) * n)
        add_weighted(tables.stage_weights[q, row], scratch.value[row], scratch.total[row], sums)
    return sums.sum()


@kernel
def score_table(
    points: Floats, boxes: Floats, size: tuple[float, float], tables: ReachTables, scratch: Scratch, scores: Floats
) -> None:
    """Score one layout.

    Args:
        points: ``[N, 2]`` objects, then starts.
        boxes: ``[m, 6]`` grown obstacles.
        size: Of the table.
        tables: The task.
        scratch: Room to work in.
        scores: ``[4]`` out: legibility per sequence (Eq. 3), expected metres of one whole task, mean and greatest
            detour of a reach (path over straight line). NaN where a point is not free or a leg has no path.
    """
    scores[:] = np.nan
    corners, target_points = scratch.corners, scratch.target_points
    count = 0
    for t in range(len(tables.targets)):
        target_points[t] = points[tables.targets[t]]
    if len(boxes):
        for i in range(len(points)):
            if not is_free(boxes, points[i, 0], points[i, 1], size):
                return
        count = keep_corners(boxes, size, corners)
        corners_between(boxes, corners, count, scratch.between)
        path_tables(boxes, corners, count, scratch.between, target_points, scratch.lengths)
    distance = 0.0
    for leg in range(len(tables.leg_from)):
        a, t = tables.leg_from[leg], tables.leg_target[leg]
        start, end = points[a], target_points[t]
        length = first_corner(boxes, corners, count, scratch.lengths[t], start[0], start[1], end[0], end[1])[0]
        distance += tables.leg_weight[leg] * length
    if not distance < np.inf:
        return
    legibility = 0.0
    mean_detour = 0.0
    most_detour = 1.0
    per_goal = len(tables.fractions)
    optimal = np.empty(len(scratch.excess))
    for q in range(len(tables.group_start)):
        start = points[tables.group_start[q]]
        first = tables.group_offset[q]
        num_goals = tables.group_offset[q + 1] - first
        num_points = num_goals * per_goal
        for g in range(num_goals):
            t = tables.goal_target[first + g]
            goal = target_points[t]
            length, corner = first_corner(
                boxes, corners, count, scratch.lengths[t], start[0], start[1], goal[0], goal[1]
            )
            optimal[g] = length
            num_bends = write_path(
                boxes, corners, count, scratch.between, scratch.lengths[t], corner, start, goal, scratch.path
            )
            mine = slice(g * per_goal, (g + 1) * per_goal)
            x, y, observed = scratch.x[mine], scratch.y[mine], scratch.observed[mine]
            place_reach(scratch.path, num_bends, length, tables.fractions, x, y, observed)
            straight = norm(goal[0] - start[0], goal[1] - start[1])
            detour = length / straight if straight > 0.0 else 1.0
            mean_detour += tables.reach_weight[first + g] * detour
            most_detour = max(most_detour, detour)
        for g in range(num_goals):
            straight_excess(
                scratch.x[:num_points],
                scratch.y[:num_points],
                scratch.observed[:num_points],
                target_points[tables.goal_target[first + g]],
                optimal[g],
                scratch.excess[g],
            )
            scratch.excess[g, g * per_goal : (g + 1) * per_goal] = 0.0
        if len(boxes):
            detour_excess(boxes, count, tables, first, num_goals, num_points, optimal, scratch)
        legibility += group_value(q, num_goals, tables, scratch)
    scores[0] = legibility
    scores[1] = distance
    scores[2] = mean_detour
    scores[3] = most_detour


@kernel
def score_genomes(
    genomes: Floats,
    template: Floats,
    movable: Ints,
    obstacle_size: tuple[float, float],
    hand: float,
    size: tuple[float, float],
    tables: ReachTables,
    scores: Floats,
) -> None:
    """Score ``genomes [B, 2M + 4m]`` into ``scores [B, 4]``, see :func:`score_table`.

    Args:
        genomes: Centres of the ``M`` movable objects, then ``(active, x, y, angle)`` of each obstacle.
        template: ``[N, 2]`` objects and starts; movable objects are overwritten.
        movable: ``[M]`` their positions among the points.
        obstacle_size: Length and width of an obstacle, not grown.
        hand: Half the hand's width.
        size: Of the table.
        tables: The task.
        scores: Out.
    """
    points = template.copy()
    num_places = (genomes.shape[1] - 2 * len(movable)) // 4
    scratch = make_scratch(num_places, tables)
    for b in range(len(genomes)):
        genome = genomes[b]
        for i in range(len(movable)):
            points[movable[i], 0] = genome[2 * i]
            points[movable[i], 1] = genome[2 * i + 1]
        count = 0
        for i in range(num_places):
            row = genome[2 * len(movable) + 4 * i : 2 * len(movable) + 4 * i + 4]
            if row[0] > 0.5:
                grow(row[1], row[2], row[3], obstacle_size[0], obstacle_size[1], hand, scratch.boxes[count])
                count += 1
        score_table(points, scratch.boxes[:count], size, tables, scratch, scores[b])
