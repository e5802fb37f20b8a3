"""Run folders read back: the elites and metrics of a search, and every damage named by its file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import SearchError, load_run
from optimizers.runs.folder import COLUMNS, is_run_folder
from tests.support.run_folders import write_run, write_run_of


@pytest.fixture(scope="module")
def workspace() -> OvercookedWorkspace:
    return OvercookedWorkspace(shape=(7, 7))


def edit_config(folder: Path, **changes: object) -> None:
    path = folder / "config.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def test_elites_come_by_score_or_by_cell(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    genomes = workspace.sample(4, np.random.default_rng(3))
    run = load_run(write_run_of(tmp_path, workspace, genomes, np.array([77, 5, 600, 30])))
    by_cell, by_score = run.elites(best_first=False), run.elites()
    assert by_cell.index.tolist() == [5, 30, 77, 600]
    assert len(by_cell) == len(by_score) == 4
    assert (np.diff(by_score.objective) <= 0).all()
    for elites in (by_cell, by_score):
        assert elites.objective == pytest.approx(workspace.legibility(elites.solution))
        assert (elites.measures[:, 0] * 24 + elites.measures[:, 1]).tolist() == elites.index.tolist()
    assert by_score.solution[0].tolist() == run.require_genome().tolist()
    assert run.best_objective == by_score.objective[0]


def test_metrics_are_the_rows_that_were_logged(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    run = load_run(write_run(tmp_path, workspace, 5, rows=7))
    table = run.metrics()
    assert table.columns.tolist() == list(COLUMNS)
    assert table["evaluations"].tolist() == [1000 + 500 * i for i in range(7)]
    assert [row["iteration"] for row in run.history] == list(range(7))
    assert run.seconds == run.history[-1]["seconds"]


def test_a_line_that_was_cut_off_is_left_out(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    write_run(tmp_path, workspace, 5, rows=3)
    path = tmp_path / "metrics.csv"
    path.write_text(path.read_text() + "3,search,25")
    assert len(load_run(tmp_path).history) == 3
    path.unlink()
    assert load_run(tmp_path).history == []


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda f: (f / "config.json").unlink(), "no config.json"),
        (lambda f: (f / "config.json").write_text("{"), "not valid JSON"),
        (lambda f: (f / "config.json").write_text("[1]"), "holds a list"),
        (lambda f: (f / "config.json").write_text("{}"), "lacks"),
        (
            lambda f: edit_config(f, archive={"dims": [10**9] * 2}),
            r"config.json: `archive.dims` must make an",
        ),
        (
            lambda f: edit_config(f, objective={"name": 3}),
            r"config.json: `objective.name` must be a non-empty",
        ),
        (lambda f: edit_config(f, seed=-1), r"`seed` must be an integer >= 0, got -1"),
        (lambda f: edit_config(f, sead=1), r"has the unknown key 'sead' \(did you mean `seed`\?\)"),
        (lambda f: edit_config(f, emitter=[{}]), r"`emitter\[0\]` lacks the key `name`"),
        (
            lambda f: edit_config(f, result={"best_genome": [0] * 3}),
            r"`result.best_genome` must have 32 numbers",
        ),
        (
            lambda f: edit_config(f, result={"best_genome": [99] * 32}),
            r"`result.best_genome\[0\]` must be an integer",
        ),
        (lambda f: edit_config(f, schema=2), "it lacks `sha256`, the digest of its content"),
        (lambda f: edit_config(f, schema=3), "has schema 3, this version reads schema 2"),
        (lambda f: (f / "archive.npz").unlink(), "no archive.npz"),
        (lambda f: (f / "archive.npz").write_bytes(b"PK\x03\x04 no"), "damaged"),
        (lambda f: (f / "archive.npz").write_bytes((f / "archive.npz").read_bytes()[:500]), "damaged"),
        (lambda f: np.savez(f / "archive.npz", solution=np.zeros((1, 32))), "lacks the arrays"),
        (
            lambda f: np.savez(f / "archive.npz", solution=np.zeros((2, 32)), objective=[1.0], measures=[1], index=[1]),
            r"`solution` must be numbers of shape \(1, any\), got float64 of shape \(2, 32\)",
        ),
        (
            lambda f: np.savez(
                f / "archive.npz", solution=np.zeros((1, 9)), objective=[1.0], measures=[[1, 1]], index=[1]
            ),
            "does not fit the manifest",
        ),
        (lambda f: (f / "metrics.csv").write_text("a,b\n1,2\n"), "lacks the columns"),
        (
            lambda f: (f / "metrics.csv").write_text(",".join(COLUMNS) + "\n" + ",".join(["x"] * len(COLUMNS)) + "\n"),
            "metrics.csv is damaged",
        ),
    ],
)
def test_damaged_runs_are_named(
    tmp_path: Path, workspace: OvercookedWorkspace, damage: Callable[[Path], object], message: str
) -> None:
    write_run(tmp_path, workspace, 5)
    damage(tmp_path)
    with pytest.raises(SearchError, match=message) as caught:
        load_run(tmp_path)
    assert str(tmp_path) in str(caught.value)


def test_no_folder_is_said(tmp_path: Path) -> None:
    with pytest.raises(SearchError, match="nowhere is not a folder; expected the folder of a search"):
        load_run(tmp_path / "nowhere")
    assert not is_run_folder(tmp_path)


def test_pickles_are_never_loaded(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    write_run(tmp_path, workspace, 5)
    objects = np.array([print] * 3, dtype=object)
    np.savez(tmp_path / "archive.npz", solution=objects, objective=objects, measures=objects, index=objects)
    with pytest.raises(SearchError, match="damaged"):
        load_run(tmp_path)


def test_a_search_without_a_layout_has_no_best_genome(tmp_path: Path, workspace: OvercookedWorkspace) -> None:
    write_run(tmp_path, workspace, 5, result=None)
    empty = {"solution": np.zeros((0, 32), np.int8), "objective": [], "measures": np.zeros((0, 2)), "index": []}
    np.savez(tmp_path / "archive.npz", **empty)
    run = load_run(tmp_path)
    assert run.best_layout is None
    assert len(run.elites()) == 0
    with pytest.raises(SearchError, match="the archive is empty, so there is no best layout yet; resume the search"):
        run.require_genome()
