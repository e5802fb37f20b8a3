"""The draws that emitters share."""

import numpy as np

from optimizers import make_archive
from optimizers.emitters.draws import crossed, draw_elites, perturbed
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


def test_elites_are_drawn_by_cell_and_not_by_arrival(started):
    archive, evaluate = started(SHELF)
    again = make_archive(SHELF)
    data = archive.data(["solution", "objective", "measures"])
    order = np.random.default_rng(3).permutation(len(data["objective"]))
    again.add(data["solution"][order], data["objective"][order], data["measures"][order])
    for replace in (True, False):
        drawn = [draw_elites(a, 15, np.random.default_rng(1), replace=replace) for a in (archive, again)]
        np.testing.assert_array_equal(drawn[0][0], drawn[1][0])
        np.testing.assert_array_equal(drawn[0][1], evaluate.score(drawn[0][0]))
    everyone, _ = draw_elites(archive, 10_000, np.random.default_rng(1), replace=False)
    assert len(np.unique(everyone, axis=0)) == len(everyone) == len(archive)


def test_every_phase_is_perturbed_and_crossings_are_valid():
    rng = np.random.default_rng(0)
    parents = SHELF.sample(400, rng)
    children = perturbed(SHELF, parents, rng)
    boxes, lamps = (children[:, :3] != parents[:, :3]).any(axis=1), (children[:, 3:] != parents[:, 3:]).any(axis=1)
    assert boxes.mean() > 0.2
    assert lamps.mean() > 0.4
    assert not (boxes & lamps).any()
    assert perturbed(SHELF, parents[:0], rng).shape == (0, 6)
    others = SHELF.sample(400, rng)
    mixed = crossed(SHELF, parents, others, rng)
    assert SHELF.valid(mixed).all()
    assert ((mixed == parents) | (mixed == others)).all()
    assert (mixed != parents).any()
    assert (mixed != others).any()
