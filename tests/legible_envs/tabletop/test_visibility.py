"""Shortest paths on a table against shapely and networkx, and every degenerate case by name."""

import itertools
import math

import numpy as np
import pytest
import shapely

from legible_envs.errors import LayoutError
from legible_envs.tabletop import Table, TableObject, TabletopLayout, VirtualObstacle
from tests.oracles.table_oracle import PathOracle, grown

HAND = 0.025
HALF_WIDTH = 0.005 + HAND  # of a grown obstacle
HALF_LENGTH = 0.15 + HAND
HOME = (0.60, 0.05)


def table(obstacles, goals=((0.6, 0.5),), **options):
    things = [TableObject(f"cup{i}", at) for i, at in enumerate(goals)]
    return TabletopLayout(things, obstacles, Table(**options) if options else None)


def random_layout(rng, max_obstacles=6, num_goals=4):
    goals = rng.uniform((0.10, 0.20), (0.80, 0.70), (num_goals, 2))
    obstacles = [
        VirtualObstacle(tuple(rng.uniform((0, 0), (1.2, 0.8))), rng.uniform(-np.pi, np.pi))
        for _ in range(rng.integers(0, max_obstacles + 1))
    ]
    return table(obstacles, goals)


def length_of(path):
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def check_against_oracle(layout, points):
    oracle = PathOracle(layout)
    paths = layout.paths
    found = paths.lengths(points)
    for point, lengths in zip(points, found, strict=True):
        expected = oracle.lengths(point)
        assert np.array_equal(np.isinf(lengths), np.isinf(expected)), (layout.to_json(), point)
        finite = np.isfinite(expected)
        np.testing.assert_allclose(lengths[finite], expected[finite], rtol=0, atol=1e-12)
        for g, (path, length) in enumerate(zip(paths.polylines(point), lengths, strict=True)):
            if path is None:
                assert math.isinf(length)
                continue
            assert length_of(path) == pytest.approx(length, abs=1e-12)
            assert tuple(path[0]) == tuple(point)
            assert tuple(path[-1]) == layout.objects[g].at
            legs = [(tuple(a), tuple(b)) for a, b in itertools.pairwise(path)]
            assert all(oracle.clear(a, b) for a, b in legs)
            assert all(oracle.table.covers(shapely.Point(p)) for p in path)
    return found


def check_random(seed, count):
    rng = np.random.default_rng(seed)
    blocked = bent = 0
    for _ in range(count):
        layout = random_layout(rng)
        points = np.array([HOME, (1.0, 0.45), *rng.uniform((0, 0), (1.2, 0.8), (2, 2))])
        found = check_against_oracle(layout, points)
        straight = np.hypot(*(points[:, None] - layout.centres[None]).transpose(2, 0, 1))
        blocked += np.isinf(found).sum()
        bent += (np.isfinite(found) & (found > straight + 1e-9)).sum()
    assert blocked > count / 2  # the comparison is worth something
    assert bent > count / 2


def test_random_layouts_have_the_oracles_paths():
    check_random(0, 150)


def test_paths_need_no_crossing_points():
    rng = np.random.default_rng(11)
    for _ in range(40):
        layout = random_layout(rng)
        oracle = PathOracle(layout, crossings=True)
        for point in rng.uniform((0, 0), (1.2, 0.8), (2, 2)):
            # A crossing point is known to rounding only, so the oracle may cut a corner by that much.
            np.testing.assert_allclose(layout.paths.lengths([point])[0], oracle.lengths(point), atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
def test_thousands_of_random_layouts_have_the_oracles_paths(seed):
    check_random(seed, 500)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2])
def test_one_obstacle_by_hand(angle):
    layout = table([VirtualObstacle((0.6, 0.4), angle)], [(0.6, 0.6)])
    start = (0.6, 0.2)
    u = min(
        math.dist(start, a) + math.dist(a, b) + math.dist(b, (0.6, 0.6))
        for a, b in itertools.product(grown(layout.obstacles[0], HAND), repeat=2)
        if PathOracle(layout).clear(start, a)
        and PathOracle(layout).clear(a, b)
        and PathOracle(layout).clear(b, (0.6, 0.6))
    )
    assert layout.paths.lengths([start])[0, 0] == pytest.approx(u, abs=1e-12)
    if angle == 0.0:
        by_hand = 2 * math.hypot(HALF_LENGTH, 0.2 - HALF_WIDTH) + 2 * HALF_WIDTH
        assert layout.paths.lengths([start])[0, 0] == pytest.approx(by_hand, abs=1e-12)


def wall(x, y, angle=0.0, length=0.30):
    return VirtualObstacle((x, y), angle, (length, 0.01))


