"""A workspace of four real numbers for tests: Rosenbrock's valley, with gradients of score and measures."""

import numpy as np

from tests.support.shelf_workspace import ShelfWorkspace

LOW, HIGH = np.array([-1.0, -2.0, -1.5, -1.0]), np.array([2.0, 1.0, 1.5, 2.5])


def valley(x):
    """Rosenbrock's function, to be minimised; 0 at ones."""
    x = np.asarray(x)
    return (100.0 * (x[..., 1:] - x[..., :-1] ** 2) ** 2 + (1.0 - x[..., :-1]) ** 2).sum(axis=-1)


class Valley(ShelfWorkspace):
    phases = 1
    genome_dtype = property(lambda self: np.dtype(np.float64))
    lower_bounds = property(lambda self: LOW)
    upper_bounds = property(lambda self: HIGH)
    archive_dims = property(lambda self: (200, 200))
    archive_ranges = property(lambda self: list(zip(LOW[:2], HIGH[:2], strict=True)))

    def sample(self, n, rng):
        return rng.uniform(LOW, HIGH, (n, 4))

    def perturb(self, genomes, k, rng, phase=0):
        children = np.repeat(genomes, k, axis=0)
        return np.clip(children + rng.normal(0, 0.1, children.shape), LOW, HIGH)

    def valid(self, genomes):
        return ((genomes >= LOW) & (genomes <= HIGH)).all(axis=1)

    def scores(self, genomes):
        return -valley(genomes), np.linalg.norm(np.asarray(genomes) - 1.0, axis=1)

    def measures(self, genomes):
        return np.asarray(genomes)[:, :2]

    def gradients(self, genomes, objective):
        """``(n, 3, 4)`` of the score and both measures."""
        x = np.asarray(genomes, dtype=np.float64)
        gradients = np.zeros((len(x), 3, 4))
        gaps = x[:, 1:] - x[:, :-1] ** 2
        gradients[:, 0, :-1] = 400.0 * x[:, :-1] * gaps + 2.0 * (1.0 - x[:, :-1])
        gradients[:, 0, 1:] -= 200.0 * gaps
        gradients[:, 1, 0] = gradients[:, 2, 1] = 1.0
        return gradients

    def simplifications(self, genome):
        return genome[None][:0]

    def to_config(self):
        return {"workspace": "tests.support.valley_workspace:Valley", "scale": self.scale}
