"""What the tests of searches share: archives to start from, rounds of an emitter, archives compared."""

import numpy as np
import pytest

from optimizers import make_archive
from optimizers.archives import archive_arrays
from optimizers.evaluator import Evaluator


@pytest.fixture(scope="session")
def started():
    """``started(workspace, n, seed=, max_distance=)``: an archive of random layouts, and what scored them."""

    def start(workspace, n=40, *, seed=0, max_distance=None):
        archive, evaluate = make_archive(workspace, seed=0), Evaluator(workspace, max_distance=max_distance)
        genomes = workspace.sample(n, np.random.default_rng(seed))
        archive.add(genomes, *evaluate(genomes))
        return archive, evaluate

    return start


@pytest.fixture(scope="session")
def told():
    """``told(emitter, evaluate, genomes, unscored=)``: scores, archives and tells; returns the scores."""

    def tell(emitter, evaluate, genomes, *, unscored=()):
        scores, measures = evaluate(genomes)
        scores[list(unscored)] = np.nan
        emitter.tell(genomes, scores, measures, emitter.archive.add(genomes, scores, measures))
        return scores

    return tell


@pytest.fixture(scope="session")
def same_archive():
    """Whether two archives hold the same elites, bit for bit."""

    def same(a, b):
        a, b = archive_arrays(a), archive_arrays(b)
        return all(np.array_equal(a[name], b[name]) for name in a)

    return same
