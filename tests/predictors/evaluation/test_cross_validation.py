"""Cross-validation, its figures of merit against scikit-learn, and learning curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from sklearn import metrics as theirs

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts import CUTS, Trajectory
from predictors import ShortestDistance
from predictors.base import GoalPredictor
from predictors.checks import example_trajectories
from predictors.evaluation import accuracy_at, compare_conditions, evaluate, learning_curve
from predictors.evaluation.metrics import calibration_error, clustered_interval, log_loss, tied_shares, weighted_scores
from predictors.evaluation.splits import folds
from predictors.registry import PredictorError

KITCHEN = OvercookedLayout.from_ascii("XOXTX\nX   X\nX   D\nX   X\nXXSPX")
GOALS = ("onion", "tomato", "dish")


def people(count: int = 48, participants: int = 8, seed: int = 0, **more: Any) -> list[Trajectory]:
    """Wandering walks that end in one of three stations."""
    rng = np.random.default_rng(seed)
    ends = {"onion": ((1, 1), (0, 1)), "tomato": ((1, 3), (0, 3)), "dish": ((2, 3), (2, 4))}
    walks = []
    for i in range(count):
        goal = GOALS[i % 3]
        last, station = ends[goal]
        cells = [(3, 2)]
        while cells[-1] != last or len(cells) < 3:
            row, col = cells[-1]
            steps = [(1, 0), (-1, 0), (0, 1), (0, -1)]
            toward = (int(np.sign(last[0] - row)), 0) if rng.random() < 0.5 else (0, int(np.sign(last[1] - col)))
            step = steps[rng.integers(4)] if rng.random() < 0.3 or toward == (0, 0) else toward
            if KITCHEN.is_floor((row + step[0], col + step[1])):
                cells.append((row + step[0], col + step[1]))
        labels = {"participant": f"p{rng.integers(participants)}", "start": "serving"} | more
        walks.append(Trajectory(np.array([*cells, station]), goal=goal, candidates=GOALS, layout=KITCHEN, **labels))
    return walks


class Counting(GoalPredictor):
    """Knows how often each goal was reached, and whom it has learned from."""

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Counting:  # type: ignore[override]
        super().fit(X)
        self.counts_ = {name: sum(walk.goal == name for walk in X) for name in self.classes_}
        self.people_ = {walk.participant for walk in X}
        self.seen_ = {id(walk.states.base if walk.states.base is not None else walk.states) for walk in X}
        return self

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        for walk in X:
            base = walk.states.base if walk.states.base is not None else walk.states
            assert id(base) not in self.seen_, "judged on a trajectory it has learned from"
        rows = np.array([[self.counts_[n] * (n in walk.candidates) for n in self.classes_] for walk in X], dtype=float)
        return rows / rows.sum(axis=1, keepdims=True)


class Strangers(Counting):
    """Refuses to be asked about people it knows."""

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        assert not self.people_ & {walk.participant for walk in X}
        return super().predict_proba(X)


# -- cross-validation -------------------------------------------------------------------------------------------------


def test_every_trajectory_is_judged_once_per_repeat_by_who_has_not_seen_it() -> None:
    walks = people()
    found = evaluate([Counting(), "bayesian"], walks, cv=3, repeats=2, fractions=(0.2, 0.6))
    assert len(found.table) == 2 * 2 * 48 * 2
    keys = ["predictor", "repeat", "fraction", "trajectory"]
    assert not found.table.duplicated(keys).any()
    per_fold = found.table.groupby(["predictor", "repeat", "fold", "fraction", "goal"]).size()
    assert set(per_fold) == {5, 6}  # 16 examples of each goal over 3 folds
    goals = {i: walk.goal for i, walk in enumerate(walks)}
    assert found.table["goal"].tolist() == [goals[i] for i in found.table["trajectory"]]
    splits = found.table[found.table["fraction"] == 0.2].groupby("predictor")["fold"].apply(list)
    assert splits["Counting"] == splits["bayesian"]
    repeats = [
        part["fold"].tolist() for _, part in found.table[found.table["predictor"] == "bayesian"].groupby("repeat")
    ]
    assert len(repeats) == 2


def test_participants_are_kept_together_if_asked_to() -> None:
    walks = people()
    found = evaluate(Strangers(), walks, groups="participant", fractions=(0.5,))
    assert (found.table.groupby(["repeat", "participant"])["fold"].nunique() == 1).all()
    with pytest.raises(AssertionError):
        evaluate(Strangers(), walks, fractions=(0.5,))


def test_predictors_that_learn_nothing_score_as_without_folds() -> None:
    walks = people()
    found = evaluate("bayesian", walks, cut="cells")
    plain = accuracy_at(evaluate_fitted(walks), walks, cut="cells")
    for _, part in found.table.groupby("repeat"):
        ours = part.sort_values(["trajectory", "fraction"])["correct"].to_numpy()
        np.testing.assert_array_equal(ours, plain["correct"].to_numpy())
    row, wide = found.accuracy().iloc[4], found.accuracy(level=0.999).iloc[4]
    assert wide["low"] < row["low"] < row["accuracy"] < row["high"] < wide["high"]
    means = plain.groupby("fraction")["correct"].mean()
    np.testing.assert_allclose(found.accuracy()["accuracy"], means)
    assert CUTS["cells"] in found.definition
    assert found.accuracy().attrs["definition"] == CUTS["cells"]


def evaluate_fitted(walks: Sequence[Trajectory]) -> GoalPredictor:
    from predictors import BayesianGoalPredictor

    return BayesianGoalPredictor().fit(walks)


def test_the_seed_decides_the_splits() -> None:
    walks = people()
    a, b, c = (evaluate("bayesian", walks, seed=seed, fractions=(0.5,)).table for seed in (1, 1, 2))
    assert a.equals(b)
    assert a["fold"].tolist() != c["fold"].tolist() or a["trajectory"].tolist() != c["trajectory"].tolist()


def test_conditions_are_learned_apart_and_then_compared() -> None:
    one, two = people(condition="a", participants=4), people(30, participants=4, seed=1, condition="b")
    both = [walk for pair in zip(one, two, strict=False) for walk in pair] + one[30:]
    found = evaluate("bayesian", both, by="condition", fractions=(0.3, 0.6))
    alone = evaluate("bayesian", one, fractions=(0.3, 0.6))
    part = found.accuracy().query("condition == 'a'")
    np.testing.assert_allclose(part["accuracy"], alone.accuracy()["accuracy"])
    assert found.table["condition"].tolist() == [both[i].condition for i in found.table["trajectory"]]
    assert found.confusion_matrix(condition="b").to_numpy().sum() == pytest.approx(30)
    assert compare_conditions(found, unit="trajectory").means["n"].tolist()[:2] == [48, 30]
    assert compare_conditions(found).design == "within"  # the same four people


@pytest.mark.parametrize(
    ("walks", "options", "message"),
    [
        ([], {}, "no trajectories"),
        (people(participant=""), {"groups": "participant"}, "names no participant"),
        (people(), {"cv": 1}, "cv"),
        (people(), {"repeats": 0}, "repeats"),
        (people(), {"fractions": ()}, "fractions"),
        (people(), {"cut": "halves"}, "unknown cut"),
        (people(), {"groups": "layout"}, "groups"),
        (people(), {"by": "start"}, "by"),
        (people(), {"rare": "drop"}, "rare"),
        ([*people(), people()[0].first(2)], {}, "trajectory 48 .*: it is a prefix"),
        ([*people(), replace(people()[0], goal=None)], {}, "trajectory 48 .*: it has no known goal"),
        ([*people(), replace(people()[0], candidate_set="game")], {}, "candidate sets"),
    ],
)
def test_bad_input_is_refused_in_words(walks: list[Trajectory], options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        evaluate("bayesian", walks, **options)


def test_rare_goals_are_judged_if_asked_to() -> None:
    lonely = [replace(w, candidates=(*GOALS, "pot")) for w in people()]
    pot = Trajectory(np.array([(3, 2), (3, 3), (4, 3)]), goal="pot", candidates=(*GOALS, "pot"), layout=KITCHEN)
    with pytest.raises(ValueError, match=r"{'pot': 1}"):
        evaluate("grid-ngram", [*lonely, pot])
    found = evaluate("bayesian", [*lonely, pot], rare="keep", fractions=(0.5,))
    assert (found.table["trajectory"] == 48).sum() == 3


def test_folds_that_teach_nothing_are_refused() -> None:
    # Grouped, the one person who walks to the dish is either judged or learned from.
    walks = [replace(w, participant="a" if w.goal == "dish" else "b") for w in people() if w.goal != "tomato"]
    with pytest.raises(ValueError, match=r"leaves only goal '(onion|dish)' to learn from"):
        evaluate("grid-ngram", walks, cv=2, groups="participant")
    odd = [w for w in people() if w.goal != "dish"]
    odd = [replace(w, candidates=GOALS if w.participant == "p0" else GOALS[:2]) for w in odd]
    with pytest.raises(ValueError, match=r"goals \['dish'\] are candidates only in the held-out part"):
        list(folds(odd, 2, np.random.default_rng(0), groups="participant"))


def test_predictors_need_names_of_their_own() -> None:
    walks = people()
    with pytest.raises(ValueError, match="several predictors are called 'ShortestDistance'"):
        evaluate([ShortestDistance(), ShortestDistance(metric="geodesic")], walks)
    named = {"far": ShortestDistance(), "near": "bayesian"}
    assert evaluate(named, walks, fractions=(0.5,)).predictors == ["far", "near"]
    with pytest.raises(ValueError, match="no predictors"):
        evaluate([], walks)
    with pytest.raises(PredictorError, match="nobody"):
        evaluate("nobody", walks)
    with pytest.raises(TypeError, match="got str"):
        evaluate("bayesian", ["walk"])  # type: ignore[list-item]


# -- figures of merit -------------------------------------------------------------------------------------------------


def random_predictions(rng: np.random.Generator, n: int = 200, k: int = 4) -> tuple[Any, Any]:
    probabilities = rng.dirichlet(np.ones(k) * 0.7, n)
    return probabilities, rng.choice(k, n, p=[0.5, 0.3, 0.15, 0.05])


def confusion(probabilities: Any, goals: Any, k: int = 4) -> Any:
    matrix = np.zeros((k, k))
    np.add.at(matrix, goals, tied_shares(probabilities))
    return matrix


def test_scores_are_scikit_learns() -> None:
    probabilities, goals = random_predictions(np.random.default_rng(0))
    ours = weighted_scores(confusion(probabilities, goals))
    labels = probabilities.argmax(axis=1)
    expected = theirs.precision_recall_fscore_support(goals, labels, average="weighted", zero_division=0)
    assert (ours["precision"], ours["recall"], ours["f1"]) == pytest.approx(expected[:3])
    assert log_loss(probabilities[np.arange(200), goals]) == pytest.approx(theirs.log_loss(goals, probabilities))
    assert log_loss(np.array([0.0, 1.0])) == pytest.approx(theirs.log_loss([0, 1], [[0.0, 1.0], [0.0, 1.0]]))


def test_ties_are_samples_split_into_fractions() -> None:
    rng = np.random.default_rng(1)
    probabilities, goals = rng.integers(0, 3, (150, 4)) / 10 + 0.01, rng.integers(0, 4, 150)
    ours = weighted_scores(confusion(probabilities, goals))
    truth, label, weight = [], [], []
    for row, goal in zip(probabilities, goals, strict=True):
        top = np.flatnonzero(row == row.max())
        truth += [goal] * len(top)
        label += top.tolist()
        weight += [1 / len(top)] * len(top)
    expected = theirs.precision_recall_fscore_support(
        truth, label, average="weighted", zero_division=0, sample_weight=weight
    )
    assert (ours["precision"], ours["recall"], ours["f1"]) == pytest.approx(expected[:3])


def test_calibration_error_by_hand() -> None:
    # Bins (.5, .6]: confidence .6 and .55, one right: |.5 - .575| * 2; bin (.9, 1]: 1.0, right: 0.
    assert calibration_error(np.array([0.6, 0.55, 1.0]), np.array([1.0, 0.0, 1.0])) == pytest.approx(0.15 / 3)
    rng = np.random.default_rng(0)
    confidence = rng.uniform(0.2, 1, 200_000)
    right = (rng.random(200_000) < confidence).astype(float)
    assert calibration_error(confidence, right) < 0.01
    assert calibration_error(confidence, np.zeros(200_000)) == pytest.approx(confidence.mean())


def test_the_evaluation_reports_these_figures() -> None:
    walks = people(60)
    found = evaluate("bayesian", walks, cv=3, repeats=1, fractions=(0.4,))
    row, table = found.metrics().iloc[0], found.table
    assert row["accuracy"] == pytest.approx(table["correct"].mean())
    assert row["recall"] == pytest.approx(row["accuracy"])  # weighted recall is accuracy, ties shared out
    assert row["log_loss"] == pytest.approx(-np.log(table["probability"]).mean())
    assert row["calibration_error"] == pytest.approx(
        calibration_error(table["confidence"].to_numpy(), table["correct"].to_numpy())
    )
    matrix = found.confusion_matrix()
    assert matrix.to_numpy().sum() == pytest.approx(60)
    assert matrix.sum(axis=1).to_dict() == pytest.approx(dict.fromkeys(sorted(GOALS), 20))
    assert np.diag(matrix).sum() == pytest.approx(table["correct"].sum())
    assert found.confusion_matrix(normalise=True).sum(axis=1).tolist() == pytest.approx([1, 1, 1])
    assert found.confusion_matrix(fraction=0.4).equals(matrix)
    with pytest.raises(ValueError, match=r"fraction 0\.5 was not observed"):
        found.confusion_matrix(fraction=0.5)
    with pytest.raises(ValueError, match="'nobody'"):
        found.confusion_matrix("nobody")
    summary = found.summary().iloc[0]
    assert (summary["f1"], summary["trajectories"]) == (pytest.approx(row["f1"]), 60)


def test_strict_ties_count_against_recall() -> None:
    found = evaluate("bayesian", people(), fractions=(0.1,), ties="strict")
    row = found.metrics().iloc[0]
    assert row["recall"] == row["accuracy"] == 0.0  # one cell tells nothing: all goals tie


# -- confidence -------------------------------------------------------------------------------------------------------


def test_bands_are_t_intervals_where_every_unit_has_one_value() -> None:
    from scipy import stats

    values = np.random.default_rng(0).uniform(0.3, 0.7, 12)
    mean, low, high = clustered_interval(values, np.arange(12))
    expected = stats.t.interval(0.95, 11, values.mean(), stats.sem(values))
    assert (mean, low, high) == pytest.approx((values.mean(), *expected))
    assert np.isnan(clustered_interval(values, np.zeros(12, dtype=int))[1:]).all()
    assert clustered_interval(np.ones(5), np.arange(5)) == (1.0, 1.0, 1.0)


def test_bands_hold_the_truth_as_often_as_they_say_although_people_differ() -> None:
    rng, held, naive, rounds = np.random.default_rng(5), 0, 0, 400
    for _ in range(rounds):
        units = np.repeat(np.arange(20), 15)
        values = (rng.random(300) < np.repeat(rng.beta(2, 2, 20), 15)).astype(float)
        _, low, high = clustered_interval(values, units)
        held += low <= 0.5 <= high
        _, low, high = clustered_interval(values, np.arange(300))
        naive += low <= 0.5 <= high
    assert 0.91 <= held / rounds <= 0.98
    assert naive / rounds < 0.8


def test_the_band_is_the_clustered_interval_of_trajectory_means() -> None:
    walks = people()
    found = evaluate(Counting(), walks, fractions=(0.5,))
    means = found.table.groupby("trajectory")["correct"].mean().sort_index()
    units = np.unique([walks[i].participant for i in means.index], return_inverse=True)[1]
    row = found.accuracy().iloc[0]
    assert (row["accuracy"], row["low"], row["high"]) == pytest.approx(clustered_interval(means.to_numpy(), units))
    assert found.accuracy().attrs["unit"] == "participant"
    nameless = evaluate(Counting(), people(participant=""), fractions=(0.5,))
    assert nameless.accuracy().attrs["unit"] == "trajectory"
    for options, message in (({"unit": "participant"}, "names? no"), ({"unit": "x"}, "unit"), ({"level": 2}, "level")):
        with pytest.raises(ValueError, match=message):
            nameless.accuracy(**options)


# -- learning curves --------------------------------------------------------------------------------------------------


class Remembering(Counting):
    """Records what it was given."""

    given: list[tuple[int, frozenset[int]]] = []  # noqa: RUF012

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Remembering:  # type: ignore[override]
        super().fit(X)
        Remembering.given.append((len(X), frozenset(id(walk) for walk in X)))
        self.counts_["onion"] += 0  # ties stay ties
        return self


def test_learning_curves_nest_their_training_sets_and_hold_the_test_share() -> None:
    Remembering.given.clear()
    walks = people(60)
    found = learning_curve(Remembering(), walks, sizes=(6, 15, 1.0), test_share=0.25, repeats=3, fractions=(0.3, 0.9))
    assert found.table["judged"].unique().tolist() == [15]
    assert found.table["size"].unique().tolist() == [6, 15, 45]
    for repeat in range(3):
        small, middle, whole = Remembering.given[3 * repeat : 3 * repeat + 3]
        assert small[1] < middle[1] < whole[1]
        goals = [walk.goal for walk in walks if id(walk) in small[1]]
        assert {goals.count(goal) for goal in GOALS} == {2}
    assert len({whole for _, whole in Remembering.given[2::3]}) == 3
    summary = found.summary()
    assert summary["repeats"].tolist() == [3, 3, 3]
    assert (summary["low"] <= summary["accuracy"]).all()
    assert "25%" in found.definition
    assert CUTS["steps"] in found.definition


def test_learning_curves_can_hold_out_people() -> None:
    found = learning_curve(Strangers(), people(60), sizes=(0.5, 1.0), groups="participant", repeats=2)
    assert set(found.table["repeat"]) == {0, 1}
    assert found.summary()["repeats"].tolist() == [
        2,
        2,
    ]  # the same sizes in all repeats, however many walks people have


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sizes": (0,)}, "size 0"),
        ({"sizes": (1000,)}, "size 1000"),
        ({"sizes": (1.5,)}, r"size 1\.5"),
        ({"sizes": ()}, "at least one"),
        ({"test_share": 1.0}, "test_share"),
        ({"groups": "layout"}, "groups"),
    ],
)
def test_bad_sizes_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        learning_curve("bayesian", people(), **options)


def test_small_training_sets_must_have_heard_of_all_goals() -> None:
    walks = [replace(w, candidates=(w.goal or "", "pot")) for w in people()]
    with pytest.raises(ValueError, match="never mention goals"):
        learning_curve("grid-ngram", walks, sizes=(1,))


def test_the_examples_of_the_contract_can_be_evaluated() -> None:
    assert len(evaluate("bayesian", example_trajectories(), cv=2, repeats=1, rare="keep").table) == 8 * 9


@pytest.mark.slow
@pytest.mark.data
def test_recorded_people_are_read_as_measured_before() -> None:
    from legible_envs.datasets.overcooked_2019 import recorded_trajectories

    walks = recorded_trajectories(None, ["cramped_room"])
    found = evaluate(["bayesian", "shortest-distance"], walks, cut="cells")
    assert found.summary()["trajectories"].tolist() == [424, 424]
    assert found.summary()["accuracy"].tolist() == pytest.approx([0.471, 0.350], abs=0.001)
    grouped = evaluate("bayesian", walks, cut="cells", groups="participant", repeats=1)
    assert grouped.summary()["accuracy"].iloc[0] == pytest.approx(0.471, abs=0.001)
    compared = compare_conditions(found, factor="predictor", at="mean")
    assert (compared.design, compared.means["n"].tolist()) == ("within", [32, 32])
