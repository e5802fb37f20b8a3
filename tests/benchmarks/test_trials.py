"""Trials: run once, in any order, on any number of processes, with the same results."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.trials import Event, TrialName, TrialsFailed, TrialStore, run_trials
from benchmarks.trials.packages import packages_of
from benchmarks.trials.store import plain
from legible_envs.overcooked import OvercookedWorkspace
from optimizers import search
from optimizers.cluster import connect
from tests.benchmarks import trial_functions
from tests.support.clusters import LocalCluster

TRIALS = [{"seed": seed, "settings": {"size": 3}, "shape": [7, 7]} for seed in range(5)]


def with_marks(folder: Path, n: int = 4, **more: object) -> list[dict[str, object]]:
    marks = folder / "marks"
    marks.mkdir(exist_ok=True)
    return [{"seed": seed, "marks": str(marks), **more} for seed in range(n)]


def marks_of(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "marks").iterdir())


def test_rows_come_in_the_order_of_cells_with_their_settings(tmp_path: Path) -> None:
    table = run_trials(trial_functions.draw, TRIALS, tmp_path, workers=1)
    assert list(table.columns) == ["seed", "settings.size", "shape", "step", "value", "count"]
    assert table["seed"].tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]
    assert table["shape"].unique().tolist() == ["[7, 7]"]
    expected = [np.random.default_rng(seed).normal(size=2) for seed in range(5)]
    np.testing.assert_array_equal(table["value"].to_numpy().reshape(5, 2), expected)


def test_the_number_of_workers_and_the_order_change_nothing(tmp_path: Path) -> None:
    alone = run_trials(trial_functions.draw, TRIALS, tmp_path / "a", workers=1)
    many = run_trials("tests.benchmarks.trial_functions:draw", TRIALS, tmp_path / "b", workers=3)
    run_trials(trial_functions.draw, TRIALS[::-1], tmp_path / "c", workers=1)
    again = run_trials(trial_functions.draw, TRIALS + TRIALS, tmp_path / "c", workers=1)
    pd.testing.assert_frame_equal(alone, many)
    pd.testing.assert_frame_equal(alone, again)


def test_finished_cells_are_not_run_again(tmp_path: Path) -> None:
    trials = with_marks(tmp_path)
    run_trials(trial_functions.draw_and_count, trials[:2], tmp_path, workers=1)
    events: list[tuple[int, int]] = []

    def note(event: Event) -> None:
        events.append((event.found, event.done))

    run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1, progress=note)
    assert marks_of(tmp_path) == ["0-0", "1-0", "2-0", "3-0"]
    assert events[0] == (2, 2)
    assert events[-1] == (2, 4)


def test_a_damaged_result_is_computed_again(tmp_path: Path) -> None:
    trials = with_marks(tmp_path, 2)
    before = run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1)
    victim = next((tmp_path / "cells").glob("*.json"))
    victim.write_text(victim.read_text()[:30])
    after = run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1)
    pd.testing.assert_frame_equal(before, after)
    assert len(marks_of(tmp_path)) == 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rows": [1]}, "`rows[0]` must be a mapping, got 1"),
        ({"rows": [{"value": [1]}]}, "a value of `rows` must be a text, a number or null, got [1]"),
        ({"rows": [{"value": 0.5}]}, "was changed since"),
        ({"schema": 3}, "it has schema 3, this version reads schema 2"),
        ({"sha256": None}, "was changed since"),
        ({"cell": {"seed": 9}, "schema": 1}, "the unknown key 'sha256'"),
        ([], "it lacks `schema`"),
    ],
)
def test_a_result_that_is_not_what_was_kept_is_named_and_run_again(tmp_path: Path, change: Any, said: str) -> None:
    trials, events = with_marks(tmp_path, 2), list[Event]()
    before = run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1)
    victim = sorted((tmp_path / "cells").glob("*.json"))[0]
    victim.write_text(json.dumps({**json.loads(victim.read_text()), **change} if change else change))
    with pytest.warns(UserWarning, match="1 kept file of trials cannot be used") as warned:
        after = run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1, progress=events.append)
    (line,) = events[0].damaged
    assert said in line
    assert line.startswith(str(victim))
    assert line in str(warned[0].message)
    pd.testing.assert_frame_equal(before, after)
    assert len(marks_of(tmp_path)) == 3
    assert victim.with_name(f"{victim.name}.damaged").exists()


def test_a_result_of_another_trial_does_not_count(tmp_path: Path) -> None:
    trials = with_marks(tmp_path, 2)
    before = run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1)
    one, other = sorted((tmp_path / "cells").glob("*.json"))
    one.write_text(other.read_text())
    with pytest.warns(UserWarning, match="it holds another trial than its name says"):
        pd.testing.assert_frame_equal(before, run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1))


def test_a_damaged_traceback_stops_nothing(tmp_path: Path) -> None:
    trials = with_marks(tmp_path)
    with pytest.raises(TrialsFailed):
        run_trials(trial_functions.always_fail_at_two, trials, tmp_path, workers=1)
    (victim,) = (tmp_path / "failed").glob("*.json")
    victim.write_text(victim.read_text()[:99])
    with pytest.warns(UserWarning, match=victim.name), pytest.raises(TrialsFailed, match="two is not allowed"):
        run_trials(trial_functions.always_fail_at_two, trials, tmp_path, workers=1)


def test_results_of_earlier_versions_are_read(tmp_path: Path) -> None:
    trials = with_marks(tmp_path, 2)
    before = run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1)
    for path in (tmp_path / "cells").glob("*.json"):
        content = {key: value for key, value in json.loads(path.read_text()).items() if key != "sha256"}
        path.write_text(json.dumps({**content, "schema": 1}))
    pd.testing.assert_frame_equal(before, run_trials(trial_functions.draw_and_count, trials, tmp_path, workers=1))
    assert len(marks_of(tmp_path)) == 2


@pytest.mark.parametrize("value", ["\ud800", 2**200])
def test_what_could_not_be_read_back_is_not_kept(value: Any) -> None:
    with pytest.raises(ValueError, match="result row"):
        plain({"value": value})


def test_a_failed_cell_is_retried_once_and_its_traceback_kept(tmp_path: Path) -> None:
    trials = with_marks(tmp_path)
    table = run_trials(trial_functions.fail_at_first, trials, tmp_path, workers=1)
    assert table["seed"].tolist() == [0, 1, 2, 3]
    assert marks_of(tmp_path) == ["0-0", "1-0", "1-1", "2-0", "3-0"]
    assert TrialStore(tmp_path, TrialName("any")).failures() == []


def test_a_cell_that_fails_twice_costs_nothing_else(tmp_path: Path) -> None:
    trials = with_marks(tmp_path)
    with pytest.raises(TrialsFailed, match=r"1 of 4 trials failed 2 times.*two is not allowed") as caught:
        run_trials(trial_functions.always_fail_at_two, trials, tmp_path, workers=2)
    assert caught.value.table["seed"].tolist() == [0, 1, 3]
    (failure,) = caught.value.failures
    assert failure["cell"]["seed"] == 2
    assert failure["attempts"] == 2
    assert "RuntimeError: two is not allowed" in failure["traceback"]
    with pytest.raises(TrialsFailed):
        run_trials(trial_functions.always_fail_at_two, trials, tmp_path, workers=1)
    assert marks_of(tmp_path) == ["0-0", "1-0", "2-0", "2-1", "2-2", "2-3", "3-0"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_worker_that_dies_takes_only_its_cell_along(tmp_path: Path) -> None:
    trials = with_marks(tmp_path)
    table = run_trials(trial_functions.die_at_first, trials, tmp_path, workers=2)
    assert table["seed"].tolist() == [0, 1, 2, 3]
    assert marks_of(tmp_path) == ["0-0", "1-0", "1-1", "2-0", "3-0"]


HARD_OF_HEARING = """
import multiprocessing, signal
from benchmarks.trials.local import _deaf_to_interrupts
if __name__ == "__main__":
    with _deaf_to_interrupts():
        first = multiprocessing.get_context("spawn").Process(target=print)
        first.start()
        print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))
    first.join()
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="there are no masks of signals")
def test_the_first_worker_hears_no_ctrl_c_either(tmp_path: Path) -> None:
    """The first process also starts Python's tracker of resources, which changes the mask."""
    (tmp_path / "program.py").write_text(HARD_OF_HEARING)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "program.py"], cwd=tmp_path, env=environment, capture_output=True, check=True
    )
    assert b"True" in done.stdout


