"""The rules of tables: the compiled check against its readable form."""

import math
from collections import Counter

import numpy as np
import pytest

from legible_envs import LayoutError
from legible_envs.tabletop import TabletopWorkspace, VirtualObstacle
from tests.legible_envs.tabletop.design_cases import CONDITIONS, designed, rng, rule_of

TASKS = ("columns", "tea", "bins")


def broken(ws, n, seed):
    """Genomes near valid ones, about half of them invalid, some far off."""
    generator = rng(seed)
    genomes = designed(ws, n, seed, rounds=8)
    first = 2 * len(ws.rules.movable)
    genomes[: n // 3] += generator.normal(0, 0.01, (n // 3, ws.genome_size))
    rows = genomes[n // 3 : 2 * n // 3]
    at = first + 4 * generator.integers(0, ws.rules.max_obstacles, len(rows))
    rows[np.arange(len(rows)), at] = 1.0
    rows[np.arange(len(rows)), at + 1] = generator.uniform(0, 1.2, len(rows))
    rows[np.arange(len(rows)), at + 2] = generator.uniform(0, 0.8, len(rows))
    rows[np.arange(len(rows)), at + 3] = generator.uniform(-1.6, 1.6, len(rows))
    return np.where(generator.random((n, 1)) < 0.7, np.clip(genomes, ws.lower_bounds, ws.upper_bounds), genomes)


MET = {
    "range",
    "object-spacing",
    "obstacle",
    "obstacle-off-table",
    "detour",
    "start-clearance",
    "slot",
    "obstacle-apart",
}


def compare_rules(ws, genomes):
    """Which rules the readable check names; it must agree with the kernel on every genome."""
    found = Counter()
    for genome, is_valid in zip(genomes, ws.valid(genomes), strict=True):
        try:
            ws.decode(genome)
            rule = None
        except LayoutError as error:
            rule = error.rule
        assert (rule is None) == is_valid, (rule, genome.tolist())
        found[rule] += 1
    return found


@pytest.mark.slow
def test_the_kernel_is_the_readable_rules():
    ws = TabletopWorkspace("columns")
    found = compare_rules(ws, broken(ws, 1000, 0))
    assert found[None] > 100
    assert set(found) >= MET, found


@pytest.mark.parametrize(
    ("task", "options"),
    [
        ("tea", {"object_spacing": 0.0, "object_clearance": 0.0, "start_clearance": 0.0, "max_detour": None}),
        ("bins", {"obstacles_apart": False, "obstacles_on_table": False}),
        ("columns", {"condition": "obstacles", "max_detour": 1.05}),
        ("columns", {"condition": "placement"}),
    ],
)
def test_the_kernel_is_the_readable_rules_in_other_workspaces(task, options):
    ws = TabletopWorkspace(task, **options)
    found = compare_rules(ws, broken(ws, 300, 1))
    assert found[None] > 20
    assert len(found) > 1
    if task == "tea":
        assert {"overlap", "obstacle", "covered"} <= set(found)


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_kernel_is_the_readable_rules_on_many_tables(task, condition):
    ws = TabletopWorkspace(task, condition)
    compare_rules(ws, broken(ws, 1500, 7))


def test_walls_that_close_a_place_are_not_allowed():
    """Without the other rules, only whether a hand gets everywhere counts."""
    free = {"max_detour": None, "start_clearance": 0.0, "object_clearance": 0.0, "obstacles_apart": False}
    ws = TabletopWorkspace("columns", obstacle_size=(0.8, 0.01), **free)
    wall = ws.baseline.with_obstacles([VirtualObstacle((0.85, 0.4), math.pi / 2, (0.8, 0.01))])
    assert rule_of(lambda: ws.encode(wall)) == "reachable"
    genome = wall.to_genome(4, (0.8, 0.01))
    assert not ws.valid(genome[None])[0]
    gap = ws.baseline.with_obstacles([VirtualObstacle((0.85, 0.46), math.pi / 2, (0.8, 0.01))])
    assert rule_of(lambda: ws.encode(gap)) == "obstacle-off-table"
    beyond = TabletopWorkspace("columns", obstacle_size=(0.8, 0.01), obstacles_on_table=False, **free)
    assert beyond.valid(beyond.encode(gap)[None])[0]


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"max_detour": 1.02}, "detour"),
        ({"start_clearance": 0.6}, "start-clearance"),
        ({"object_clearance": 0.12}, "object-clearance"),
        ({"object_spacing": 0.19}, "object-spacing"),
    ],
)
def test_every_number_is_a_rule(change, rule):
    layout = TabletopWorkspace().baseline.with_obstacles([VirtualObstacle((0.45, 0.45), math.pi / 2)])
    assert TabletopWorkspace().encode(layout)[16] == 1
    ws = TabletopWorkspace(**change)
    assert rule_of(lambda: ws.encode(layout)) == rule
    assert not ws.valid(layout.to_genome()[None])[0]


def test_obstacles_keep_off_the_slots_of_the_desired_configuration():
    ws = TabletopWorkspace()
    over = ws.baseline.with_obstacles([VirtualObstacle((0.95, 0.3), 0.0)])
    assert rule_of(lambda: ws.encode(over)) == "slot"
    assert not ws.valid(over.to_genome()[None])[0]


def test_obstacles_may_neither_cross_nor_touch():
    ws = TabletopWorkspace()
    for x, allowed in ((0.30, False), (0.30 + 0.99e-9, False), (0.301, True)):
        pair = ws.baseline.with_obstacles([VirtualObstacle((0.18, 0.7)), VirtualObstacle((0.18 + x, 0.7))])
        assert ws.valid(pair.to_genome()[None])[0] == allowed
        if not allowed:
            assert rule_of(lambda pair=pair: ws.encode(pair)) == "obstacle-apart"
