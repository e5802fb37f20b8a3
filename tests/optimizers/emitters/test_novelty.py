"""Novelty search with local competition: its parts against their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from optimizers import NoveltyLocalCompetitionEmitter
from optimizers.emitters.novelty import crowding_distances, first_nearest, novelty_and_competition, pareto_ranks
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
POINTS = arrays(np.float64, st.tuples(st.integers(1, 25), st.just(2)), elements=st.integers(0, 6).map(float))


def literal_ranks(objectives):
    """Peel off those that none of the others left dominates."""
    left, ranks, rank = list(range(len(objectives))), np.zeros(len(objectives), dtype=int), 0
    while left:
        front = [
            i
            for i in left
            if not any((objectives[j] >= objectives[i]).all() and (objectives[j] > objectives[i]).any() for j in left)
        ]
        ranks[front] = rank
        left = [i for i in left if i not in front]
        rank += 1
    return ranks


@given(POINTS)
def test_ranks_are_those_of_peeling_fronts(objectives):
    np.testing.assert_array_equal(pareto_ranks(objectives), literal_ranks(objectives))


def test_crowding_is_that_of_nsga_ii():
    objectives = np.array([[0.0, 10.0], [1.0, 6.0], [4.0, 5.0], [10.0, 0.0], [0.0, 0.0]])
    distances = crowding_distances(objectives, np.array([0, 0, 0, 0, 1]))
    assert np.isinf(distances[[0, 3, 4]]).all()
    assert distances[1] == pytest.approx(4 / 10 + 5 / 10)
    assert distances[2] == pytest.approx(9 / 10 + 6 / 10)


def test_novelty_counts_the_past_and_competition_does_not():
    rng = np.random.default_rng(0)
    measures, scores, past = rng.random((30, 2)), rng.random(30), rng.random((12, 2))
    for k, remembered in ((1, past), (5, past), (100, past), (4, past[:0])):
        found = novelty_and_competition(measures, scores, remembered, k)
        for i in range(30):
            others = np.delete(np.arange(30), i)
            gaps = np.linalg.norm(measures[others] - measures[i], axis=1)
            gaps_past = np.linalg.norm(remembered - measures[i], axis=1)
            assert found[i, 0] == pytest.approx(np.sort([*gaps, *gaps_past])[:k].mean())
            nearest = others[np.argsort(gaps)[:k]]
            assert found[i, 1] == (scores[nearest] < scores[i]).sum()
    np.testing.assert_array_equal(novelty_and_competition(measures[:1], scores[:1], past, 3), [[0.0, 0.0]])


def test_the_next_generation_is_novel_or_locally_better(started, told):
    archive, evaluate = started(SHELF, 200)
    scale = np.ptp(SHELF.archive_ranges, axis=1)
    emitter = NoveltyLocalCompetitionEmitter(archive, SHELF, population=12, seed=1, neighbours=3)
    for _ in range(6):
        children = emitter.ask()
        before = emitter.state
        scores = told(emitter, evaluate, children, unscored=[2])
        assert children.shape == (12, SHELF.genome_size)
        genomes, scores = np.concatenate([before.genomes, children]), np.concatenate([before.scores, scores])
        measures = np.concatenate([before.measures, SHELF.measures(children)])
        living = ~np.isnan(scores)
        objectives = novelty_and_competition(measures[living] / scale, scores[living], before.past / scale, 3)
        ranks = literal_ranks(objectives)
        worst_kept = np.sort(ranks)[11]
        after = emitter.state
        assert after.ranks.max() == worst_kept
        sure = genomes[living][ranks < worst_kept]
        assert all((after.genomes == genome).all(axis=1).any() for genome in sure)
        assert len(after.past) <= 500


@pytest.mark.slow
@given(POINTS, st.integers(1, 25))
def test_of_equally_near_ones_the_first_are_neighbours(points, k):
    distances = np.abs(points[:, :1] - points[:, 1])
    k = min(k, len(points))
    expected = np.zeros(distances.shape, dtype=bool)
    np.put_along_axis(expected, np.argsort(distances, axis=1, kind="stable")[:, :k], True, axis=1)
    np.testing.assert_array_equal(first_nearest(distances, k), expected)
