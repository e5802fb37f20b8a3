"""What every built-in emitter keeps: the contract, the seed, resuming, the optimum of a small workspace."""

import numpy as np
import pytest

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import check_emitter, list_emitters, search
from optimizers.archives import archive_arrays
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
KITCHEN = OvercookedWorkspace(shape=(5, 5), prefix="sum")
NAMES = ["annealing", "cma-mae", "cma-me", "differential-evolution", "mutation", "nslc"]


def same_archive(a, b):
    a, b = archive_arrays(a), archive_arrays(b)
    return all(np.array_equal(a[name], b[name]) for name in a)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("workspace", [SHELF, KITCHEN], ids=["shelf", "kitchen"])
def test_keeps_the_contract(name, workspace):
    check_emitter(name, workspace)
    assert list_emitters()[name].origin == "built in"
    assert list_emitters()[name].summary().endswith(".")


@pytest.mark.parametrize("name", NAMES)
def test_an_interrupted_search_goes_on_as_if_it_had_not_been(name, tmp_path):
    whole = search(SHELF, emitter=name, evaluations=2500, seed=3, initial=100)
    for stop in (1, 5, 11):
        search(
            SHELF,
            emitter=name,
            evaluations=2500,
            seed=3,
            initial=100,
            checkpoint=tmp_path,
            resume="auto",
            callbacks=[lambda state, stop=stop: state.iteration >= stop],
        )
    resumed = search(SHELF, emitter=name, evaluations=2500, seed=3, initial=100, checkpoint=tmp_path, resume=True)
    assert resumed.evaluations == whole.evaluations
    assert same_archive(resumed.archive, whole.archive)
    assert resumed.config["emitter"] == whole.config["emitter"]


@pytest.mark.parametrize("name", NAMES)
def test_searches_under_a_distance_cap_and_beats_its_first_layouts(name):
    result = search(SHELF, emitter=name, evaluations=3000, initial=60, seed=0, max_distance=5.0)
    start = search(SHELF, emitter=name, evaluations=60, initial=60, seed=0, max_distance=5.0)
    elites = result.archive.data("solution")
    assert (SHELF.distance(elites) <= 5.0).all()
    assert result.best_objective > start.best_objective
    assert result.qd_score > start.qd_score


@pytest.mark.parametrize("name", NAMES)
def test_starts_from_an_empty_archive_in_a_cap_nothing_met_yet(name):
    # Hardly any random layout is allowed: the emitter has to propose random ones itself until one is.
    result = search(SHELF, emitter=name, evaluations=400, initial=1, seed=1, max_distance=2.0)
    assert result.best_genome is None or SHELF.distance(result.best_genome) <= 2.0
    assert result.evaluations >= 400


@pytest.mark.slow
@pytest.mark.parametrize("name", ["annealing", "mutation", "nslc"])
def test_finds_the_exhaustive_optimum_of_5x5(name):
    result = search(KITCHEN, emitter=name, evaluations=100_000, seed=0)
    assert result.best_objective == pytest.approx(-11.684924681147868, abs=1e-9)
