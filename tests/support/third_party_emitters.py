"""An emitter and a proposing function as other packages bring them."""

import numpy as np

from optimizers import WorkspaceEmitter


class Shift(WorkspaceEmitter):
    """A well-behaved third-party emitter: some elites, with one gene shifted."""

    emits_valid = False

    def __init__(self, archive, workspace, *, seed, step=1):
        super().__init__(archive, workspace, seed=seed)
        self.step = step
        self.settings = {"step": step}

    def ask(self):
        genomes = self.archive.data("solution").astype(int)
        genomes = genomes[self._rng.integers(len(genomes), size=40)]
        genomes[np.arange(40), self._rng.integers(genomes.shape[1], size=40)] += self.step
        return genomes


def reshuffle(archive, workspace, rng, size=30):
    """A proposing function: random layouts."""
    return workspace.sample(size, rng)
