"""The benchmark on recorded people: its tables, its command, and what it loads."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from rich.console import Console

from benchmarks.cli.app import main
from benchmarks.cli.humans import evaluate_predictors
from benchmarks.experiments.prediction import run
from benchmarks.experiments.prediction.analysis import reference_rows, to_markdown
from benchmarks.experiments.prediction.sweep import (
    LAYOUTS,
    NEURAL,
    POINTING_NEURAL,
    POINTING_PREDICTORS,
    POINTING_REFERENCE,
    PREDICTORS,
    REFERENCE,
    Experiment,
)
from benchmarks.experiments.predictor_settings import PredictorSetting
from legible_envs.datasets.pointing import load_pointing
from predictors.neural import training

ABOUT = {"definition": "so many cells", "ties": "fractional", "cut": "cells", "candidate_set": "all"}


def scores(rows: list[tuple[str, str, float, float, int]]) -> pd.DataFrame:
    table = pd.DataFrame(rows, columns=["layout", "predictor", "fraction", "accuracy", "repeats"])
    table = table.assign(chance=0.25, walks=1200, participants=5)
    table.attrs.update(ABOUT)
    return table


RECORDED = scores(
    [("random3", "Eq. 1", 0.1, 0.4, 3), ("random3", "Eq. 1", 0.9, 0.3, 3), ("random3", "n-gram", 0.1, 0.5, 1)]
)


def test_references_belong_to_predictors_that_are_evaluated() -> None:
    assert set(REFERENCE) <= {setting.label for setting in (*PREDICTORS, *NEURAL)}
    assert set(POINTING_REFERENCE) <= {setting.label for setting in (*POINTING_PREDICTORS, *POINTING_NEURAL)}
    for settings in ((*PREDICTORS, *NEURAL), (*POINTING_PREDICTORS, *POINTING_NEURAL)):
        assert len({setting.label for setting in settings}) == len(settings)


def test_a_row_says_what_was_measured_and_the_difference() -> None:
    rows = reference_rows(RECORDED)
    assert rows == [
        {"predictor": "Eq. 1", "random3": "0.350 (\u22120.028)", "repeats": "3"},
        {"predictor": "n-gram", "random3": "0.500", "repeats": "1"},
    ]
    assert to_markdown(rows).splitlines() == [
        "| predictor | random3 | repeats |",
        "| --- | ---: | ---: |",
        "| Eq. 1 | 0.350 (\u22120.028) | 3 |",
        "| n-gram | 0.500 | 1 |",
    ]


def test_those_that_take_minutes_are_repeated_less_often() -> None:
    settings = [
        PredictorSetting("a", "bayesian"),
        PredictorSetting("b", "shortest-distance"),
        PredictorSetting("c", "bayesian", max_repeats=1),
    ]
    assert [(count, list(made)) for count, made in run._by_repeats(settings, 3)] == [(3, ["a", "b"]), (1, ["c"])]
    assert [(count, list(made)) for count, made in run._by_repeats(settings, 1)] == [(1, ["a", "b", "c"])]


def test_an_experiment_has_no_other_settings() -> None:
    with pytest.raises(TypeError, match="flods"):
        run.score_every_trajectory(flods=3)


def evaluated(monkeypatch: pytest.MonkeyPatch) -> list[Experiment]:
    asked: list[Experiment] = []

    def score_recorded_play(folder: object, experiment: Experiment, *, tell: object) -> pd.DataFrame:
        asked.append(experiment)
        return RECORDED

    monkeypatch.setattr(run, "score_recorded_play", score_recorded_play)
    pointing = scores([("pointing", "GRU", 0.5, 0.8, 1)])
    monkeypatch.setattr(run, "score_pointing", lambda path, *, predictors, tell: pointing)
    return asked


def without_torch() -> None:
    raise ImportError("training needs PyTorch, which is not installed")


def test_the_command_prints_and_writes_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = evaluated(monkeypatch)
    (tmp_path / "data.csv").touch()
    stream = io.StringIO()
    evaluate_predictors(
        Console(file=stream, width=140), pointing=tmp_path / "data.csv", neural=False, repeats=2, out=tmp_path / "out"
    )
    assert asked == [Experiment(repeats=2)]
    for text in ("0.350 (\u22120.028)", "0.800 (+0.002)", "random3 1,200 trajectories", "so many cells"):
        assert text in stream.getvalue()
    assert "| GRU | 0.800 (+0.002) | 1 |" in (tmp_path / "out" / "pointing.md").read_text(encoding="utf-8")
    assert pd.read_csv(tmp_path / "out" / "kitchens.csv")["mean"].tolist() == [0.35, 0.5]


def test_networks_are_evaluated_where_torch_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = evaluated(monkeypatch)
    monkeypatch.setattr(training, "require_torch", lambda: None)
    stream = io.StringIO()
    evaluate_predictors(Console(file=stream, width=140), layouts=("random3",))
    assert asked == [Experiment(predictors=(*PREDICTORS, *NEURAL), layouts=("random3",))]
    assert "pointing was not evaluated: --pointing" in stream.getvalue()
    monkeypatch.setattr(training, "require_torch", without_torch)
    evaluate_predictors(Console(file=stream, width=140))
    assert asked[1] == Experiment(layouts=LAYOUTS)
    assert "Networks were not evaluated: training needs PyTorch" in stream.getvalue()
    wanted = CliRunner().invoke(main, ["humans", "evaluate", "--neural"])
    assert (wanted.exit_code, len(asked)) == (2, 2)
    assert "needs PyTorch" in wanted.output
    unknown = CliRunner().invoke(main, ["humans", "evaluate", "--layout", "random0"])
    assert unknown.exit_code == 2
    assert "no trajectories are recorded in ['random0']" in unknown.output


def test_pointing_is_trimmed_resampled_and_starts_nowhere(tmp_path: Path) -> None:
    rest, move = np.zeros(10), np.linspace(0, 1, 61)
    share = np.concatenate([rest, move, np.ones(20)])
    rows = [
        {"participant": 3, "condition": "a", "trial": trial, "target": trial, "target_x": x, "target_y": y, "t_ms": t,
         "x": 5 + s * x, "y": s * y}
        for trial, (x, y) in enumerate([(300.0, 0.0), (0.0, -300.0)])
        for t, s in zip(np.arange(len(share)) * 1000 / 60, share, strict=True)
    ]  # fmt: skip
    path = tmp_path / "pointing.csv"
    pd.DataFrame(rows).to_csv(path, index=False)
    right, down = load_pointing(path)
    assert (right.goal, down.goal, right.participant) == ("target0", "target1", "p3")
    assert right.goal_positions == ((0.3, 0.0), (0.0, -0.3))
    assert right.states[0].tolist() == [0.0, 0.0]
    assert right.states[-1] == pytest.approx([0.3, 0.0], abs=0.006)
    assert np.diff(right.times) == pytest.approx(1 / 30)
    assert right.times[-1] == pytest.approx(1.0, abs=0.04)
    pd.DataFrame(rows).drop(columns="t_ms").to_csv(path, index=False)
    with pytest.raises(ValueError, match=r"no table of pointing: the columns \['t_ms'\] are missing"):
        load_pointing(path)
