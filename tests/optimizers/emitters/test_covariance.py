"""CMA-ME and CMA-MAE on random keys."""

import numpy as np
import pytest

from optimizers import CmaMaeEmitter, CmaMeEmitter, search
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.valley_workspace import Valley

SHELF = ShelfWorkspace()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [("cma-me", 0.2), ("cma-mae", 0.1)])
def test_evolution_strategies_climb_the_valley(name, share):
    workspace = Valley()
    options = {"strategies": 3, "batch_size": 20}
    result = search(workspace, emitter=name, evaluations=3000, initial=100, seed=0, emitter_options=options)
    sampled = search(workspace, emitter="random", evaluations=3000, initial=100, seed=0)
    assert -result.best_objective < share * -sampled.best_objective
    assert result.config["emitter"]["settings"]["strategies"] == 3


def test_thresholds_of_cma_mae_rise_slowly(started, told):
    workspace = Valley()
    archive, evaluate = started(workspace, 100)
    emitter = CmaMaeEmitter(archive, workspace, strategies=2, batch_size=30, learning_rate=0.1, seed=0)
    median = float(np.median(archive.data("objective")))
    assert not len(emitter.state.thresholds)
    for _ in range(10):
        told(emitter, evaluate, emitter.ask())
    found = emitter.state
    assert len(found.thresholds)
    assert (found.thresholds > median).all()
    assert (found.thresholds < found.bests).all()


def test_a_batch_goes_on_from_the_elite_a_strategy_restarted_from(started, told):
    archive, evaluate = started(SHELF, 100)
    # Steps this small never leave the interval of keys that stands for a gene, so a new start shows as itself.
    emitter = CmaMeEmitter(archive, SHELF, strategies=2, batch_size=10, sigma0=0.01, seed=0)
    restarts = np.zeros(2)
    for _ in range(20):
        genomes = emitter.ask()
        assert SHELF.valid(genomes).all()
        for before, after, start, batch in zip(
            restarts, emitter.state.restarts, emitter.state.starts, genomes.reshape(2, 10, -1), strict=True
        ):
            if after > before:
                np.testing.assert_array_equal(batch, np.tile(start, (10, 1)))
        restarts = emitter.state.restarts
        told(emitter, evaluate, genomes)
    assert restarts.any()
