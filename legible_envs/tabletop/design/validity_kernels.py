"""Kernels: which genomes of a table obey the design rules.

The readable rules, with a message for each, are :class:`~legible_envs.tabletop.design.rules.DesignRules`. A *box* is a
row ``(x, y, cos, sin, half_length, half_width)``; obstacles are boxes that are not grown by the hand here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.support.compiled import kernel
from legible_envs.tabletop.geometry.visibility_kernels import (
    Floats,
    Ints,
    clear,
    corners_between,
    first_corner,
    is_free,
    keep_corners,
    norm,
    path_tables,
)

__all__ = [
    "EDGE",
    "Room",
    "Rules",
    "batch_detours",
    "make_room",
    "obeys",
    "obstacle_allowed",
    "on_table",
    "place",
    "too_close",
    "valid_genomes",
    "ways_allowed",
]

EDGE = 1e-9


class Rules(NamedTuple):
    """The rules as numbers: ``n`` objects, ``N`` points (objects, then starts), ``d`` genes.

    Attributes:
        template: ``[N, 2]`` objects and starts; movable objects are overwritten by a genome.
        movable: ``[M]`` objects a genome places.
        fixed: ``[n]`` whether the workspace leaves an object where it is; two such objects are not compared.
        shapes: ``[n, 4]`` cosine and sine of each object's angle, half its length, half its width.
        lower: ``[d]`` least value of each gene.
        upper: ``[d]`` greatest value of each gene.
        size: Of the table.
        hand: Half the hand's width.
        obstacle: Half an obstacle's length and width, not grown.
        max_detour: Greatest shortest path of a reach over its straight line.
        start_clearance: Least distance of an obstacle from every start.
        object_clearance: Least distance of an obstacle from every object's centre, also where it is built.
        object_spacing: Least distance between centres of objects.
        on_table: Whether obstacles must lie wholly on the table.
        apart: Whether obstacles may neither cross nor touch one another.
        slots: ``[S, 6]`` boxes of the desired configuration.
        reach_from: ``[R]`` point each reach of the task leaves from.
        reach_to: ``[R]`` object it leads to.
        reach_weight: ``[R]`` expected number of such reaches, divided by that of all.
    """

    template: Floats
    movable: Ints
    fixed: npt.NDArray[np.bool_]
    shapes: Floats
    lower: Floats
    upper: Floats
    size: tuple[float, float]
    hand: float
    obstacle: tuple[float, float]
    max_detour: float
    start_clearance: float
    object_clearance: float
    object_spacing: float
    on_table: bool
    apart: bool
    slots: Floats
    reach_from: Ints
    reach_to: Ints
    reach_weight: Floats


class Room(NamedTuple):
    """Room to work in, for ``m`` obstacles."""

    points: Floats
    boxes: Floats
    grown: Floats
    corners: Floats
    between: Floats
    lengths: Floats
    is_known: npt.NDArray[np.bool_]


@kernel
def make_room(rules: Rules) -> Room:
    """Allocate what :func:`obeys` needs."""
    num_obstacles = (len(rules.lower) - 2 * len(rules.movable)) // 4
    corners = 4 * num_obstacles
    n = len(rules.shapes)
    return Room(
        rules.template.copy(),
        np.empty((num_obstacles, 6)),
        np.empty((num_obstacles, 6)),
        np.empty((corners, 2)),
        np.empty((corners, corners)),
        np.empty((n, corners)),
        np.empty(n, dtype=np.bool_),
    )


@kernel
def in_bounds(genome: Floats, rules: Rules) -> bool:
    """Whether every gene is within its bounds; NaN is not."""
    for i in range(len(genome)):
        if not rules.lower[i] <= genome[i] <= rules.upper[i]:
            return False
    return True


@kernel
def place(genome: Floats, rules: Rules, room: Room) -> int:
    """Write where objects and obstacles lie to ``room``; returns the number of obstacles."""
    points, boxes = room.points, room.boxes
    for i in range(len(rules.movable)):
        points[rules.movable[i], 0] = genome[2 * i]
        points[rules.movable[i], 1] = genome[2 * i + 1]
    count = 0
    for first in range(2 * len(rules.movable), len(genome), 4):
        if genome[first] > 0.5:
            boxes[count, 0] = genome[first + 1]
            boxes[count, 1] = genome[first + 2]
            boxes[count, 2] = np.cos(genome[first + 3])
            boxes[count, 3] = np.sin(genome[first + 3])
            boxes[count, 4] = rules.obstacle[0]
            boxes[count, 5] = rules.obstacle[1]
            room.grown[count] = boxes[count]
            room.grown[count, 4] += rules.hand
            room.grown[count, 5] += rules.hand
            count += 1
    return count


@kernel
def gap_along(dx: float, dy: float, a: Floats, b: Floats) -> float:
    """Greatest gap between two boxes along the two axes of the first; ``a``, ``b [4]`` without their centres."""
    along = abs(a[0] * b[0] + a[1] * b[1])
    across = abs(a[0] * b[1] - a[1] * b[0])
    u = abs(dx * a[0] + dy * a[1]) - a[2] - b[2] * along - b[3] * across
    v = abs(dy * a[0] - dx * a[1]) - a[3] - b[2] * across - b[3] * along
    return max(u, v)


@kernel
def gap(dx: float, dy: float, a: Floats, b: Floats) -> float:
    """Greatest gap of two boxes along any of their axes: negative where they overlap, 0 where they touch."""
    return max(gap_along(dx, dy, a, b), gap_along(dx, dy, b, a))


@kernel
def on_table(x: float, y: float, shape: Floats, size: tuple[float, float]) -> bool:
    """Whether a box lies wholly on the table."""
    half_x = abs(shape[0]) * shape[2] + abs(shape[1]) * shape[3]
    half_y = abs(shape[1]) * shape[2] + abs(shape[0]) * shape[3]
    return x - half_x >= -EDGE and x + half_x <= size[0] + EDGE and y - half_y >= -EDGE and y + half_y <= size[1] + EDGE


@kernel
def distance_to(box: Floats, x: float, y: float) -> float:
    """Distance of a point from a box; 0 inside."""
    dx, dy = x - box[0], y - box[1]
    u = max(abs(dx * box[2] + dy * box[3]) - box[4], 0.0)
    v = max(abs(dy * box[2] - dx * box[3]) - box[5], 0.0)
    return norm(u, v)


@kernel
def too_close(rules: Rules, points: Floats, i: int, j: int) -> bool:
    """Whether two objects lie nearer than ``object_spacing``, or overlap."""
    a, b = rules.shapes[i], rules.shapes[j]
    dx, dy = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
    distance = norm(dx, dy)
    if distance < rules.object_spacing - EDGE:
        return True
    return distance < norm(a[2], a[3]) + norm(b[2], b[3]) and gap(dx, dy, a, b) < -EDGE


@kernel
def objects_allowed(rules: Rules, points: Floats) -> bool:
    """Whether objects lie on the table, apart from one another."""
    for i in range(len(rules.shapes)):
        if rules.fixed[i]:
            continue
        if not on_table(points[i, 0], points[i, 1], rules.shapes[i], rules.size):
            return False
        for j in range(len(rules.shapes)):
            if (j < i or (rules.fixed[j] and j != i)) and too_close(rules, points, i, j):
                return False
    return True


@kernel
def covers(box: Floats, x: float, y: float, shape: Floats, clearance: float) -> bool:
    """Whether an obstacle lies over an object here, or nearer to its centre than ``clearance``."""
    if distance_to(box, x, y) < clearance - EDGE:
        return True
    dx, dy = x - box[0], y - box[1]
    if norm(dx, dy) >= norm(box[4], box[5]) + norm(shape[2], shape[3]):
        return False
    return gap(dx, dy, box[2:], shape) < -EDGE


@kernel
def obstacle_allowed(rules: Rules, points: Floats, boxes: Floats, i: int) -> bool:
    """Whether obstacle ``i`` of ``boxes [m, 6]`` keeps off starts, objects, slots and the obstacles before it."""
    box = boxes[i]
    n = len(rules.shapes)
    if rules.on_table and not on_table(box[0], box[1], box[2:], rules.size):
        return False
    for k in range(n, len(points)):
        if distance_to(box, points[k, 0], points[k, 1]) < rules.start_clearance - EDGE:
            return False
    for k in range(n):
        if covers(box, points[k, 0], points[k, 1], rules.shapes[k], rules.object_clearance):
            return False
    for k in range(len(rules.slots)):
        slot = rules.slots[k]
        if covers(box, slot[0], slot[1], slot[2:], rules.object_clearance):
            return False
    if rules.apart:
        for j in range(i):
            other = boxes[j]
            if gap(other[0] - box[0], other[1] - box[1], box[2:], other[2:]) <= EDGE:
                return False
    return True


@kernel
def know_ways(rules: Rules, room: Room, grown: Floats) -> int:
    """Prepare :func:`path_length`: corners, and nothing known of any object yet; returns how many corners there are."""
    count = keep_corners(grown, rules.size, room.corners)
    corners_between(grown, room.corners, count, room.between)
    room.is_known[:] = False
    return count


@kernel
def path_length(room: Room, grown: Floats, count: int, x: float, y: float, goal: int) -> float:
    """Length of the shortest path from a free point to an object; inf where there is none."""
    points = room.points
    if clear(grown, x, y, points[goal, 0], points[goal, 1]):
        return norm(points[goal, 0] - x, points[goal, 1] - y)
    one = slice(goal, goal + 1)
    if not room.is_known[goal]:
        path_tables(grown, room.corners, count, room.between, points[one], room.lengths[one])
        room.is_known[goal] = True
    return first_corner(grown, room.corners, count, room.lengths[goal], x, y, points[goal, 0], points[goal, 1])[0]


@kernel
def detour(room: Room, grown: Floats, count: int, start: int, goal: int) -> float:
    """Shortest path of a reach over its straight line."""
    x, y = room.points[start, 0], room.points[start, 1]
    straight = norm(room.points[goal, 0] - x, room.points[goal, 1] - y)
    return path_length(room, grown, count, x, y, goal) / straight if straight > 0.0 else 1.0


@kernel
def ways_allowed(rules: Rules, room: Room, num_obstacles: int) -> bool:
    """Whether a hand may be at all points, gets everywhere, and no reach is a long detour."""
    grown, points, n = room.grown[:num_obstacles], room.points, len(rules.shapes)
    for i in range(len(points)):
        if not is_free(grown, points[i, 0], points[i, 1], rules.size):
            return False
    for i in range(len(rules.slots)):
        if not is_free(grown, rules.slots[i, 0], rules.slots[i, 1], rules.size):
            return False
    count = know_ways(rules, room, grown)
    for i in range(len(rules.reach_from)):
        # also false for inf / inf
        if not detour(room, grown, count, rules.reach_from[i], rules.reach_to[i]) <= rules.max_detour + EDGE:
            return False
    for goal in range(n):
        for i in range(n, len(points)):
            if not path_length(room, grown, count, points[i, 0], points[i, 1], goal) < np.inf:
                return False
    for i in range(len(rules.slots)):
        if not path_length(room, grown, count, rules.slots[i, 0], rules.slots[i, 1], 0) < np.inf:
            return False
    return True


@kernel
def obeys(genome: Floats, rules: Rules, room: Room) -> bool:
    """Whether a genome obeys every rule."""
    if not in_bounds(genome, rules):
        return False
    num_obstacles = place(genome, rules, room)
    if not objects_allowed(rules, room.points):
        return False
    if num_obstacles == 0:
        return True
    for i in range(num_obstacles):
        if not obstacle_allowed(rules, room.points, room.boxes, i):
            return False
    return ways_allowed(rules, room, num_obstacles)


@kernel
def valid_genomes(genomes: Floats, rules: Rules, valid: npt.NDArray[np.bool_]) -> None:
    """Write to ``valid [B]`` which of ``genomes [B, d]`` obey every rule."""
    room = make_room(rules)
    for b in range(len(genomes)):
        valid[b] = obeys(genomes[b], rules, room)


@kernel
def batch_detours(genomes: Floats, rules: Rules, mean: Floats) -> None:
    """Write to ``mean [B]`` the mean detour over all reaches of the task; NaN where a point is not free."""
    room = make_room(rules)
    for b in range(len(genomes)):
        num_obstacles = place(genomes[b], rules, room)
        grown = room.grown[:num_obstacles]
        mean[b] = 0.0
        for i in range(len(room.points)):
            if not is_free(grown, room.points[i, 0], room.points[i, 1], rules.size):
                mean[b] = np.nan
        if num_obstacles == 0:
            mean[b] += 1.0
        elif mean[b] == 0.0:
            count = know_ways(rules, room, grown)
            for i in range(len(rules.reach_from)):
                mean[b] += rules.reach_weight[i] * detour(room, grown, count, rules.reach_from[i], rules.reach_to[i])
            mean[b] = max(mean[b], 1.0)  # rounding
