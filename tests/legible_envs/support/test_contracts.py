"""Checks of plug-ins: all are made, whatever one of them raises, and one error lists what they found."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from legible_envs.errors import WorkspaceError
from legible_envs.support.contracts import ContractError, find_problems, refuse
from predictors.registry import PredictorError


def broken():
    raise KeyError("colour")


def careless():
    np.random.random()  # noqa: NPY002 - what the check is for
    return []


def test_every_check_is_made_and_what_it_finds_is_listed_in_order():
    found = find_problems({"names": lambda: ["it has no name"], "page": broken, "rows": lambda: iter(["a", "b"])})
    assert found == ["it has no name", "page: raised KeyError: 'colour'", "a", "b"]
    assert find_problems({"nothing": list}) == []


def test_global_randomness_is_noticed():
    (problem,) = find_problems({"careless": careless})
    assert problem.startswith("it draws from numpy's global random state")


def test_nothing_is_raised_where_nothing_is_wrong():
    refuse(object(), "emitter", [], ContractError)


@pytest.mark.parametrize("error", [ContractError, WorkspaceError, PredictorError])
def test_the_error_lists_the_problems_and_pickles(error):
    with pytest.raises(error, match=r"^int breaks the emitter contract:\n- one\n- two$") as caught:
        refuse(3, "emitter", iter(["one", "two"]), error)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), str(again), again.problems) == (error, str(caught.value), ("one", "two"))
