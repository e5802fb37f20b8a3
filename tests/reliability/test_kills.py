"""Whatever instant a program is killed at, its folder starts or resumes, and the results are those of an unbroken run.

Kills come in two kinds: at every single operation on files, one after the other, without processes (all instants that
the disk can tell apart), and with ``kill -9`` at random moments of real processes.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.trials import run_trials
from legible_envs.workspace import Workspace, make_workspace
from optimizers import SearchError, SearchResult, load_run, search
from optimizers.archives import archive_arrays, read_archive
from optimizers.runs.folder import RunFolder
from tests.benchmarks import trial_functions
from tests.support.interruptions import killed_at
from tests.support.repeats import Repeats
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
SMALL: dict[str, Any] = {"evaluations": 70, "initial": 30, "emitter_options": {"climbs": 3, "fanout": 6}}
SMALL |= {"checkpoint_every": 0.0, "progress": False}
EVER = 10**9

pytestmark = pytest.mark.filterwarnings("ignore:.*stopped before its first checkpoint", "ignore:.*damaged checkpoint")


@pytest.fixture(autouse=True)
def fast_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes are killed here, not machines: nothing has to reach the disk itself."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)


def assert_same(folder: Path, expected: SearchResult) -> None:
    """The files of a run hold what an unbroken search finds, bit for bit."""
    found, arrays = load_run(folder), archive_arrays(expected.archive)
    for name, values in read_archive(folder / "archive.npz").items():
        assert values.tobytes() == arrays[name].tobytes(), name
    assert np.array_equal(found.best_genome, expected.best_genome)
    assert (found.best_objective, found.evaluations) == (expected.best_objective, expected.evaluations)
    timing = ("seconds", "evaluations_per_second")
    kept = [[{k: v for k, v in row.items() if k not in timing} for row in run.history] for run in (found, expected)]
    assert kept[0] == kept[1]
    assert not [path for path in folder.rglob("*") if ".part-" in path.name or path.name.endswith(".replaced")]


def go_on(folder: Path, workspace: Workspace, **settings: Any) -> None:
    """Resume as a user would who knows nothing of the kill."""
    resume = True if RunFolder(folder).holds_a_run else "auto"
    search(workspace, checkpoint=folder, resume=resume, **settings)


def test_killed_at_any_operation_a_search_goes_on_to_the_same_result(tmp_path: Path) -> None:
    expected = search(SHELF, **SMALL)
    with killed_at(tmp_path, EVER) as unbroken:
        search(SHELF, checkpoint=tmp_path / "unbroken", **SMALL)
    assert unbroken.done > 40, unbroken.done
    only_begun = 0
    for k in range(unbroken.done):
        folder = tmp_path / str(k)
        with killed_at(folder, k) as operations:
            search(SHELF, checkpoint=folder, **SMALL)
        assert operations.dead
        state = RunFolder(folder)
        only_begun += state.has_only_begun
        # The manifest comes first: what lies there without one is nothing.
        assert state.holds_a_run == (folder / "config.json").exists()
        if state.holds_a_run:
            with pytest.raises(SearchError, match="already holds a run: continue it with resume=True"):
                search(SHELF, checkpoint=folder, **SMALL)
        go_on(folder, SHELF, **SMALL)
        assert_same(folder, expected)
    assert only_begun > 3


def test_killed_again_and_again_a_search_goes_on_to_the_same_result(tmp_path: Path, repeats: Repeats) -> None:
    expected, rng = search(SHELF, **SMALL), np.random.default_rng(5)
    for attempt in range(repeats(8, 800)):
        folder, kills = tmp_path / str(attempt), 0
        while True:
            with killed_at(folder, int(rng.integers(40))) as operations:
                go_on(folder, SHELF, **SMALL)
            if not operations.dead:
                break
            kills += 1
            if kills > 40:
                go_on(folder, SHELF, **SMALL)
                break
        assert_same(folder, expected)


def test_killed_while_it_is_overwritten_a_run_is_there_whole_or_not_at_all(tmp_path: Path) -> None:
    before = {**SMALL, "seed": 1}
    old, expected = search(SHELF, **before), search(SHELF, **SMALL)
    old_runs = new_runs = no_runs = 0
    for k in range(EVER):
        folder = tmp_path / str(k)
        search(SHELF, checkpoint=folder, **before)
        with killed_at(folder, k) as operations:
            search(SHELF, checkpoint=folder, overwrite=True, **SMALL)
        if not operations.dead or (new_runs > 15 and k % 7):
            break
        if not RunFolder(folder).holds_a_run:
            no_runs += 1
            with pytest.raises(SearchError, match=r"it has no config\.json"):
                load_run(folder)
        elif RunFolder(folder).read_config()["seed"] == 1:
            old_runs += 1
            assert_same(folder, old)
            search(SHELF, checkpoint=folder, resume=True, **before)
            assert_same(folder, old)
            continue
        else:
            new_runs += 1
        search(SHELF, checkpoint=folder, resume="auto", **SMALL)
        assert_same(folder, expected)
    assert old_runs >= 1
    assert no_runs > 5
    assert new_runs > 15


@pytest.mark.parametrize("config", [{"workspace": "overcooked", "shape": [5, 5]}, {"workspace": "tabletop"}])
def test_killed_at_random_operations_kitchens_and_tables_go_on(
    tmp_path: Path, repeats: Repeats, config: dict[str, Any]
) -> None:
    workspace, rng = make_workspace(config), np.random.default_rng(0)
    settings = {**SMALL, "evaluations": 400, "initial": 60}
    expected = search(workspace, **settings)
    for attempt in range(repeats(3, 100)):
        folder = tmp_path / str(attempt)
        with killed_at(folder, int(rng.integers(60))):
            search(workspace, checkpoint=folder, **settings)
        go_on(folder, workspace, **settings)
        assert_same(folder, expected)


def test_a_run_that_has_only_begun_says_so_and_refuses_other_settings(tmp_path: Path) -> None:
    with killed_at(tmp_path, 4):
        search(SHELF, checkpoint=tmp_path, **SMALL)
    assert RunFolder(tmp_path).has_only_begun
    for change, said in (({"seed": 3}, "seed was 0, now it is 3"), ({"emitter_options": None}, "emitter was")):
        with pytest.raises(SearchError, match=said):
            search(SHELF, checkpoint=tmp_path, resume="auto", **{**SMALL, **change})
    with pytest.warns(UserWarning, match="stopped before its first checkpoint; it begins anew with the same settings"):
        search(SHELF, checkpoint=tmp_path, resume=True, **SMALL)


def test_what_killed_searches_left_before_can_be_continued(tmp_path: Path) -> None:
    """Earlier versions wrote the manifest last: what is there without it is resumed, and no new search replaces it."""
    search(SHELF, checkpoint=tmp_path, callbacks=[lambda state: state.iteration == 3], **SMALL)
    (tmp_path / "config.json").unlink()
    with pytest.raises(SearchError, match="already holds a run"):
        search(SHELF, checkpoint=tmp_path, **SMALL)
    assert RunFolder(tmp_path).settings()["seed"] == 0
    with pytest.warns(UserWarning, match=r"no config\.json; it is written anew from the checkpoint"):
        search(SHELF, checkpoint=tmp_path, resume=True, **SMALL)
    assert_same(tmp_path, search(SHELF, **SMALL))


def test_killed_at_any_operation_trials_go_on_to_the_same_table(tmp_path: Path) -> None:
    def trials(folder: Path) -> list[dict[str, Any]]:
        (folder / "marks").mkdir(parents=True, exist_ok=True)
        return [{"seed": seed, "marks": str(folder / "marks")} for seed in range(3)]

    expected = None
    for k in range(EVER):
        folder = tmp_path / str(k)
        plan = trials(tmp_path / f"marks{k}")
        with killed_at(folder, k) as operations:
            run_trials(trial_functions.fail_at_first, plan, folder, workers=1)
        table = run_trials(trial_functions.fail_at_first, plan, folder, workers=1).drop(columns="marks")
        expected = table if expected is None else expected
        pd.testing.assert_frame_equal(table, expected)
        assert not list((folder / "failed").glob("*.json"))
        if not operations.dead:
            break
    assert k > 6


SCRIPT = """
import json, sys
from legible_envs.workspace import make_workspace
from optimizers import search
workspace, folder, settings = json.loads(sys.argv[1]), sys.argv[2], json.loads(sys.argv[3])
search(make_workspace(workspace), checkpoint=folder, resume="auto", progress=False, **settings)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_killed_processes_leave_folders_that_go_on(tmp_path: Path, repeats: Repeats) -> None:
    """``kill -9``, a third of them within the first second after the first file was written."""
    rng, killed = np.random.default_rng(1), 0
    settings = {"evaluations": 4000, "initial": 500, "checkpoint_every": 0.0}
    configs = [{"workspace": "overcooked", "shape": [5, 6]}, {"workspace": "tabletop"}]
    expected = [search(make_workspace(config), progress=False, **settings) for config in configs]
    for attempt in range(repeats(2, 100)):
        folder, which = tmp_path / str(attempt), attempt % 2
        command = [sys.executable, "-c", SCRIPT, json.dumps(configs[which]), str(folder), json.dumps(settings)]
        process = subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])})
        while process.poll() is None and not folder.exists():
            time.sleep(0.001)
        time.sleep(float(rng.uniform(0, 0.05 if attempt % 6 == 0 else 1.0 if attempt % 3 == 0 else 4.0)))
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            search(make_workspace(configs[which]), checkpoint=folder, resume="auto", progress=False, **settings)
        assert_same(folder, expected[which])
    print(f"{killed} processes were killed in mid-search")
    assert killed
