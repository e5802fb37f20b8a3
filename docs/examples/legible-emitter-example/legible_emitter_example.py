"""Uniform crossover between elites: an emitter in a package of its own, found by its entry point (see README.md)."""

import numpy as np

from optimizers import WorkspaceEmitter


class CrossoverEmitter(WorkspaceEmitter):
    """Each child takes each gene from one of two random elites.

    Many children are not valid (two stations on one counter, say). That is fine: with ``emits_valid = False`` the
    search checks the proposals and leaves out those that are not layouts.

    Args:
        archive: Elites to cross; never empty when ``ask`` is called.
        workspace: The design problem; only its bounds are used here.
        batch_size: Children per ``ask``, before invalid ones are left out.
        seed: Seed of everything random.
    """

    emits_valid = False

    def __init__(self, archive, workspace, *, batch_size=1024, seed=None):
        super().__init__(archive, workspace, seed=seed)
        self.batch_size = batch_size
        self.settings = {"batch_size": batch_size}  # written to the manifest of a run

    def ask(self):
        elites = self.archive.data("solution")
        mothers, fathers = elites[self._rng.integers(len(elites), size=(2, self.batch_size))]
        return np.where(self._rng.random(mothers.shape) < 0.5, mothers, fathers)
