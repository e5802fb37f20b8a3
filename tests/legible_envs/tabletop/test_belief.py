"""Eq. 1 along a reach, against its definition with shapely's and networkx' paths."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.errors import LayoutError
from legible_envs.legibility import posterior
from legible_envs.rollouts import Trajectory
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.partner.belief import BayesianIntent, GoalBelief
from tests.oracles.table_oracle import PathOracle

HOME = (0.60, 0.05)
COLUMNS = TabletopTask.named("columns").layout
WALLED = COLUMNS.with_obstacles(
    [VirtualObstacle((0.33, 0.45)), VirtualObstacle((0.60, 0.22), 0.3), VirtualObstacle((0.57, 0.60), 1.5)]
)


def boxed(at=(0.4, 0.5), clearance=0.1):
    """Four walls round a point."""
    x, y = at
    return [VirtualObstacle((x + dx, y + dy), angle) for dx, dy, angle in (
        (clearance, 0, math.pi / 2), (-clearance, 0, math.pi / 2), (0, clearance, 0), (0, -clearance, 0))]  # fmt: skip


def random_table(rng):
    goals = rng.uniform((0.10, 0.20), (0.80, 0.70), (5, 2))
    walls = [
        VirtualObstacle(tuple(rng.uniform((0, 0), (1.2, 0.8))), rng.uniform(-np.pi, np.pi))
        for _ in range(rng.integers(0, 5))
    ]
    return TabletopLayout([TableObject(f"cup{i}", tuple(at)) for i, at in enumerate(goals)], walls)


def test_it_is_equation_1_with_independent_paths():
    rng = np.random.default_rng(0)
    compared = 0
    while compared < 150:
        layout = random_table(rng)
        oracle = PathOracle(layout)
        start, hand = rng.uniform((0, 0), (1.2, 0.8), (2, 2))
        optimal, remaining = oracle.lengths(start), oracle.lengths(hand)
        if not np.isfinite([optimal, remaining]).all():
            continue
        prior = dict(zip(layout.goals, rng.dirichlet(np.ones(5)).tolist(), strict=True)) if compared % 2 else None
        beta = float(rng.uniform(0, 40))
        expected = posterior(
            dict(zip(layout.goals, remaining, strict=True)), dict(zip(layout.goals, optimal, strict=True)), beta, prior
        )
        belief = GoalBelief(layout, beta, start=start, prior=prior)
        assert belief.update(hand) == pytest.approx(expected, abs=1e-9)
        compared += 1


def test_only_the_start_and_the_hand_matter():
    straight, wandering = GoalBelief(WALLED, start=HOME), GoalBelief(WALLED)
    for point in (HOME, (0.3, 0.3), (1.0, 0.7), (0.1, 0.1), (0.45, 0.3)):
        last = wandering.update(point, time=1.0)
    assert straight.update((0.45, 0.3)) == last == wandering.belief


def test_at_the_start_it_is_the_prior_exactly():
    belief = GoalBelief(WALLED, goals=COLUMNS.goals[:4])
    uniform = dict.fromkeys(COLUMNS.goals[:4], 0.25)
    assert belief.belief == uniform
    assert belief.update((0.33, 0.21)) == uniform
    prior = {"red-circle": 3, "blue-circle": 1, "green-circle": 0}
    weighed = GoalBelief(WALLED, goals=list(prior), prior=prior, start="home")
    assert weighed.belief == {"red-circle": 0.75, "blue-circle": 0.25, "green-circle": 0.0}
    assert weighed.update(HOME) == weighed.belief
    assert weighed.update(WALLED.place("green-circle"))["green-circle"] == 0  # impossible stays impossible
    assert sum(weighed.belief.values()) == pytest.approx(1)


def test_at_a_goal_it_is_sure():
    for goal in COLUMNS.goals:
        belief = GoalBelief(WALLED, start=HOME).update(WALLED.place(goal))
        assert max(belief, key=belief.__getitem__) == goal


def test_without_obstacles_straight_lines_count():
    start, hand = np.array(HOME), np.array((0.5, 0.2))
    far = np.hypot(*(COLUMNS.centres - hand).T) - np.hypot(*(COLUMNS.centres - start).T)
    weights = np.exp(-20 * far)
    found = GoalBelief(COLUMNS, start=start).update(hand)
    np.testing.assert_allclose(list(found.values()), weights / weights.sum(), atol=1e-12)


def test_a_hand_inside_a_grown_obstacle_is_at_the_nearest_free_point():
    rng = np.random.default_rng(1)
    points = rng.uniform((0, 0), (1.2, 0.8), (4000, 2))
    covered = points[~WALLED.paths.is_free(points)][:200]
    assert len(covered) == 200
    at, beside = GoalBelief(WALLED, start=HOME), GoalBelief(WALLED, start=HOME)
    for point, free in zip(covered, WALLED.paths.nearest_free(covered), strict=True):
        assert not np.array_equal(point, free)
        found = at.update(point)
        assert found == beside.update(free)
        assert sum(found.values()) == pytest.approx(1)
    inside = GoalBelief(WALLED, start=covered[0])  # so is the start
    assert inside.update((0.5, 0.1)) == GoalBelief(WALLED, start=WALLED.paths.nearest_free(covered[:1])[0]).update(
        (0.5, 0.1)
    )


def test_objects_that_were_moved_count_where_they_are():
    goals = ("green-circle", "red-triangle")
    moved = {"green-circle": (0.55, 0.43), "red-triangle": (0.21, 0.66)}
    objects = [TableObject(o.name, moved.get(o.name, o.at)) for o in WALLED.objects]
    pushed = TabletopLayout(objects, WALLED.obstacles)
    there = GoalBelief(pushed, goals=goals, start=HOME)
    told = GoalBelief(WALLED, goals=goals, positions=[moved[g] for g in goals], start=HOME)
    for point in ((0.5, 0.2), (0.3, 0.5), (0.33, 0.45)):
        assert told.update(point) == there.update(point)
    assert told.belief != GoalBelief(WALLED, goals=goals, start=HOME).update((0.33, 0.45))
    same = GoalBelief(WALLED, goals=goals, positions=[WALLED.place(g) for g in goals], start=HOME)
    assert same.update((0.5, 0.2)) == GoalBelief(WALLED, goals=goals, start=HOME).update((0.5, 0.2))


def test_a_goal_behind_obstacles_counts_by_its_straight_line():
    layout = TabletopLayout([TableObject("shut", (0.4, 0.5)), TableObject("open", (0.9, 0.5))], boxed())
    assert np.isinf(layout.paths.lengths([HOME])).tolist() == [[True, False]]
    free = layout.with_obstacles([])
    hand = (0.8, 0.12)  # whence the open one is in sight
    assert GoalBelief(layout, start=HOME).update(hand) == pytest.approx(GoalBelief(free, start=HOME).update(hand))
    nowhere = layout.with_obstacles([VirtualObstacle((0.6, 0.4), 0.0, (3.0, 3.0))])  # no free point at all
    assert GoalBelief(nowhere, start=HOME).update(hand) == pytest.approx(GoalBelief(free, start=HOME).update(hand))


@settings(deadline=None, max_examples=60)
@given(
    st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
    st.floats(0, 1e6),
    st.booleans(),
)
def test_whatever_the_hand_does_it_is_a_distribution(start, hand, beta, closed):
    layout = WALLED.with_obstacles(boxed(WALLED.objects[1].at, 0.08)) if closed else WALLED
    found = GoalBelief(layout, beta, start=start).update(hand)
    assert tuple(found) == layout.goals
    assert all(0 <= p <= 1 for p in found.values())
    assert sum(found.values()) == pytest.approx(1)


def test_as_a_predictor_it_opens_a_stream_for_each_reach():
    goals = COLUMNS.goals[:3]
    context = Trajectory(np.zeros((0, 2)), candidates=goals, layout=WALLED, complete=False)
    stream = BayesianIntent(12.0).stream(context)
    stream.update(HOME)
    assert stream.update((0.5, 0.2), 0.3) == GoalBelief(WALLED, 12.0, goals=goals, start=HOME).update((0.5, 0.2))
    assert repr(BayesianIntent()) == "BayesianIntent(beta=20.0)"


@pytest.mark.parametrize("point", [(math.nan, 0), (math.inf, 0), (1,), (1, 2, 3), "ab", None, 3.0, ("x", 1)])
def test_what_is_no_point_is_rejected_and_changes_nothing(point):
    belief = GoalBelief(WALLED, start=HOME)
    before = belief.update((0.4, 0.2))
    with pytest.raises(LayoutError, match="finite point"):
        belief.update(point)
    assert belief.belief == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"beta": -1}, "`beta`"),
        ({"beta": math.nan}, "`beta`"),
        ({"beta": math.inf}, "`beta`"),
        ({"beta": True}, "`beta`"),
        ({"goals": ()}, "`goals`"),
        ({"goals": ("red-circle", "red-circle")}, "`goals`"),
        ({"goals": ("pink-circle",)}, "pink-circle"),
        ({"start": "kitchen"}, "kitchen"),
        ({"start": (math.nan, 0)}, "finite point"),
        ({"positions": [(0, 0)]}, "8 finite points"),
        ({"goals": ("red-circle",), "positions": [(math.nan, 0)]}, "1 finite points"),
        ({"prior": {"red-circle": 1}}, "`prior`"),
        ({"goals": ("red-circle",), "prior": {"red-circle": -1}}, "`prior`"),
        ({"goals": ("red-circle",), "prior": {"red-circle": 0}}, "`prior`"),
        ({"goals": ("red-circle",), "prior": {"red-circle": math.nan}}, "`prior`"),
    ],
)
def test_wrong_arguments_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        GoalBelief(WALLED, **options)
