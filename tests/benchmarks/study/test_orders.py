"""Orders: what a Williams design promises, who comes next, and plug-ins that do not keep the contract."""

import sys
from collections import Counter
from itertools import pairwise, permutations
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.study.errors import StudyError
from benchmarks.study.orders import make_policy, next_order, williams

NAMES = [f"c{i}" for i in range(12)]


@pytest.mark.parametrize("count", range(1, 13))
def test_every_condition_is_at_every_place_and_behind_every_other_equally_often(count):
    names = NAMES[:count]
    rows = williams(names)
    assert len(rows) == (count if count % 2 == 0 or count == 1 else 2 * count)
    assert all(sorted(row) == sorted(names) for row in rows)
    assert len({tuple(row) for row in rows}) == len(rows)
    for place in range(count):
        assert set(Counter(row[place] for row in rows).values()) == {len(rows) // count}
    neighbours = Counter(pair for row in rows for pair in pairwise(row))
    assert set(neighbours) == set(permutations(names, 2))
    assert len(set(neighbours.values())) <= 1


@given(count=st.integers(1, 7), rounds=st.integers(1, 4), seed=st.integers(0, 2**32))
def test_full_rounds_of_participants_are_balanced(count, rounds, seed):
    names, rng = NAMES[:count], np.random.default_rng(seed)
    policy, counts = make_policy("williams", names), Counter()
    for _ in range(rounds * policy.num_orders):
        number, order = next_order(policy, names, counts, rng)
        assert order == williams(names)[number]
        counts[number] += 1
    assert set(counts.values()) == {rounds}


@given(seed=st.integers(0, 2**32), lost=st.integers(0, 3), rounds=st.integers(1, 5))
def test_the_order_of_a_drop_out_comes_next(seed, lost, rounds):
    counts = dict.fromkeys(range(4), rounds)
    counts[lost] -= 1  # somebody left, and counts no longer
    assert next_order("williams", NAMES[:4], counts, np.random.default_rng(seed))[0] == lost


def test_ties_are_decided_by_chance_and_the_same_seed_decides_the_same():
    first = [next_order("williams", NAMES[:4], {}, np.random.default_rng(seed))[0] for seed in range(200)]
    again = [next_order("williams", NAMES[:4], {}, np.random.default_rng(seed))[0] for seed in range(200)]
    assert first == again
    assert min(Counter(first).values()) > 25  # of 50 expected; p < 1e-5 if it were fair


def test_counts_of_orders_that_there_are_not_do_not_matter():
    assert next_order("fixed", ["a", "b"], {0: 9, 7: 1}, np.random.default_rng(0)) == (0, ["a", "b"])


def test_simple_random_orders_are_equally_likely_whatever_others_met():
    rng = np.random.default_rng(1)
    found = Counter(tuple(next_order("random", NAMES[:3], {0: 1000}, rng)[1]) for _ in range(1200))
    assert set(found) == set(permutations(NAMES[:3]))
    chi_square = sum((n - 200) ** 2 / 200 for n in found.values())
    assert chi_square < 20.5  # 0.1 % of 5 degrees of freedom


@pytest.fixture
def plug_in(monkeypatch):
    def install(function):
        monkeypatch.setitem(sys.modules, "own_orders", SimpleNamespace(orders=function))
        return "own_orders:orders"

    return install


def test_a_plug_in_lists_its_orders(plug_in):
    policy = make_policy(plug_in(lambda names: [names, names[::-1]]), ["a", "b"])
    assert policy.num_orders == 2
    assert policy.order(1, np.random.default_rng(0)) == ["b", "a"]


def _random_orders(names, rng=np.random.default_rng(0)):  # noqa: B008  # to be another one at each call
    return [list(rng.permutation(names)) for _ in range(20)]


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda names: [], "1 to 10,000 orders, got 0"),
        (lambda names: [names[:-1]], "orders of all of a, b, c; order 1 is"),
        (lambda names: [names, ("a", "a", "c")], "order 2 is"),
        (lambda names: [(1, 2, 3)], "order 1 is"),
        (lambda names: 3, "cannot be used: TypeError"),
        (lambda names: 1 / 0, "cannot be used: ZeroDivisionError"),
        (lambda: [("a",)], "cannot be used: TypeError"),
        (_random_orders, "the same orders whenever it is called"),
    ],
)
def test_a_plug_in_that_breaks_the_contract_is_refused(plug_in, function, message):
    with pytest.raises(StudyError, match=message):
        make_policy(plug_in(function), ["a", "b", "c"])


@pytest.mark.parametrize("name", ["latin", "", "no_such_module:f", "os:no_such_function", ":", "os:"])
def test_what_is_no_policy_is_refused(name):
    with pytest.raises(StudyError, match=r"order policy is one of|cannot be used"):
        make_policy(name, ["a", "b"])