DEGENERATE = {
    "duplicate": [wall(0.6, 0.3), wall(0.6, 0.3)],
    "duplicate turned by half a turn": [wall(0.6, 0.3, 0.4), wall(0.6, 0.3, 0.4 + np.pi)],
    "three of the same": [wall(0.5, 0.3, 1.0)] * 3,
    "touching end to end": [wall(0.45, 0.3), wall(0.45 + 2 * HALF_LENGTH, 0.3)],
    "touching corner to corner": [wall(0.45, 0.3), wall(0.45 + 2 * HALF_LENGTH, 0.3 + 2 * HALF_WIDTH)],
    "abutting side by side": [wall(0.6, 0.3), wall(0.6, 0.3 + 2 * HALF_WIDTH)],
    "abutting and shifted": [wall(0.6, 0.3), wall(0.7, 0.3 + 2 * HALF_WIDTH)],
    "crossing": [wall(0.6, 0.3), wall(0.6, 0.3, np.pi / 2)],
    "crossing askew": [wall(0.6, 0.3, 0.3), wall(0.65, 0.3, -0.9)],
    "T": [wall(0.6, 0.3), wall(0.6, 0.3 + HALF_WIDTH + HALF_LENGTH, np.pi / 2)],
    "T that overlaps": [wall(0.6, 0.3), wall(0.6, 0.42, np.pi / 2)],
    "a corner inside another": [wall(0.6, 0.3), wall(0.74, 0.32, 0.2)],
    "overlapping by less than rounding": [wall(0.45, 0.3), wall(0.45 + 2 * HALF_LENGTH - 1e-13, 0.3)],
    "a gap of less than rounding": [wall(0.45, 0.3), wall(0.45 + 2 * HALF_LENGTH + 1e-13, 0.3)],
    "three at one point": [wall(0.6, 0.3, a) for a in (0.0, np.pi / 3, 2 * np.pi / 3)],
    "along the edge of the table": [wall(0.6, HALF_WIDTH)],
    "out of the table": [wall(0.0, 0.3), wall(1.2, 0.3)],
}


@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_obstacles(name):
    layout = table(DEGENERATE[name], [(0.6, 0.5), (0.2, 0.6), (0.45, 0.7), (0.6, 0.1)])
    points = np.array([HOME, (1.0, 0.45), (0.6, 0.2), (0.3, 0.3), (0.9, 0.6)])
    check_against_oracle(layout, points)


def test_duplicates_change_nothing():
    once, twice = table([wall(0.6, 0.3, 0.2)]), table([wall(0.6, 0.3, 0.2)] * 2)
    points = np.random.default_rng(0).uniform((0, 0), (1.2, 0.8), (50, 2))
    assert np.array_equal(once.paths.lengths(points), twice.paths.lengths(points))


def test_a_gap_of_exactly_the_hands_width_is_passable_and_a_narrower_one_is_not():
    fits = table([wall(0.6 - HALF_LENGTH, 0.3), wall(0.6 + HALF_LENGTH, 0.3)])
    assert fits.paths.lengths([HOME])[0, 0] == pytest.approx(0.45, abs=1e-12)
    tight = table([wall(0.6 - HALF_LENGTH + 1e-6, 0.3), wall(0.6 + HALF_LENGTH, 0.3)])
    assert tight.paths.lengths([HOME])[0, 0] > 0.5


GOAL_CASES = {
    "on the middle of a grown edge": (0.6, 0.3 + HALF_WIDTH),
    "on a grown corner": (0.6 + HALF_LENGTH, 0.3 + HALF_WIDTH),
    "collinear with a grown edge": (0.9, 0.3 + HALF_WIDTH),
    "collinear with the axis": (0.9, 0.3),
}


@pytest.mark.parametrize("case", GOAL_CASES)
def test_a_goal_on_or_collinear_with_a_grown_edge(case):
    layout = table([wall(0.6, 0.3)], [GOAL_CASES[case]])
    points = np.array([HOME, (0.2, 0.3 + HALF_WIDTH), (0.2, 0.3 - HALF_WIDTH), (0.6, 0.7), GOAL_CASES[case]])
    found = check_against_oracle(layout, points)
    assert np.isfinite(found).all()
    assert found[4, 0] == 0.0


def test_a_path_runs_along_a_collinear_edge():
    layout = table([wall(0.6, 0.3)], [(0.9, 0.3 + HALF_WIDTH)])
    start = (0.3, 0.3 + HALF_WIDTH)
    assert layout.paths.lengths([start])[0, 0] == pytest.approx(0.6, abs=1e-12)
    assert len(layout.paths.polyline(start, "cup0")) == 2


@pytest.mark.parametrize("start", [(0.6, 0.3 - HALF_WIDTH), (0.6 - HALF_LENGTH, 0.3), (0.6 - HALF_LENGTH, 0.27)])
def test_a_start_on_the_boundary_is_free(start):
    layout = table([wall(0.6, 0.3)])
    assert layout.paths.is_free([start])[0]
    assert np.isfinite(check_against_oracle(layout, np.array([start]))).all()


