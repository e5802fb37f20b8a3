"""What predictors assume of their input is made true at the door, or refused with the trajectory's number."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.exceptions import ConvergenceWarning

from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors import (
    BayesianGoalPredictor,
    GoalPredictor,
    GridLogistic,
    MaxEntIRL,
    ReachLogistic,
    ShortestDistance,
    StraightLineBayesian,
    ThresholdDecision,
    TimeSeriesGaussian,
    UniformPredictor,
)
from predictors.base import TrajectoryError, check_fractions
from predictors.evaluation import accuracy_at, evaluate, learning_curve
from tests.predictors.cases import CASES, NAMES, NEURAL_CASES, ROOM, THREE, Case, fitted, people, reaches, walk

KITCHEN_CASES = [case for case in CASES if case.kind == "kitchen"]
REACH_CASES = [case for case in CASES if case.kind == "reaches"]


# -- trajectories in kitchens -----------------------------------------------------------------------------------------

WRONG_WAYS = {
    "it jumps": (
        [(3, 2), (3, 1), (1, 1), (0, 1)],
        "serving",
        "from row 3, column 1 to row 1, column 1, .* not one step",
    ),
    "it goes across a corner": ([(3, 2), (2, 1), (1, 1), (0, 1)], "serving", "which is not one step"),
    "it ends elsewhere": ([(3, 2), (3, 1), (2, 1), (1, 1)], "serving", "ends with the cell of its goal station"),
    "it ends in another goal": ([(3, 2), (3, 3), (2, 3), (1, 3), (0, 3)], "serving", "ends with the cell of its goal"),
    "it is the goal alone": ([(0, 1)], "serving", "after one floor cell or more"),
    "it begins elsewhere": ([(2, 1), (1, 1), (0, 1)], "serving", "row 2, column 1 is not beside 'serving'"),
    "it leaves the floor": ([(3, 2), (2, 2), (1, 2), (1, 1), (0, 1)], "serving", "row 2, column 2 is neither floor"),
    "it passes through a station": ([(3, 2), (4, 2), (3, 2), (3, 1), (2, 1), (1, 1), (0, 1)], "serving", "row 4, col"),
    "it is a prefix": (None, "serving", "prefix"),
}


def routes(predictor: GoalPredictor) -> dict[str, Callable[[list[Trajectory]], object]]:
    """Every way on which fractions of trajectories are taken."""
    named = {"it": predictor}
    return {
        "predict_proba_at": predictor.predict_proba_at,
        "score": predictor.score,
        "accuracy_at": lambda found: accuracy_at(predictor, found),
        "evaluate": lambda found: evaluate(named, found, cv=2, repeats=1),
        "learning_curve": lambda found: learning_curve(named, found, sizes=(1.0,), repeats=1),
    }


@pytest.mark.parametrize("wrong", WRONG_WAYS)
@pytest.mark.parametrize("predictor", [BayesianGoalPredictor(), ShortestDistance(), MaxEntIRL()], ids=repr)
def test_trajectories_that_are_none_are_refused_on_every_way(predictor: GoalPredictor, wrong: str) -> None:
    cells, start, message = WRONG_WAYS[wrong]
    bad = people()[0].first(3) if cells is None else walk(cells, start=start)
    found = [*people(), replace(bad, participant="Ada"), *people()]
    fitted_one = clone(predictor).fit(people())
    for name, route in routes(fitted_one).items():
        expected = (
            "not both"
            if wrong == "it is a prefix" and name == "score"
            else rf"trajectory 11 \(participant 'Ada'\): .*{message}"
        )
        with pytest.raises(ValueError, match=expected):
            route(found)
    if wrong != "it is a prefix":
        with pytest.raises(TrajectoryError, match=message):
            ThresholdDecision(fitted_one).decide(found)
    if isinstance(predictor, MaxEntIRL):
        with pytest.raises(TrajectoryError, match="trajectory 11") as caught:
            clone(predictor).fit(found)
        assert (caught.value.number, caught.value.participant) == (11, "Ada")


@pytest.mark.parametrize("case", KITCHEN_CASES, ids=str)
def test_no_predictor_takes_fractions_of_a_way_with_a_jump(case: Case) -> None:
    bad = [*case.test, walk(WRONG_WAYS["it jumps"][0])]
    if isinstance(case.predictor, UniformPredictor):  # assumes nothing; but its evaluation does
        with pytest.raises(TrajectoryError, match="not one step"):
            evaluate(case.predictor, bad, cv=2, rare="keep")
        return
    with pytest.raises(TrajectoryError, match=f"trajectory {len(case.test)}: .*not one step"):
        fitted(case).predict_proba_at(bad)


def test_an_error_is_about_the_trajectory_that_was_given() -> None:
    """Prefixes, folds and parts have numbers of their own, which mean nothing to whoever gave the trajectories."""
    far = replace(
        people()[0], layout=OvercookedLayout.from_ascii("XOXTX\nX   X\nX   D\nX   X\nXXSPX"), participant="Bo"
    )
    found = [replace(each, condition="a") for each in people()] + [replace(far, condition="b")] * 3
    costly = {"it": BayesianGoalPredictor(cell_costs=np.ones((7, 7)))}
    with pytest.raises(ValueError, match=r"trajectory 0: cell costs must have"):
        evaluate(costly, found, cv=2, rare="keep")
    gaussian = TimeSeriesGaussian().fit(reaches(2))
    short = [*reaches(1), Trajectory([(0.0, 0.0)], goal="left", candidates=NAMES, participant="Cy")]
    with pytest.raises(TrajectoryError, match=r"trajectory 3 \(participant 'Cy'\): .* 1 state has no prefix"):
        gaussian.predict_proba_at(short)
    error = TrajectoryError(3, "Cy", "why")
    import pickle

    twin = pickle.loads(pickle.dumps(error))
    assert (str(twin), twin.number, twin.reason) == ("trajectory 3 (participant 'Cy'): why", 3, "why")


# -- parameters -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("predictor", "message"),
    [
        (GridLogistic(max_iter=2.5), "`max_iter` must be an integer"),  # type: ignore[arg-type]
        (MaxEntIRL(max_iter=0.5), "`max_iter` must be an integer"),  # type: ignore[arg-type]
        (MaxEntIRL(prior="flat"), "`prior`"),  # type: ignore[arg-type]
        (BayesianGoalPredictor(prior="flat"), "`prior`"),  # type: ignore[arg-type]
        (BayesianGoalPredictor(beta=1e200), r"`beta` must be .* 1e\+09"),
        (ShortestDistance("diagonal"), "`metric`"),  # type: ignore[arg-type]
        (StraightLineBayesian(obstacles=1), "`obstacles` must be True or False"),  # type: ignore[arg-type]
        (TimeSeriesGaussian(velocity=1), "`velocity` must be True or False"),  # type: ignore[arg-type]
        (TimeSeriesGaussian(floor=1e-200), "`floor` must be a finite number >= 1e-06"),
        (ReachLogistic(degree=3), "`degree`"),
    ],
)
def test_parameters_are_checked_before_anything_is_learned(predictor: GoalPredictor, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        predictor.fit([])
    with pytest.raises(ValueError, match=f"predictor 'it': .*{message}"):  # no dash for a typing error
        evaluate({"it": predictor, "uniform": UniformPredictor()}, people(), cv=2)


@pytest.mark.parametrize(
    "fractions",
    [0.5, "0.5", None, {0.5}, {0.5: 1}, (0.0,), (1.1,), (-0.1,), (np.nan,), (True,), ("0.5",), ((0.5,),), (None,)],
)
def test_fractions_are_numbers_above_0_and_up_to_1(fractions: Any) -> None:
    predictor = BayesianGoalPredictor().fit(people())
    with pytest.raises(ValueError, match="fractions"):
        predictor.predict_proba_at(people(), fractions)
    with pytest.raises(ValueError, match="fractions"):
        predictor.score(people(), fractions=fractions)
    with pytest.raises(ValueError, match="fractions"):
        evaluate(predictor, people(), cv=2, fractions=fractions)
    with pytest.raises(ValueError, match="fractions"):
        learning_curve(predictor, people(), fractions=fractions)


def test_fractions_are_taken_in_any_order_and_from_any_iterable() -> None:
    predictor = BayesianGoalPredictor().fit(people())
    cube = predictor.predict_proba_at(people(), (0.2, 0.5, 0.9))
    np.testing.assert_array_equal(predictor.predict_proba_at(people(), np.array([0.9, 0.2, 0.5])), cube[:, [2, 0, 1]])
    np.testing.assert_array_equal(predictor.predict_proba_at(people(), (f for f in (0.2, 0.5, 0.9))), cube)  # type: ignore[arg-type]
    rising, falling = (evaluate(predictor, people(), cv=2, fractions=each) for each in ((0.2, 0.9), (0.9, 0.2)))
    assert rising.accuracy().sort_values("fraction").to_numpy().tolist() == (
        falling.accuracy().sort_values("fraction").to_numpy().tolist()
    )
    for twice in ((0.5, 0.5), (0.3, 0.1 + 0.2)):
        with pytest.raises(ValueError, match="each once"):
            predictor.score(people(), fractions=twice)
    assert check_fractions((0.0, 1), "cells") == (0.0, 1.0)
    with pytest.raises(ValueError, match="unknown cut"):
        check_fractions((0.5,), "half")  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", [2.5, -1, None, True, "0", np.nan, [1]])
def test_seeds_are_whole_numbers_or_generators(seed: Any) -> None:
    for run in (evaluate, learning_curve):
        with pytest.raises(ValueError, match="`seed`"):
            run("bayesian", people(), seed=seed)


def test_names_that_arrays_of_texts_would_mix_up_are_refused() -> None:
    with pytest.raises(ValueError, match="NUL"):
        UniformPredictor().fit([Trajectory([(0.0, 0.0)], candidates=("a", "a\0"))])


# -- streams ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_stream_refuses_leaves_it_as_it_was(case: Case) -> None:
    predictor, one = fitted(case), case.test[0]
    stream = predictor.stream(one)
    missing = np.ma.masked_array([1, 2], [True, False])
    bad: list[Any] = [(1e10, 0.0), (-1e200, 0.0), (10**400, 0), (1j, 0), (True, False), [], missing]
    if case.kind == "kitchen" and not isinstance(predictor, UniformPredictor):
        bad += [(0, 0), (0.5, 1.5), (10**8, 3)]
    for point in bad:
        with pytest.raises(ValueError, match=r"point|the layout"):
            stream.update(point, 1.0)
        assert (stream.num_states, np.isnan(stream.last_time)) == (0, True)
    for time in (np.nan, np.inf, "1", True, 1e13):
        with pytest.raises(ValueError, match="time"):
            stream.update(one.states[0], time)  # type: ignore[arg-type]
    for number, (state, time) in enumerate(zip(one.states[:4], one.times, strict=False), 1):
        belief = stream.update(state, float(time))
        for point in bad:
            with pytest.raises(ValueError, match=r"point|the layout"):
                stream.update(point, float(time))
        assert (stream.num_states, stream.belief) == (number, belief)
        expected = predictor.predict_proba([one.first(number)])[0, predictor.candidate_columns(one)]
        np.testing.assert_allclose(list(belief.values()), expected, rtol=0, atol=max(case.slack, 1e-12))


@pytest.mark.parametrize("case", REACH_CASES, ids=str)
def test_whole_numbers_are_positions_to_predictors_of_reaches(case: Case) -> None:
    """(0, 0) twice is a pause there, not one cell."""
    predictor, one = fitted(case), case.test[0]
    points = np.array([(0, 0), (0, 0), (1, 0), (1, 0)])
    whole, exact = predictor.stream(one), predictor.stream(one)
    if isinstance(predictor, UniformPredictor):
        return
    for point in points:
        assert whole.update(point) == exact.update(point.astype(float))
    assert whole.num_states == 4
    cells = replace(one, states=points, times=None, goal_positions=None)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"give positions in metres or pixels as floats|this trajectory has 2-d cells"):
        predictor.predict_proba([cells])


def test_a_stream_is_about_one_kind_of_points() -> None:
    context = Trajectory(np.zeros((0, 2)), candidates=("a", "b"))
    stream = UniformPredictor().fit([context]).stream(context)
    stream.update((0, 0))
    stream.update((0, 0))
    assert stream.num_states == 1
    with pytest.raises(ValueError, match="give floats from the first one on"):
        stream.update((0.5, 0.0))
    other = UniformPredictor().fit([context]).stream(context)
    for point in ((0.5, 0.0), (1, 1), (1, 1)):
        other.update(point)
    assert other.num_states == 3


# -- numbers that are none of a hand ----------------------------------------------------------------------------------

MAGNITUDES = (
    0.0,
    -0.0,
    5e-324,
    1e-310,
    1e-300,
    1e-160,
    1e-12,
    1e-3,
    1.0,
    3.0,
    1e3,
    1e6,
    1e9,
    1e10,
    1e100,
    1e200,
    1e308,
)
PERIODS = (0.0, 5e-324, 1e-300, 1e-12, 1e-9, 1e-4, 1e-2, 1.0, 1e3, 1e6, 1e11, 1e20, 1e300)


@st.composite
def nasty_reaches(draw: st.DrawFn, complete: bool = True) -> Trajectory | None:
    """A reach of odd numbers, dtype and memory; None where it is none at all, which must be said in words."""
    count = draw(st.integers(1, 6))
    size = draw(st.sampled_from(MAGNITUDES))
    numbers = st.sampled_from((0.0, 1.0, -1.0, 0.5, 0.25, size, -size))
    rows = draw(st.lists(st.tuples(numbers, numbers), min_size=count, max_size=count))
    array = np.array(rows) * draw(st.sampled_from((1.0, size if size < 1e100 else 1.0)))
    kind = draw(
        st.sampled_from(("plain", "float16", "float32", "longdouble", "int64", "fortran", "sparse", "frozen", "same"))
    )
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind in ("float16", "float32", "longdouble", "int64"):
            array = array.astype(kind)
    if kind == "fortran":
        array = np.asfortranarray(array)
    if kind == "sparse":
        array = np.repeat(np.repeat(array, 2, axis=0), 2, axis=1)[::2, ::2]
    if kind == "frozen":
        array.flags.writeable = False
    if kind == "same":
        array = np.repeat(array[:1], count, axis=0)
    gaps = draw(st.lists(st.sampled_from(PERIODS), min_size=count, max_size=count))
    times = None if draw(st.booleans()) else np.cumsum(gaps)
    goal = draw(st.sampled_from(NAMES))
    places = draw(st.sampled_from((None, ((0.0, 0.0), (1.0, 0.0), (1e-300, 1e9)), ((0.0, 0.0),) * 3)))
    try:
        return Trajectory(array, times, goal=goal, candidates=NAMES, complete=complete, goal_positions=places)
    except ValueError as error:
        in_words(error)
        return None


def in_words(error: ValueError) -> None:
    """A refusal says something, and not that numpy was given what it cannot work on."""
    assert len(str(error)) > 15
    assert not any(word in str(error) for word in ("broadcast", "infinity or a value too large", "NaN", "Singular"))


def answers(ask: Callable[[], Any], shape: tuple[int, ...]) -> None:
    """Either an error in words or probabilities; never a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", ConvergenceWarning)  # documented: logistic regression says that it is not done
        try:
            rows = ask()
        except ValueError as error:
            in_words(error)
            return
    assert rows.shape == shape
    assert np.isfinite(rows).all()
    assert (rows >= 0).all()
    np.testing.assert_allclose(rows.sum(axis=-1), 1.0, atol=1e-9)


