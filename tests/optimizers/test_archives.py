"""Archives: exact cells, layouts without a score, plain files."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ribs.archives import GridArchive

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import SearchError
from optimizers.archives import archive_arrays, make_archive, read_archive, write_archive
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


def test_is_a_grid_archive_of_the_workspaces_genomes():
    workspace = OvercookedWorkspace(shape=(5, 6))
    archive = make_archive(workspace, seed=3)
    assert isinstance(archive, GridArchive)
    assert archive.dtypes["solution"] == np.int8
    assert archive.solution_dim == workspace.genome_size == 7 + 3 * 4
    assert archive.cells == 13 * 24
    assert archive.qd_score_offset == workspace.score_floor
    assert make_archive(workspace, score_floor=-5.0).qd_score_offset == -5.0


@pytest.mark.parametrize("workspace", [SHELF, OvercookedWorkspace(shape=(5, 7))], ids=["shelf", "kitchen"])
def test_every_combination_of_measures_has_its_own_cell(workspace):
    archive = make_archive(workspace)
    combinations = np.array(list(itertools.product(*(range(n) for n in workspace.archive_dims))), dtype=float)
    assert sorted(archive.index_of(combinations)) == list(range(archive.cells))


@given(st.integers(0, 2**32 - 1), st.integers(0, 60), st.floats(0, 1))
@settings(max_examples=60, deadline=None)
def test_layouts_without_a_score_are_as_if_never_offered(seed, n, share):
    rng = np.random.default_rng(seed)
    genomes, scores = SHELF.sample(n, rng), rng.normal(size=n)
    measures = SHELF.measures(genomes)
    missing = rng.random(n) < share
    masked, plain = make_archive(SHELF), make_archive(SHELF)
    info = masked.add(genomes, np.where(missing, np.nan, scores), np.where(missing[:, None], np.nan, measures))
    assert info["status"].shape == info["value"].shape == (n,)
    assert (info["status"][missing] == 0).all()
    assert np.isnan(info["value"][missing]).all()
    if (~missing).any():
        expected = GridArchive.add(plain, genomes[~missing], scores[~missing], measures[~missing])
        np.testing.assert_array_equal(info["status"][~missing], expected["status"])
        np.testing.assert_array_equal(info["value"][~missing], expected["value"])
    assert len(masked) == len(plain)
    for name, values in archive_arrays(plain).items():
        np.testing.assert_array_equal(archive_arrays(masked)[name], values)


def test_filling_a_cell_never_lowers_the_qd_score():
    workspace = OvercookedWorkspace(shape=(5, 5), prefix="sum")  # scores here are negative
    archive, scores = make_archive(workspace), []
    for genome in workspace.sample(200, np.random.default_rng(0)):
        archive.add(genome[None], workspace.legibility(genome[None]), workspace.measures(genome[None]))
        scores.append(float(archive.stats.qd_score))
    assert archive.stats.obj_max < 0
    assert scores[0] > 0
    assert (np.diff(scores) >= 0).all()


def filled():
    archive = make_archive(SHELF)
    genomes = SHELF.sample(200, np.random.default_rng(1))
    archive.add(genomes, SHELF.legibility(genomes), SHELF.measures(genomes))
    return archive


def test_files_hold_the_elites_in_order_of_cell_and_no_pickle(tmp_path):
    archive = filled()
    write_archive(tmp_path / "archive.npz", archive)
    with np.load(tmp_path / "archive.npz", allow_pickle=False) as stored:
        assert set(stored.files) == {"solution", "objective", "measures", "index"}
        assert stored["solution"].dtype == np.int8
    arrays = read_archive(tmp_path / "archive.npz")
    assert (np.diff(arrays["index"]) > 0).all()
    np.testing.assert_array_equal(arrays["objective"], SHELF.legibility(arrays["solution"]))
    np.testing.assert_array_equal(arrays["index"], archive.index_of(arrays["measures"]))
    assert len(arrays["index"]) == len(archive)


def test_files_do_not_depend_on_the_order_elites_came_in(tmp_path):
    genomes = SHELF.sample(200, np.random.default_rng(1))
    written = []
    for order in (np.arange(200), np.random.default_rng(2).permutation(200)):
        archive = make_archive(SHELF)
        for genome in genomes[order]:
            archive.add(genome[None], SHELF.legibility(genome[None]), SHELF.measures(genome[None]))
        write_archive(tmp_path / "archive.npz", archive)
        written.append({k: v for k, v in read_archive(tmp_path / "archive.npz").items() if k != "solution"})
    for name, values in written[0].items():
        np.testing.assert_array_equal(values, written[1][name])


@pytest.mark.parametrize("damage", ["cut", "text", "empty", "other"])
def test_a_damaged_file_is_refused_by_name(tmp_path, damage):
    path = tmp_path / "archive.npz"
    write_archive(path, filled())
    content = path.read_bytes()
    path.write_bytes({"cut": content[: len(content) // 2], "text": b"hello", "empty": b"", "other": b""}[damage])
    if damage == "other":
        np.savez(path, solution=np.zeros(3))
    with pytest.raises(SearchError, match=r"archive\.npz is not an archive written by a search"):
        read_archive(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objective": np.array([0.5, np.nan])}, r"`objective` must be finite, got nan at \[1\]"),
        ({"objective": np.array(0.5)}, r"`objective` must be floats of shape \(any\), got float64 of shape \(\)"),
        ({"solution": np.zeros((3, 2))}, r"`solution` must be .* of shape \(2, any\), got float64 of shape \(3, 2\)"),
        ({"measures": np.zeros(2)}, r"`measures` must be numbers of shape \(2, any\)"),
        ({"index": np.array([4, 4])}, "`index` must hold numbers of cells from 0 on, each once"),
        ({"index": np.array([-1, 4])}, "`index` must hold numbers of cells from 0 on, each once"),
        ({"index": np.array([[1], [2]], dtype=object)}, "pickled objects, which are never loaded"),
    ],
)
def test_arrays_that_do_not_fit_each_other_are_named(tmp_path, changes, message):
    whole = {
        "solution": np.zeros((2, 3), dtype=np.int64),
        "objective": np.array([0.5, 1.5]),
        "measures": np.zeros((2, 2)),
        "index": np.array([3, 9]),
    }
    np.savez(tmp_path / "archive.npz", **whole)
    assert len(read_archive(tmp_path / "archive.npz")["index"]) == 2
    np.savez(tmp_path / "archive.npz", **{**whole, **changes})
    with pytest.raises(SearchError, match=rf"archive\.npz is not an archive .*: .*{message}"):
        read_archive(tmp_path / "archive.npz")
