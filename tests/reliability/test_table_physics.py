"""However fast a hand is: objects stay on the table and apart, and everything can be repeated and copied."""

from __future__ import annotations

import copy
import math
import pickle

import gymnasium as gym
import numpy as np
import pytest
from shapely import MultiPoint, Point, Polygon

import legible_envs  # noqa: F401
from legible_envs.tabletop import Table, TableObject, TabletopLayout, TabletopTask
from legible_envs.tabletop.env import TabletopEnv
from legible_envs.tabletop.game.contact_kernels import (
    AWAY,
    FIXED,
    LIFTED,
    LOOSE,
    TOLERANCE,
    box_overlap,
    find_room,
    hand_overlap,
    keep_apart,
)
from legible_envs.tabletop.game.physics import TablePhysics
from legible_envs.tasks import Subtask, TaskGraph
from tests.support.rough_hands import SPEEDS, RoughHand, Watch, corners_of, depths, rough_table

EDGE, LEAST = 1e-9, 1e-3
SIZE = (1.2, 0.8)
EPISODE = 400


def minkowski_depth(first, second):
    """How deep two convex polygons overlap: from the origin to the edge of their Minkowski difference."""
    difference = MultiPoint([a - b for a in first for b in second]).convex_hull
    origin = Point(0, 0)
    return difference.exterior.distance(origin) if difference.contains(origin) else 0.0


