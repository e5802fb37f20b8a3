"""The rule that says when to act on a prediction."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.rollouts import Trajectory
from predictors import (
    BayesianGoalPredictor,
    GoalPredictor,
    ShortestDistance,
    ThresholdDecision,
)
from predictors.checks import example_trajectories
from predictors.evaluation.decisions import Decision, summarise_decisions
from tests.predictors.cases import Case

# -- when to act -------------------------------------------------------------------------------------------------------


class Scripted(GoalPredictor):
    """Believes what the states say: the probability of the first candidate is in the first coordinate."""

    def predict_proba(self, X: Sequence[Trajectory]) -> npt.NDArray[np.float64]:
        rows = np.zeros((len(X), len(self.classes_)))
        for row, walk in zip(rows, X, strict=True):
            first = walk.states[-1, 0] if walk.num_states else 0.5
            row[self.candidate_columns(walk)] = first, 1 - first
        return rows


def scripted(values: Sequence[float], goal: str | None = "a") -> Trajectory:
    times = 10 + 0.5 * np.arange(len(values))
    return Trajectory(np.array(values, dtype=float)[:, None], times, goal=goal, candidates=("a", "b"), participant="p")


def test_decides_at_the_threshold_and_stays() -> None:
    walk = scripted([0.5, 0.7, 0.8, 0.1, 0.0])
    watcher = ThresholdDecision(Scripted().fit([walk]), 0.8).stream(walk)
    assert watcher.belief == {"a": 0.5, "b": 0.5}
    assert watcher.update([0.5], 10.0) is None
    assert watcher.update([0.7], 10.5) is None
    decision = watcher.update([0.8], 11.0)
    assert decision == Decision("a", 0.8, 3, 11.0)
    assert watcher.update([0.1], 11.5) is decision
    assert watcher.decision is decision
    assert watcher.belief == pytest.approx({"a": 0.1, "b": 0.9})


def test_patience_wants_the_same_goal_in_a_row() -> None:
    walk = scripted([0.9, 0.1, 0.1, 0.5, 0.9, 0.9, 0.9, 0.9])
    predictor = Scripted().fit([walk])
    steps = [ThresholdDecision(predictor, 0.8, patience=n).decide([walk])["step"].item() for n in (1, 2, 3, 4)]
    assert steps == [1, 3, 7, 0]  # the last state is the goal's own and not shown
    assert ThresholdDecision(predictor, 0.8, patience=2).decide([walk])["decision"].item() == "b"


def test_ties_decide_nothing() -> None:
    walk = scripted([0.5, 0.5, 0.5])
    assert not ThresholdDecision(Scripted().fit([walk]), 0.3).decide([walk])["decided"].any()


def test_rows_say_when_and_whether_rightly() -> None:
    walks = [scripted([0.6, 0.9, 1, 1]), scripted([0.1, 1, 1, 1]), scripted([0.5] * 4), scripted([0.9, 0.9], None)]
    rule = ThresholdDecision(Scripted().fit(walks), 0.85)
    rows = rule.decide(walks)
    assert rows["decision"].tolist() == ["a", "b", "", "a"]
    assert rows["step"].tolist() == [2, 1, 0, 1]
    assert rows["correct"].tolist()[:3] == [1, 0, 0]
    assert math.isnan(rows["correct"].iloc[3])
    assert rows["fraction"].tolist()[:2] == [0.5, 0.25]
    assert rows["time"].tolist()[:2] == [0.5, 0.0]
    assert rows["lead"].tolist()[:2] == [1.0, 1.5]
    assert rows.loc[2, ["fraction", "time", "lead", "probability"]].isna().all()
    summary = summarise_decisions(rows[:3])
    expected = {"threshold": 0.85, "trajectories": 3, "decided": 2 / 3, "correct": 1 / 3, "precision": 0.5}
    assert summary.loc[0, list(expected)].to_dict() == pytest.approx(expected)
    assert summary.loc[0, ["fraction", "lead"]].tolist() == [0.375, 1.25]
    prefix = Trajectory([[0.9]], goal="a", candidates=("a", "b"), complete=False)
    assert rule.decide([prefix])["step"].item() == 1  # all of a prefix is shown
    assert rule.decide([]).empty
    assert list(rule.decide([]).columns) == list(rows.columns)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    values=st.lists(st.sampled_from([0.0, 0.2, 0.5, 0.75, 0.9, 1.0]), min_size=1, max_size=8),
    threshold=st.sampled_from([0.3, 0.6, 0.75, 0.9, 1.0]),
    patience=st.integers(1, 3),
)
def test_whole_trajectories_are_streams(values: list[float], threshold: float, patience: int) -> None:
    walk = scripted(values)
    rule = ThresholdDecision(Scripted().fit([walk]), threshold, patience=patience)
    watcher = rule.stream(walk)
    for state, time in zip(walk.states[:-1], walk.times[:-1], strict=True):
        watcher.update(state, float(time))
    row = rule.decide([walk]).iloc[0]
    if watcher.decision is None:
        assert not row["decided"]
    else:
        found = (row["decision"], row["probability"], row["step"], row["time"] + 10)
        assert found == (*[getattr(watcher.decision, f) for f in ("goal", "probability", "step", "time")],)


def test_every_predictor_can_decide(case: Case, predictor: GoalPredictor) -> None:
    walks = case.test
    thresholds = [0.4, 0.6, 0.9, 1.0]
    rows = ThresholdDecision(predictor).trade_off(walks, thresholds)
    assert len(rows) == len(walks) * len(thresholds)
    steps = rows["step"].where(rows["decided"], 10**6).to_numpy().reshape(len(thresholds), -1)
    assert (np.diff(steps, axis=0) >= 0).all()  # surer is later
    summary = summarise_decisions(rows)
    assert summary["threshold"].tolist() == thresholds
    rule, walk = ThresholdDecision(predictor, 0.6), walks[0]
    watcher = rule.stream(walk)
    for state, time in zip(walk.states[:-1], walk.times[:-1], strict=True):
        watcher.update(state, float(time))
    step = rule.decide([walk])["step"].item()
    assert step == (0 if watcher.decision is None else watcher.decision.step)


def test_standing_still_is_no_evidence_for_patience() -> None:
    walk = example_trajectories()[0]
    predictor = BayesianGoalPredictor(beta=5.0).fit([walk])
    watcher = ThresholdDecision(predictor, 0.9, patience=2).stream(walk)
    for cell in ((3, 2), (2, 2), (1, 2), (1, 1), (1, 1), (1, 1)):
        assert watcher.update(cell) is None
    assert watcher.update((0, 1)) is not None


def test_bad_rules_and_points() -> None:
    walk = example_trajectories()[0]
    predictor = ShortestDistance().fit([walk])
    for threshold in (0, 1.1, math.nan, True, "high"):
        with pytest.raises(ValueError, match="`threshold` must be a finite number > 0 and <= 1"):
            ThresholdDecision(predictor, threshold)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="`patience`"):
        ThresholdDecision(predictor, patience=0)
    with pytest.raises(TypeError, match="must be a GoalPredictor"):
        ThresholdDecision("shortest-distance")  # type: ignore[arg-type]
    watcher = ThresholdDecision(predictor).stream(walk)
    with pytest.raises(ValueError, match="finite point"):
        watcher.update((np.nan, 1.0))
    with pytest.raises(TypeError, match="put it in a list"):
        ThresholdDecision(predictor).decide(walk)  # type: ignore[arg-type]