SLOW = {"deadline": None, "suppress_health_check": [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]}


@pytest.mark.parametrize("case", REACH_CASES, ids=str)
@settings(max_examples=60, **SLOW)  # type: ignore[arg-type]
@given(data=st.data())
def test_odd_reaches_get_probabilities_or_a_reason(case: Case, data: st.DataObject) -> None:
    predictor = fitted(case)
    found = data.draw(nasty_reaches())
    if found is None:
        return
    answers(lambda: predictor.predict_proba([found]), (1, 3))
    answers(lambda: predictor.predict_proba_at([found], (0.3, 1.0), "time"), (1, 2, 3))
    answers(lambda: predictor.predict_proba([found.first(1)]), (1, 3))

    def follow() -> Any:
        stream = predictor.stream(found)
        for state, time in zip(found.states, found.times, strict=True):
            belief = stream.update(state, float(time))
        return np.array([list(belief.values())])

    answers(follow, (1, 3))


@pytest.mark.parametrize("case", [case for case in REACH_CASES if case not in NEURAL_CASES], ids=str)
@settings(max_examples=40, **SLOW)  # type: ignore[arg-type]
@given(data=st.data())
def test_odd_reaches_are_learned_from_or_refused_with_a_reason(case: Case, data: st.DataObject) -> None:
    found = [one for one in (data.draw(nasty_reaches()) for _ in range(5)) if one is not None]
    ordinary = reaches(1) if data.draw(st.booleans()) else []
    answers(lambda: clone(case.predictor).fit([*found, *ordinary]).predict_proba([*found, *_TEST]), (len(found) + 3, 3))


