"""The likelihood of maximum-entropy IRL against brute force, finite differences, value iteration and sampling."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors import BayesianGoalPredictor, MaxEntIRL
from predictors.checks import example_trajectories
from predictors.grid.graphs import soft_costs, station_costs, walk_graph
from predictors.grid.walk_kernels import factorise, solve, solve_transposed
from predictors.grid.walk_likelihood import MOST_RATIONAL, best_uniform_cost, collect_evidence
from tests.predictors.maxent_cases import GOALS, ROOM, neighbours_of, random_costs, sample_walks

OPEN = OvercookedLayout.from_ascii("XXOXTXX\nX     X\nX     X\nX     D\nX     X\nXXXSPXX")


@st.composite
def kitchens(draw: st.DrawFn) -> tuple[OvercookedLayout, tuple[str, ...]]:
    rows, cols = draw(st.integers(3, 6)), draw(st.integers(3, 6))
    symbols = draw(st.lists(st.sampled_from("     XVOTD"), min_size=rows * cols, max_size=rows * cols))
    assume(" " in symbols)
    layout = OvercookedLayout.from_rows([symbols[r * cols : (r + 1) * cols] for r in range(rows)])
    goals = tuple(name for name in layout.stations if layout.access(name))
    assume(goals)
    return layout, goals


def dense(layout: OvercookedLayout, goals: tuple[str, ...], costs: Any) -> tuple[Any, Any]:
    """``W`` and ``B``, as written in the definition."""
    graph = walk_graph(layout, goals)
    cells = [tuple(cell) for cell in graph.cells.tolist()]
    steps, ends = np.zeros((len(cells), len(cells))), np.zeros((len(cells), len(goals)))
    for u, cell in enumerate(cells):
        for beside in neighbours_of(layout, cell):
            steps[u, cells.index(beside)] = np.exp(-costs[beside])
        for column, goal in enumerate(goals):
            ends[u, column] = cell in layout.access(goal)
    return steps, ends


# -- the sum over walks ------------------------------------------------------------------------------------------------


def test_z_is_the_sum_over_all_walks_enumerated() -> None:
    costs = random_costs(ROOM, 0, 2.2, 3.0)
    table = soft_costs(ROOM, GOALS, costs)
    beside = {c: neighbours_of(ROOM, c) for c in map(tuple, np.argwhere(ROOM.cells == 0).tolist())}
    ends = {cell: [goal for goal in GOALS if cell in ROOM.access(goal)] for cell in beside}
    for start in ((1, 1), (3, 3)):
        totals = dict.fromkeys(GOALS, 0.0)
        walks: dict[tuple[int, int], float] = {start: 1.0}  # by last cell: every walk of each length, summed
        for _ in range(60):
            for cell, weight in walks.items():
                for goal in ends[cell]:
                    totals[goal] += weight
            longer = dict.fromkeys(beside, 0.0)
            for cell, weight in walks.items():
                for after in beside[cell]:
                    longer[after] += weight * np.exp(-costs[after])
            walks = longer
        for column, goal in enumerate(GOALS):
            assert np.exp(-table[(*start, column)]) == pytest.approx(totals[goal], rel=1e-6)


def test_probabilities_of_walks_one_by_one_sum_to_one() -> None:
    costs = random_costs(ROOM, 1, 2.8, 3.2)
    irl = MaxEntIRL(l2=1e3).fit(sample_walks(ROOM, costs, 40, np.random.default_rng(1)))
    start, goal, longest = (3, 1), "onion", 13
    found, queue = [], [[start]]
    while queue:
        cells = queue.pop()
        if cells[-1] in ROOM.access(goal):
            states = np.array([*cells, ROOM.stations[goal]])
            found.append(Trajectory(states, goal=goal, candidates=GOALS, layout=ROOM))
        if len(cells) < longest:
            queue.extend([*cells, beside] for beside in neighbours_of(ROOM, cells[-1]))
    probabilities = np.exp(irl.log_likelihoods(found))
    assert len(found) > 500
    assert 0.999 < probabilities.sum() <= 1.0 + 1e-9
    # Of walks with the same ends, the log-odds are the difference of what their cells cost.
    totals = [irl.cost_[w.states[1:-1, 0], w.states[1:-1, 1]].sum() for w in found]
    assert np.allclose(np.log(probabilities) + totals, np.log(probabilities[0]) + totals[0])


@settings(max_examples=40, deadline=None)
@given(kitchens(), st.integers(0, 1000))
def test_costs_are_those_of_log_sum_exp_value_iteration(
    found: tuple[OvercookedLayout, tuple[str, ...]], seed: int
) -> None:
    layout, goals = found
    costs = random_costs(layout, seed)
    soft, hard = soft_costs(layout, goals, costs), station_costs(layout, goals, costs)
    steps, ends = dense(layout, goals, costs)
    with np.errstate(divide="ignore"):
        steps, ends = np.log(steps), np.log(ends)
    values = np.full(ends.shape, -np.inf)
    for _ in range(300):
        onward = np.logaddexp.reduce(steps[:, :, None] + values[None], axis=1)
        values = np.logaddexp(ends, onward)
    cells = walk_graph(layout, goals).cells
    assert np.allclose(-values, soft[cells[:, 0], cells[:, 1]], atol=1e-6)
    assert (soft <= hard + 1e-12).all()
    for column, goal in enumerate(goals):
        assert soft[(*layout.stations[goal], column)] == 0


@settings(max_examples=60, deadline=None)
@given(kitchens(), st.integers(0, 1000), st.floats(0.3, 3.0))
def test_the_factorisation_knows_its_domain(
    found: tuple[OvercookedLayout, tuple[str, ...]], seed: int, level: float
) -> None:
    layout, goals = found
    graph = walk_graph(layout, goals)
    costs = random_costs(layout, seed, level - 0.2, level + 0.2)
    dense_steps, ends = dense(layout, goals, costs)
    radius = np.abs(np.linalg.eigvals(dense_steps)).max()
    assume(abs(radius - 1) > 1e-6)
    steps = np.where(graph.neighbours >= 0, np.exp(-costs[tuple(graph.cells.T)])[graph.neighbours], 0.0)
    factors, finite = factorise(graph.neighbours, steps, graph.band)
    assert finite == (radius < 1)
    unit = walk_graph(layout, goals).divergence_cost
    assert np.exp(unit) == pytest.approx(np.abs(np.linalg.eigvals(dense_steps > 0)).max(), abs=1e-9)
    if finite:
        matrix = np.eye(len(dense_steps)) - dense_steps
        assert np.allclose(solve(factors, ends), np.linalg.solve(matrix, ends), rtol=1e-6)
        assert np.allclose(solve_transposed(factors, ends), np.linalg.solve(matrix.T, ends), rtol=1e-6)
    else:
        with pytest.raises(ValueError, match="diverges"):
            soft_costs(layout, goals, costs)


def test_nothing_underflows_however_far() -> None:
    corridor = OvercookedLayout.from_rows(["X" * 60, "O" + " " * 58 + "D", "X" * 60])
    table = soft_costs(corridor, ("onion", "dish"), np.full(corridor.shape, 20.0))
    assert table[1, 58, 0] == pytest.approx(20.0 * 57, rel=1e-9)  # exp(-1140) is 0 in double precision
    far = Trajectory([(1, 30), (1, 29)], candidates=("onion", "dish"), layout=corridor, complete=False)
    soft = BayesianGoalPredictor(beta=20.0, costs="soft").fit([far])
    assert soft.predict_proba([far])[0] == pytest.approx([0.0, 1.0], abs=1e-12)


def test_costs_below_zero_are_fine_while_no_round_trip_pays() -> None:
    costs = np.full(ROOM.shape, 3.0)
    costs[1, 1] = costs[3, 3] = -1.0
    hard, soft = station_costs(ROOM, GOALS, costs), soft_costs(ROOM, GOALS, costs)
    assert hard[2, 1, 0] == -1.0  # one step up, beside the onions
    assert np.isfinite(soft[1, 1]).all()


# -- the likelihood ----------------------------------------------------------------------------------------------------


def test_the_gradient_is_that_of_finite_differences() -> None:
    rng = np.random.default_rng(2)
    walks = sample_walks(OPEN, random_costs(OPEN, 2, 1.6, 2.4), 30, rng)
    (evidence,) = collect_evidence(walks).values()
    costs = rng.uniform(1.6, 2.4, len(evidence.visits))
    value, gradient = evidence.loss(costs)
    assert np.isfinite(value)
    for v in range(len(costs)):
        step = np.zeros(len(costs))
        step[v] = 1e-6
        slope = (evidence.loss(costs + step)[0] - evidence.loss(costs - step)[0]) / 2e-6
        assert gradient[v] == pytest.approx(slope, abs=1e-4)


def test_the_likelihood_is_that_of_each_walk_alone() -> None:
    walks = sample_walks(OPEN, random_costs(OPEN, 3), 25, np.random.default_rng(3))
    irl = MaxEntIRL().fit(walks)
    (evidence,) = collect_evidence(walks).values()
    value, _ = evidence.loss(irl.cost_[tuple(evidence.graph.cells.T)])
    assert irl.log_likelihoods(walks).sum() == pytest.approx(-value)
    assert irl.log_likelihood_ == pytest.approx(-value / len(walks))


def test_expected_visits_are_those_of_sampled_walks() -> None:
    costs, rng = random_costs(ROOM, 4, 1.2, 2.0), np.random.default_rng(4)
    walks = sample_walks(ROOM, costs, 6000, rng)
    (evidence,) = collect_evidence(walks).values()
    _, gradient = evidence.loss(costs[tuple(evidence.graph.cells.T)])
    expected = evidence.visits - gradient  # the gradient is visits counted minus visits expected
    assert np.abs(expected - evidence.visits).max() < 5 * np.sqrt(expected.max() * 3)
    assert expected == pytest.approx(evidence.visits, rel=0.08)


def test_the_loss_is_convex() -> None:
    rng = np.random.default_rng(5)
    (evidence,) = collect_evidence(sample_walks(OPEN, random_costs(OPEN, 5), 20, rng)).values()
    for _ in range(50):
        a, b = rng.uniform(1.4, 4.0, (2, len(evidence.visits)))
        middle = evidence.loss((a + b) / 2)[0]
        assert middle <= (evidence.loss(a)[0] + evidence.loss(b)[0]) / 2 + 1e-9


def test_outside_its_domain_the_loss_is_infinite_and_the_fit_comes_back() -> None:
    walks = sample_walks(OPEN, np.full(OPEN.shape, 1.3), 60, np.random.default_rng(6))
    (evidence,) = collect_evidence(walks).values()
    border = evidence.graph.divergence_cost
    assert evidence.loss(np.full(len(evidence.visits), border - 1e-3))[0] == np.inf
    assert np.isfinite(evidence.loss(np.full(len(evidence.visits), border + 1e-3))[0])
    # So little penalty that the search runs into the border on its way.
    irl = MaxEntIRL(l2=1e-3, max_iter=3000).fit(walks)
    steps, _ = dense(OPEN, GOALS, irl.cost_)
    assert np.abs(np.linalg.eigvals(steps)).max() < 1
    assert irl.log_likelihood_ > MaxEntIRL(l2=1e6).fit(walks).log_likelihood_
    assert irl.converged_


def test_a_checkerboard_is_the_same_person() -> None:
    costs = random_costs(OPEN, 7)
    rows, cols = np.indices(OPEN.shape)
    shifted = costs + np.where((rows + cols) % 2, 0.3, -0.3)
    floor = OPEN.cells == 0
    shift = soft_costs(OPEN, GOALS, shifted)[floor] - soft_costs(OPEN, GOALS, costs)[floor]
    # Walks from one cell to one station's access all have the same parity, so its costs shift as one.
    for column, goal in enumerate(GOALS):
        (access,) = OPEN.access(goal)
        colour = (rows + cols) % 2
        expected = np.where(colour == (sum(access) % 2), 0.0, np.where(colour == 0, 0.3, -0.3))
        assert np.allclose(shift[:, column], expected[floor])
    walk = sample_walks(OPEN, costs, 1, np.random.default_rng(7))[0]
    both = [BayesianGoalPredictor(costs="soft", cell_costs=c).fit([walk]) for c in (costs, shifted)]
    parts = [walk.first(t) for t in range(1, walk.num_states)]
    a, b = (np.log(p.predict_proba(parts)) for p in both)
    assert np.allclose(a[::2], b[::2])  # after an even number of steps nothing tells them apart


def test_enough_walks_recover_the_costs() -> None:
    rng = np.random.default_rng(8)
    costs = np.where(ROOM.cells == 0, rng.uniform(1.2, 2.4, ROOM.shape), np.nan)
    walks = sample_walks(ROOM, costs, 4000, rng)
    irl = MaxEntIRL(l2=0.1).fit(walks)
    rows, cols = np.indices(ROOM.shape)
    floor = ROOM.cells == 0
    error = (irl.cost_ - costs)[floor]
    colour = np.where((rows + cols) % 2, 1.0, -1.0)[floor]
    error -= colour * (error @ colour) / len(colour)  # what cannot be known
    assert np.abs(error).max() < 0.25
    assert np.abs(error).mean() < 0.1


def test_learned_costs_explain_unseen_walks_better() -> None:
    rng = np.random.default_rng(9)
    costs = rng.uniform(0.9, 3.5, ROOM.shape)
    walks = sample_walks(ROOM, costs, 500, rng)
    unseen = sample_walks(ROOM, costs, 500, rng)
    learned, uniform = MaxEntIRL().fit(walks), MaxEntIRL(l2=1e8).fit(walks)
    assert learned.log_likelihoods(unseen).mean() > uniform.log_likelihoods(unseen).mean() + 0.02
    assert uniform.cost_[ROOM.cells == 0] == pytest.approx(uniform.uniform_cost_, abs=1e-4)


def test_the_best_uniform_cost_is_best() -> None:
    walks = sample_walks(OPEN, np.full(OPEN.shape, 1.7), 1500, np.random.default_rng(10))
    evidence = collect_evidence(walks)
    best = best_uniform_cost(evidence)
    (part,) = evidence.values()

    def loss(cost: float) -> float:
        return part.loss(np.full(len(part.visits), cost))[0]

    assert loss(best) < min(loss(best - 1e-3), loss(best + 1e-3))
    assert best == pytest.approx(1.7, abs=0.08)
    assert BayesianGoalPredictor("fit", costs="soft").fit(walks).beta_ == best
    straight = [w for w in example_trajectories() if len(w.states) <= 5][:1]
    assert best_uniform_cost(collect_evidence(straight)) == MOST_RATIONAL
