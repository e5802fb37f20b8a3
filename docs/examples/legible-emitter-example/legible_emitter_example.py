"""Uniform crossover between elites: an emitter in a package of its own, found by its entry point (see README.md)."""

import numpy as np
from ribs.emitters import EmitterBase


class CrossoverEmitter(EmitterBase):
    """Each child takes each gene from one of two random elites.

    Many children are not valid (two stations on one counter, say). That is fine: an emitter that does not claim
    ``emits_valid = True`` has its proposals checked, and those that are not layouts are left out.

    Args:
        archive: Elites to cross; never empty when ``ask`` is called.
        workspace: The design problem; only its bounds are used here.
        batch_size: Children per ``ask``, before invalid ones are left out.
        seed: Seed of everything random.
    """

    def __init__(self, archive, workspace, *, batch_size=1024, seed=None):
        super().__init__(
            archive,
            solution_dim=archive.solution_dim,
            bounds=None,
            lower_bounds=workspace.lower_bounds,
            upper_bounds=workspace.upper_bounds,
        )
        self.batch_size = batch_size
        self.settings = {"batch_size": batch_size}  # written to the manifest of a run
        self._rng = np.random.default_rng(seed)

    def ask(self):
        elites = self.archive.data("solution")
        mothers, fathers = elites[self._rng.integers(len(elites), size=(2, self.batch_size))]
        return np.where(self._rng.random(mothers.shape) < 0.5, mothers, fathers)