_TEST = reaches(1, seed=5, positions=False)


def test_huge_numbers_are_no_metres() -> None:
    """The example of the report: positions of 1e200 ended in an overflow."""
    for states in ([(1e200, 0.0), (0.0, 1e200)], [(0.0, 0.0), (-2e9, 0.0)]):
        with pytest.raises(ValueError, match=r"metres or pixels, up to 1e\+09"):
            Trajectory(states, candidates=NAMES)
    with pytest.raises(ValueError, match="metres or pixels"):
        Trajectory([(0.0, 0.0)], candidates=("a",), goal_positions=((1e200, 0.0),))


def test_covariances_that_have_no_inverse_are_refused() -> None:
    rng = np.random.default_rng(0)
    along = rng.normal(0, 1e6, (20, 1))
    found = [
        Trajectory(np.outer(np.linspace(0, 1, 10), (x, x)), goal="left", candidates=NAMES) for x in along[:, 0].tolist()
    ]
    with pytest.raises(ValueError, match="`floor`"):
        TimeSeriesGaussian(floor=1e-3).fit(found)
    assert TimeSeriesGaussian(floor=10.0).fit(found).predict_proba([found[0].first(3)]).sum() == pytest.approx(1)


# -- cells that are none of a kitchen ---------------------------------------------------------------------------------


