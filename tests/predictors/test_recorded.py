"""Predictors of kitchens on the recorded games."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from sklearn.base import clone

from benchmarks.experiments.prediction import (
    PREDICTORS,
    UNTRAINED,
    accuracy_table,
    compare_with_reference,
    score_recorded_play,
)
from benchmarks.experiments.prediction.run import score_every_trajectory
from benchmarks.experiments.prediction.sweep import LAYOUTS, REFERENCE
from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from predictors import GridLogistic, GridNeighbours, GridNGram


@pytest.mark.data
def test_beliefs_about_recorded_people_are_honest_before_they_move() -> None:
    walks = recorded_trajectories(None, ["cramped_room"])[:120]
    counts = Counter(w.goal for w in walks)
    for predictor in (GridLogistic(), GridNeighbours(k=3), GridNGram()):
        fitted = clone(predictor).fit(walks)
        row = fitted.predict_proba([walks[0].first(0)])[0]
        expected = np.array([counts[name] + 1 for name in fitted.classes_.tolist()]) / (len(walks) + 3)
        assert row == pytest.approx(expected)


@pytest.mark.data
@pytest.mark.slow
def test_all_predictors_are_as_accurate_as_measured_before() -> None:
    table = compare_with_reference(score_recorded_play())
    assert len(table) == len(LAYOUTS) * len(PREDICTORS)
    known = table.dropna(subset=["reference"])
    assert len(known) == len(LAYOUTS) * len(REFERENCE.keys() & {setting.label for setting in PREDICTORS})
    for row in known.itertuples():
        assert row.difference > -0.02, row
    fixed = known[known["predictor"].isin(["shortest distance", "Eq. 1", "Eq. 1 (soft costs)", "MaxEnt IRL"])]
    assert fixed["difference"].abs().max() < 0.003


@pytest.mark.slow
@pytest.mark.data
def test_untrained_predictors_are_as_accurate_as_measured_before() -> None:
    scores = score_recorded_play(predictors=UNTRAINED, repeats=1)
    table = accuracy_table(scores).set_index(["layout", "predictor"])
    expected = {
        "asymmetric_advantages": (502, 0.605, 0.712),
        "coordination_ring": (807, 0.293, 0.337),
        "cramped_room": (424, 0.350, 0.471),
        "random3": (673, 0.448, 0.378),
    }
    assert list(expected) == list(LAYOUTS)
    for layout, (count, nearest, bayesian) in expected.items():
        assert table.loc[(layout, "shortest distance"), "walks"] == count
        assert table.loc[(layout, "shortest distance"), "mean"] == pytest.approx(nearest, abs=0.001)
        assert table.loc[(layout, "Eq. 1"), "mean"] == pytest.approx(bayesian, abs=0.001)
    assert scores.attrs["candidate_set"] == "all"
    assert len(scores) == len(LAYOUTS) * len(UNTRAINED) * 9
    columns = [f"{percent} %" for percent in range(10, 100, 10)]
    assert table.columns.tolist() == ["walks", *columns, "mean", "chance"]


@pytest.mark.slow
@pytest.mark.data
def test_candidates_of_the_running_game_are_judged_apart() -> None:
    rows = score_every_trajectory(layouts=("cramped_room",), fractions=(0.5,), candidate_set="game", repeats=1)
    assert rows.attrs["candidate_set"] == "game"
    assert 0 < rows["trajectory"].nunique() < 424
    with pytest.raises(ValueError, match="no trajectories to evaluate"):
        score_every_trajectory(layouts=("random0",))
