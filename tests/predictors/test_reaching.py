"""Predictors of reaches: on synthetic reaches with known answers, on hostile input, and on real pointing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from sklearn.base import clone

from legible_envs.rollouts import Trajectory, load_trajectories, save_trajectories
from predictors import (
    GoalPredictor,
    ReachLogistic,
    ReachNeighbours,
    ShortestDistance,
    StraightLineBayesian,
    TimeSeriesGaussian,
    make_predictor,
)
from predictors.reaching.ellipses import draw_reaches, ellipse_table, spread_table
from predictors.reaching.features import Reach, resample
from tests.predictors.cases import NAMES, PLACES, POSITIONS, REACH_CASES, Case, fitted, reaches
from tests.support.pointing import grouped_accuracy, load_pointing, needs_pointing

TRAIN, TEST = reaches(), reaches(5, seed=1)
every = pytest.mark.parametrize("case", REACH_CASES, ids=str)


@every
def test_more_of_a_reach_is_predicted_better(case: Case) -> None:
    predictor = fitted(case)
    early, late = (predictor.score(TEST, fractions=(f,)) for f in (0.1, 0.9))
    assert late == pytest.approx(1.0)
    assert early < late
    assert predictor.score(TEST, fractions=(0.5,)) > 0.6


@every
def test_candidates_may_be_fewer_and_in_another_order(case: Case) -> None:
    predictor = fitted(case)
    walk = TEST[0]
    two = ("right", "left")
    places = tuple(PLACES[name] for name in two)
    part = Trajectory(walk.states[:9], walk.times[:9], candidates=two, goal_positions=places, complete=False)
    row = predictor.predict_proba([part])[0]
    assert row[list(predictor.classes_).index("middle")] == 0
    assert row.sum() == pytest.approx(1.0)
    if not isinstance(predictor, ShortestDistance):
        full = predictor.predict_proba([walk.first(9)])[0]
        assert row[0] / row[2] == pytest.approx(full[0] / full[2])


@every
@pytest.mark.parametrize("walks", [TRAIN[:3], [TRAIN[0]]], ids=["one reach to every goal", "one reach at all"])
def test_goals_with_one_example_are_learned_from(case: Case, walks: list[Trajectory]) -> None:
    predictor = clone(case.predictor).fit(walks)
    rows = predictor.predict_proba_at(walks)
    assert np.isfinite(rows).all()
    assert rows.sum(axis=2) == pytest.approx(1.0)
    if not isinstance(predictor, ReachLogistic | ReachNeighbours):
        assert predictor.predict(walks).tolist() == [walk.goal for walk in walks]


@every
def test_states_of_another_dimension_are_refused(case: Case) -> None:
    predictor = fitted(case)
    solid = Trajectory(np.arange(9.0).reshape(3, 3), candidates=NAMES, goal="left")
    with pytest.raises(ValueError, match="dimension 2 as in `fit`, got 3"):
        predictor.predict_proba([solid])
    with pytest.raises(ValueError, match="dimension"):
        clone(predictor).fit([*TRAIN, solid])


def test_positions_must_be_finite() -> None:
    with pytest.raises(ValueError, match="state 1, coordinate 0 is nan"):
        Trajectory([(0.0, 0.0), (np.nan, 1.0)], candidates=NAMES)
    with pytest.raises(ValueError, match="mixed dimensions"):
        Trajectory([(0.0, 0.0), (1.0,)], candidates=NAMES)  # type: ignore[arg-type]


@pytest.mark.parametrize("predictor", [TimeSeriesGaussian(), ReachLogistic()])
@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (TRAIN[0].first(5), "is a prefix"),
        (Trajectory(np.zeros((3, 2)), candidates=NAMES), "no known goal"),
        (Trajectory(np.zeros((1, 2)), candidates=NAMES, goal="left"), "1 state and no duration"),
        (Trajectory(np.zeros((3, 2)), np.zeros(3), candidates=NAMES, goal="left"), "no duration"),
    ],
)
def test_learns_from_complete_reaches_only(predictor: GoalPredictor, bad: Trajectory, message: str) -> None:
    with pytest.raises(ValueError, match=rf"trajectory 1.*{message}"):
        predictor.fit([TRAIN[0], bad])


@pytest.mark.parametrize(
    "options",
    [
        {"n_samples": 1},
        {"n_samples": 5.0},
        {"alignment": "dtw"},
        {"online": "offline"},
        {"band": 1.5},
        {"floor": 0.0},
        {"velocity_floor": np.nan},
        {"half_life": -1.0},
    ],
)
def test_parameters_out_of_range(options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(options))):
        TimeSeriesGaussian(**options).fit(TRAIN)


def test_parameters_of_the_others() -> None:
    for predictor in (
        StraightLineBayesian(-1.0),
        ReachLogistic(C=0.0),
        ReachLogistic(degree=3),
        ReachNeighbours(0),
    ):
        with pytest.raises(ValueError, match="must be"):
            predictor.fit(TRAIN)
    with pytest.raises(ValueError, match="euclidean"):
        ShortestDistance("taxi").fit(TRAIN).predict_proba(TEST)  # type: ignore[arg-type]


# -- the Gaussian -----------------------------------------------------------------------------------------------------


def test_gaussian_by_hand() -> None:
    """With regular samples, no alignment and the clock, every step is a plain Gaussian."""
    rng = np.random.default_rng(3)
    clock = np.linspace(0, 1, 11)
    walks = [
        Trajectory(
            np.r_[[[0, 0]], rng.normal(size=(10, 2)).cumsum(axis=0)] + 5, clock, goal=goal, candidates=("a", "b")
        )
        for goal in "aabbbab"
    ]
    gaussian = TimeSeriesGaussian(11, online="index", floor=0.5).fit(walks)
    for column, goal in enumerate("ab"):
        own = np.array([walk.states - walk.states[0] for walk in walks if walk.goal == goal])
        assert gaussian.means_[column] == pytest.approx(own.mean(axis=0))
        for step in range(11):
            expected = np.cov(own[:, step].T) + 0.25 * np.eye(2)
            assert gaussian.covariances_[column, step] == pytest.approx(expected)
    seen = walks[0].first(6)
    moved = seen.states - seen.states[0]
    scores = [
        np.mean(
            [
                multivariate_normal(gaussian.means_[g, k], gaussian.covariances_[g, k]).logpdf(moved[k])
                for k in range(1, 6)
            ]
        )
        for g in range(2)
    ]
    expected = np.exp(scores) / np.exp(scores).sum()
    assert gaussian.predict_proba([seen])[0] == pytest.approx(expected)
    newest = TimeSeriesGaussian(11, online="index", floor=0.5, half_life=0).fit(walks)
    last = [multivariate_normal(gaussian.means_[g, 5], gaussian.covariances_[g, 5]).logpdf(moved[5]) for g in range(2)]
    assert newest.predict_proba([seen])[0] == pytest.approx(np.exp(last) / np.exp(last).sum())


def test_gaussian_borrows_covariances_and_gives_unreached_goals_nothing() -> None:
    walks = [walk for walk in TRAIN if walk.goal == "left"] + [TRAIN[1]]
    gaussian = TimeSeriesGaussian().fit(walks)
    assert gaussian.goals_.tolist() == ["left", "middle"]
    assert gaussian.covariances_[1] == pytest.approx(gaussian.covariances_[0])
    assert (gaussian.predict_proba(TEST)[:, 2] == 0).all()
    assert gaussian.predict_proba([TEST[0].first(0)])[0].tolist() == [0.5, 0.5, 0.0]
    unreached = Trajectory(np.zeros((2, 2)), candidates=("right",))
    assert gaussian.predict_proba([unreached])[0].tolist() == [0, 0, 1]
    lonely = TimeSeriesGaussian(floor=0.02).fit([TRAIN[0]])
    assert lonely.covariances_[0] == pytest.approx(np.tile(0.02**2 * np.eye(2), (50, 1, 1)))


def test_gaussian_does_not_care_where_or_when_a_reach_begins() -> None:
    gaussian = TimeSeriesGaussian(velocity=True).fit(TRAIN)
    walk = TEST[0]
    moved = Trajectory(walk.states + np.array([7.0, -3.0]), walk.times + 40, goal=walk.goal, candidates=NAMES)
    assert gaussian.predict_proba([moved.first(9)]) == pytest.approx(gaussian.predict_proba([walk.first(9)]), abs=1e-9)


def test_alignment_shrinks_covariances() -> None:
    kinds = ("none", "mean", "medoid", "dba")
    found = {kind: spread_table(TimeSeriesGaussian(alignment=kind, band=0.2, floor=1e-3).fit(TRAIN)) for kind in kinds}
    for kind in kinds[1:]:
        for size in ("trace", "determinant"):
            assert found[kind][size].mean() < 0.8 * found["none"][size].mean()


def test_a_pause_in_the_data_does_not_tear_the_alignment() -> None:
    gaussian = TimeSeriesGaussian().fit(TRAIN)
    for walk in TEST[:6]:
        sparse = [0, 1, walk.num_states - 3, walk.num_states - 1]
        part = Trajectory(walk.states[sparse], walk.times[sparse], candidates=NAMES, complete=False)
        row = gaussian.predict_proba([part])[0]
        assert gaussian.classes_[row.argmax()] == walk.goal


def test_fraction_of_a_reach_that_is_still_going_on_is_unknown() -> None:
    gaussian = TimeSeriesGaussian(online="fraction").fit(TRAIN)
    assert gaussian.score(TEST, fractions=(0.9,)) == 1.0
    whole = gaussian.predict_proba(TEST)
    assert whole == pytest.approx(gaussian.predict_proba_at(TEST, (1.0,), "arc")[:, 0])
    with pytest.raises(ValueError, match="duration of the whole reach"):
        gaussian.predict_proba([TEST[0].first(5)])
    with pytest.raises(ValueError, match="duration of the whole reach"):
        gaussian.stream(TEST[0])


def test_velocities_look_backwards_and_resampling_keeps_the_ends() -> None:
    walk = Trajectory([(1.0, 1.0), (1.0, 2.0), (3.0, 2.0), (3.0, 5.0)], [2.0, 2.5, 2.5, 4.5], candidates=NAMES)
    features = Reach(walk).features(True)
    assert features.tolist() == [[0, 0, 0, 0], [0, 1, 0, 2], [2, 1, 0, 2], [2, 4, 0, 1.5]]
    assert resample(np.array([[0.0], [4.0]]), np.array([1.0, 3.0]), 5).ravel().tolist() == [0, 1, 2, 3, 4]


# -- places -----------------------------------------------------------------------------------------------------------


def test_straight_lines_by_hand() -> None:
    walk = TEST[0].first(12)
    here, start = walk.states[-1], walk.states[0]
    ways = np.array([np.linalg.norm(np.array(place) - here) for place in POSITIONS])
    whole = np.array([np.linalg.norm(np.array(place) - start) for place in POSITIONS])
    weights = np.exp(-20.0 * (ways - whole))
    assert StraightLineBayesian().fit(TRAIN).predict_proba([walk])[0] == pytest.approx(weights / weights.sum())
    nearest = ShortestDistance("euclidean").fit(TRAIN)
    assert nearest.predict([walk]).tolist() == [NAMES[ways.argmin()]]
    between = Trajectory([(0.0, 0.0), (0.0, 0.1)], candidates=("left", "right"), goal_positions=((-1, 0), (1, 0)))
    assert nearest.predict_proba([between])[0].tolist() == [0.5, 0.0, 0.5]


def test_places_are_told_or_learned_from_ends() -> None:
    silent = reaches(6, seed=4, goal_positions=None)
    nearest = ShortestDistance("euclidean").fit(silent)
    for name, place in PLACES.items():
        assert nearest.places_[name] == pytest.approx(place, abs=0.03)
    assert nearest.score(silent, fractions=(0.9,)) == 1.0
    unseen = ShortestDistance("euclidean").fit([walk for walk in silent if walk.goal != "left"])
    with pytest.raises(ValueError, match=r"\['left'\]"):
        unseen.predict_proba(silent)
    assert unseen.predict_proba(TEST).shape == (15, 3)  # these say where their goals are


def test_goal_positions_are_checked_compared_and_kept_in_files(tmp_path: Any) -> None:
    path = save_trajectories(tmp_path / "reaches.npz", TEST)
    assert load_trajectories(path) == TEST
    with np.load(path) as file:
        assert int(file["schema"]) == 2
    walk = TEST[0]
    other = Trajectory(walk.states, walk.times, goal=walk.goal, candidates=NAMES, participant=walk.participant)
    assert other != walk
    for wrong in (((0.0, 0.0),), ((0.0,),) * 3, ((0.0, np.inf),) * 3, ((0.0, 0.0), (0.0,), (1.0, 1.0)), "abc"):
        with pytest.raises(ValueError, match="position"):
            Trajectory(walk.states, candidates=NAMES, goal_positions=wrong)  # type: ignore[arg-type]


# -- figures ----------------------------------------------------------------------------------------------------------


def test_spread_and_ellipses() -> None:
    gaussian = TimeSeriesGaussian(20, velocity=True).fit(TRAIN)
    spread = spread_table(gaussian)
    assert len(spread) == 60
    row = spread[(spread["goal"] == "middle") & (spread["step"] == 7)].iloc[0]
    covariance = gaussian.covariances_[1, 7, :2, :2]
    assert row["determinant"] == pytest.approx(np.linalg.det(covariance))
    assert row["trace"] == pytest.approx(covariance[0, 0] + covariance[1, 1])
    ellipses = ellipse_table(gaussian, deviations=1.0, every=7)
    assert sorted(set(ellipses["step"])) == [0, 7, 14, 19]
    one = ellipses[(ellipses["goal"] == "middle") & (ellipses["step"] == 7)].iloc[0]
    turn = np.array([[np.cos(one["angle"]), -np.sin(one["angle"])], [np.sin(one["angle"]), np.cos(one["angle"])]])
    assert turn @ np.diag([one["major"] ** 2, one["minor"] ** 2]) @ turn.T == pytest.approx(covariance)
    assert one["major"] >= one["minor"] > 0
    image = draw_reaches(gaussian, size=200)
    assert image.shape == (200, 200, 3)
    assert image.dtype == np.uint8
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 20
    line = [Trajectory(walk.states[:, :1], walk.times, goal=walk.goal, candidates=NAMES) for walk in TRAIN]
    with pytest.raises(ValueError, match="plane"):
        draw_reaches(TimeSeriesGaussian().fit(line))


# -- real pointing ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@needs_pointing
@pytest.mark.parametrize(
    ("predictor", "published"),
    [
        (ShortestDistance("euclidean"), 0.754),
        (StraightLineBayesian(), 0.759),
        (TimeSeriesGaussian(online="index"), 0.723),
        (TimeSeriesGaussian(), 0.711),
        (TimeSeriesGaussian(online="index", velocity=True), 0.757),
        (ReachLogistic(), 0.776),
    ],
    ids=lambda value: repr(value)[:50],
)
def test_real_pointing_reaches_the_published_accuracy(predictor: GoalPredictor, published: float) -> None:
    assert grouped_accuracy(predictor) == pytest.approx(published, abs=0.015)


@pytest.mark.slow
@needs_pointing
def test_newest_sample_and_velocity_read_real_pointing_better() -> None:
    assert grouped_accuracy(TimeSeriesGaussian(velocity=True, half_life=0)) > 0.77
    assert grouped_accuracy(ReachNeighbours()) > 0.78


@pytest.mark.slow
@needs_pointing
def test_literal_warping_to_a_medoid_is_the_worst_on_real_pointing() -> None:
    literal = TimeSeriesGaussian(alignment="medoid", band=None)
    assert 0.4 < grouped_accuracy(literal) < 0.69


@needs_pointing
def test_real_pointing_leaks_no_target_in_its_first_sample() -> None:
    walks = list(load_pointing())
    first = [walk.first(1) for walk in walks]
    for name in ("reach-gaussian", "reach-bayesian"):
        assert make_predictor(name).fit(walks).score(first) == pytest.approx(0.1)
