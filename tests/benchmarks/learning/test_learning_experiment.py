"""The experiment on small budgets: what is logged, and what is made of it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments.learning import sweep
from benchmarks.experiments.learning.analysis import bands, beside_scripted, elsewhere, sections
from benchmarks.experiments.learning.run import learn, places_of, reproduce, thinned
from benchmarks.experiments.learning.settings import Environment, TrainingSettings
from benchmarks.experiments.learning.sweep import QUICK, TASKS, Task, trials_of


def test_every_task_has_settings_that_can_be_kept() -> None:
    trials = trials_of(sweep.FULL, [{"condition": "Legible", "drawing": "X"}])
    assert len(trials) == 5 * len(TASKS)
    assert {trial["seed"] for trial in trials} == set(range(5))
    for trial in trials:
        settings = TrainingSettings.from_dict(trial["training"])
        assert settings.seed == trial["seed"]
        assert settings.steps == TASKS[trial["task"]].steps
        assert bool(trial["places"]) == TASKS[trial["task"]].elsewhere


def test_curves_are_thinned_to_means_over_episodes() -> None:
    nan = np.nan
    curve = np.array([[10, 2, 4.0, 8.0, 1.0], [20, 0, nan, nan, nan], [30, 6, 8.0, 4.0, 0.5]])
    rows = thinned(np.repeat(curve, 1, axis=0))
    assert [row["steps"] for row in rows] == [10, 30]
    long = np.tile(curve, (60, 1))
    long[:, 0] = np.arange(1, 181) * 10
    rows = thinned(long)
    assert len(rows) == 60
    assert rows[0] == {
        "steps": 30,
        "score": pytest.approx(7),
        "length": pytest.approx(5),
        "finished": pytest.approx(0.625),
    }


def test_a_policy_is_tried_where_the_paper_and_recorded_people_cooked() -> None:
    own = Environment(id="LegibleOvercooked-v0", arguments={"recipes": [["onion"]], "layouts": "random:train"})
    places = dict(places_of(own, [{"where": "Legible", "drawing": "X"}, {"where": "Legible", "drawing": "Y"}]))
    assert places["trained"] == own
    assert places["held out"].arguments == {"recipes": [["onion"]], "layouts": "random:test"}
    assert places["Legible"].arguments["layouts"] == ["X", "Y"]
    assert list(dict(places_of(own, []))) == ["trained"]


def logged() -> pd.DataFrame:
    """Two seeds of one task: one is as fast as the cook, one is not."""
    rows = []
    for seed, (score, length) in enumerate([(30.0, 33.0), (20.0, 50.0)]):
        base = {"task": "t", "seed": seed}
        rows.append({**base, "table": "curve", "steps": 100, "score": score, "finished": 1.0})
        for where, factor in (("trained", 1.0), ("held out", 0.5)):
            for player, own, steps in (("policy", factor * score, length), ("scripted", 40.0, 32.0)):
                played = {"where": where, "player": player, "score": own, "length": steps, "finished": 1.0}
                rows.append({**base, "table": "played", **played})
    return pd.DataFrame(rows)


def test_bands_reach_from_the_least_to_the_greatest_seed() -> None:
    row = bands(logged()).iloc[0]
    assert (row["score"], row["low"], row["high"], row["seeds"]) == (25.0, 20.0, 30.0, 2)


def test_only_seeds_that_are_as_fast_as_the_scripted_cook_count() -> None:
    row = beside_scripted(logged()).iloc[0]
    assert (row["seeds"], row["reached"]) == (2, 1)
    assert row["ratio"] == pytest.approx(41.5 / 32)


def test_elsewhere_is_told_as_a_share_of_the_scripted_return() -> None:
    table = elsewhere(logged()).set_index("where")
    assert table.loc["held out", "share"] == pytest.approx(12.5 / 40)
    assert elsewhere(logged()[lambda rows: rows["where"] != "held out"]).empty


@pytest.mark.slow
def test_the_experiment_runs_and_its_report_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    arguments = {"recipes": [["onion"]], "layouts": "random:train", "max_episode_steps": 100}
    task = Task("overcooked", arguments, 8192, 8192, elsewhere=True)
    monkeypatch.setattr(sweep, "TASKS", {"small": task})
    monkeypatch.setattr("benchmarks.experiments.learning.run.TASKS", {"small": task})
    settings = dataclasses.replace(QUICK, tasks=("small",), seeds=1, episodes=2, initial=20, improvements=1)
    reproduce(tmp_path, settings=settings, workers=1)
    rows = pd.read_csv(tmp_path / "learning.csv")
    assert {"curve", "played", "speed"} <= set(rows["table"])
    assert {"trained", "held out", "Legible", "Random"} <= set(rows["where"].dropna())
    found = sections(tmp_path)
    assert [section.title for section in found][-1] == "In other kitchens"
    assert "scripted" in found[1].text
    assert all(figure.exists() for section in found for figure in section.figures)


def test_what_is_logged_depends_on_the_trial_alone() -> None:
    pytest.importorskip("torch")
    trial = trials_of(dataclasses.replace(QUICK, tasks=("5x5, one onion",), seeds=1, episodes=2), [])[0]
    trial["training"] |= {"steps": 4096, "checkpoint_every": 4096, "network": {"channels": [], "hidden": [8]}}
    first, second = (
        [{**row, "steps_per_second": 0} for row in learn(trial) if row["table"] != "speed"] for _ in range(2)
    )
    assert first == second
