"""How tables are drawn at random, and how their children differ from them."""

import itertools
import math
from collections import Counter

import numpy as np
import pytest

from legible_envs import LayoutError
from legible_envs.tabletop import TableObject, TabletopLayout, TabletopTask, TabletopWorkspace, VirtualObstacle
from legible_envs.tabletop.design.measures import least_distances
from legible_envs.tasks import Subtask, TaskGraph
from tests.legible_envs.tabletop.design_cases import designed, rng


def test_random_tables_are_uniform_given_that_they_are_valid():
    """Against rejection by the readable rules' spacing alone, which is all that counts without obstacles."""
    ws = TabletopWorkspace()
    genomes = ws.sample(2000, rng(1))
    assert (genomes[:, 16:] == 0).all()
    draws = rng(2).uniform((0.1, 0.2), (0.8, 0.7), (15_000, 8, 2))
    kept = draws[least_distances(draws, np.zeros(8, bool)) >= 0.08]
    assert len(kept) > 1500
    from scipy.stats import ks_2samp

    for column in (0, 7, 15):
        assert ks_2samp(genomes[:, column], kept.reshape(-1, 16)[:, column]).pvalue > 1e-3
    ours = least_distances(genomes[:, :16].reshape(-1, 8, 2), np.zeros(8, bool))
    assert ks_2samp(ours, least_distances(kept, np.zeros(8, bool))).pvalue > 1e-3


def test_random_obstacles_lie_on_the_sorted_arrangement():
    ws = TabletopWorkspace(condition="obstacles")
    genomes = ws.sample(400, rng())
    counts = ws.num_obstacles(genomes)
    assert set(counts) == {0, 1, 2, 3, 4}
    assert (genomes[:, :16] == ws.baseline.centres.ravel()).all()
    assert len(np.unique(genomes[counts > 0], axis=0)) == (counts > 0).sum()


def test_a_crowded_region_is_an_error():
    with pytest.raises(LayoutError, match="leave \\(almost\\) no room") as caught:
        TabletopWorkspace(object_spacing=0.34).sample(1, rng())
    assert caught.value.rule == "room"


def test_children_move_objects_first_and_obstacles_then():
    ws = TabletopWorkspace()
    parents = designed(ws, 60)
    for phase, mine, other in ((0, slice(0, 16), slice(16, 32)), (1, slice(16, 32), slice(0, 16))):
        children = ws.perturb(parents, 30, rng(3), phase=phase)
        assert ws.valid(children).all()
        before = np.repeat(parents, 30, axis=0)
        assert np.array_equal(children[:, other], before[:, other])
        assert (children[:, mine] != before[:, mine]).any(axis=1).mean() > 0.99


def test_moves_are_gaussian_steps_of_one_or_a_few_or_swaps():
    ws = TabletopWorkspace(object_spacing=0.0, step_sd=0.01)
    centre = ws.encode(ws.baseline)
    children = ws.perturb(centre[None], 4000, rng(4))[:, :16].reshape(-1, 8, 2)
    steps = children - ws.baseline.centres
    moved = (steps != 0).any(axis=2)
    swapped = (np.abs(steps).max(axis=(1, 2)) > 0.1) & (moved.sum(axis=1) == 2)
    assert swapped.mean() == pytest.approx(0.2, abs=0.03)
    assert set(map(tuple, np.sort(children[swapped], axis=1).round(9).reshape(-1, 16))) == {
        tuple(np.sort(ws.baseline.centres, axis=0).round(9).ravel())
    }
    counts = Counter(moved[~swapped].sum(axis=1).tolist())
    assert counts[1] > counts[2] > counts[3] > 0
    ones = steps[~swapped & (moved.sum(axis=1) == 1)]
    assert ones[ones != 0].std() == pytest.approx(0.01, rel=0.1)


def test_obstacles_are_added_removed_nudged_and_turned():
    ws = TabletopWorkspace()
    two = [VirtualObstacle((0.33, 0.45), math.pi / 2), VirtualObstacle((0.57, 0.45), math.pi / 2)]
    parent = ws.encode(ws.baseline.with_obstacles(two))
    children = ws.perturb(parent[None], 600, rng(5), phase=1)
    rows, before = children[:, 16:].reshape(-1, 4, 4), parent[16:].reshape(4, 4)
    count = rows[:, :, 0].sum(axis=1)
    changed = (rows != before).any(axis=2).sum(axis=1)
    turned = (rows[:, :, 1:3] == before[:, 1:3]).all(axis=(1, 2)) & (count == 2)
    kinds = {"added": count == 3, "removed": count == 1, "turned": turned, "nudged": (count == 2) & ~turned}
    for kind, mask in kinds.items():
        assert 0.15 < mask.mean() < 0.35, kind
    assert (changed[kinds["nudged"] | kinds["turned"]] == 1).all()
    assert (rows[kinds["removed"]][:, 1:] == 0).all()
    for new in rows[kinds["added"]][:, 2]:
        across = np.array([math.cos(new[3]), math.sin(new[3])])
        assert any(
            abs((b - a) @ across) < 1e-9
            and abs((new[1:3] - a) @ [-across[1], across[0]]) < math.dist(a, b)
            and abs((new[1:3] - a) @ [b[1] - a[1], a[0] - b[0]]) < 1e-9
            for a, b in itertools.combinations(ws.baseline.centres, 2)
        )


def test_parents_without_a_child_repeat_themselves():
    layout = TabletopLayout([TableObject("only", (0.3, 0.4))])
    ws = TabletopWorkspace(TabletopTask("one", layout, TaskGraph([Subtask("take", ("only",))], start="home")))
    parent = ws.encode(layout)
    assert (ws.perturb(parent[None], 3, rng(), phase=1) == parent).all()
    assert (ws.perturb(parent[None], 3, rng(), phase=0) != parent).any(axis=1).all()


def test_wrong_parents_and_phases_are_refused():
    ws = TabletopWorkspace(condition="placement")
    with pytest.raises(LayoutError):
        ws.perturb(np.zeros((1, 32)), 2, rng())
    with pytest.raises(ValueError, match="phase"):
        ws.perturb(ws.sample(1, rng()), 2, rng(), phase=1)
