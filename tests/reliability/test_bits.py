"""Flipped bits in what is kept: refused, run again and named, or of no consequence; never another result in silence."""

from __future__ import annotations

import json
import shutil
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.presenters.tabletop_panels import LIST, listed
from benchmarks.reports.prediction_report import evaluate_trajectories, evaluation_section, write_evaluation
from benchmarks.trials import Event, run_trials
from legible_envs.overcooked import OvercookedWorkspace
from optimizers import SearchError, SearchResult, load_run, search
from optimizers.archives import archive_arrays
from tests.benchmarks import trial_functions
from tests.support.repeats import Repeats
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
SETTINGS: dict[str, Any] = {"evaluations": 160, "initial": 40, "emitter_options": {"climbs": 3, "fanout": 4}}
SETTINGS |= {"checkpoint_every": 0.0, "progress": False}


def flipped(path: Path, rng: np.random.Generator) -> None:
    """Turn one bit of a file."""
    content = bytearray(path.read_bytes())
    bit = int(rng.integers(8 * len(content)))
    content[bit // 8] ^= 1 << (bit % 8)
    path.write_bytes(content)


def outcome(read: Callable[[], Any]) -> tuple[Any, str]:
    """What reading gives, and the message where it is refused; any other error is a failure."""
    try:
        return read(), ""
    except SearchError as error:
        return None, str(error)


@pytest.fixture
def copies(tmp_path: Path) -> Callable[[Path], Iterator[Path]]:
    """``copies(folder)``: one fresh copy of a folder after the other."""

    def make(folder: Path) -> Iterator[Path]:
        while True:
            copy = tmp_path / "copy"
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(folder, copy)
            yield copy

    return make


def says(run: SearchResult) -> dict[str, Any]:
    """Everything that a report or a script takes from a run that was read back."""
    arrays = {name: values.tolist() for name, values in archive_arrays(run.archive).items()}
    best = None if run.best_genome is None else run.best_genome.tolist()
    counts = (run.evaluations, run.iterations, run.seconds, run.stopped, run.qd_score, run.coverage)
    # As texts: 1 and 1.0, 0.0 and -0.0 differ.
    return {"archive": str(arrays), "best": repr((best, run.best_objective)), "counts": repr(counts)} | {
        "history": repr(run.history),
        "config": json.dumps(run.config, sort_keys=True),
    }


def test_a_finished_run_says_the_same_or_is_refused(
    tmp_path: Path, copies: Callable[[Path], Iterator[Path]], repeats: Repeats
) -> None:
    folder, rng, ends = tmp_path / "run", np.random.default_rng(0), Counter[str]()
    search(SHELF, checkpoint=folder, **SETTINGS)
    expected = says(load_run(folder, SHELF))
    for copy, _ in zip(copies(folder), range(repeats(60, 1000)), strict=False):
        victim = copy / rng.choice(["config.json", "archive.npz", "metrics.csv"])
        flipped(victim, rng)
        found, refusal = outcome(lambda folder=copy: says(load_run(folder, SHELF)))
        assert found == expected or victim.name in refusal, f"another result in silence: {victim}"
        ends["refused" if refusal else "the same"] += 1
    print(dict(ends))
    assert ends["refused"] > ends["the same"]


def test_a_run_goes_on_to_the_same_result_or_is_refused(
    tmp_path: Path, copies: Callable[[Path], Iterator[Path]], repeats: Repeats
) -> None:
    """Whatever of it is damaged; what is written anew on the way is right again."""
    folder, rng, ends = tmp_path / "run", np.random.default_rng(1), Counter[str]()
    expected = says(search(SHELF, **SETTINGS))
    search(SHELF, checkpoint=folder, callbacks=[lambda state: state.iteration == 5], **SETTINGS)
    kept = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    assert sum(path.suffix == ".checkpoint" for path in kept) == 2
    for copy, _ in zip(copies(folder), range(repeats(60, 1000)), strict=False):
        victim = copy / kept[rng.integers(len(kept))]
        flipped(victim, rng)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            search(SHELF, checkpoint=copy, resume=True, **SETTINGS)
        found = says(load_run(copy, SHELF))
        assert all(found[name] == expected[name] for name in ("archive", "best")), f"another result: {victim}"
        assert found["config"].count('"seed": 0') == 1
        ends["named" if any(victim.name in str(each.message) for each in said) else "the same"] += 1
    print(dict(ends))
    assert ends["named"]


def test_results_of_trials_give_the_same_table_and_damage_is_named(
    tmp_path: Path, copies: Callable[[Path], Iterator[Path]], repeats: Repeats
) -> None:
    (tmp_path / "marks").mkdir()
    trials = [{"seed": seed, "marks": str(tmp_path / "marks")} for seed in range(4)]
    folder, rng, ends = tmp_path / "run", np.random.default_rng(2), Counter[str]()
    with pytest.raises(RuntimeError):
        run_trials(trial_functions.always_fail_at_two, trials, folder, workers=1)
    run_trials(trial_functions.draw, trials, folder, workers=1)
    trials[2]["seed"] = 7
    expected = run_trials(trial_functions.always_fail_at_two, trials, folder, workers=1)
    kept, function = [path.relative_to(folder) for path in folder.rglob("*.json")], trial_functions.always_fail_at_two
    assert {path.parts[0] for path in kept} == {"cells", "failed"}
    for copy, _ in zip(copies(folder), range(repeats(60, 1000)), strict=False):
        victim = copy / kept[rng.integers(len(kept))]
        flipped(victim, rng)
        events: list[Event] = []
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            table = run_trials(function, trials, copy, workers=1, progress=lambda event, all=events: all.append(event))
        pd.testing.assert_frame_equal(table, expected)
        named = any(victim.name in str(each.message) for each in said)
        assert named == bool(events[0].damaged) == victim.with_name(f"{victim.name}.damaged").exists()
        ends["named" if named else "the same"] += 1
        again = run_trials(trial_functions.always_fail_at_two, trials, copy, workers=1)
        pd.testing.assert_frame_equal(again, expected)
    print(dict(ends))
    assert ends["named"]


def test_the_section_about_predictors_is_the_same_or_left_out_and_named(
    tmp_path: Path, copies: Callable[[Path], Iterator[Path]], repeats: Repeats
) -> None:
    workspace, rng, ends = OvercookedWorkspace(shape=(5, 5)), np.random.default_rng(3), Counter[str]()
    trajectories = workspace.simulate(workspace.sample(1, rng)[0], 6, rng)
    how: dict[str, Any] = {"keep_rare": True, "curve": False, "folds": 2, "repeats": 1}
    results = evaluate_trajectories(trajectories, ["shortest-distance"], **how)
    write_evaluation(results, tmp_path / "people")
    expected = evaluation_section(tmp_path / "people")
    assert expected
    for copy, _ in zip(copies(tmp_path / "people"), range(repeats(40, 400)), strict=False):
        victim = copy / rng.choice(["reading.json", "accuracy.svg", "confusion.svg"])
        flipped(victim, rng)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            found = evaluation_section(copy)
        assert found == expected or (found is None and "evaluate again" in str(said[-1].message)), victim
        ends["the same" if found else "named"] += 1
    print(dict(ends))
    assert ends["named"]


def test_the_list_of_conditions_is_the_same_or_refused(tmp_path: Path, repeats: Repeats) -> None:
    together, rng = {"both": ".", "placement": "placement", "obstacles": "obstacles"}, np.random.default_rng(4)
    for _ in range(repeats(60, 1000)):
        (tmp_path / LIST).write_text(json.dumps(together, indent=1) + "\n")
        flipped(tmp_path / LIST, rng)
        found, refusal = outcome(lambda: listed(tmp_path))
        assert found == together or LIST in refusal
