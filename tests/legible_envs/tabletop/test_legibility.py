"""Legibility on a table: the kernels against the definition, which uses shapely and networkx for every cost."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.errors import LayoutError, TaskError
from legible_envs.observer import ObserverModel
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.scoring.explanation import explain_layout, score_layout
from legible_envs.tabletop.scoring.posterior_kernels import exponentials
from legible_envs.tabletop.scoring.scorer import TabletopScorer
from legible_envs.tasks import Subtask, TaskGraph
from tests.oracles.table_oracle import PathOracle, legibility
from tests.support.plain_python import printed_both_ways

MIDPOINTS = [(i + 0.5) / 10 for i in range(10)]


def reach_task(*names, at=None):
    """Reach for any of the objects, once."""
    at = at or [(0.2 + 0.15 * i, 0.5) for i in range(len(names))]
    layout = TabletopLayout([TableObject(n, p) for n, p in zip(names, at, strict=True)])
    return TabletopTask("reach", layout, TaskGraph([Subtask("reach", names)], start="home"))


def sorting_task(num_pieces=3):
    """A small `bins`: every piece goes into either bin, so reaches start at objects too."""
    things = [TableObject("left", (0.2, 0.3), size=(0.1, 0.1)), TableObject("right", (0.7, 0.3), size=(0.1, 0.1))]
    things += [TableObject(f"piece{i}", (0.15 + 0.2 * i, 0.6), movable=False) for i in range(num_pieces)]
    subtasks, groups = [], {}
    for i in range(num_pieces):
        subtasks += [
            Subtask(f"take{i}", (f"piece{i}",)),
            Subtask(f"put{i}", ("left", "right"), after=(f"take{i}",)),
        ]
        groups[f"piece{i}"] = (f"take{i}", f"put{i}")
    graph = TaskGraph(subtasks, "home", groups, max_open=1)
    return TabletopTask("sorting", TabletopLayout(things), graph)


def random_layout(task, rng, max_obstacles=4):
    genome = []
    for thing in task.layout.objects:
        if thing.movable:
            genome += list(rng.uniform((0.10, 0.20), (0.80, 0.70)))
    obstacles = [
        VirtualObstacle(tuple(rng.uniform((0.1, 0.1), (1.0, 0.7))), rng.uniform(-np.pi, np.pi))
        for _ in range(rng.integers(0, max_obstacles + 1))
    ]
    return task.layout.with_genome(genome, 0).with_obstacles(obstacles)


def valid_layouts(task, rng, scorer, count, max_obstacles=4):
    found = 0
    while found < count:
        layout = random_layout(task, rng, max_obstacles)
        scores = scorer.score_layouts([layout])
        if math.isfinite(scores.legibility[0]):
            found += 1
            yield layout, scores


def check_random(task, seed, count, max_obstacles=4, **options):
    scorer = TabletopScorer(task, observer=ObserverModel.in_metres(**options))
    options = {k: v for k, v in options.items() if k != "prefix"} | {
        "fractions": sorted(options["prefix"]) if "prefix" in options else None
    }
    detours = []
    for layout, scores in valid_layouts(task, np.random.default_rng(seed), scorer, count, max_obstacles):
        expected = legibility(layout, task.graph, **options)
        assert abs(scores.legibility[0] - expected) <= 1e-9, layout.to_json()
        detours.append(scores.max_detour[0])
    assert max(detours) > 1.05


COLUMNS = TabletopTask.named("columns")


def test_the_kernel_is_the_definition_on_random_tables():
    check_random(COLUMNS, 0, 25)


@pytest.mark.parametrize(
    "options",
    [
        {"prefix": (0.9, 0.2, 0.5)},
        {"prefix": (1.0,)},
        {"ties": "strict", "c": 3.0},
        {"beta": 1.0},
        {"beta": 300.0, "unit": 0.01},
        {"tie_tolerance": 0.02},
    ],
)
def test_the_kernel_is_the_definition_with_other_parameters(options):
    check_random(TabletopTask.named("tea"), 1, 8, **options)


def test_reaches_may_start_at_objects():
    check_random(sorting_task(), 2, 8)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 7))
def test_the_kernel_is_the_definition_on_many_random_tables(seed, repeats):
    check_random(COLUMNS, seed, repeats(60, 150))


def test_what_the_columns_task_can_reach():
    scorer = TabletopScorer("columns")
    assert scorer.best_possible == pytest.approx(20, abs=1e-12)
    assert scorer.genome_size == 2 * 8 + 4 * 4
    rng = np.random.default_rng(0)
    genomes = np.zeros((2000, 32))
    genomes[:, :16] = rng.uniform((0.10, 0.20), (0.80, 0.70), (2000, 8, 2)).reshape(2000, 16)
    found = scorer.score_genomes(genomes).legibility
    assert (found < 20).all()
    assert 6 < found.mean() < 7  # random tables


def test_two_goals_by_hand():
    task = reach_task("left", "right", at=[(0.4, 0.4), (0.8, 0.4)])
    home = task.layout.place("home")
    legible = 0.0
    for goal, other in (((0.4, 0.4), (0.8, 0.4)), ((0.8, 0.4), (0.4, 0.4))):
        for f in MIDPOINTS:
            q = (home[0] + f * (goal[0] - home[0]), home[1] + f * (goal[1] - home[1]))
            excess = math.dist(home, q) + math.dist(q, other) - math.dist(home, other)
            p = 1 / (1 + math.exp(-20 * excess))
            legible += (p - (1 - p)) / 10
    scores = TabletopScorer(task).score_layouts([task.layout])
    assert scores.legibility[0] == pytest.approx(legible, abs=1e-12)
    assert scores.distance[0] == pytest.approx(math.dist(home, (0.4, 0.4)), abs=1e-12)
    assert scores.mean_detour[0] == scores.max_detour[0] == 1


def test_one_goal_is_certain():
    task = reach_task("only")
    assert TabletopScorer(task).score_layouts([task.layout]).legibility[0] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("ties", "wrong"), [("expected", 0.5), ("strict", 1.0)])
def test_goals_in_one_line_tie_until_the_nearer_one(ties, wrong):
    task = reach_task("near", "far", at=[(0.6, 0.3), (0.6, 0.55)])
    near = sum(-wrong * f * 0.25 / 0.05 / 10 for f in MIDPOINTS)
    far = 0.0
    for f in MIDPOINTS:
        if f * 0.5 <= 0.25:
            far += -wrong * f * 0.5 / 0.05 / 10
        else:
            excess = 2 * (f * 0.5 - 0.25)
            far += (1 - math.exp(-20 * excess)) / (1 + math.exp(-20 * excess)) / 10
    found = TabletopScorer(task, observer=ObserverModel.in_metres(ties=ties)).score_layouts([task.layout]).legibility[0]
    assert found == pytest.approx(near + far, abs=1e-12)


def test_goals_behind_one_corner_tie_until_the_corner():
    task = reach_task("a", "b", at=[(0.5, 0.6), (0.55, 0.6)])
    layout = task.layout.with_obstacles([VirtualObstacle((0.55, 0.3), 0.0, (0.6, 0.01))])
    paths = [layout.paths.polyline(layout.place("home"), goal) for goal in ("a", "b")]
    assert np.array_equal(paths[0][1], paths[1][1])
    first_leg = math.dist(*paths[0][:2])
    length = layout.paths.lengths([layout.place("home")])[0, 0]
    early = [f for f in MIDPOINTS if f * length < first_leg]
    assert len(early) >= 2
    found = TabletopScorer(task, observer=ObserverModel.in_metres(prefix=early)).score_layouts([layout]).legibility[0]
    lengths = layout.paths.lengths([layout.place("home")])[0]
    assert found == pytest.approx(-0.5 * sum(f * sum(lengths) / 0.05 for f in early) / len(early), abs=1e-12)


def test_an_obstacle_can_make_a_reach_legible():
    task = reach_task("a", "b", at=[(0.55, 0.6), (0.65, 0.6)])
    between = task.layout.with_obstacles([VirtualObstacle((0.6, 0.35), math.pi / 2)])
    # A wall between two goals that are straight ahead: neither way is barred, one is told from the other no earlier.
    scorer = TabletopScorer(task)
    plain, walled = scorer.score_layouts([task.layout]), scorer.score_layouts([between])
    assert walled.legibility[0] == pytest.approx(legibility(between, task.graph), abs=1e-9)
    assert walled.legibility[0] != plain.legibility[0]


def test_obstacles_out_of_every_way_and_doubled_ones_change_nothing():
    rng = np.random.default_rng(5)
    scorer = TabletopScorer("columns", max_obstacles=8)
    for layout, scores in valid_layouts(COLUMNS, rng, scorer, 10, max_obstacles=3):
        doubled = layout.with_obstacles([*layout.obstacles, *layout.obstacles])
        np.testing.assert_allclose(np.array(scorer.score_layouts([doubled])), np.array(scores), rtol=0, atol=1e-12)
        far = layout.with_obstacles([*layout.obstacles, VirtualObstacle((-3.0, 3.0))])
        np.testing.assert_allclose(np.array(scorer.score_layouts([far])), np.array(scores), rtol=0, atol=1e-12)


def test_distance_is_that_of_all_legs_and_detours_those_of_reaches():
    rng = np.random.default_rng(6)
    for task in (COLUMNS, sorting_task()):
        scorer = TabletopScorer(task)
        reaches: dict[tuple[str, str], float] = {}
        for t in task.graph.transitions():
            reaches[t.start, t.goal] = reaches.get((t.start, t.goal), 0.0) + t.weight
        for layout, scores in valid_layouts(task, rng, scorer, 5):
            oracle = PathOracle(layout)

            def way(a, b, layout=layout, oracle=oracle):
                if b not in layout.goals:
                    a, b = b, a
                return oracle.lengths(layout.place(a))[layout.index(b)]

            expected = sum(weight * way(a, b) for (a, b), weight in task.graph.legs().items())
            assert scores.distance[0] == pytest.approx(expected, abs=1e-9)
            detours = {k: way(*k) / math.dist(layout.place(k[0]), layout.place(k[1])) for k in reaches}
            assert scores.max_detour[0] == pytest.approx(max(detours.values()), abs=1e-9)
            mean = sum(w * detours[k] for k, w in reaches.items()) / sum(reaches.values())
            assert scores.mean_detour[0] == pytest.approx(mean, abs=1e-9)


def test_genomes_score_like_their_layouts_in_any_batch():
    rng = np.random.default_rng(8)
    scorer = TabletopScorer("columns")
    layouts = [random_layout(COLUMNS, rng) for _ in range(60)]
    genomes = np.array([layout.to_genome() for layout in layouts])
    order = rng.permutation(60)
    together = np.array(scorer.score_genomes(genomes))
    one_by_one = np.hstack([np.array(scorer.score_layouts([layout])) for layout in layouts])
    np.testing.assert_allclose(together, one_by_one, rtol=0, atol=1e-12)
    assert np.array_equal(np.array(scorer.score_genomes(genomes[order])), together[:, order], equal_nan=True)
    assert 0 < np.isnan(together[0]).sum() < 60
    assert np.array_equal(np.isnan(together), np.isnan(together[[0, 0, 0, 0]]))


def test_inactive_obstacles_take_any_place_in_the_genome():
    layout = COLUMNS.layout.with_obstacles([VirtualObstacle((0.45, 0.2), 0.3), VirtualObstacle((0.9, 0.6), 1.0)])
    genome = layout.to_genome()
    shuffled = genome.copy()
    rows = shuffled[16:].reshape(4, 4)
    rows[:] = rows[[2, 1, 3, 0]]
    rows[rows[:, 0] == 0, 1:] = 0.45
    scorer = TabletopScorer("columns")
    scores = np.array(scorer.score_genomes([genome, shuffled]))
    np.testing.assert_allclose(scores[:, 0], scores[:, 1], rtol=0, atol=1e-12)


def test_covered_or_walled_in_objects_have_no_score():
    scorer = TabletopScorer("columns")
    layout = COLUMNS.layout
    covered = layout.with_obstacles([VirtualObstacle(layout.objects[0].at)])
    start = layout.with_obstacles([VirtualObstacle((1.0, 0.45))])
    wall = layout.with_obstacles([VirtualObstacle((0.85, 0.4), math.pi / 2, (0.8, 0.01))])
    for broken in (covered, start, wall):
        assert np.isnan(np.array(scorer.score_layouts([broken]))).all()
        assert not broken.is_valid()


@given(st.integers(0, 31), st.sampled_from([np.nan, np.inf, -np.inf]))
@settings(max_examples=20, deadline=None)
def test_genomes_that_are_not_finite_score_nan_and_leave_the_others_alone(entry, value):
    scorer = TabletopScorer("columns")
    genomes = np.array([COLUMNS.layout.to_genome()] * 3)
    genomes[1, entry] = value
    scores = np.array(scorer.score_genomes(genomes))
    assert np.isnan(scores[:, 1]).all()
    assert np.isfinite(scores[:, [0, 2]]).all()


@pytest.mark.parametrize("shape", [(32,), (2, 31), (2, 33), (1, 2, 32)])
def test_genomes_of_another_shape_are_refused(shape):
    with pytest.raises(LayoutError, match=r"expected genomes of shape \(n, 32\)"):
        TabletopScorer("columns").score_genomes(np.zeros(shape))


def test_no_genomes_have_no_scores():
    assert TabletopScorer("columns").score_genomes(np.zeros((0, 32))).legibility.shape == (0,)


def test_layouts_of_another_task_are_refused():
    with pytest.raises(LayoutError, match="task 'columns' is about"):
        TabletopScorer("columns").score_layouts([TabletopTask.named("tea").layout])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"beta": -1.0}, "beta"),
        ({"beta": math.nan}, "beta"),
        ({"c": math.inf}, "`c` must be a finite number >= 0, got inf"),
        ({"unit": 0.0}, "unit"),
        ({"prefix": "sum"}, "`prefix` must be 'mean'"),
        ({"prefix": (0.0, 0.5)}, "`prefix` must be 'mean'"),
        ({"prefix": ()}, "`prefix` must be 'mean'"),
        ({"ties": "first"}, "ties"),
    ],
)
def test_wrong_settings_of_the_observer_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        TabletopScorer("columns", observer=ObserverModel.in_metres(**options))
    with pytest.raises(ValueError, match=message):
        TabletopWorkspace(**options)


@pytest.mark.parametrize(
    ("options", "message"), [({"max_obstacles": -1}, "max_obstacles"), ({"obstacle_size": (0.3,)}, "obstacle_size")]
)
def test_wrong_parameters_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        TabletopScorer("columns", **options)


@pytest.mark.parametrize("options", [{}, {"prefix": (0.2, 0.9), "beta": 7.0, "c": 2.0, "ties": "strict", "unit": 0.1}])
def test_the_scorer_and_the_functions_say_the_same_of_a_layout(options):
    observer = ObserverModel.in_metres(**options)
    for task in (COLUMNS, sorting_task()):
        scorer = TabletopScorer(task, observer=observer)
        for layout, scores in valid_layouts(task, np.random.default_rng(12), scorer, 3):
            found = scorer.score_layout(layout)
            assert (found["score"], found["max_detour"]) == (scores.legibility[0], scores.max_detour[0])
            defined = score_layout(layout, task, observer=observer)
            assert list(found) == list(defined)
            for key, value in defined.items():
                assert found[key] == (pytest.approx(value, abs=1e-9) if isinstance(value, float) else value), key
            rows = scorer.explain_layout(layout)
            assert rows == explain_layout(layout, task, observer=observer)
            assert math.fsum(row["contribution"] for row in rows) == pytest.approx(defined["score"])
            single = math.fsum(row["contribution"] for row in rows if len(row["goals"]) == 1)
            assert single == pytest.approx(defined["single_goal_score"])


def test_one_layout_without_a_score_says_why():
    wall = COLUMNS.layout.with_obstacles([VirtualObstacle((0.85, 0.4), math.pi / 2, (0.8, 0.01))])
    for score in (TabletopScorer().score_layout, TabletopScorer().explain_layout, score_layout, explain_layout):
        with pytest.raises(LayoutError, match=r"no path from \S+ to \S+") as caught:
            score(wall)
        assert caught.value.rule == "reachable"
        with pytest.raises(LayoutError, match="task 'columns' is about"):
            score(TabletopTask.named("tea").layout)


def test_too_many_goals_at_once_are_refused():
    names = [f"cup{i}" for i in range(13)]
    task = reach_task(*names, at=[(0.12 + 0.05 * i, 0.5) for i in range(13)])
    with pytest.raises(TaskError, match="at most 12 goals"):
        TabletopScorer(task)


def test_exponentials_are_exact_enough():
    excess = np.concatenate([np.linspace(-1e-12, 3, 100_001), [50.0, 1e6]])
    found = np.empty_like(excess)
    exponentials(20.0, excess, found)
    np.testing.assert_allclose(found, np.exp(-20.0 * np.maximum(excess, 0)), rtol=0, atol=1e-14)


def test_kernels_run_as_plain_python():
    code = (
        "from legible_envs.tabletop.scoring.scorer import TabletopScorer;"
        "from legible_envs.tabletop import VirtualObstacle;"
        "s = TabletopScorer('tea');"
        "o = [VirtualObstacle((0.45, 0.2), 0.3), VirtualObstacle((0.85, 0.5), 1.5)];"
        "print(*[float(x[0]) for x in s.score_layouts([s.task.layout.with_obstacles(o)])])"
    )
    outcomes = [[float(word) for word in text.split()] for text in printed_both_ways(code)]
    assert outcomes[0] == pytest.approx(outcomes[1], abs=1e-12)
    assert outcomes[0][3] > 1