def test_results_under_a_former_name_are_found_and_new_ones_kept_under_the_new(tmp_path: Path) -> None:
    """A function that moves or is renamed keeps its finished trials."""
    trials = with_marks(tmp_path, 3)
    before = run_trials(trial_functions.draw_and_count, trials[:2], tmp_path, workers=1)
    after = run_trials(trial_functions.draw_and_count_renamed, trials, tmp_path, workers=1)
    assert marks_of(tmp_path) == ["0-0", "1-0", "2-0"]
    pd.testing.assert_frame_equal(after.iloc[:2], before)
    names = sorted(json.loads(path.read_text())["function"] for path in (tmp_path / "cells").iterdir())
    assert names == ["tests.benchmarks.trial_functions:draw_and_count"] * 2 + ["tests/draw"]


def test_a_failure_under_a_former_name_is_forgotten_with_the_next_attempt(tmp_path: Path) -> None:
    (trial,) = with_marks(tmp_path, 1)
    former, name = TrialName("before"), TrialName("now", ("before",))
    TrialStore(tmp_path, former).save_failure(trial, "Error: then", 2, "it")
    TrialStore(tmp_path, name).save_failure(trial, "Error: now", 2, "it")
    assert [failure["function"] for failure in TrialStore(tmp_path, name).failures()] == ["now"]
    TrialStore(tmp_path, former).save_failure(trial, "Error: then", 2, "it")
    TrialStore(tmp_path, name).save(trial, [{"value": 1}], 0.1, "it")
    assert TrialStore(tmp_path, name).failures() == []


