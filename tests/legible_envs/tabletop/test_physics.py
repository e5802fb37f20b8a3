"""The hand among obstacles against brute force and shapely; pushed objects: what they do, that it is exact, copies."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon

from legible_envs.tabletop import TableObject, TabletopLayout, VirtualObstacle
from legible_envs.tabletop.game.physics import TablePhysics
from legible_envs.tabletop.geometry.motion_kernels import count_entered, slide, touch_distances
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.objects import rectangle

SIZE = (1.2, 0.8)
DT = 1 / 30
HAND = 0.025

OBSTACLE = st.tuples(
    st.floats(0, 1.2), st.floats(0, 0.8), st.floats(-4, 4), st.sampled_from([0.3, 0.1]), st.sampled_from([0.01, 0.2])
)


def grown(rows):
    return ShortestPaths(np.zeros((0, 2)), rows, HAND, SIZE)


def polygons(boxes, shrink=0.0):
    return [
        Polygon(rectangle(x, y, math.atan2(sin, cos), 2 * (a - shrink), 2 * (b - shrink)))
        for x, y, cos, sin, a, b in boxes.tolist()
    ]


# -- the hand -----------------------------------------------------------------------------------------------


@settings(max_examples=300, deadline=None)
@given(
    st.lists(OBSTACLE, max_size=4),
    st.tuples(st.floats(0, 1.2), st.floats(0, 0.8)),
    st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), min_size=1, max_size=6),
)
def test_a_hand_stays_free_and_goes_no_further_than_told(rows, start, moves):
    paths = grown(rows)
    x, y = paths.nearest_free([start])[0].tolist()
    if math.isnan(x):
        return
    solid = polygons(paths.boxes, 2e-9)
    for dx, dy in moves:
        to_x, to_y, was_stopped = slide(paths.boxes, SIZE, x, y, dx, dy)
        assert paths.is_free([(to_x, to_y)])[0]
        assert math.dist((x, y), (to_x, to_y)) <= math.hypot(dx, dy) + 1e-8
        line = LineString([(x, y), (x + dx, y + dy)])
        is_clear = not any(line.intersects(box) for box in polygons(paths.boxes, -1e-9))
        if is_clear and 0 <= x + dx <= 1.2 and 0 <= y + dy <= 0.8:
            assert (to_x, to_y, was_stopped) == (x + dx, y + dy, False)
        if any(line.intersects(box) for box in solid):
            assert was_stopped
        x, y = to_x, to_y


def test_a_hand_slides_along_a_wall_by_what_is_left_of_the_move():
    boxes = grown([(0.6, 0.4, 0.0, 0.3, 0.01)]).boxes
    side = 0.4 - 0.005 - HAND
    x, y, was_stopped = slide(boxes, SIZE, 0.55, 0.30, 0.06, 0.14)
    assert was_stopped
    assert (x, y) == pytest.approx((0.61, side), abs=1e-8)
    # along the wall nothing stops it, away from it neither, into it nothing is left
    assert slide(boxes, SIZE, x, y, 0.05, 0.0) == pytest.approx((x + 0.05, y, False))
    assert slide(boxes, SIZE, x, y, 0.0, -0.05) == pytest.approx((x, y - 0.05, False))
    assert slide(boxes, SIZE, x, y, 0.0, 0.05) == pytest.approx((x, y, True))
    # past the end of the wall the slide goes on straight
    assert slide(boxes, SIZE, 0.76, side, 0.05, 0.0)[:2] == pytest.approx((0.81, side))


def test_a_hand_stops_at_the_edge_of_the_table():
    nothing = np.empty((0, 6))
    assert slide(nothing, SIZE, 1.19, 0.4, 0.1, 0.05) == pytest.approx((1.2, 0.45, True))
    assert slide(nothing, SIZE, 0.0, 0.0, -0.1, -0.1) == (0.0, 0.0, True)


def test_a_hand_does_not_leave_a_closed_box_nor_get_stuck_in_it():
    walls = [(0.6, 0.3, 0.1, 0.4, 0.01), (0.6, 0.55, -0.05, 0.4, 0.01)]
    walls += [(0.45, 0.42, 1.5, 0.4, 0.01), (0.75, 0.42, 1.6, 0.4, 0.01)]
    paths = grown(walls)
    rng = np.random.default_rng(0)
    x, y = 0.6, 0.42
    seen = []
    for _ in range(4000):
        x, y, _ = slide(paths.boxes, SIZE, x, y, *rng.normal(0, 0.05, 2))
        seen.append((x, y))
    seen = np.array(seen)
    assert (seen.min(axis=0) > (0.4, 0.29)).all()
    assert (seen.max(axis=0) < (0.8, 0.56)).all()
    assert len(np.unique(seen[2000:].round(6), axis=0)) > 1500


def test_a_hand_can_follow_every_shortest_path():
    rng = np.random.default_rng(1)
    checked = 0
    while checked < 60:
        rows = [(*rng.uniform((0.1, 0.15), (0.9, 0.7)), rng.uniform(0, 3), 0.3, 0.01) for _ in range(4)]
        goals = rng.uniform((0.1, 0.2), (0.8, 0.7), (5, 2))
        paths = ShortestPaths(goals, rows, HAND, SIZE)
        for goal, path in zip(goals, paths.polylines((0.6, 0.05)), strict=True):
            if path is None or len(path) < 3:
                continue
            at = path[0]
            for corner in path[1:]:
                for _ in range(200):
                    step = corner - at
                    if np.hypot(*step) < 1e-7:
                        break
                    at = np.array(slide(paths.boxes, SIZE, *at, *(step * min(1, 0.03 / np.hypot(*step))))[:2])
            assert at == pytest.approx(goal, abs=1e-6)
            checked += 1


@settings(max_examples=300, deadline=None)
@given(st.lists(OBSTACLE, max_size=4), *[st.floats(-0.1, 1.2)] * 4)
def test_crossings_are_those_of_geometry(rows, x0, y0, x1, y1):
    boxes = ShortestPaths(np.zeros((0, 2)), rows, 0.0, SIZE).boxes
    line, start = LineString([(x0, y0), (x1, y1)]), Point(x0, y0)
    pairs = list(zip(polygons(boxes, 1e-8), polygons(boxes, -1e-8), strict=True))
    least = sum(line.intersects(inner) and not start.intersects(outer) for inner, outer in pairs)
    most = sum(line.intersects(outer) and not start.intersects(inner) for inner, outer in pairs)
    assert least <= count_entered(boxes, x0, y0, x1, y1) <= most


@settings(max_examples=200, deadline=None)
@given(st.lists(OBSTACLE, min_size=1, max_size=4), st.floats(0, 1.2), st.floats(0, 0.8))
def test_distances_are_those_of_geometry(rows, x, y):
    data = np.array(rows)
    distances = np.empty(len(rows))
    touch_distances(data[:, :2].copy(), data[:, 2].copy(), data[:, 3:] / 2, x, y, distances)
    expected = [Polygon(rectangle(*row)).distance(Point(x, y)) for row in rows]
    assert distances == pytest.approx(expected, abs=1e-9)


# -- what is pushed ---------------------------------------------------------------------------------------------


def cubes(*at, size=(0.045, 0.045)):
    return TabletopLayout([TableObject(f"cube-{i}", point, size=size) for i, point in enumerate(at)])


def physics_of(layout, fixed=()):
    loose = np.ones(len(layout.objects), dtype=bool)
    loose[list(fixed)] = False
    return TablePhysics(layout, HAND, DT, loose)


def push(physics, start, velocity, ticks, is_low=True):
    x, y = start
    for _ in range(ticks):
        physics.advance((x, y), velocity, is_low)
        x, y = x + velocity[0] * DT, y + velocity[1] * DT
    return x, y


def overlap(physics, layout):
    shapes = [
        Polygon(rectangle(*at, angle, *thing.size))
        for at, angle, thing in zip(physics.positions.tolist(), physics.angles.tolist(), layout.objects, strict=True)
    ]
    return max(a.intersection(b).area for i, a in enumerate(shapes) for b in shapes[:i])


def test_a_hand_pushes_a_cube_before_it():
    physics = physics_of(cubes((0.5, 0.4)))
    x, y = push(physics, (0.4, 0.4), (0.2, 0.0), 30)
    assert (x, y) == pytest.approx((0.6, 0.4))
    assert physics.positions[0] == pytest.approx((x + HAND + 0.0225, 0.4), abs=2e-3)
    assert abs(physics.angles[0]) < 0.02
    assert not physics.is_resting
    push(physics, (x, y), (-0.2, 0.0), 15)
    assert physics.is_resting
    # dry friction: from 0.2 m/s at 0.5 g a cube slides 4 mm
    assert physics.positions[0, 0] == pytest.approx(x + HAND + 0.0225 + 0.004, abs=3e-3)


def test_a_hand_above_touches_nothing():
    physics = physics_of(cubes((0.5, 0.4)))
    before = physics.positions.copy()
    push(physics, (0.4, 0.4), (0.5, 0.0), 20, is_low=False)
    assert (physics.positions == before).all()


def test_a_cube_hit_off_its_middle_turns():
    physics = physics_of(cubes((0.5, 0.4)))
    push(physics, (0.42, 0.42), (0.2, 0.0), 20)
    assert physics.angles[0] < -0.2  # clockwise: hit on its far side, from the left


def test_cubes_push_cubes_and_fixed_ones_stay():
    layout = cubes((0.5, 0.4), (0.56, 0.4), (0.7, 0.4))
    physics = physics_of(layout, fixed=[2])
    push(physics, (0.42, 0.4), (0.2, 0.0), 20)
    assert physics.positions[1, 0] > 0.6
    assert physics.positions[2].tolist() == [0.7, 0.4]
    assert overlap(physics, layout) < 1e-5


@pytest.mark.parametrize(
    ("start", "velocity"), [((0.3, 0.4), (-0.5, 0)), ((0.5, 0.3), (0.03, -0.5)), ((0.3, 0.3), (-0.4, -0.4))]
)
def test_cubes_stay_on_the_table(start, velocity):
    layout = cubes((0.2, 0.4), (0.5, 0.2), (0.2, 0.2))
    physics = physics_of(layout)
    push(physics, start, velocity, 24)
    push(physics, (0.9, 0.7), (0.0, 0.0), 30)
    assert physics.is_resting
    for at, angle in zip(physics.positions.tolist(), physics.angles.tolist(), strict=True):
        corners = rectangle(*at, angle, 0.045, 0.045)
        assert (corners > -0.03).all()
        assert ((physics.positions > 0) & (physics.positions < SIZE)).all()


def test_a_hand_gives_way_to_nothing_however_heavy():
    layout = TabletopLayout([TableObject("kettle", (0.5, 0.4), size=(0.16, 0.14))])
    physics = physics_of(layout)
    x, _ = push(physics, (0.38, 0.4), (0.2, 0.0), 30)
    assert physics.positions[0, 0] == pytest.approx(x + HAND + 0.08, abs=2e-3)


def test_taking_and_putting():
    layout = cubes((0.5, 0.4), (0.7, 0.4))
    physics = physics_of(layout)
    physics.take(0)
    push(physics, (0.42, 0.4), (0.2, 0.0), 20)
    assert physics.positions[0].tolist() == [0.5, 0.4]
    physics.put(0, (0.71, 0.42), 0.3, is_fixed=True)  # on top of the other, which is pushed aside
    assert not physics.is_resting
    for _ in range(60):
        physics.advance((0.1, 0.1), (0.0, 0.0), False)
    assert physics.is_resting
    assert (physics.positions[0].tolist(), physics.angles[0]) == ([0.71, 0.42], 0.3)
    assert overlap(physics, layout) < 1e-5


def crowd():
    rng = np.random.default_rng(3)
    points = [(0.3 + 0.07 * i, 0.3 + 0.06 * j) for i in range(3) for j in range(3)]
    layout = TabletopLayout(
        [TableObject(f"cube-{i}", at, angle=float(rng.uniform(-0.1, 0.1))) for i, at in enumerate(points)]
    )
    layout.validate()
    return layout


def stir(physics, ticks, seed):
    """Push back and forth through everything."""
    rng = np.random.default_rng(seed)
    states, hand, velocity = [], np.array([0.2, 0.36]), np.zeros(2)
    for tick in range(ticks):
        if tick % 8 == 0:
            velocity = rng.uniform(-0.3, 0.3, 2) + 2 * (np.array([0.37, 0.36]) - hand)
        physics.advance(tuple(hand.tolist()), tuple(velocity.tolist()), bool(rng.random() < 0.9))
        hand = hand + velocity * DT
        states.append((physics.positions.copy(), physics.angles.copy()))
    return states


def same(first, second):
    return all(np.array_equal(a, c) and np.array_equal(b, d) for (a, b), (c, d) in zip(first, second, strict=True))


def test_the_same_calls_give_exactly_the_same_world():
    layout = crowd()
    first = stir(physics_of(layout), 120, 0)
    assert np.abs(first[-1][0] - layout.centres).max() > 0.02
    assert same(first, stir(physics_of(layout), 120, 0))
    assert not same(first, stir(physics_of(layout), 120, 1))


@pytest.mark.parametrize("copier", [copy.deepcopy, copy.copy, lambda physics: pickle.loads(pickle.dumps(physics))])
def test_copies_in_the_middle_of_a_push_go_on_exactly_alike(copier):
    physics = physics_of(crowd())
    stir(physics, 50, 0)
    physics.take(4)
    physics.positions[4] = (0.9, 0.1)
    stir(physics, 20, 1)
    twin = copier(physics)
    assert not physics.is_resting
    assert np.array_equal(twin.positions, physics.positions)
    assert same(stir(physics, 60, 2), stir(twin, 60, 2))


def test_long_histories_are_forgotten_at_rest(monkeypatch):
    monkeypatch.setattr("legible_envs.tabletop.game.physics.LOG_LIMIT", 50)
    worlds = physics_of(crowd()), physics_of(crowd())
    for physics in worlds:
        stir(physics, 60, 0)
        busy = len(pickle.dumps(physics))
        for _ in range(60):
            physics.advance((1.1, 0.7), (0.0, 0.0), False)
        assert physics.is_resting
        before = physics.positions.copy()
        physics.settle()
        assert len(pickle.dumps(physics)) < busy / 2, "a picklable history is all that makes a world larger"
        assert np.array_equal(before, physics.positions)
    twin = pickle.loads(pickle.dumps(worlds[0]))
    futures = [stir(physics, 60, 1) for physics in (*worlds, twin)]
    assert same(futures[0], futures[1])
    assert same(futures[0], futures[2])


def test_obstacles_are_light_and_stop_no_cube():
    layout = TabletopLayout([TableObject("cube", (0.5, 0.4))], [VirtualObstacle((0.56, 0.4), 1.57)])
    physics = physics_of(layout)
    push(physics, (0.42, 0.4), (0.2, 0.0), 40)
    assert physics.positions[0, 0] > 0.62
