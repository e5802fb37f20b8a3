"""Predictors that cannot be evaluated on some trajectories: a dash and a reason, and the results of the others."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

from legible_envs.rollouts import Trajectory
from predictors import BayesianGoalPredictor, CandidatePredictor, GoalPredictor, StraightLineBayesian, UniformPredictor
from predictors.evaluation import accuracy_at, compare_conditions, evaluate, learning_curve
from predictors.evaluation.figures import accuracy_figure, learning_curve_figure
from predictors.registry import PredictorError
from tests.predictors.cases import reaches
from tests.predictors.evaluation.test_cross_validation import GOALS, people

TO_DISH = [walk for walk in people() if walk.goal == "dish"]
MIXED = ["bayesian", "grid-ngram", "shortest-distance"]
REASON = "all 16 trajectories go to 'dish'; there is nothing to tell apart"


class Blind(CandidatePredictor):
    """Learns nothing, and remembers what it was shown."""

    shown: list[Trajectory] = []  # noqa: RUF012 - of the class, as `clone` makes new ones

    def candidate_probabilities(self, trajectory: Trajectory) -> npt.NDArray[np.float64]:
        return np.full(len(trajectory.candidates), 1 / len(trajectory.candidates))

    @property
    def learns(self) -> bool:
        return False

    def fit(self, X: Sequence[Trajectory], y: object = None) -> Blind:  # type: ignore[override]
        type(self).shown = list(X)
        return super().fit(X)


@pytest.mark.parametrize("rare", ["error", "keep"])
def test_where_all_people_chose_one_goal_predictors_that_learn_nothing_are_evaluated(rare: Any) -> None:
    found = evaluate(MIXED, TO_DISH, rare=rare)
    assert found.predictors == ["bayesian", "shortest-distance"]
    assert found.omitted.to_dict("records") == [{"predictor": "grid-ngram", "reason": REASON}]
    plain = accuracy_at(BayesianGoalPredictor().fit(people()), TO_DISH)
    for _, part in found.table.query("predictor == 'bayesian'").groupby("repeat"):
        ours = part.sort_values(["trajectory", "fraction"])["correct"].to_numpy()
        np.testing.assert_array_equal(ours, plain["correct"].to_numpy())
    assert found.accuracy()["trajectories"].tolist() == [16] * 18
    assert f"without folds ({REASON})" in found.definition
    assert "cross-validation" not in found.definition
    assert found.confusion_matrix("bayesian").loc["dish"].sum() == pytest.approx(16)


def test_tables_and_figures_show_a_dash_and_the_reason() -> None:
    found = evaluate(MIXED, TO_DISH, fractions=(0.3, 0.6))
    summary = found.summary()
    assert summary["predictor"].tolist() == ["bayesian", "shortest-distance", "grid-ngram"]
    assert summary["reason"].tolist() == ["", "", REASON]
    assert summary[["accuracy", "f1", "log_loss"]].isna().all(axis=1).tolist() == [False, False, True]
    assert f"grid-ngram,{',' * 5}" in summary.to_csv(index=False)
    lines = found.to_markdown().splitlines()
    assert lines[0].startswith("| predictor | accuracy | precision |")
    assert lines[2].startswith(f"| bayesian | {summary['accuracy'][0]:.3f} |")
    assert lines[4].startswith("| grid-ngram | \u2013 | \u2013 |")
    note = f"grid-ngram was not evaluated: {REASON}"
    assert lines[-1] == f"\u2013 {note}"
    for table in (found.accuracy(), found.metrics(), summary):
        assert table.attrs["omitted"] == [note]
    stream = io.StringIO()
    accuracy_figure(found).savefig(stream, format="svg")
    assert "grid-ngram was not evaluated" in " ".join(text.strip() for text in stream.getvalue().split())
    compared = compare_conditions(found, factor="predictor", at="mean", unit="trajectory")
    assert compared.means["predictor"].tolist() == ["bayesian", "shortest-distance"]
    assert compared.omitted == (note,)
    alone = evaluate(["bayesian", "grid-ngram"], TO_DISH, fractions=(0.3,))
    with pytest.raises(ValueError, match=r"the only predictor is 'bayesian'; grid-ngram was not evaluated: all 16"):
        compare_conditions(alone, factor="predictor")
    with pytest.raises(ValueError, match=r"no values of predictor 'grid-ngram'.*was not evaluated: all 16"):
        compare_conditions(alone, predictor="grid-ngram")


def test_where_every_predictor_is_evaluated_nothing_is_said() -> None:
    found = evaluate(MIXED, people(), fractions=(0.5,), repeats=1)
    assert len(found.omitted) == 0
    assert found.summary()["reason"].tolist() == ["", "", ""]
    assert "omitted" not in found.accuracy().attrs
    assert "without folds" not in found.definition
    assert not found.to_markdown().endswith("\u2013\n")


@pytest.mark.parametrize(
    ("walks", "options", "message"),
    [
        (people(3), {}, "^4 folds need at least 4 trajectories, got 3$"),
        (people(10), {}, r"^goals with fewer examples than the 4 folds: {'dish': 3, 'tomato': 3}"),
        (TO_DISH, {}, f"^{REASON}$"),
        (TO_DISH, {"rare": "keep"}, f"^{REASON}$"),
        (people(participants=3), {"groups": "participant"}, "at least 4 participants, got 3"),
        (people(7, condition="b"), {"by": "condition"}, "^condition 'b': goals with fewer"),
    ],
)
def test_where_no_predictor_is_left_there_is_one_error(
    walks: list[Trajectory], options: dict[str, Any], message: str
) -> None:
    for names in ("grid-ngram", ["grid-ngram", "grid-logistic"]):
        with pytest.raises(ValueError, match=message):
            evaluate(names, walks, **options)
    assert evaluate(["grid-ngram", "bayesian"], walks, **options).predictors == ["bayesian"]


def test_different_reasons_are_said_of_each() -> None:
    with pytest.raises(ValueError, match=r"grid-ngram: all 16 .*; reach-bayesian: trajectory 0 .*: the states are int"):
        evaluate(["grid-ngram", "reach-bayesian"], TO_DISH)
    found = evaluate(["reach-gaussian", "bayesian"], people(), repeats=1, fractions=(0.5,))
    assert found.predictors == ["bayesian"]
    assert "give positions in metres or pixels as floats" in found.omitted["reason"][0]


def test_a_condition_that_cannot_be_learned_from_costs_that_condition_only() -> None:
    both = [*people(condition="a"), *people(7, condition="b", seed=1)]
    found = evaluate(["bayesian", "grid-ngram"], both, by="condition", repeats=1, fractions=(0.5,))
    assert found.omitted[["predictor", "condition"]].to_numpy().tolist() == [["grid-ngram", "b"]]
    assert found.summary()[["predictor", "condition"]].to_numpy().tolist() == [
        ["bayesian", "a"],
        ["grid-ngram", "a"],
        ["bayesian", "b"],
        ["grid-ngram", "b"],
    ]
    assert "x 1; predictors that learn nothing evaluated without folds in condition 'b' (goals with" in found.definition
    alone = evaluate(["bayesian", "grid-ngram"], both[:48], repeats=1, fractions=(0.5,))
    for name in alone.predictors:
        here = found.table[(found.table["predictor"] == name) & (found.table["condition"] == "a")]
        assert here["correct"].tolist() == alone.table.loc[alone.table["predictor"] == name, "correct"].tolist()
    with pytest.raises(ValueError, match=r"grid-ngram was not evaluated in condition 'b': goals with fewer"):
        compare_conditions(found, predictor="grid-ngram")


def test_a_predictor_that_learns_nothing_is_told_nothing_that_it_could_learn_from() -> None:
    evaluate(Blind(), people(), cv=3, repeats=1)
    assert any(walk.goal and walk.num_states for walk in Blind.shown)  # with folds, as ever
    evaluate(Blind(), TO_DISH)
    assert len(Blind.shown) == 16
    for given, walk in zip(Blind.shown, TO_DISH, strict=True):
        assert (given.goal, given.num_states, given.start, given.candidates) == (None, 0, "serving", GOALS)
        assert given.layout == walk.layout
    # Places are learned from where reaches end: without these there is no telling how far away a goal is.
    left = [one for one in reaches(4, positions=False) if one.goal == "left"]
    with pytest.raises(ValueError, match="unknown places"):
        evaluate("reach-bayesian", left, repeats=1)
    known = [one for one in reaches(4) if one.goal == "left"]
    assert evaluate("reach-bayesian", known, repeats=1).predictors == ["reach-bayesian"]


def test_one_trajectory_is_enough_where_nothing_is_learned() -> None:
    found = evaluate(MIXED, TO_DISH[:1])
    assert found.accuracy()["trajectories"].unique().tolist() == [1]
    assert found.omitted["predictor"].tolist() == ["grid-ngram"]
    with pytest.raises(ValueError, match="can be held out of two trajectories or more, got 1"):
        learning_curve("bayesian", TO_DISH[:1])


def test_learning_curves_leave_out_who_cannot_learn() -> None:
    found = learning_curve(MIXED, TO_DISH, sizes=(0.5, 1.0), repeats=2)
    assert found.summary()["predictor"].unique().tolist() == ["bayesian", "shortest-distance"]
    assert found.omitted.to_dict("records") == [{"predictor": "grid-ngram", "reason": REASON}]
    lines = found.to_markdown().splitlines()
    assert lines[0] == "| predictor | 6 | 12 |"
    assert lines[4] == "| grid-ngram | \u2013 | \u2013 |"
    assert lines[-1] == f"\u2013 grid-ngram was not evaluated: {REASON}"
    stream = io.StringIO()
    learning_curve_figure(found).savefig(stream, format="svg")
    assert "was not evaluated" in stream.getvalue()
    walks = [replace(w, candidates=(w.goal or "", "pot")) for w in people()]
    one = learning_curve(MIXED, walks, sizes=(1, 30), repeats=2)
    assert one.table["predictor"].unique().tolist() == ["bayesian", "shortest-distance"]
    assert "never mention goals" in one.omitted["reason"][0]
    with pytest.raises(ValueError, match="all 16 trajectories go to"):
        learning_curve("grid-ngram", TO_DISH)
    with pytest.raises(ValueError, match="`repeats`"):
        learning_curve("bayesian", TO_DISH, repeats=1.5)  # type: ignore[arg-type]


# -- what is no fact of the data ---------------------------------------------------------------------------------------


class Mine(GoalPredictor):
    """Says what it is told to say."""

    def __init__(self, fault: str = "") -> None:
        self.fault = fault

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        rows: Any = np.zeros((len(X), len(self.classes_)))
        for row, trajectory in zip(rows, X, strict=True):
            row[self.candidate_columns(trajectory)] = 1 / len(trajectory.candidates)
        if self.fault == "inf":
            rows[-1, 0] = np.inf
        elif self.fault == "nan":
            rows[-1, 0] = np.nan
        elif self.fault == "negative":
            rows[-1, :2] = -0.5, 1 / 3 + 0.5 + 1 / 3
        elif self.fault == "sum":
            rows *= 1.01
        elif self.fault == "whole":
            rows = rows.astype(np.int64)
        elif self.fault == "candidates":
            rows[:] = 1 / rows.shape[1]
        elif self.fault == "shape":
            rows = rows[:, :-1]
        return rows


FAULTS = {
    "inf": "must be finite and >= 0, got inf for goal 'dish' of trajectory",
    "nan": "must be finite and >= 0, got nan",
    "negative": r"must be finite and >= 0, got -0\.5",
    "sum": r"must sum to 1, got 1\.01 for trajectory 0",
    "whole": "must be floats, got dtype int64",
    "candidates": r"got probability 0\.\d+ without being one of its candidates",
    "shape": r"expected an array of shape",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_answers_that_are_no_probabilities_are_refused_by_name(fault: str) -> None:
    walks = [replace(w, candidates=(w.goal or "", "pot")) if i % 3 else w for i, w in enumerate(people(30))]
    named = {"fine": "bayesian", "mine": Mine(fault)}
    calls = {
        "evaluate": lambda: evaluate(named, walks, cv=2),
        "learning_curve": lambda: learning_curve(named, walks, sizes=(1.0,)),
    }
    for call in calls.values():
        with pytest.raises(PredictorError, match=f"predictor 'mine': .*{FAULTS[fault]}"):
            call()
    with pytest.raises(PredictorError, match=f"predictor 'Mine': .*{FAULTS[fault]}"):
        accuracy_at(Mine(fault).fit(walks), walks)
    with pytest.raises(ValueError, match=f"Mine: .*{FAULTS[fault]}"):
        Mine(fault).fit(walks).score(walks)


def test_answers_that_are_probabilities_pass() -> None:
    assert evaluate({"mine": Mine()}, people(30), cv=2).summary()["accuracy"][0] == pytest.approx(1 / 3)
    assert not Mine().learns
    assert not UniformPredictor().learns
    assert not StraightLineBayesian().learns
    assert not BayesianGoalPredictor().learns
    assert BayesianGoalPredictor("fit").learns
    assert BayesianGoalPredictor(cell_costs="learned").learns
    assert BayesianGoalPredictor(prior="empirical").learns
    assert not BayesianGoalPredictor(cell_costs=np.ones((5, 5))).learns


# -- reports ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_reports_show_a_dash_and_the_reason(tmp_path: Path) -> None:
    from rich.console import Console

    from benchmarks.reports.prediction_report import evaluate_trajectories, print_evaluation, write_evaluation

    results = evaluate_trajectories(TO_DISH, MIXED, repeats=1)
    stream = io.StringIO()
    print_evaluation(Console(file=stream, width=200), results)
    printed = stream.getvalue()
    assert sum("grid-ngram  " in line and " - " in line for line in printed.splitlines()) == 2
    assert f"grid-ngram was not evaluated: {REASON}" in printed
    write_evaluation(results, tmp_path)
    about = json.loads((tmp_path / "reading.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert about["summary"][2]["accuracy"] is None
    assert about["notes"][0] == f"grid-ngram was not evaluated: {REASON}"
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.search(r">grid-ngram</td>\s*<td", page)
    assert "\u2013</td>" in page
    assert pd.read_csv(tmp_path / "omitted.csv")["predictor"].tolist() == ["grid-ngram"]
    assert set(pd.read_csv(tmp_path / "accuracy.csv")["predictor"]) == {"bayesian", "shortest-distance"}