def test_values_that_are_not_finite_survive(tmp_path: Path) -> None:
    for _ in range(2):
        table = run_trials(trial_functions.not_a_number, TRIALS[:1], tmp_path, workers=1)
        assert np.isnan(table["value"][0])
        assert table["note"][0] == "none"


def test_bad_functions_and_cells_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="plain JSON"):
        run_trials(trial_functions.draw, [{"seed": np.zeros(2)}], tmp_path, workers=1)
    with pytest.raises(ValueError, match="plain JSON"):
        run_trials(trial_functions.draw, [{"seed": float("nan")}], tmp_path, workers=1)
    with pytest.raises(ValueError, match="top of a module"):
        run_trials(lambda trial: {}, TRIALS, tmp_path, workers=1)
    with pytest.raises(ValueError, match="top of a module"):
        run_trials("tests.benchmarks.trial_functions:missing", TRIALS, tmp_path, workers=1)
    with pytest.raises(TrialsFailed, match="column 'value' of a result row holds a ndarray"):
        run_trials(trial_functions.not_rows, TRIALS[:1], tmp_path, workers=1)
    with pytest.raises(ValueError, match="`workers` must be None or an integer from 1 to 1024"):
        run_trials(trial_functions.draw, TRIALS, tmp_path / "x", workers=0)
    (tmp_path / "file").touch()
    with pytest.raises(FileExistsError, match="is a file"):
        run_trials(trial_functions.draw, TRIALS, tmp_path / "file", workers=1)


def test_workers_are_asked_for_the_packages_that_trials_name(aisle_package: Path) -> None:
    ours = ["benchmarks", "legible_envs", "optimizers", "predictors"]
    trial = {"workspace": {"workspace": "overcooked"}, "label": "a: b", "time": "json:loads", "gone": "no_such:Thing"}
    assert packages_of("benchmarks.sweeps.run:run_search", [trial]) == ours
    theirs = {"workspace": {"workspace": "aisle"}, "emitters": [{"emitter": "tests.support.pointing:Mine"}]}
    assert packages_of("scipy.stats:norm", [trial, theirs]) == sorted(
        [*ours, "legible_workspace_example", "scipy", "tests"]
    )


def test_a_missing_scheduler_is_named() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(ConnectionError, match=r"no Dask scheduler answers at 'tcp://127.0.0.1:1'"):
        connect("tcp://127.0.0.1:1", timeout=0.5)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    """A scheduler with two workers."""
    pytest.importorskip("distributed")
    with LocalCluster(tmp_path_factory.mktemp("cluster")) as found:
        found.add_worker()
        found.add_worker()
        yield found


@pytest.mark.slow
def test_a_search_on_a_cluster_finds_what_it_finds_alone(cluster: LocalCluster) -> None:
    workspace = OvercookedWorkspace(shape=(5, 5), prefix="sum")
    alone = search(workspace, evaluations=3000, seed=1)
    spread = search(workspace, evaluations=3000, seed=1, scheduler=cluster.address)
    for field in ("solution", "objective", "index"):
        np.testing.assert_array_equal(alone.archive.data(field), spread.archive.data(field))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_cluster_loses_a_worker_and_no_result(cluster: LocalCluster, tmp_path: Path) -> None:
    address, victim = cluster.address, cluster.workers[0]
    trials = with_marks(tmp_path, 12, seconds=0.5)
    seen: set[str] = set()

    def kill_one(event: Event) -> None:
        seen.update(event.running)
        if event.done >= 2 and len(seen) == 2 and victim.poll() is None:
            victim.send_signal(signal.SIGKILL)

    table = run_trials(trial_functions.slowly, trials, tmp_path / "run", scheduler=address, progress=kill_one)
    assert victim.wait(timeout=10) == -signal.SIGKILL
    alone = run_trials(trial_functions.draw, [{"seed": seed} for seed in range(12)], tmp_path / "alone", workers=1)
    assert table["value"].tolist() == alone[alone["step"] == 0]["value"].tolist()
    run = len(marks_of(tmp_path))
    assert 12 <= run <= 14, "run twice at most: the trial it was running, and one whose result was on its way"
