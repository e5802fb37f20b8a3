"""Warping against an independent library, against every path there is, and against its own definitions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from predictors.reaching.alignment_kernels import closed_cost, closed_path, dba_step, match_means, pairwise_costs
from predictors.reaching.open_end_kernels import advance, log_densities, observe

Array = np.ndarray[Any, np.dtype[np.float64]]
sizes = st.integers(1, 5)


def paths(i: int, j: int, n: int, m: int) -> Iterator[list[tuple[int, int]]]:
    """Every warping path from (i, j) to (n-1, m-1)."""
    if (i, j) == (n - 1, m - 1):
        yield [(i, j)]
    for a, b in ((1, 1), (1, 0), (0, 1)):
        if i + a < n and j + b < m:
            for rest in paths(i + a, j + b, n, m):
                yield [(i, j), *rest]


def cost_of(path: list[tuple[int, int]], x: Array, y: Array) -> float:
    return float(sum(((x[i] - y[j]) ** 2).sum() for i, j in path))


def inside(path: list[tuple[int, int]], n: int, m: int, radius: int) -> bool:
    """The band as the module documents it."""
    if radius < 0:
        return True
    if n > m:
        path, n, m = [(j, i) for i, j in path], m, n
    return all(i - radius <= j <= i + radius + m - n for i, j in path)


@given(sizes, sizes, st.integers(1, 3), st.integers(-1, 3), st.integers(0, 2**32 - 1))
@settings(max_examples=120, deadline=None)
def test_closed_warping_is_the_cheapest_of_all_paths(n: int, m: int, d: int, radius: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=(n, d)), rng.normal(size=(m, d))
    costs = [cost_of(path, x, y) for path in paths(0, 0, n, m) if inside(path, n, m, radius)]
    assert closed_cost(x, y, radius) == pytest.approx(min(costs))
    found = [tuple(pair) for pair in closed_path(x, y, radius).tolist()]
    assert inside(found, n, m, radius)
    assert found in list(paths(0, 0, n, m))
    assert cost_of(found, x, y) == pytest.approx(min(costs))


@pytest.mark.slow  # the library takes its time to load
def test_closed_warping_agrees_with_tslearn() -> None:
    metrics = pytest.importorskip("tslearn.metrics", reason="an independent implementation to compare with")
    rng = np.random.default_rng(1)
    for _ in range(60):
        n, m, d = rng.integers(1, 40, 3)
        radius = int(rng.integers(-1, 12))
        x, y = rng.normal(size=(n, d)), rng.normal(size=(m, d))
        band = {} if radius < 0 else {"global_constraint": "sakoe_chiba", "sakoe_chiba_radius": radius}
        assert closed_cost(x, y, radius) == pytest.approx(metrics.dtw(x, y, **band) ** 2)


def test_closed_warping_agrees_with_dtaidistance() -> None:
    library = pytest.importorskip("dtaidistance.dtw_ndim", reason="an independent implementation to compare with")
    rng = np.random.default_rng(2)
    for _ in range(30):
        n, m = rng.integers(2, 30, 2)
        x, y = rng.normal(size=(n, 2)).cumsum(axis=0), rng.normal(size=(m, 2)).cumsum(axis=0)
        assert closed_cost(x, y, -1) == pytest.approx(library.distance(x, y) ** 2)


def test_a_wider_band_never_costs_more_and_no_band_costs_least() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(30, 2)).cumsum(axis=0), rng.normal(size=(34, 2)).cumsum(axis=0)
    costs = [closed_cost(x, y, radius) for radius in range(35)]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] > costs[-1] == pytest.approx(closed_cost(x, y, -1))
    assert closed_cost(x, x, 0) == 0
    between = closed_cost(x, y[:30], 3)
    assert pairwise_costs(np.stack([x, y[:30]]), 3) == pytest.approx(np.array([[0, between], [between, 0]]))


@pytest.mark.slow
def test_averages_under_warping() -> None:
    rng = np.random.default_rng(4)
    way = np.linspace(0, 1, 40)
    powers = rng.uniform(0.5, 2.0, 8)
    series = np.stack([np.column_stack([way**p, (way**p) ** 2]) for p in powers])  # one path, walked unevenly
    reference = series.mean(axis=0)
    aligned = match_means(series, series, reference, -1)
    assert aligned.shape == series.shape
    assert aligned.var(axis=0).sum() < 0.2 * series.var(axis=0).sum()
    assert np.allclose(match_means(series[:1], series[:1], series[0], 5), series[:1])

    def inertia(average: Array) -> float:
        return float(sum(closed_cost(one, average, -1) for one in series))

    costs = [inertia(reference)]
    for _ in range(5):
        reference = dba_step(series, reference, -1)
        costs.append(inertia(reference))
    assert all(after <= before + 1e-12 for before, after in pairwise(costs))
    assert costs[-1] < 0.9 * costs[0]


def test_one_step_of_barycentre_averaging_by_hand() -> None:
    series = np.array([[[0.0], [1.2], [1.2]], [[0.0], [0.0], [3.0]]])
    # The first matches 0|1.2,1.2 to 0|2; the second 0,0|3.
    assert dba_step(series, np.array([[0.0], [2.0]]), -1).ravel() == pytest.approx([0.0, 1.8])


def open_end_brute_force(
    points: Array, density: Array, reference: Array, windows: list[tuple[int, int]], decays: Array
) -> tuple[float, int, float]:
    """Cheapest cost, where it ends, and the weighted mean of densities along it, from every path there is."""
    best = (np.inf, 0, 0.0)
    count = len(points)
    for end in range(len(reference)):
        for path in paths(0, 0, count, end + 1):
            if not all(windows[i][0] <= k < windows[i][1] for i, k in path):
                continue
            cost = cost_of(path, points, reference)
            if cost < best[0]:
                weights = np.array([np.prod(decays[i + 1 : count]) if i else 0.0 for i, _ in path])
                values = np.array([density[i, k] for i, k in path])
                mean = float((weights * values).sum() / weights.sum()) if weights.any() else 0.0
                best = (cost, end, mean)
    return best


@given(sizes, st.integers(2, 5), st.booleans(), st.sampled_from([0.0, 0.5, 1.0]), st.integers(0, 2**32 - 1))
@settings(max_examples=120, deadline=None)
def test_open_end_alignment_is_the_cheapest_of_all_paths(
    count: int, steps: int, banded: bool, decay: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    points, reference = rng.normal(size=(count, 2)), rng.normal(size=(steps, 2))
    density = rng.normal(size=(count, steps))
    windows = [(0, steps)] * count
    if banded:
        clock = [min(i, steps - 1) for i in range(count)]
        windows = [(max(0, c - 1), min(steps, c + 2)) for c in clock]
    cost, total, weight = np.zeros((3, steps))
    for i, (low, high) in enumerate(windows):
        end = advance(points[i], density[i], reference, low, high, decay, cost, total, weight, i == 0)
        expected = open_end_brute_force(points[: i + 1], density, reference, windows, np.full(i + 1, decay))
        assert cost[end] == pytest.approx(expected[0])
        assert end == expected[1]
        assert (total[end] / weight[end] if weight[end] else 0.0) == pytest.approx(expected[2], abs=1e-9)


def test_densities_are_those_of_scipy() -> None:
    from scipy.stats import multivariate_normal

    rng = np.random.default_rng(5)
    means, root = rng.normal(size=(6, 4)), rng.normal(size=(6, 4, 7))
    covariances = root @ root.transpose(0, 2, 1)
    norms = -0.5 * (np.linalg.slogdet(covariances)[1] + 4 * np.log(2 * np.pi))
    sample, out = rng.normal(size=4), np.zeros(6)
    log_densities(sample, means, np.linalg.inv(covariances), norms, out)
    expected = [multivariate_normal(mean, cov).logpdf(sample) for mean, cov in zip(means, covariances, strict=True)]
    assert out == pytest.approx(expected)


def test_windows_of_one_step_follow_the_clock() -> None:
    rng = np.random.default_rng(6)
    points, means = rng.normal(size=(4, 2)), rng.normal(size=(1, 5, 2))
    precisions, norms = np.tile(np.eye(2), (1, 5, 1, 1)), np.zeros((1, 5))
    lows = np.array([[0], [2], [3], [4]])
    scores = observe(points, points, lows, lows + 1, np.ones(4), means, precisions, norms, np.zeros((3, 1, 5)), False)
    single = -0.5 * ((points - means[0, lows[:, 0]]) ** 2).sum(axis=1)
    assert scores[:, 0] == pytest.approx([0.0, single[1], single[1:3].mean(), single[1:4].mean()])