@pytest.mark.parametrize("case", KITCHEN_CASES, ids=str)
@settings(max_examples=60, **SLOW)  # type: ignore[arg-type]
@given(data=st.data())
def test_odd_cells_get_probabilities_or_a_reason(case: Case, data: st.DataObject) -> None:
    near, far = st.integers(0, 4), st.sampled_from((-(2**63), -1, 0, 5, 10**9, 2**62))
    cells = data.draw(st.lists(st.tuples(near, near) | st.tuples(near | far, near | far), min_size=0, max_size=6))
    kind = data.draw(st.sampled_from(("int64", "int8", "uint64", "float64")))
    try:
        with np.errstate(all="ignore"):
            array = np.array(cells, dtype=np.int64).reshape(-1, 2).astype(kind)
        found = Trajectory(
            array, goal="onion", candidates=THREE, layout=ROOM, start=data.draw(st.sampled_from(("", "serving")))
        )
    except ValueError as error:
        in_words(error)
        return
    predictor = fitted(case)
    count = len(predictor.classes_)
    answers(lambda: predictor.predict_proba([found]), (1, count))
    answers(lambda: predictor.predict_proba_at([found]), (1, 9, count))


@pytest.mark.parametrize("costs", ["hard", "soft"])
def test_the_largest_beta_is_that_of_people_who_never_stray(costs: Any) -> None:
    predictor = BayesianGoalPredictor(1e9, costs=costs).fit(people())
    way = people()[0]
    rows = predictor.predict_proba([way.first(1), way.first(2), way])
    assert rows[:, predictor.classes_.tolist().index("onion")].tolist() == [1 / 3, 1.0, 1.0]


def test_what_was_found_right_is_no_excuse_for_others() -> None:
    """The note that a way was checked belongs to that very trajectory."""
    predictor, way = ShortestDistance().fit(people()), people()[0]
    predictor.predict_proba_at([way])
    others = {
        "prefix": way.first(3),
        "not beside": replace(way, start="pot"),
        "ends with": replace(way, goal="dish"),
        "not one step": replace(way, states=way.states[[0, 2, 3, 4]], times=None),  # type: ignore[arg-type]
        "neither floor": replace(way, layout=OvercookedLayout.from_ascii("XOXTX\nX   X\nXVX D\nX   X\nXXSPX")),
    }
    for message, other in others.items():
        with pytest.raises(ValueError, match=message):
            predictor.predict_proba_at([way, other])
    twin = replace(way, participant="Ada")
    assert twin != way
    assert replace(twin, participant=way.participant) == way
