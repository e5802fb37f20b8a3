"""A recording of every tick says the same as one of every step: standing still on a cell is no progress anywhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sklearn.base import clone

from legible_envs.overcooked.humans import fit_rationality
from legible_envs.rollouts import Trajectory, load_trajectories, read_csv, save_trajectories, write_csv
from predictors import GoalPredictor, ThresholdDecision
from predictors.evaluation import compare_conditions, evaluate, learning_curve
from tests.predictors.cases import CASES, NEURAL_CASES, ROOM, Case, fitted, people
from tests.predictors.evaluation.test_cross_validation import people as wanderers

ON_GRIDS = [case for case in CASES if case.kind == "kitchen"]
ALL_FRACTIONS = tuple(np.linspace(0.01, 1, 34).tolist())


def ticks(found: Trajectory, rng: np.random.Generator) -> tuple[Any, Any]:
    """Cells and times of a recording that looks every tick: most states come several times."""
    counts = rng.integers(1, 5, found.num_states)
    counts[rng.integers(found.num_states)] += 1  # one at least is repeated
    cells = np.repeat(found.states, counts, axis=0)
    arrived = np.concatenate([[0], np.cumsum(counts)[:-1]])
    times = np.empty(len(cells))
    for first, count, start, end in zip(
        arrived, counts, found.times, [*found.times[1:], found.times[-1] + 1], strict=True
    ):
        times[first : first + count] = np.linspace(start, end, count, endpoint=False)
    return cells, times


def recorded(found: Trajectory, rng: np.random.Generator) -> Trajectory:
    cells, times = ticks(found, rng)
    return replace(found, states=cells, times=times)


def test_the_example_of_the_report() -> None:
    """At 70 % of the way Eq. 1 is sure; cut by ticks, of which most are spent at the start, it would know nothing."""
    from predictors import BayesianGoalPredictor

    way = [(3, 2), (3, 1), (2, 1), (1, 1), (0, 1)]
    idle = [(3, 2)] * 20 + way
    kinds = [Trajectory(cells, goal="onion", candidates=("onion", "tomato"), layout=ROOM) for cells in (way, idle)]
    for found in kinds:
        assert found.prefix_length(0.7) == 4
        assert BayesianGoalPredictor().fit(kinds).score([found], fractions=(0.7,)) == 1.0


@pytest.mark.parametrize("case", ON_GRIDS, ids=str)
def test_predictions_do_not_count_ticks(case: Case) -> None:
    predictor, rng = fitted(case), np.random.default_rng(0)
    for found in case.test:
        for _ in range(3):
            cells, times = ticks(found, rng)
            idle = replace(found, states=cells, times=times)
            assert idle.num_states == found.num_states < len(cells)
            np.testing.assert_array_equal(predictor.predict_proba([idle]), predictor.predict_proba([found]))
            for cut in ("steps", "cells", "arc"):
                np.testing.assert_array_equal(
                    predictor.predict_proba_at([idle], ALL_FRACTIONS, cut),  # type: ignore[arg-type]
                    predictor.predict_proba_at([found], ALL_FRACTIONS, cut),  # type: ignore[arg-type]
                )
            check_streams(predictor, found, cells, times)
    idle_people = [recorded(found, rng) for found in case.test]
    assert predictor.score(idle_people) == predictor.score(case.test)
    columns = ["decided", "decision", "probability", "step", "fraction", "correct"]
    rule = ThresholdDecision(predictor, 0.5)
    assert rule.decide(idle_people)[columns].equals(rule.decide(case.test)[columns])


def check_streams(predictor: GoalPredictor, found: Trajectory, cells: Any, times: Any) -> None:
    stream, walked = predictor.stream(found), predictor.stream(found)
    decision, seen = ThresholdDecision(predictor, 0.4, patience=2).stream(found), 0
    once = ThresholdDecision(predictor, 0.4, patience=2).stream(found)
    for tick, (cell, time) in enumerate(zip(cells, times, strict=True)):
        belief, made = stream.update(cell, float(time)), decision.update(cell, float(time))
        if tick == 0 or (cells[tick - 1] != cell).any():
            assert walked.update(cell, float(time)) == belief
            once.update(cell, float(time))
            seen += 1
        assert (stream.num_states, stream.belief, stream.last_time) == (seen, walked.belief, walked.last_time)
        assert made == once.decision


@pytest.mark.parametrize("case", [case for case in ON_GRIDS if case not in NEURAL_CASES[1:]], ids=str)
def test_learning_does_not_count_ticks(case: Case) -> None:
    rng = np.random.default_rng(1)
    if case in NEURAL_CASES:
        pytest.importorskip("torch")
    again = clone(case.predictor).fit([recorded(found, rng) for found in case.train])
    np.testing.assert_array_equal(again.predict_proba_at(case.test), fitted(case).predict_proba_at(case.test))


def test_evaluations_do_not_count_ticks() -> None:
    rng = np.random.default_rng(2)
    walked = [replace(each, condition="ab"[i % 2]) for i, each in enumerate(wanderers(48))]
    idle = [recorded(each, rng) for each in walked]
    names = ["bayesian", "grid-ngram"]
    options: dict[str, Any] = {"by": "condition", "repeats": 1, "cv": 3}
    one, other = (evaluate(names, each, **options) for each in (walked, idle))
    assert one.table.equals(other.table)
    assert one.confusion.equals(other.confusion)
    tests = [compare_conditions(each, predictor="bayesian", unit="trajectory").pairs for each in (one, other)]
    assert tests[0].equals(tests[1])
    curves = [learning_curve(names, each, sizes=(0.5, 1.0), repeats=2).table for each in (walked, idle)]
    assert curves[0].equals(curves[1])
    assert fit_rationality(idle).rationality == fit_rationality(walked).rationality


def test_files_do_not_count_ticks(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    found = people()
    save_trajectories(tmp_path / "a.npz", [recorded(each, rng) for each in found])
    assert [each.states.tolist() for each in load_trajectories(tmp_path / "a.npz")] == [
        each.states.tolist() for each in found
    ]
    write_csv(tmp_path / "a.csv", found)
    header, *lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    every_tick = [line for line in lines for _ in range(3)]
    (tmp_path / "b.csv").write_text("\n".join([header, *every_tick]), encoding="utf-8")
    assert read_csv(tmp_path / "b.csv") == read_csv(tmp_path / "a.csv")


def test_pauses_of_a_hand_are_part_of_its_motion() -> None:
    """Positions are kept as recorded: a fraction of the samples is a fraction of the recording, not of the way."""
    reach = Trajectory([(0.0, 0.0)] * 3 + [(0.1, 0.0), (0.3, 0.4)], candidates=("cup",))
    assert reach.num_states == 5
    assert [reach.prefix_length(0.6, cut) for cut in ("steps", "time", "arc")] == [3, 3, 4]
