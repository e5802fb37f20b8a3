"""Random keys of any workspace: one key per gene, repaired with an anchor."""

import numpy as np

from legible_envs.random_keys import BoundedKeys
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


def test_keys_of_any_workspace_are_its_genes_and_are_repaired_with_the_anchor():
    keys = SHELF.key_decoder()
    assert isinstance(keys, BoundedKeys)
    genomes = SHELF.all_genomes()
    np.testing.assert_array_equal(keys.decode(keys.encode(genomes), genomes, np.random.default_rng(0)), genomes)
    raw = np.random.default_rng(1).normal(0.5, 1.0, (400, SHELF.genome_size))
    anchors = SHELF.sample(400, np.random.default_rng(2))
    decoded = keys.decode(raw, anchors, np.random.default_rng(3))
    assert SHELF.valid(decoded).all()
    # Every gene is the key's or the anchor's, and genes that were fine alone are mostly the key's.
    own = np.clip(np.floor(np.clip(raw, 0, 1) * (SHELF.upper_bounds + 1.0)), 0, SHELF.upper_bounds)
    assert ((decoded == own) | (decoded == anchors)).all()
    assert (decoded == own).mean() > 0.6


class Hopeless(ShelfWorkspace):
    """Only one layout is valid."""

    def valid(self, genomes):
        return (np.asarray(genomes) == [0, 1, 2, 0, 0, 0]).all(axis=1)


def test_repair_ends_at_the_anchor():
    anchors = np.tile(np.array([[0, 1, 2, 0, 0, 0]], dtype=np.int8), (50, 1))
    decoded = BoundedKeys(Hopeless()).decode(np.full((50, 6), 0.9), anchors, np.random.default_rng(0))
    np.testing.assert_array_equal(decoded, anchors)
