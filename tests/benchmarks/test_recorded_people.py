"""Legibility against measured accuracy: correlations on made-up stages, scores on a small recording."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from benchmarks.experiments.recorded import analysis, run
from benchmarks.experiments.recorded.analysis import correlate, places_of
from benchmarks.experiments.recorded.sweep import FULL, QUICK, accuracy_trials, score_trials
from benchmarks.trials import run_trials
from legible_envs.legibility import From, goal_legibility
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.humans import simulate_participants
from legible_envs.overcooked.scoring.explanation import grid_graph
from predictors.evaluation.rank_correlation import detectable, spearman, spearman_rows


def logged(slope: float, places: int = 20, people: int = 12, seed: int = 0) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores and readings of places whose accuracy rises with the score as ``slope`` says."""
    rng = np.random.default_rng(seed)
    scores, readings = [], []
    for i in range(places):
        place = {"candidate_set": "all", "kitchen": f"k{i % 4}", "start": f"s{i}", "goals": "a b"}
        score = i / places
        scores.append(place | {"candidates": 2, "goal": "", "walks": people, "score": score})
        for person in range(people):
            correct = float(np.clip(0.6 + slope * (score - 0.5) + 0.1 * rng.normal(), 0, 1))
            row = {"goal": "a", "participant": f"p{person}", "walks": 2, "predictor": "it", "correct": correct}
            readings.append(place | row)
    return pd.DataFrame(scores), pd.DataFrame(readings)


@pytest.mark.parametrize(("slope", "sign"), [(0.6, 1), (-0.6, -1)])
def test_a_relation_is_found_with_its_sign(slope: float, sign: int) -> None:
    row = correlate(*logged(slope), "stage", bootstraps=200).iloc[0]
    assert sign * row["rho"] > 0.8
    low, high = sorted((sign * row["places_low"], sign * row["places_high"]))
    assert 0 < low <= sign * row["rho"] <= high + 0.05
    assert row["p"] < 0.02
    assert row["places"] == 20
    assert sign * row["rho_within"] > 0.5


def test_no_relation_is_not_found() -> None:
    rows = [correlate(*logged(0.0, seed=seed), "stage", bootstraps=60).iloc[0] for seed in range(20)]
    covered = sum(row["places_low"] <= 0 <= row["places_high"] for row in rows)
    assert covered >= 15
    assert sum(row["p"] < 0.05 for row in rows) <= 4


def test_accuracy_counts_walks_and_skill_takes_chance_away() -> None:
    scores, readings = logged(0.5, places=1, people=2)
    readings["walks"], readings["correct"] = [30, 10], [1.0, 0.6]
    place = places_of(scores, readings, "stage").iloc[0]
    assert place["accuracy"] == pytest.approx(0.9)
    assert place["skill"] == pytest.approx(0.8)
    assert place["participants"] == 2
    assert not len(places_of(scores, readings, "stage", min_trajectories=41))


def test_rank_correlation_is_scipys() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        x, y = rng.integers(0, 6, 15).astype(float), rng.normal(size=15)
        assert spearman(x, y) == pytest.approx(stats.spearmanr(x, y).statistic)
        many = np.stack([rng.permutation(y) for _ in range(3)])
        rows = spearman_rows(np.broadcast_to(x, many.shape), many)
        assert rows.tolist() == [spearman(x, row) for row in many]
    assert math.isnan(spearman(np.ones(5), np.arange(5.0)))


def test_the_stated_power_is_about_right() -> None:
    n, rng = 20, np.random.default_rng(0)
    rho = detectable(n)
    pearson = 2 * math.sin(math.pi * rho / 6)  # of normals with this rank correlation
    x = rng.normal(size=(400, n))
    y = pearson * x + math.sqrt(1 - pearson**2) * rng.normal(size=(400, n))
    found = sum(stats.spearmanr(a, b).pvalue < 0.05 for a, b in zip(x, y, strict=True))
    assert 0.7 < found / 400 < 0.9
    assert detectable(12) > detectable(30)
    assert math.isnan(detectable(4))


# -- trials ------------------------------------------------------------------------------------------------------------

KITCHEN = OvercookedLayout.from_ascii("XOXXTXX\nX     X\nX     D\nXXPXXSX")


@pytest.fixture
def recording(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulated people in place of the recorded ones."""
    trajectories = simulate_participants(
        KITCHEN, 6, np.random.default_rng(0), task=_task(), layout_name="room", condition="recorded", executions=3
    )
    trajectories = [one for one in trajectories if len(one.candidates) > 1]
    monkeypatch.setattr(run, "_recorded", lambda trial: trajectories)


def _task():  # type: ignore[no-untyped-def]
    from legible_envs.overcooked.recipes import soup_task

    return soup_task([("tomato", "tomato", "onion"), ("onion", "onion", "onion")])


def trial() -> dict[str, object]:
    return {"candidate_set": "all", "kitchen": "room", "recorded_walks": 1}


@pytest.mark.usefixtures("recording")
def test_stages_score_what_the_definition_says() -> None:
    rows = pd.DataFrame(run.score_stages(trial()))  # type: ignore[arg-type]
    assert {"pot", "serving"} >= set(rows["start"])
    graph = grid_graph(KITCHEN)
    for (start, goals), part in rows.groupby(["start", "goals"]):
        names = goals.split(" ")
        own = part.set_index("goal")["score"]
        for goal in names:
            prefixes = goal_legibility(graph, From(start), goal, names)
            assert own[goal] == pytest.approx(sum(p.probability * p.weight * p.value for p in prefixes))
        assert own[""] == pytest.approx(own[names].mean())
        walks = part.set_index("goal")["walks"]
        assert walks[""] == walks[names].sum()


@pytest.mark.usefixtures("recording")
def test_results_become_tables_figures_and_words(tmp_path: Path) -> None:
    settings = QUICK.__class__(predictors=("Eq. 1", "shortest distance"), layouts=("room",), candidate_sets=("all",))
    for name, function, trials in (
        ("scores", run.score_stages, score_trials(settings, 1)),
        ("readings", run.evaluate_by_stage, accuracy_trials(settings, 1)),
    ):
        run_trials(function, trials, tmp_path, workers=1).to_csv(tmp_path / f"{name}.csv", index=False)
    readings = pd.read_csv(tmp_path / "readings.csv")
    assert readings.groupby("predictor")["walks"].sum().nunique() == 1
    (section,) = analysis.sections(tmp_path, bootstraps=50)
    assert "no, not shown for any predictor" in section.text or "yes, for every predictor" in section.text
    assert all(path.is_file() for path in section.figures)
    before = (tmp_path / "tables" / "correlations.csv").read_bytes()
    analysis.sections(tmp_path, bootstraps=50)
    assert (tmp_path / "tables" / "correlations.csv").read_bytes() == before


def test_cells_name_everything_that_matters() -> None:
    assert len(accuracy_trials(FULL, 7)) == len(FULL.predictors) * len(score_trials(FULL, 7))
    assert all(trial["recorded_walks"] == 7 for trial in accuracy_trials(QUICK, 7))
    with pytest.raises(ValueError, match="no predictor is called 'x'"):
        accuracy_trials(QUICK.__class__(predictors=("x",)), 1)


def test_missing_results_say_so(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"scores\.csv is missing"):
        analysis.sections(tmp_path)