# -- the soak ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("speed", SPEEDS)
def test_no_object_leaves_the_table_nor_overlaps(speed, repeats):
    steps, number = repeats(800, 400_000), 0
    rng, watch = np.random.default_rng(int(10 * speed)), Watch()
    while watch.steps < steps:
        env, layout = rough_table(number, speed, rng)
        env.reset(seed=number, options={"layout": layout})
        hand = RoughHand(env, rng)
        for _ in range(min(EPISODE, max(steps // 10, 80))):
            observation, _, is_over, _, _ = env.step(hand())
            watch.look(env, observation)
            if is_over:
                break
        number += 1
    print(f"{speed} m/s: {number} tables, {watch}")
    assert watch.pushed > steps / 50
    assert watch.low > steps / 10
    assert watch.off <= EDGE
    assert watch.overlap < LEAST
    assert watch.hand < LEAST


# -- kernels against shapely -------------------------------------------------------------------------------------------


def crowd(rng, n=6):
    """Rectangles anywhere, many over each other."""
    positions = rng.uniform((0.1, 0.1), (1.1, 0.7), (n, 2)) if rng.random() < 0.5 else rng.normal(0.5, 0.06, (n, 2))
    return positions, rng.uniform(-4, 4, n), rng.uniform(0.005, 0.06, (n, 2))


def test_overlaps_are_those_of_geometry(repeats):
    rng = np.random.default_rng(0)
    for _ in range(repeats(300, 20_000)):
        positions, angles, halves = crowd(rng, 2)
        corners = corners_of(positions, angles, 2 * halves)
        expected = minkowski_depth(*corners)
        depth, x, y = box_overlap(positions, angles, halves, 0, 1)
        assert max(depth, 0) == pytest.approx(expected, abs=1e-9)
        assert depths(corners[:1], corners[1:])[0] == pytest.approx(expected, abs=1e-9)
        assert math.hypot(x, y) == pytest.approx(1)
        if expected > 0:
            assert minkowski_depth(corners[0] + np.array([x, y]) * (depth + 1e-6), corners[1]) == 0
        hand, radius = tuple(positions[0] + rng.uniform(-0.08, 0.08, 2)), rng.uniform(0, 0.05)
        box = Polygon(corners[0])
        inside = box.exterior.distance(Point(hand)) * (1 if box.contains(Point(hand)) else -1)
        depth, x, y = hand_overlap(positions, angles, halves, 0, hand, radius)
        assert depth == pytest.approx(radius + inside, abs=1e-9)
        if depth > 0:
            away = Polygon(corners[0] + np.array([x, y]) * (depth + 1e-6)).distance(Point(hand))
            assert away >= radius - 1e-9


def keeps_the_rules(positions, angles, halves, kinds):
    on = kinds != AWAY
    corners = corners_of(positions, angles, 2 * halves)
    loose = corners[kinds == LOOSE]
    assert (loose >= -EDGE).all()
    assert (loose <= np.array(SIZE) + EDGE).all()
    for i in np.flatnonzero(on):
        for j in np.flatnonzero(on[:i]):
            if LOOSE in (kinds[i], kinds[j]):
                assert minkowski_depth(corners[i], corners[j]) <= TOLERANCE + EDGE


def test_whatever_a_solver_finds_is_put_right(repeats):
    rng, furthest, done = np.random.default_rng(1), 0.05, 0
    codes = []
    while done < repeats(100, 5_000):
        old, old_angles, halves = crowd(rng)
        kinds = rng.choice([AWAY, LOOSE, LOOSE, FIXED], len(old))
        first = np.flatnonzero(kinds == LOOSE)
        if not len(first) or not find_room(old, old_angles, halves, kinds, SIZE, int(first[0])):
            continue
        try:
            keeps_the_rules(old, old_angles, halves, kinds)
        except AssertionError:  # the others were over each other at first, which no game begins with
            continue
        done += 1
        is_loose = (kinds == LOOSE)[:, None]
        positions = old + is_loose * rng.normal(0, rng.choice([0.001, 0.01, 0.1]), old.shape)
        angles = old_angles + is_loose[:, 0] * rng.normal(0, 0.2, len(old))
        if rng.random() < 0.1:
            positions[first[0]] = np.nan
        hand, radius = tuple(rng.uniform(0, 1, 2) * SIZE), float(rng.choice([-1.0, 0.03, 0.2]))
        stuck = np.zeros(len(old), dtype=bool)
        fixed = positions[kinds != LOOSE].copy()
        result = keep_apart(positions, angles, halves, kinds, SIZE, hand, radius, old, old_angles, furthest, stuck)
        codes.append(result + 4 * stuck.any())
        assert np.array_equal(positions[kinds != LOOSE], fixed)
        keeps_the_rules(positions, angles, halves, kinds)
        if radius > 0 and not result & LIFTED:
            for i in np.flatnonzero(kinds != AWAY):
                assert hand_overlap(positions, angles, halves, i, hand, radius)[0] <= TOLERANCE
    assert set(codes) >= {0, 1, 3, 5}


# -- cases -------------------------------------------------------------------------------------------------------------


def cubes(*at, **more):
    return TabletopLayout([TableObject(f"cube-{i}", point, **more) for i, point in enumerate(at)])


def physics_of(layout, fixed=()):
    loose = np.ones(len(layout.objects), dtype=bool)
    loose[list(fixed)] = False
    return TablePhysics(layout, 0.025, 1 / 30, loose)


def pushed(physics, start, velocity, ticks):
    """Whether the hand stayed low in each tick, until it rose."""
    (x, y), low = start, []
    while len(low) < ticks and all(low):
        low.append(physics.advance((x, y), velocity, True))
        x, y = x + velocity[0] / 30, y + velocity[1] / 30
    return low


@pytest.mark.parametrize("speed", [0.2, *SPEEDS])
def test_a_hand_pushes_a_cube_before_it_and_rises_where_it_cannot_give_way(speed):
    across = math.ceil(0.4 / speed * 30)
    physics = physics_of(cubes((0.4, 0.4)))
    if speed <= 3:
        assert all(pushed(physics, (0.3, 0.4), (speed, 0.0), across))
        assert physics.positions[0] == pytest.approx((0.3 + across * speed / 30 + 0.0475, 0.4), abs=2e-3)
    # against the rim, into a corner, against a fixed cube, between two
    for layout, fixed, way in (
        (cubes((0.8, 0.4)), (), (1.0, 0.0)),
        (cubes((1.1, 0.7)), (), (math.sqrt(0.5), math.sqrt(0.5))),
        (cubes((0.6, 0.4), (0.7, 0.4)), (1,), (1.0, 0.0)),
        (cubes((0.6, 0.4), (0.7, 0.37), (0.7, 0.43)), (1, 2), (1.0, 0.0)),
    ):
        physics = physics_of(layout, fixed)
        start = np.array(layout.objects[0].at) - 0.1 * np.array(way)
        low = pushed(physics, tuple(start.tolist()), (speed * way[0], speed * way[1]), math.ceil(0.8 / speed * 30))
        assert not low[-1]
        assert physics.positions[0] @ way > layout.objects[0].at @ np.array(way) + 0.02
        halves = np.full((len(layout.objects), 2), 0.0225)
        kinds = np.where(physics.loose, LOOSE, FIXED)
        keeps_the_rules(physics.positions, physics.angles, halves, kinds)


def test_what_lies_where_something_is_put_down_makes_room():
    slots = [(0.6, 0.4 + 0.0465 * k) for k in range(3)]
    layout = cubes((0.2, 0.3), slots[0], slots[2], (0.6005, 0.4465 + 0.1))
    physics = physics_of(layout, fixed=(1, 2))
    physics.take(0)
    physics.take(3)
    assert physics.put(3, slots[1], 0.0, is_fixed=False)  # shut in between two that are fixed: 0.75 mm of air
    assert physics.put(0, slots[1], 0.0, is_fixed=True)
    assert physics.positions[0].tolist() == list(slots[1])
    keeps_the_rules(physics.positions, physics.angles, np.full((4, 2), 0.0225), np.array([FIXED] * 3 + [LOOSE]))
    # off the table, and on top of others
    physics.take(3)
    assert physics.put(3, (1.2, 0.8), 0.5, is_fixed=False)
    keeps_the_rules(physics.positions, physics.angles, np.full((4, 2), 0.0225), np.array([FIXED] * 3 + [LOOSE]))


def test_a_table_without_room_is_not_changed():
    table = Table(
        size=(0.2, 0.2),
        region=(0.02, 0.02, 0.18, 0.18),
        assembly=(0.02, 0.02, 0.18, 0.18),
        hand=0.0,
        starts={"home": (0.1, 0.1)},
    )
    objects = [TableObject("a", (0.05, 0.1), size=(0.09, 0.18)), TableObject("b", (0.15, 0.1), size=(0.09, 0.18))]
    physics = TablePhysics(TabletopLayout(objects, table=table), 0.0, 1 / 30, np.ones(2, dtype=bool))
    physics.take(0)
    before = pickle.dumps(physics)
    assert not physics.put(0, (0.1, 0.1), 0.0, is_fixed=True)
    assert pickle.dumps(physics) == before
    assert physics.solid.tolist() == [False, True]
    assert physics.put(0, (0.05, 0.1), 0.0, is_fixed=True)


def go_to(env, there):
    """Move the hand to a point as fast as it can, and rest there for a step; returns what ``step`` returns."""
    while np.hypot(*(there - env.hand)) > 1e-7:
        offset = (there - env.hand) * 30 / env.max_speed
        env.step(offset / max(1.0, np.hypot(*offset)))
    return env.step(np.zeros(2))


def test_a_placed_object_is_solid_and_a_low_hand_is_in_none():
    env = TabletopEnv(contact="always")
    env.reset(options={"start": "red-circle"})
    env.step(np.zeros(2))
    place = np.array(env.task.configuration["red-circle"])
    go_to(env, place)
    assert env.view().status[0] == "placed"
    heights = []
    for x in (0.0, 0.0, 0.2, 0.3, 0.2, 0.0, -0.2, -0.3, -0.2, 0.0):
        observation = env.step(np.array([x, 0.0]))[0]
        is_low = bool(observation[env.observation_names.index("hand is low")])
        heights.append(is_low)
        assert not is_low or env.hand[0] - place[0] - 0.0225 >= 0.025 - TOLERANCE
    assert {True, False} == set(heights)
    assert env.positions[0].tolist() == place.tolist()


def test_objects_are_put_down_wholly_on_the_table_and_not_on_fixed_ones():
    table = Table(assembly=(0.8, 0.0, 1.2, 0.8), starts={"home": (0.6, 0.05), "assembly": (1.0, 0.45)})
    objects = [TableObject("a", (0.3, 0.3)), TableObject("b", (1.0, 0.3), movable=False)]
    graph = TaskGraph([Subtask("a", ("a",), then=("assembly",)), Subtask("b", ("b",), after=("a",))], "home")
    env = TabletopEnv(task=TabletopTask("zone", TabletopLayout(objects, table=table), graph))
    for there, status in (((1.19, 0.3), "hand"), ((1.01, 0.31), "hand"), ((1.1775, 0.3), "placed")):
        env.reset(options={"start": "a"})
        env.step(np.zeros(2))
        go_to(env, there)
        assert env.view().status[0] == status


# -- numbers, repetition and copies ------------------------------------------------------------------------------------


def test_huge_actions_are_shortened_and_what_is_no_number_is_refused():
    for huge in ((1e308, 1e308), (-1.7e308, 1.7e308), (1e200, 0.0), (3e38, -3e38)):
        env, plain = TabletopEnv(contact="always"), TabletopEnv(contact="always")
        env.reset()
        plain.reset()
        direction = np.array(huge) / max(map(abs, huge))
        assert env.step(np.array(huge))[0] == pytest.approx(plain.step(direction * 2)[0])
        for bad in (np.nan, np.inf, -np.inf):
            before = env.hand
            with pytest.raises(ValueError, match="two finite numbers"):
                env.step(np.array([0.0, bad]))
            assert np.array_equal(env.hand, before)
    env = TabletopEnv(contact="always", max_speed=1e300)
    env.reset()
    for direction in ((1.0, 1.0), (-1.0, 0.3), (0.5, -1e308)):
        assert np.isfinite(env.step(np.array(direction))[0]).all()


def actions_at(speed, seed, steps):
    """A table, its layout, and what a rough hand does there."""
    rng = np.random.default_rng(seed)
    env = TabletopEnv(contact="always", max_speed=speed)
    env.reset(seed=seed)
    hand, actions, observations = RoughHand(env, rng), [], []
    for _ in range(steps):
        actions.append(hand())
        observations.append(env.step(actions[-1])[0])
    return env, actions, observations


@pytest.mark.parametrize("speed", [0.5, 10.0])
def test_the_same_actions_do_exactly_the_same_again_in_copies_and_in_vectors(speed):
    env, actions, first = actions_at(speed, 5, 100)
    assert np.abs(env.positions - env.layout.centres).max() > 0.02
    copies = []
    env.reset(seed=5)
    for t, action in enumerate(actions):
        if t in (20, 60):
            copies += [(t, copy.deepcopy(env)), (t, pickle.loads(pickle.dumps(env)))]
        assert np.array_equal(env.step(action)[0], first[t])
    for t, twin in copies:
        for k in range(t, len(actions)):
            assert np.array_equal(twin.step(actions[k])[0], first[k])
    envs = gym.make_vec("LegibleTabletop-v0", num_envs=2, contact="always", max_speed=speed)
    envs.reset(seed=5)
    _, others, second = actions_at(speed, 6, 100)
    for t, pair in enumerate(zip(actions, others, strict=True)):
        observed = envs.step(np.array(pair))[0]
        assert np.array_equal(observed[0], first[t])
        assert np.array_equal(observed[1], second[t])


def test_a_refused_action_in_the_middle_of_a_push_changes_nothing():
    env, actions, first = actions_at(3.0, 6, 60)
    env.reset(seed=5)
    for t, action in enumerate(actions):
        with pytest.raises(ValueError, match="two finite numbers"):
            env.step(np.array([np.nan, 1.0]))
        assert np.array_equal(env.step(action)[0], first[t])