@pytest.mark.parametrize("corner", [(0.0, 0.0), (1.2, 0.0), (1.2, 0.8), (0.0, 0.8), (0.6, 0.0)])
def test_a_start_on_the_edge_of_the_table(corner):
    layout = table([wall(0.6, 0.3)], [(0.6, 0.5), (0.2, 0.2)])
    assert np.isfinite(check_against_oracle(layout, np.array([corner]))).all()


def closed_box(x, y, half=0.15):
    return [
        wall(x, y - half),
        wall(x, y + half),
        wall(x - half, y, np.pi / 2),
        wall(x + half, y, np.pi / 2),
    ]


def test_a_closed_box_round_a_cube():
    layout = table(closed_box(0.45, 0.45), [(0.45, 0.45), (0.75, 0.45)])
    found = check_against_oracle(layout, np.array([HOME, (0.47, 0.44)]))
    assert found.tolist()[0][0] == math.inf
    assert math.isfinite(found[0, 1])
    assert math.isfinite(found[1, 0])
    assert found[1, 1] == math.inf
    assert layout.paths.polylines(HOME)[0] is None
    with pytest.raises(LayoutError, match="no path from") as caught:
        layout.paths.polyline(HOME, "cup0")
    assert caught.value.rule == "reachable"
    with pytest.raises(LayoutError, match=r"cup0 at .* cannot be reached from 'home'") as caught:
        layout.validate()
    assert caught.value.rule == "reachable"


def test_a_wall_to_the_tables_edge_is_passed_on_the_other_side():
    # From the left edge to x = 0.8: only the right end is passable.
    layout = table([wall(0.4, 0.3, length=0.8)], [(0.1, 0.5)])
    found = check_against_oracle(layout, np.array([(0.1, 0.1)]))
    end = 0.8 + HAND
    by_hand = 2 * math.hypot(end - 0.1, 0.2 - HALF_WIDTH) + 2 * HALF_WIDTH
    assert found[0, 0] == pytest.approx(by_hand, abs=1e-12)


def test_a_wall_across_the_table_leaves_no_path_and_raises_nothing():
    layout = table([wall(0.6, 0.3, length=1.2)])
    assert check_against_oracle(layout, np.array([HOME]))[0, 0] == math.inf
    assert layout.paths.polylines(HOME) == [None]
    assert not layout.is_valid()


def test_a_wall_whose_grown_side_lies_on_the_edge_lets_the_hand_slide_along_it():
    layout = table([wall(HALF_LENGTH, 0.3)], [(0.1, 0.5)])
    path = layout.paths.polyline((0.1, 0.1), "cup0")
    check_against_oracle(layout, np.array([(0.1, 0.1)]))
    assert path[1:-1, 0] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_there_is_no_way_from_or_to_a_point_inside_a_grown_obstacle():
    layout = table([wall(0.6, 0.3)], [(0.6, 0.32), (0.2, 0.6)])
    found = check_against_oracle(layout, np.array([(0.6, 0.31), HOME, (-0.1, 0.3)]))
    assert np.isinf(found[0]).all()
    assert np.isinf(found[1, 0])
    assert np.isfinite(found[1, 1])
    assert np.isinf(found[2]).all()


def test_the_nearest_free_point_against_shapely():
    rng = np.random.default_rng(3)
    inside = 0
    for _ in range(150):
        layout = random_layout(rng, max_obstacles=5)
        boxes = shapely.union_all([shapely.Polygon(grown(o, HAND)) for o in layout.obstacles])
        free = shapely.box(0, 0, 1.2, 0.8).difference(boxes)
        points = rng.uniform((0, 0), (1.2, 0.8), (20, 2))
        nearest = layout.paths.nearest_free(points)
        assert layout.paths.is_free(nearest).all()
        for point, found in zip(points, nearest, strict=True):
            expected = shapely.distance(free, shapely.Point(point))
            assert math.dist(point, found) == pytest.approx(expected, abs=2e-8)
            inside += expected > 0
    assert inside > 100


def test_the_nearest_free_point_of_one_off_the_table_and_where_nothing_is_free():
    assert table([]).paths.nearest_free([(-0.5, 0.3), (2.0, 9.0)]).tolist() == [[0.0, 0.3], [1.2, 0.8]]
    full = table([VirtualObstacle((0.6, 0.4), 0.0, (3.0, 3.0))])
    assert np.isnan(full.paths.nearest_free([(0.3, 0.3)])).all()


@pytest.mark.parametrize("points", [[(np.nan, 0.1)], [(0.1, 0.2, 0.3)], (0.1, 0.2), [(np.inf, 0)]])
def test_bad_points_are_refused(points):
    with pytest.raises(LayoutError, match="finite numbers of shape"):
        table([]).paths.lengths(points)


def test_symmetry_and_the_triangle_inequality():
    rng = np.random.default_rng(7)
    for _ in range(40):
        layout = random_layout(rng, num_goals=6)
        between = layout.paths.lengths(layout.centres)
        np.testing.assert_allclose(between, between.T, atol=1e-12)
        for i, j, k in itertools.permutations(range(6), 3):
            assert between[i, k] <= between[i, j] + between[j, k] + 1e-12
