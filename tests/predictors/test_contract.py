"""What every predictor promises, tested on every registered one and on the settings of them that differ in code."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.exceptions import NotFittedError

from legible_envs.rollouts import CUTS, Trajectory
from predictors import GoalPredictor, ShortestDistance, check_predictor, list_predictors
from predictors.checks import example_trajectories
from tests.predictors.cases import CASES, NEURAL_CASES, ROOM, Case, fitted, people, prefixes, reaches, walk

BACK_AND_FORTH = walk([(3, 2), (3, 3), (2, 3), (3, 3), (3, 2), (3, 1)], None, complete=False)


def needs_torch(case: Case) -> None:
    if case in NEURAL_CASES:
        pytest.importorskip("torch", reason="the extra `torch` is not installed")


def test_every_built_in_predictor_is_tested_here() -> None:
    built_in = [name for name, info in list_predictors().items() if info.origin == "built in"]
    assert sorted(case.name for case in CASES if case.name) == sorted(built_in)


# -- scikit-learn -----------------------------------------------------------------------------------------------------


def test_the_check_for_plug_ins_finds_no_fault(case: Case) -> None:
    needs_torch(case)
    if case.kind == "kitchen":
        check_predictor(case.predictor)
        check_predictor(case.predictor, people())
    else:
        check_predictor(case.predictor, case.train[:12])


def test_parameters_are_cloned_and_set_as_in_scikit_learn(case: Case) -> None:
    twin = clone(case.predictor)
    assert type(twin) is type(case.predictor)
    assert repr(twin.get_params()) == repr(case.predictor.get_params())
    assert repr(twin.set_params(**case.predictor.get_params(deep=False))) == repr(case.predictor)
    assert not hasattr(twin, "classes_")


def test_fitting_returns_the_predictor_and_learns_the_goals(case: Case) -> None:
    needs_torch(case)
    fresh = clone(case.predictor)
    assert fresh.fit(case.train) is fresh
    assert fresh.classes_.tolist() == sorted({name for each in case.train for name in each.candidates})


def test_equal_fits_predict_equally(case: Case, predictor: GoalPredictor) -> None:
    again = clone(case.predictor).fit(case.train)
    asked = prefixes(case.test)
    assert np.array_equal(again.predict_proba(asked), predictor.predict_proba(asked))


def test_pickled_ones_are_the_same(case: Case, predictor: GoalPredictor) -> None:
    twin = pickle.loads(pickle.dumps(predictor))
    assert np.array_equal(twin.predict_proba(case.test), predictor.predict_proba(case.test))


@pytest.mark.parametrize("case", NEURAL_CASES, ids=str)
def test_saved_ones_are_the_same(case: Case, tmp_path: Path) -> None:
    predictor: Any = fitted(case)
    path = predictor.save(tmp_path / "made" / "predictor.npz")
    copy = type(predictor).load(path)
    assert copy.get_params() == predictor.get_params()
    assert np.array_equal(copy.predict_proba(case.test), predictor.predict_proba(case.test))
    assert np.array_equal(copy.validation_loss_, predictor.validation_loss_)


# -- probabilities ----------------------------------------------------------------------------------------------------


def test_probabilities_belong_to_the_candidates_alone(case: Case, predictor: GoalPredictor) -> None:
    asked = prefixes(case.test)
    assert any(len(each.candidates) < len(predictor.classes_) for each in asked)
    rows = predictor.predict_proba(asked)
    assert rows.shape == (len(asked), len(predictor.classes_))
    assert np.isfinite(rows).all()
    assert (rows >= 0).all()
    assert np.allclose(rows.sum(axis=1), 1)
    for row, prefix in zip(rows, asked, strict=True):
        assert {goal for goal, p in zip(predictor.classes_, row, strict=True) if p > 0} <= set(prefix.candidates)
    only = replace(case.test[0].first(2), candidates=case.test[0].candidates[:1], goal=None, goal_positions=None)
    assert sorted(predictor.predict_proba([only])[0].tolist()) == [0.0] * (len(predictor.classes_) - 1) + [1.0]
    assert predictor.predict_proba([]).shape == (0, len(predictor.classes_))


def test_nothing_observed_is_a_prior_that_start_and_states_do_not_change(case: Case, predictor: GoalPredictor) -> None:
    by_candidates: dict[frozenset[str], dict[str, float]] = {}
    for each in case.test:
        row = dict(zip(predictor.classes_.tolist(), predictor.predict_proba([each.first(0)])[0], strict=True))
        assert row == pytest.approx(by_candidates.setdefault(frozenset(each.candidates), row), abs=1e-12)
        assert predictor.stream(each).belief == pytest.approx({goal: row[goal] for goal in each.candidates})


@pytest.mark.parametrize("case", [case for case in CASES if case.uniform], ids=str)
def test_a_uniform_prior_is_exactly_so(case: Case, predictor: GoalPredictor) -> None:
    for row, each in zip(predictor.predict_proba([each.first(0) for each in case.test]), case.test, strict=True):
        count = len(each.candidates)
        assert sorted(row, reverse=True)[:count] == [1 / count] * count


@pytest.mark.parametrize("case", [case for case in CASES if case.blind], ids=str)
def test_one_state_scores_like_the_prior(case: Case) -> None:
    """A recording, or a simulation, must not leak its goal by where it begins."""
    if case.kind == "kitchen":
        predictor = fitted(case)
        parts = [walk([cell], None, complete=False) for cell in np.argwhere(ROOM.cells == 0)]
        known = [each.first(1) for each in case.test]
    else:
        # Those that learn where goals are do so from reaches that begin anywhere.
        found = reaches(6, seed=2, positions=case.name == "reach-bayesian")
        predictor = clone(case.predictor).fit(found)
        parts = known = [each.first(1) for each in found]
    nothing = predictor.predict_proba([part.first(0) for part in parts])
    one = predictor.predict_proba(parts)
    assert one == pytest.approx(nothing, abs=1e-12)
    if case.uniform:
        assert (one == 1 / 3).all()
        assert (nothing == 1 / 3).all()
    assert predictor.score(known) == pytest.approx(predictor.score([part.first(0) for part in known]))


# -- time -------------------------------------------------------------------------------------------------------------


def test_a_stream_says_what_prefixes_say(case: Case, predictor: GoalPredictor) -> None:
    extra = [BACK_AND_FORTH] if case.kind == "kitchen" else []
    for each in [*case.test, *extra]:
        stream = predictor.stream(each)
        rows = predictor.predict_proba([each.first(count) for count in range(each.num_states + 1)])
        beliefs = [stream.belief] + [
            stream.update(state, float(time)) for state, time in zip(each.states, each.times, strict=True)
        ]
        columns = [predictor.classes_.tolist().index(goal) for goal in each.candidates]
        found = [list(belief.values()) for belief in beliefs]
        np.testing.assert_allclose(found, rows[:, columns], rtol=0, atol=case.slack)
        assert all(tuple(belief) == each.candidates for belief in beliefs)
        assert stream.belief == beliefs[-1]
        assert (stream.num_states, stream.last_time) == (each.num_states, each.times[-1])


def test_the_future_changes_nothing(case: Case, predictor: GoalPredictor) -> None:
    """The belief after t states is the same whatever comes after them, goal and whole length included."""
    for each in case.test:
        half = each.num_states // 2
        back = np.concatenate([each.states[:half], each.states[:half][::-1]])
        other, same = (
            replace(each, states=states, times=None, goal=None, complete=False)  # type: ignore[arg-type]
            for states in (back, each.states)
        )
        for count in range(half + 1):
            expected = predictor.predict_proba([same.first(count)])
            np.testing.assert_allclose(predictor.predict_proba([other.first(count)]), expected, atol=1e-12)


@pytest.mark.parametrize("cut", CUTS)
def test_fractions_are_the_prefixes_they_name(case: Case, predictor: GoalPredictor, cut: Any) -> None:
    fractions = (0.05, 0.3, 0.31, 0.8, 1.0)
    cube = predictor.predict_proba_at(case.test, fractions, cut)
    assert cube.shape == (len(case.test), len(fractions), len(predictor.classes_))
    for column, fraction in enumerate(fractions):
        rows = predictor.predict_proba([each.prefix(fraction, cut) for each in case.test])
        np.testing.assert_allclose(cube[:, column], rows, rtol=0, atol=min(case.slack, 1e-12))
    assert predictor.predict_proba_at([], fractions, cut).shape == (0, len(fractions), len(predictor.classes_))


# -- bad input --------------------------------------------------------------------------------------------------------


def test_bad_input_is_refused_in_words(case: Case, predictor: GoalPredictor) -> None:
    good = case.test[0]
    fresh = clone(case.predictor)
    with pytest.raises(NotFittedError, match="call `fit`"):
        fresh.predict_proba([good])
    with pytest.raises(NotFittedError, match="call `fit`"):
        fresh.stream(good)
    with pytest.raises(ValueError, match="at least one trajectory"):
        fresh.fit([])
    with pytest.raises(TypeError, match="put it in a list"):
        predictor.predict_proba(good)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="got ndarray at index 0"):
        predictor.predict_proba([np.zeros((2, 2))])  # type: ignore[list-item]
    strange = replace(good, candidates=(good.candidates[0], "ceiling"), goal=None, goal_positions=None)
    with pytest.raises(ValueError, match=r"unknown goals \['ceiling'\]"):
        predictor.predict_proba([strange])
    with pytest.raises(ValueError, match=r"unknown goals \['ceiling'\]"):
        predictor.stream(strange)
    with pytest.raises(ValueError, match="no known goal"):
        predictor.score([replace(good, goal=None)])
    with pytest.raises(ValueError, match="not both"):
        predictor.score([good, good.first(1)])
    with pytest.raises(ValueError, match="no trajectories"):
        predictor.score([])


def test_bad_points_are_refused_and_change_nothing(case: Case, predictor: GoalPredictor) -> None:
    first = case.test[0].states[0]
    stream = predictor.stream(case.test[0])
    before = stream.update(first, time=1.0)
    bad_points: list[Any] = [(np.nan, 1.0), (1, 2, 3), (0.0, 0.0, 0.0), 5, ("a", "b"), [[1, 2]]]
    for point in bad_points:
        with pytest.raises(ValueError, match="point"):
            stream.update(point, time=2.0)
        assert stream.belief == before
    with pytest.raises(ValueError, match="backwards"):
        stream.update(case.test[0].states[1], time=0.5)
    assert stream.belief == before
    assert (stream.num_states, stream.last_time) == (1, 1.0)


# -- the baseline of baselines ----------------------------------------------------------------------------------------


def test_the_uniform_predictor_is_at_chance() -> None:
    from predictors import UniformPredictor

    found = example_trajectories()
    predictor = UniformPredictor().fit(found)
    chance = np.mean([1 / len(each.candidates) for each in found])
    assert predictor.score(found) == pytest.approx(chance)
    assert ShortestDistance().fit(found).score(found) > predictor.score(found)
    context = Trajectory(np.zeros((1, 2)), candidates=("a", "b", "c", "d"))
    stream = UniformPredictor().fit([context]).stream(context)
    assert stream.update((0.3, 0.4), 0.2) == dict.fromkeys("abcd", 0.25)
