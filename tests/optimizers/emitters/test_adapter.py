"""Emitters that know no workspace: what they propose becomes layouts, and what they are told fits what they asked."""

import numpy as np
import pytest

from optimizers import EmitterError, make_archive
from optimizers.emitters.adapter import FloatArchiveView, GenomeAdapter
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


class Scripted:
    """Proposes what it is given, and remembers what it is told."""

    solution_dim = SHELF.genome_size

    def __init__(self, batches):
        self.batches, self.told = list(batches), []

    def ask(self):
        return self.batches.pop(0)

    def tell(self, solution, objective, measures, add_info):
        self.told.append((solution, objective, measures, add_info))


def test_adapter_rounds_clips_filters_and_reports_back_the_whole_batch(started):
    raw = np.array(
        [
            [0.4, 1.4, 2.4, 0.4, -3.0, 9.0],  # rounds and clips to 0 1 2 | 0 0 1
            [3.0, 3.2, 5.0, 0.0, 0.0, 0.0],  # two boxes on place 3: left out
            [-9.0, 99.0, 3.0, np.nan, 0.0, 1.0],  # 0 5 3 | 0 0 1
            [1.0, 2.0, 3.0, 0.0, 0.0, 0.0],  # will have no score
        ]
    )
    archive, _ = started(SHELF, 50)
    inner = Scripted([raw])
    adapter = GenomeAdapter(archive, SHELF, inner, name="scripted")
    genomes = adapter.ask()
    np.testing.assert_array_equal(genomes, [[0, 1, 2, 0, 0, 1], [0, 5, 3, 0, 0, 1], [1, 2, 3, 0, 0, 0]])
    assert genomes.dtype == np.int8
    scores = np.array([1.5, -20.0, np.nan])
    info = archive.add(genomes, scores, SHELF.measures(genomes))
    adapter.tell(genomes, scores, SHELF.measures(genomes), info)
    solution, objective, measures, told = inner.told[0]
    np.testing.assert_array_equal(solution, raw)
    np.testing.assert_array_equal(objective, [1.5, -20.0, -20.0, -20.0])
    np.testing.assert_array_equal(measures[[0, 2]], SHELF.measures(genomes[:2]))
    np.testing.assert_array_equal(told["status"][[1, 3]], [0, 0])
    assert (told["value"][[1, 3]] <= told["value"].min()).all()
    assert np.isfinite(objective).all()
    assert np.isfinite(measures).all()
    assert np.isfinite(told["value"]).all()


def test_adapter_asks_again_until_something_is_valid_and_gives_up_in_words(started):
    wrong = np.full((5, SHELF.genome_size), 2.0)
    right = np.array([[0, 1, 2, 0, 0, 0]])
    inner = Scripted([wrong] * 3 + [right])
    adapter = GenomeAdapter(started(SHELF, 50)[0], SHELF, inner)
    np.testing.assert_array_equal(adapter.ask(), right)
    assert len(inner.told) == 3
    with pytest.raises(EmitterError, match="stubborn: no valid layout in 100 consecutive batches"):
        GenomeAdapter(started(SHELF, 50)[0], SHELF, Scripted([wrong] * 200), name="stubborn").ask()


@pytest.mark.parametrize("wrong", [np.zeros((4, 3)), np.zeros(6), np.array([["a"] * 6])])
def test_adapter_says_what_shape_it_expected(wrong, started):
    with pytest.raises(EmitterError, match=r"mine: ask\(\) must return numbers of shape \(n, 6\), it returned"):
        GenomeAdapter(started(SHELF, 50)[0], SHELF, Scripted([wrong]), name="mine").ask()


def test_adapter_starts_an_empty_archive_with_random_layouts():
    adapter = GenomeAdapter(make_archive(SHELF), SHELF, Scripted([]), initial=12)
    genomes = adapter.ask()
    assert len(genomes) == 12
    assert SHELF.valid(genomes).all()
    adapter.tell(genomes, SHELF.legibility(genomes), SHELF.measures(genomes), {})


def test_view_shows_integer_elites_as_real_numbers(started):
    archive, _ = started(SHELF, 50)
    view = FloatArchiveView(archive)
    assert view.dtypes["solution"] == np.float64
    assert view.sample_elites(3)["solution"].dtype == np.float64
    assert view.best_elite["solution"].dtype == np.float64
    assert view.data("solution").dtype == np.float64
    assert view.data(["solution", "index"])["index"].dtype == archive.dtypes["index"]
    assert view.retrieve(SHELF.measures(SHELF.sample(2, np.random.default_rng(0))))[1]["solution"].dtype == np.float64
    assert len(view) == len(archive) == len(list(view))
    assert next(iter(view))["solution"].dtype == np.float64
    assert FloatArchiveView(make_archive(SHELF)).best_elite is None
    assert view.empty is False
