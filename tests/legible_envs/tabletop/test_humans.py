"""Simulated participants who reach over a table: paths, times, people and tasks."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
import shapely
from scipy.stats import kstest

from legible_envs.errors import LayoutError
from legible_envs.rollouts import load_trajectories, save_trajectories
from legible_envs.tabletop import TabletopLayout, TabletopTask, VirtualObstacle
from legible_envs.tabletop.design.workspace import TabletopWorkspace
from legible_envs.tabletop.humans import (
    Person,
    ReachModel,
    plan_reach,
    sample_person,
    simulate_participants,
    simulate_reach,
    simulate_task,
)
from tests.legible_envs.tabletop.human_cases import COLUMNS, HOME, detour, random_tables
from tests.support.plain_python import printed

CALM = Person(
    skew=1.0,
    skew_trial=0.0,
    bow=0.0,
    bow_trial=0.0,
    aim=0.0,
    duration_trial=0.0,
    endpoint_sd=0.0,
    start_sd=0.0,
    signal_sd=0.0,
)
"""Plain minimum jerk along the shortest path."""

# -- one reach ---------------------------------------------------------------------------------------------------------


def test_the_calm_person_is_minimum_jerk() -> None:
    times, states = simulate_reach(COLUMNS.layout, "home", "red-circle", CALM, np.random.default_rng(0), rate=50)
    share = times / times[-1]
    progress = 10 * share**3 - 15 * share**4 + 6 * share**5
    ends = np.array([HOME, COLUMNS.layout.place("red-circle")])
    assert states == pytest.approx(ends[0] + progress[:, None] * (ends[1] - ends[0]), abs=1e-12)
    assert np.diff(times) == pytest.approx(0.02)
    skewed = simulate_reach(
        COLUMNS.layout, "home", "red-circle", replace(CALM, skew=2.0), np.random.default_rng(0), rate=50
    )
    early = 1 - (1 - share) ** 2
    progress = 10 * early**3 - 15 * early**4 + 6 * early**5
    assert skewed[1] == pytest.approx(ends[0] + progress[:, None] * (ends[1] - ends[0]), abs=1e-12)


def test_durations_follow_fitts_law_and_corners() -> None:
    person = replace(CALM, intercept=0.1, slope=0.2, corner_cost=0.3)
    length = np.hypot(*np.subtract(COLUMNS.layout.place("red-circle"), HOME))
    times, _ = simulate_reach(COLUMNS.layout, "home", "red-circle", person, np.random.default_rng(0), rate=1000)
    assert times[-1] == pytest.approx(0.1 + 0.2 * np.log2(length / 0.045 + 1), abs=1e-3)
    layout = detour()
    corners = len(layout.paths.polyline(HOME, "cup")) - 2
    assert corners == 2
    times, _ = simulate_reach(layout, "home", "cup", person, np.random.default_rng(0), rate=1000)
    far = layout.paths.lengths([HOME])[0, 0]
    assert times[-1] == pytest.approx(0.1 + 0.2 * np.log2(far / 0.045 + 1) + 2 * 0.3, abs=1e-3)
    kettle = TabletopTask.named("tea").layout  # wide objects are reached sooner
    assert person.duration(0.5, 0.14) < person.duration(0.5, 0.045)
    slow = simulate_reach(kettle, "home", "kettle", person, np.random.default_rng(0), rate=1000)[0][-1]
    length = kettle.paths.lengths([HOME])[0, kettle.index("kettle")]
    assert slow == pytest.approx(0.1 + 0.2 * np.log2(length / 0.14 + 1), abs=1e-3)


def test_bows_lean_where_the_person_leans_and_by_how_much() -> None:
    for bow, turns in ((-0.1, (0.0,) * 4), (0.15, (0.0,) * 4), (0.0, (0.02, -0.03, 0.01, 0.05))):
        person = replace(CALM, bow=bow, bow_turns=turns)
        for end in ((0.3, 0.4), (-0.3, 0.1), (0.0, -0.5)):
            path, _ = plan_reach(None, (0.0, 0.0), end, person, np.random.default_rng(0))
            far = np.hypot(*end)
            left = path @ np.array([-end[1], end[0]]) / far / far
            expected = person.bow_towards((0.0, 0.0), end)
            assert left[np.abs(left).argmax()] == pytest.approx(expected, rel=1e-3)
    d = np.arctan2(0.4, 0.3)
    assert expected != bow
    assert replace(CALM, bow_turns=(0.02, -0.03, 0.01, 0.05)).bow_towards((1.0, 1.0), (1.3, 1.4)) == pytest.approx(
        0.02 * np.cos(d) - 0.03 * np.sin(d) + 0.01 * np.cos(2 * d) + 0.05 * np.sin(2 * d)
    )


def test_reaches_begin_and_end_with_the_noise_stated() -> None:
    rng = np.random.default_rng(1)
    person = Person(endpoint_sd=0.015, start_sd=0.006, signal_sd=0.0)
    reaches = [simulate_reach(None, (0, 0), (0.4, 0.3), person, rng)[1] for _ in range(800)]
    for points, centre, sd in (
        (np.array([reach[0] for reach in reaches]), (0, 0), 0.006),
        (np.array([reach[-1] for reach in reaches]), (0.4, 0.3), 0.015),
    ):
        for axis in range(2):
            assert kstest(points[:, axis], "norm", args=(centre[axis], sd)).pvalue > 1e-3
    still = replace(CALM, signal_sd=0.002)
    noise = np.concatenate(
        [
            simulate_reach(None, (0, 0), (0.4, 0.3), still, np.random.default_rng(k))[1]
            - simulate_reach(None, (0, 0), (0.4, 0.3), CALM, np.random.default_rng(k))[1]
            for k in range(40)
        ]
    )
    assert noise.std(axis=0) == pytest.approx([0.002, 0.002], rel=0.1)
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.1


def test_a_hand_never_goes_through_an_obstacle() -> None:
    rng = np.random.default_rng(2)
    model = ReachModel(Person(start_sd=0.02, signal_sd=0.004, bow=-0.2, bow_trial=0.15, aim=0.1))
    inside = bowed = count = 0
    for layout in random_tables(40, seed=3):
        walls = shapely.union_all([shapely.Polygon(o.corners) for o in layout.obstacles])
        for goal in layout.goals:
            for start in ("home", "assembly"):
                _, states = simulate_reach(layout, start, goal, model.sample_person(rng), rng)
                line = shapely.LineString(states)
                assert line.intersection(walls).length < 1e-9
                assert (states >= 0).all()
                assert (states <= layout.table.size).all()
                assert np.isfinite(states).all()
                count += len(states)
                inside += int((~layout.paths.is_free(states)).sum())
                path, _ = plan_reach(layout, start, goal, sample_person(rng), rng)
                # a round hand that means to follow the path touches no obstacle (3 mm: chords of rounded corners)
                assert shapely.LineString(path).distance(walls) > layout.table.hand - 0.003
                polyline = layout.paths.polyline(layout.place(start), goal)
                bowed += shapely.LineString(path).hausdorff_distance(shapely.LineString(polyline)) > 0.01
    assert inside > 0  # noise and rounded corners do enter the margin
    assert inside < 0.3 * count
    assert bowed > 200  # there is often room


def test_corners_are_rounded() -> None:
    layout = detour()
    sharp, _ = plan_reach(layout, "home", "cup", replace(CALM, corner_radius=0.0), np.random.default_rng(0))
    round_, _ = plan_reach(layout, "home", "cup", replace(CALM, corner_radius=0.06), np.random.default_rng(0))

    def sharpest(path: np.ndarray) -> float:
        steps = np.diff(path, axis=0)
        steps = steps[np.hypot(*steps.T) > 1e-9]
        turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
        return float(np.abs(turns).max())

    assert sharpest(round_) < 0.6 * sharpest(sharp)
    assert shapely.LineString(round_).length < shapely.LineString(sharp).length


def test_who_ignores_obstacles_reaches_as_if_there_were_none() -> None:
    layout = random_tables(1, seed=5)[0]
    bare = layout.with_obstacles([])
    for seed in range(20):
        goal = layout.goals[seed % 4]
        person = ReachModel(Person(crossing_rate=1.0)).sample_person(np.random.default_rng(seed))
        crossed, absent = (simulate_reach(x, "home", goal, person, np.random.default_rng(seed)) for x in (layout, bare))
        assert np.array_equal(crossed[1], absent[1])
        assert np.array_equal(crossed[0], absent[0])
    blocked = detour()
    rng = np.random.default_rng(0)
    wall = shapely.Polygon(blocked.obstacles[0].corners)
    for rate in (0.0, 0.3, 1.0):
        person = replace(Person(), crossing_rate=rate)
        through = [
            shapely.LineString(simulate_reach(blocked, "home", "cup", person, rng)[1]).intersects(wall)
            for _ in range(400)
        ]
        assert np.mean(through) == pytest.approx(rate, abs=4 * np.sqrt(rate * (1 - rate) / 400))


def test_points_and_starts_in_the_margin_are_places_too() -> None:
    layout = detour()
    rng = np.random.default_rng(0)
    _, states = simulate_reach(layout, (0.62, 0.31), (0.3, 0.6), CALM, rng)
    assert states[-1] == pytest.approx([0.3, 0.6])
    assert layout.paths.is_free(states[:1]).all()
    for bad in (
        (None, "home", (0, 0)),
        (layout, "kitchen", "cup"),
        (layout, "home", "spoon"),
        (layout, (0, np.nan), "cup"),
    ):
        with pytest.raises(LayoutError):
            simulate_reach(*bad, CALM, rng)
    for rate in (0, -1.0, np.nan, np.inf, "fast", True):
        with pytest.raises(ValueError, match="rate"):
            simulate_reach(layout, "home", "cup", CALM, rng, rate=rate)
    closed = [
        VirtualObstacle((0.6 + dx, 0.5 + dy), angle)
        for dx, dy, angle in ((0, 0.12, 0), (0, -0.12, 0), (0.12, 0, np.pi / 2), (-0.12, 0, np.pi / 2))
    ]
    with pytest.raises(LayoutError, match="no path"):
        simulate_reach(layout.with_obstacles(closed), "home", "cup", CALM, rng)


# -- people ------------------------------------------------------------------------------------------------------------


def test_people_differ_by_the_spreads_of_the_model() -> None:
    model = ReachModel(bow_target=0.03)
    people = [model.sample_person(np.random.default_rng(seed)) for seed in range(1500)]
    for values, mean, sd in (
        (np.log([p.skew for p in people]), np.log(1.35), 0.12),
        ([p.bow for p in people], -0.105, 0.02),
        (np.log([p.intercept for p in people]), np.log(0.2), 0.1),
        ([p.bow_turns[2] for p in people], 0.0, 0.03),
    ):
        assert kstest(values, "norm", args=(mean, sd)).pvalue > 1e-3
    assert len({p.slope / p.intercept for p in people}) < 10  # all durations of a person go together
    assert people[0].endpoint_sd == 0.015
    assert pickle.loads(pickle.dumps(people[0])) == copy.deepcopy(people[0]) == people[0]
    drawn = [sample_person(np.random.default_rng(seed)) for seed in range(300)]
    default = [-person.bow_towards((0, 0), (0.3, 0.3)) for person in drawn]
    assert np.mean([0.06 <= bow <= 0.15 for bow in default]) > 0.8


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"skew": 0.0}, "skew"),
        ({"skew": -1.0}, "`skew` must be a finite number >= 0"),
        ({"bow": np.nan}, "`bow` must be a finite number,"),
        ({"endpoint_sd": "wide"}, "endpoint_sd"),
        ({"crossing_rate": 1.5}, "crossing_rate is a probability"),
        ({"crossing_rate": True}, "crossing_rate"),
        ({"bow_turns": (0.0, 1.0)}, "four"),
        ({"drift_time": 0.0}, "drift_time"),
        ({"intercept": 0.0, "slope": 0.0}, "intercept"),
    ],
)
def test_impossible_people_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Person(**options)  # type: ignore[arg-type]


def test_impossible_populations_are_refused() -> None:
    for options, message in (({"bow_spread": -1.0}, "bow_spread"), ({"median": 1.35}, "must be a Person")):
        with pytest.raises(ValueError, match=message):
            ReachModel(**options)  # type: ignore[arg-type]


# -- tasks -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["columns", "tea", "bins"])
def test_a_task_is_done_in_a_valid_order(name: str) -> None:
    task = TabletopTask.named(name)
    stages = {(stage.start, frozenset(stage.goals)) for stage in task.graph.stages()}
    rng = np.random.default_rng(0)
    for _ in range(5):
        reaches = simulate_task(task.layout, sample_person(rng), rng, task=task, participant="p", layout_name="sorted")
        assert len(reaches) == task.graph.length
        clock = -1.0
        for reach in reaches:
            assert (reach.start, frozenset(reach.candidates)) in stages
            assert reach.goal in reach.candidates
            assert (reach.candidate_set, reach.participant, reach.condition) == ("task", "p", "simulated")
            assert reach.layout == task.layout
            assert reach.goal_positions == tuple(task.layout.place(goal) for goal in reach.candidates)
            assert reach.times[0] > clock
            clock = reach.times[-1]
            assert np.hypot(*(reach.states[0] - task.layout.place(reach.start))) < 0.04
            assert np.hypot(*(reach.states[-1] - task.layout.place(reach.goal))) < 0.09
        if name != "bins":
            assert sorted(reach.goal or "" for reach in reaches) == sorted(task.graph.goals)


def test_orders_are_uniformly_random_and_seeds_repeat(tmp_path: object) -> None:
    tea = TabletopTask.named("tea")
    reaches = simulate_participants(tea.layout, 150, np.random.default_rng(3), task=tea, executions=2)
    orders = [tuple(r.goal for r in reaches[k : k + 5]) for k in range(0, len(reaches), 5)]
    counts = np.unique(orders, axis=0, return_counts=True)[1]
    assert len(counts) == 12
    assert ((counts - 25) ** 2 / 25).sum() < 31.3  # chi square with 11 degrees of freedom, p = .001
    assert len({r.participant for r in reaches}) == 150
    again = simulate_participants(tea.layout, 150, np.random.default_rng(3), task=tea, executions=2)
    assert again == reaches
    path = save_trajectories(f"{tmp_path}/reaches.npz", reaches[:20])
    assert load_trajectories(path) == reaches[:20]
    with pytest.raises(ValueError, match="executions"):
        simulate_participants(tea.layout, 1, np.random.default_rng(0), executions=-1)
    with pytest.raises(LayoutError, match="lacks"):
        simulate_task(COLUMNS.layout, Person(), np.random.default_rng(0), task=tea)
    assert simulate_participants(tea.layout, 0, np.random.default_rng(0)) == []


@pytest.mark.parametrize("name", ["columns", "tea", "bins"])
def test_the_task_is_the_packaged_one_that_has_the_objects(name: str) -> None:
    task = TabletopTask.named(name)
    layout = TabletopLayout.from_json(task.layout.to_json())
    assert TabletopTask.for_layout(layout) is task
    people = (simulate_participants(layout, 2, np.random.default_rng(0), task=given) for given in (None, task))
    assert next(people) == next(people)
    one = (simulate_task(layout, Person(), np.random.default_rng(0), task=given) for given in (None, task))
    assert next(one) == next(one)


def test_without_a_packaged_task_one_must_be_named() -> None:
    layout, rng = detour(), np.random.default_rng(0)
    with pytest.raises(LayoutError, match=r"no task of the package \(bins, columns, tea\) has the objects \['cup'\]"):
        simulate_participants(layout, 1, rng)
    with pytest.raises(LayoutError, match="name the task"):
        simulate_task(layout, Person(), rng)


def test_a_workspace_has_people() -> None:
    workspace = TabletopWorkspace("tea")
    genome = workspace.sample(1, np.random.default_rng(0))[0]
    model = ReachModel(Person(crossing_rate=0.5))
    reaches = workspace.simulate(genome, 3, np.random.default_rng(1), population=model, condition="random")
    layout = workspace.decode(genome)
    again = simulate_participants(layout, 3, np.random.default_rng(1), population=model, condition="random")
    assert reaches == again
    assert reaches[0].layout == layout


# -- what Eq. 1 makes of them ------------------------------------------------------------------------------------------


def test_plain_python_gives_the_same_reaches() -> None:
    code = (
        "import numpy as np\n"
        "from legible_envs.tabletop import *\n"
        "from legible_envs.tabletop.humans import *\n"
        "layout = TabletopLayout([TableObject('cup', (0.6, 0.5))], [VirtualObstacle((0.62, 0.3))])\n"
        "times, states = simulate_reach(layout, 'home', 'cup', Person(), np.random.default_rng(0), rate=10)\n"
        "print(times[-1], *states.ravel())"
    )
    times, states = simulate_reach(detour(), "home", "cup", Person(), np.random.default_rng(0), rate=10)
    expected = [times[-1], *states.ravel()]
    assert [float(x) for x in printed(code, compiled=False).split()] == pytest.approx(expected, abs=1e-12)
    assert len(expected) > 15
