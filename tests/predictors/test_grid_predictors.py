"""Eq. 1 with soft and learned costs, priors, and the baselines that learn from prefixes."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone

from legible_envs.errors import LayoutError
from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors import (
    BayesianGoalPredictor,
    GoalPredictor,
    GridLogistic,
    GridNeighbours,
    GridNGram,
    MaxEntIRL,
    RecurrentPredictor,
    ShortestDistance,
)
from predictors.grid.graphs import walk_graph
from predictors.grid.nearest_kernels import votes_of_nearest
from predictors.grid.priors import GoalPrior
from tests.predictors.cases import KITCHEN_CASES, ROOM, THREE, Case, fitted, people, prefixes, walk

LEARNERS: list[GoalPredictor] = [
    MaxEntIRL(),
    MaxEntIRL(prior="empirical"),
    BayesianGoalPredictor(cell_costs="learned"),
    BayesianGoalPredictor("fit", costs="soft", prior="empirical"),
    GridLogistic(),
    GridNeighbours(k=3),
    GridNGram(),
]
BAYESIAN: list[GoalPredictor] = [
    BayesianGoalPredictor(beta=2.0),
    BayesianGoalPredictor(costs="soft"),
    BayesianGoalPredictor("fit", costs="soft"),
    BayesianGoalPredictor(cell_costs="learned"),
    BayesianGoalPredictor(costs="soft", cell_costs=MaxEntIRL(l2=2.0)),
    BayesianGoalPredictor(cell_costs=np.arange(25.0).reshape(5, 5)),
    MaxEntIRL(),
]
UNSEEN_LAYOUT = OvercookedLayout.from_ascii("XOXTX\nX   X\nX   D\nXV  X\nXXSPX")


# -- the contract -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", KITCHEN_CASES, ids=str)
def test_inside_a_station_the_goal_is_certain(case: Case) -> None:
    walks = [*people(), *case.test]
    assert fitted(case).predict(walks).tolist() == [w.goal for w in walks]
    assert (fitted(case).predict_proba(walks).max(axis=1) == 1.0).all()


@pytest.mark.parametrize("predictor", LEARNERS, ids=repr)
def test_the_order_of_walks_and_names_of_people_mean_nothing(predictor: GoalPredictor) -> None:
    walks = people()
    asked = prefixes([walks[0], walks[8]])
    forth, back = (clone(predictor).fit(order).predict_proba(asked) for order in (walks, walks[::-1]))
    assert np.allclose(forth, back, atol=1e-3)
    for w in asked[:3]:
        part = walk(w.states, None, ("dish", "onion"), participant="nobody", complete=False)
        row = clone(predictor).fit(walks).predict_proba([part])[0]
        assert row[2] == 0  # tomato is no candidate
        assert row.sum() == pytest.approx(1.0)


# -- priors -----------------------------------------------------------------------------------------------------------


def test_nothing_observed_is_the_prior_exactly() -> None:
    walks = people()
    nothing = [w.first(0) for w in walks]
    for predictor in BAYESIAN:
        assert (clone(predictor).fit(walks).predict_proba(nothing) == 1 / 3).all()
    empirical = GoalPrior("empirical", walks, np.array(sorted(THREE))).of(sorted(THREE))
    assert empirical == pytest.approx([3 / 14, 7 / 14, 4 / 14])
    for predictor in (*LEARNERS[4:], MaxEntIRL(prior="empirical"), BayesianGoalPredictor(prior="empirical")):
        assert (clone(predictor).fit(walks).predict_proba(nothing) == empirical).all()


def test_one_cell_is_the_prior_exactly_for_bayesian_inference() -> None:
    walks = people()
    cells = np.argwhere(ROOM.cells == 0)
    parts = [walk([cell], None, complete=False) for cell in cells]
    for predictor in BAYESIAN:
        assert (clone(predictor).fit(walks).predict_proba(parts) == 1 / 3).all()
    with_prior = BayesianGoalPredictor(prior="empirical").fit(walks)
    assert with_prior.predict_proba(parts) == pytest.approx(np.tile([3 / 14, 7 / 14, 4 / 14], (len(parts), 1)))


def test_the_empirical_prior_counts_choices_where_they_could_be_made() -> None:
    two = [walk([(3, 2), (3, 1), (2, 1), (1, 1), (0, 1)], "onion", ("onion", "tomato")) for _ in range(8)]
    other = [walk([(3, 2), (3, 3), (2, 3), (2, 4)], "dish", ("dish", "tomato")) for _ in range(8)]
    prior = GoalPrior("empirical", [*two, *other], np.array(sorted(THREE)))
    # Onions and dishes were taken whenever they could be, tomatoes never in sixteen times.
    assert prior.of(("onion", "dish")) == pytest.approx([0.5, 0.5])
    assert prior.of(("tomato", "onion")) == pytest.approx(np.array([1 / 19, 9 / 11]) / (1 / 19 + 9 / 11))
    unknown = walk([(3, 2)], None, complete=False)
    assert GoalPrior("empirical", [unknown], np.array(sorted(THREE))).of(THREE) == pytest.approx([1 / 3] * 3)


def test_bayesian_inference_multiplies_its_prior_with_its_likelihood() -> None:
    walks = people()
    parts = [p for p in prefixes(walks) if p.num_states]
    for costs in ("hard", "soft"):
        flat = BayesianGoalPredictor(costs=costs).fit(walks).predict_proba(parts)  # type: ignore[arg-type]
        bent = BayesianGoalPredictor(costs=costs, prior="empirical").fit(walks)  # type: ignore[arg-type]
        expected = flat * [3 / 14, 7 / 14, 4 / 14]
        assert bent.predict_proba(parts) == pytest.approx(expected / expected.sum(axis=1, keepdims=True))


# -- soft costs -------------------------------------------------------------------------------------------------------


def test_soft_costs_become_hard_ones_as_people_become_rational() -> None:
    part = walk([(3, 2), (3, 1), (3, 2), (3, 3)], None, complete=False)
    far = BayesianGoalPredictor(40.0, costs="soft").fit([part])
    hard = BayesianGoalPredictor(40.0).fit([part])
    soft_table, hard_table = (p.goal_costs(ROOM, THREE) / 40.0 for p in (far, hard))
    floor = ROOM.cells == 0
    assert np.allclose(soft_table[floor], hard_table[floor] - 1, atol=0.05)  # the last step is free in one


def test_soft_costs_count_the_ways_there_are() -> None:
    # Two cells as far from both stations, but more ways lead on to the one: hard costs see no difference.
    layout = OvercookedLayout.from_ascii("XXXXXXX\nO     T\nX   XXX\nX   XXX\nXXXXXXX")
    part = Trajectory([(1, 3), (1, 2)], candidates=("onion", "tomato"), layout=layout, complete=False)
    hard, soft = (
        BayesianGoalPredictor(1.3, costs=costs).fit([part]).predict_proba([part])[0]  # type: ignore[arg-type]
        for costs in ("hard", "soft")
    )
    assert hard[0] == pytest.approx(1 / (1 + math.exp(-2.6)))
    assert abs(soft[0] - hard[0]) > 0.01


def test_soft_costs_say_where_they_are_not_defined() -> None:
    layout = OvercookedLayout.from_ascii("XXOXTXX\nX     X\nX     X\nX     D\nX     X\nX     X\nXXXSPXX")
    part = Trajectory([(1, 1), (1, 2)], candidates=THREE, layout=layout, complete=False)
    border = walk_graph(layout, THREE).divergence_cost
    assert border == pytest.approx(math.log(4 * math.cos(math.pi / 6)))
    with pytest.raises(ValueError, match=r"diverges.*above 1\.242.*raise `beta` \(1\)"):
        BayesianGoalPredictor(1.0, costs="soft").fit([part]).predict_proba([part])
    default = BayesianGoalPredictor(costs="soft").fit([part]).predict_proba([part])
    assert default == pytest.approx(
        BayesianGoalPredictor(border + 0.25, costs="soft").fit([part]).predict_proba([part])
    )
    ring = OvercookedLayout.from_ascii("XOXTX\nX   X\nX X D\nX   X\nXXSPX")
    here = Trajectory([(1, 1), (1, 2)], candidates=THREE, layout=ring, complete=False)
    assert np.array_equal(
        BayesianGoalPredictor(costs="soft").fit([here]).predict_proba([here]),
        BayesianGoalPredictor(1.0, costs="soft").fit([here]).predict_proba([here]),
    )


def test_costs_of_cells_bend_the_way_that_is_expected() -> None:
    costs = np.ones(ROOM.shape)
    costs[3, 1] = 50.0  # the way to the onions then leads round the other side too, past (3, 3)
    part = walk([(3, 2), (3, 3)], None, ("onion", "tomato"), complete=False)
    plain, wary = (
        BayesianGoalPredictor(cell_costs=c).fit([part]).predict_proba([part])[0]
        for c in ("uniform", costs)  # type: ignore[arg-type]
    )
    assert plain[0] < 0.2
    assert wary[0] == pytest.approx(0.5)
    same = BayesianGoalPredictor(2.0, cell_costs=np.ones(ROOM.shape)).fit([part]).predict_proba([part])
    assert same == pytest.approx(BayesianGoalPredictor(2.0).fit([part]).predict_proba([part]))


# -- baselines against their definitions ------------------------------------------------------------------------------


def test_the_n_gram_counts_contexts() -> None:
    walks = people()
    predictor = GridNGram(n=2, strength=2.0).fit(walks)
    part = walks[8].first(2)
    assert part.states.tolist() == [[3, 2], [3, 3]]
    shares = np.array([3 / 14, 7 / 14, 4 / 14])  # dish, onion, tomato
    shares = (np.array([2, 0, 3]) + 2 * shares) / 7  # last cell (3, 3): two to the dishes, three to the tomatoes
    shares = (np.array([2, 0, 3]) + 2 * shares) / 7  # the last two cells: the same walks
    assert predictor.predict_proba([part])[0] == pytest.approx(shares)
    elsewhere = walk([(1, 2)], None, complete=False)
    assert predictor.predict_proba([elsewhere])[0] == pytest.approx([3 / 14, 7 / 14, 4 / 14])


def test_neighbours_are_all_that_are_as_near() -> None:
    walks = people()
    for k in (1, 2, 3, 7):
        predictor = GridNeighbours(k=k).fit(walks)
        part = walks[0].first(3)  # six people stood exactly so, a quarter of each one's way
        row = predictor.predict_proba([part])[0]
        exact = np.array([3 / 14, 7 / 14 + 6 / 4, 4 / 14])
        if k == 1:
            assert row == pytest.approx(exact / exact.sum())
        assert row.argmax() == 1
    everyone = GridNeighbours(k=1000).fit(walks).predict_proba([walks[0].first(1), walks[8].first(3)])
    assert everyone[0] == pytest.approx(everyone[1])


def test_votes_of_the_nearest_are_those_of_a_full_sort() -> None:
    rng = np.random.default_rng(0)
    for count, k in itertools.product((1, 2, 7, 300), (1, 3, 15, 1_000)):
        features = rng.integers(0, 3, (count, 6)) / 2.0  # few values: many are equally near
        sizes = 1.0 / rng.integers(1, 8, count)
        votes = np.eye(3)[rng.integers(0, 3, count)] * sizes[:, None]
        query = rng.integers(0, 3, 6) / 2.0
        there = np.flatnonzero(query)
        squares = (features**2).sum(axis=1)
        found = votes_of_nearest(there, query[there], np.ascontiguousarray(features.T), squares, votes, sizes, float(k))
        distances = ((features - query) ** 2).sum(axis=1).round(9)
        order = distances.argsort()
        enough = np.searchsorted(np.cumsum(sizes[order]), k - 1e-9)
        limit = distances[order[min(enough, count - 1)]]
        assert found == pytest.approx(votes[distances <= limit].sum(axis=0))


def test_logistic_regression_learns_what_can_be_learned() -> None:
    rng = np.random.default_rng(0)
    walks = [w for w in people() for _ in range(20)]
    predictor = GridLogistic(C=100.0).fit([walks[i] for i in rng.permutation(len(walks))])
    first, later = predictor.predict_proba([walks[0].first(1), walks[0].first(3)])
    shares = np.array([2 / 3, 6 / 4, 3 / 4])  # all walks begin on the same cell, one of three or four
    assert first == pytest.approx(shares / shares.sum(), abs=0.02)
    assert later[1] > 0.95
    two = [w for w in walks if w.goal != "dish"]
    binary = GridLogistic().fit(two)
    assert binary.predict_proba([two[0].first(3)])[0, 1] > 0.8
    assert 0 < binary.predict_proba([two[0].first(3)])[0, 0] < 0.05  # a candidate that nobody chose
    lonely = GridLogistic().fit(walks[:5]).predict_proba([walks[0].first(2)])[0]
    assert lonely[1] > 0.5
    assert (lonely > 0).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_learners_answer_about_walks_and_kitchens_they_never_saw(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layout = (ROOM, UNSEEN_LAYOUT)[rng.integers(2)]
    cells = [tuple(rng.choice(np.argwhere(layout.cells == 0)).tolist())]
    for _ in range(rng.integers(0, 9)):
        row, col = cells[-1]
        beside = [c for c in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)) if layout.is_floor(c)]
        cells.append(beside[rng.integers(len(beside))])
    part = walk(cells, None, layout=layout, start="pot", complete=False)
    for predictor in _FITTED:
        row = predictor.predict_proba([part])[0]
        assert np.isfinite(row).all()
        assert (row > 0).all()
        assert row.sum() == pytest.approx(1.0)


_FITTED = [clone(predictor).fit(people()) for predictor in LEARNERS]


# -- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("predictor", LEARNERS, ids=repr)
def test_a_goal_with_one_example_is_learned_from(predictor: GoalPredictor) -> None:
    walks = [w for w in people() if w.goal == "onion"] + [people()[-1]]
    fitted = clone(predictor).fit(walks)
    rows = fitted.predict_proba(prefixes(walks))
    assert np.isfinite(rows).all()
    assert np.allclose(rows.sum(axis=1), 1.0)
    assert fitted.predict_proba([walks[-1].first(3)])[0, 0] > fitted.predict_proba([walks[0].first(3)])[0, 0]


@pytest.mark.parametrize("case", KITCHEN_CASES, ids=str)
def test_states_that_do_not_fit_the_kitchen_are_refused_in_words(case: Case) -> None:
    predictor = fitted(case)
    with pytest.raises(ValueError, match=r"unknown goals \['pot'\]"):
        predictor.predict_proba([walk([(3, 3)], "pot", ("onion", "pot"))])
    for cells in ([(1, 1), (2, 2), (3, 3)], [(1, 2), (2, 2), (3, 2)]):
        with pytest.raises(ValueError, match="state 1, row 2, column 2 is neither floor"):
            predictor.predict_proba([walk(cells)])
    with pytest.raises(ValueError, match="state 0, row 0, column 1"):
        predictor.predict_proba([walk([(0, 1), (1, 1)])])
    with pytest.raises(ValueError, match="state 0, row 9, column -4"):
        predictor.predict_proba([walk([(9, -4)])])
    with pytest.raises(ValueError, match="cells"):
        predictor.predict_proba([walk([(1.0, 1.0)])])
    with pytest.raises(ValueError, match="needs the layout"):
        predictor.predict_proba([walk([(1, 1)], layout=None)])
    bare = OvercookedLayout.from_ascii("XXXTX\nX   X\nX   D\nXXSPX")
    with pytest.raises((ValueError, LayoutError), match="onion"):
        predictor.predict_proba([walk([(1, 1)], layout=bare)])


@pytest.mark.parametrize("predictor", LEARNERS, ids=repr)
def test_learning_from_states_that_do_not_fit_is_refused_in_words(predictor: GoalPredictor) -> None:
    walks = people()
    jump = walk([(3, 2), (1, 2), (1, 1), (0, 1)])
    wrong = walk([(3, 2), (2, 2), (1, 2), (1, 1), (0, 1)])
    with pytest.raises(ValueError, match="row 3, column 2 to row 1, column 2"):
        clone(predictor).fit([*walks, jump])
    with pytest.raises(ValueError, match="complete trajectories with known goals"):
        clone(predictor).fit([*walks, walks[0].first(2)])
    with pytest.raises(ValueError, match="state 1, row 2, column 2"):
        clone(predictor).fit([*walks, wrong])


HALVES = OvercookedLayout.from_ascii("XOXXXXXXOX\nX   PX   X\nT 2  D 1 X\nX   PX   X\nXXSXXXXXTX")
"""Each half has an onion and a tomato station; the dishes between them are in reach of both."""


def halves() -> list[Trajectory]:
    """Trajectories of both players, with the candidates in reach of each."""
    own = {2: ("dish", "onion@(0,1)", "tomato@(2,0)"), 1: ("dish", "onion@(0,8)", "tomato@(4,8)")}
    ways = [
        (2, [(1, 3), (1, 2), (1, 1), (0, 1)]),
        (2, [(3, 3), (3, 2), (2, 2), (2, 1), (2, 0)]),
        (2, [(3, 2), (2, 2), (2, 3), (2, 4), (2, 5)]),
        (1, [(1, 6), (1, 7), (1, 8), (0, 8)]),
        (1, [(2, 6), (3, 6), (3, 7), (3, 8), (4, 8)]),
        (1, [(1, 7), (2, 7), (2, 6), (2, 5)]),
    ]
    found = []
    for player, cells in ways:
        goal = HALVES.station_at(cells[-1])
        found.append(Trajectory(cells, start="pot", goal=goal, candidates=own[player], layout=HALVES))
    return found


NEURAL = RecurrentPredictor(4, members=1, max_epochs=1, validation_fraction=0.0)


@pytest.mark.parametrize(
    "predictor", [*BAYESIAN[:5], *LEARNERS, ShortestDistance(), ShortestDistance("geodesic"), NEURAL], ids=repr
)
def test_candidates_out_of_reach_are_no_goals(predictor: GoalPredictor) -> None:
    walks = halves()
    everything = tuple(sorted({name for each in walks for name in each.candidates}))
    fitted = clone(predictor).fit(walks)
    of_all = clone(predictor).fit([replace(each, candidates=everything) for each in walks])
    np.testing.assert_array_equal(of_all.predict_proba(walks), fitted.predict_proba(walks))
    for each in walks:
        for count in range(1, each.num_states + 1):
            alone, among_all = each.first(count), replace(each.first(count), candidates=everything)
            row = fitted.predict_proba([among_all])[0]
            np.testing.assert_array_equal(row, fitted.predict_proba([alone])[0])
            assert not row[[name not in each.candidates for name in fitted.classes_.tolist()]].any()
            assert row.sum() == pytest.approx(1.0)
            positions = [HALVES.stations[name] for name in everything]
            placed = replace(among_all, goal_positions=positions)
            np.testing.assert_array_equal(fitted.predict_proba([placed])[0], row)
    stream = fitted.stream(replace(walks[0], candidates=everything, goal=None))
    for count, cell in enumerate(walks[0].states[:-1], 1):
        belief = stream.update(cell)
        assert belief.keys() == set(everything)
        own = fitted.predict_proba([walks[0].first(count)])[0]
        of_own = [own[fitted.classes_.tolist().index(name)] for name in everything]
        assert [belief[name] for name in everything] == pytest.approx(of_own, abs=1e-12)


def test_costs_are_those_of_the_floor_in_the_persons_reach() -> None:
    """A corridor and an open room share the dishes; in the room the sum over paths diverges earlier."""
    rows = [
        "XOXXXXXXXXOX",
        "X XX       X",
        "X XX       X",
        "T 1D       X",
        "X XX       X",
        "XXXX   2   X",
        "XXXXXXXXXPXX",
    ]
    whole, alone = (OvercookedLayout.from_rows(one) for one in (rows, [row[:4] + "X" * 8 for row in rows]))
    ways = [
        [(3, 1), (2, 1), (1, 1), (0, 1)],
        [(2, 1), (1, 1), (2, 1), (3, 1), (3, 0)],
        [(2, 1), (3, 1), (3, 2), (3, 3)],
        [(1, 1), (2, 1), (3, 1), (4, 1), (3, 1), (3, 2), (3, 3)],
    ]
    of_whole, of_alone = (
        [Trajectory(way, goal=one.station_at(way[-1]), candidates=names, layout=one) for way in ways]
        for one, names in ((whole, ("dish", "onion@(0,1)", "tomato")), (alone, ("dish", "onion", "tomato")))
    )
    others = (BayesianGoalPredictor(0.85, costs="soft"), MaxEntIRL(features=np.ones((84, 1))))
    for predictor in (*BAYESIAN[:5], *LEARNERS, *others):
        one, other = clone(predictor).fit(of_whole), clone(predictor).fit(of_alone)
        for seen, same in zip(of_whole, of_alone, strict=True):
            for count in range(seen.num_states + 1):
                found, wanted = (p.predict_proba([w.first(count)])[0] for p, w in ((one, seen), (other, same)))
                np.testing.assert_allclose(found, wanted, atol=1e-9, err_msg=repr(predictor))
        if isinstance(one, MaxEntIRL) and isinstance(other, MaxEntIRL):
            assert one.uniform_cost_ == pytest.approx(other.uniform_cost_)
            np.testing.assert_allclose(one.log_likelihoods(of_whole), other.log_likelihoods(of_alone))
    with pytest.raises(ValueError, match="diverges"):
        BayesianGoalPredictor(0.85, costs="soft").fit(of_whole).goal_costs(whole, of_whole[0].candidates)


def test_where_no_candidate_is_in_reach_they_are_named() -> None:
    split = OvercookedLayout.from_ascii("XOXTX\nX X D\nX X X\nXXPXX")
    ways = [walk([(1, 1), (0, 1)], layout=split), walk([(2, 1), (1, 1), (0, 1)], layout=split)]
    for predictor in (*BAYESIAN[:5], MaxEntIRL()):
        fitted = clone(predictor).fit(ways)
        belief = dict(zip(fitted.classes_.tolist(), fitted.predict_proba([ways[0].first(1)])[0], strict=True))
        assert belief == {"onion": 1.0} | {name: 0.0 for name in ways[0].candidates if name != "onion"}
        there = replace(ways[0].first(1), goal=None, candidates=("tomato", "dish"))
        with pytest.raises(ValueError, match=r"'tomato' cannot be reached from row 1, column 1"):
            fitted.predict_proba([there])


def test_bad_parameters_are_refused() -> None:
    walks = people()
    bad: list[tuple[GoalPredictor, str]] = [
        (BayesianGoalPredictor(-1.0), "beta"),
        (BayesianGoalPredictor("best"), "beta"),  # type: ignore[arg-type]
        (BayesianGoalPredictor("fit", cell_costs="learned"), "uniform costs"),
        (BayesianGoalPredictor(costs="firm"), "costs"),  # type: ignore[arg-type]
        (BayesianGoalPredictor(cell_costs="dear"), "cell_costs"),  # type: ignore[arg-type]
        (BayesianGoalPredictor(prior="mine"), "prior"),  # type: ignore[arg-type]
        (GridLogistic(C=0.0), "`C`"),
        (GridLogistic(max_iter=-1), "max_iter"),
        (GridNeighbours(k=0), "`k`"),
        (GridNeighbours(k=2.5), "`k`"),  # type: ignore[arg-type]
        (GridNGram(n=0), "`n`"),
        (GridNGram(strength=0.0), "strength"),
    ]
    for predictor, name in bad:
        with pytest.raises(ValueError, match=name):
            predictor.fit(walks)
    for costs, message in ((np.ones((2, 2)), r"shape \(5, 5\)"), (np.full((5, 5), np.nan), "row 1, column 1 is nan")):
        with pytest.raises(ValueError, match=message):
            BayesianGoalPredictor(cell_costs=costs).fit(walks).predict_proba([walks[0].first(2)])
