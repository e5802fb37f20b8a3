"""A tiny third-party-like workspace for tests: nothing of kitchens, two phases, small enough for brute force.

Three boxes stand on six places of a shelf, no two on one place; each of three lamps is on or off. Phase 0 moves a box,
phase 1 switches a lamp. Boxes left of one another score; lamps score or cost depending on the boxes; one lamp does
nothing (so there is something to prune).
"""

import itertools

import numpy as np

from legible_envs.workspace import Workspace

BOXES, PLACES, LAMPS = 3, 6, 3
WEIGHTS = np.array([[0.0, 3.1, -1.7], [0.4, 0.0, 2.3], [1.9, -2.2, 0.0]])
LIGHT = np.array([[0.9, -0.6, 0.5, -0.3, 0.7, -0.8], [-0.4, 0.8, -0.7, 0.6, -0.5, 0.3], [0.0] * 6])


class ShelfWorkspace(Workspace):
    name = "shelf"
    phases = 2
    measure_names = ("lamps on", "place of the first box")

    def __init__(self, scale=1.0):
        self.scale = float(scale)

    genome_dtype = property(lambda self: np.dtype(np.int8))
    lower_bounds = property(lambda self: np.zeros(BOXES + LAMPS, dtype=np.int8))
    upper_bounds = property(lambda self: np.array([PLACES - 1] * BOXES + [1] * LAMPS, dtype=np.int8))
    archive_dims = property(lambda self: (LAMPS + 1, PLACES))
    archive_ranges = property(lambda self: [(-0.5, LAMPS + 0.5), (-0.5, PLACES - 0.5)])

    def decode(self, genome):
        shelf = ["."] * PLACES
        for box, place in enumerate(np.asarray(genome)[:BOXES]):
            shelf[place] = "ABC"[box]
        return "".join(shelf) + "\n" + "".join("-+"[on] for on in np.asarray(genome)[BOXES:])

    def encode(self, layout):
        shelf, lamps = layout.split("\n")
        return np.array([shelf.index(box) for box in "ABC"] + ["-+".index(lamp) for lamp in lamps], dtype=np.int8)

    def sample(self, n, rng):
        boxes = np.argsort(rng.random((n, PLACES)), axis=1)[:, :BOXES]
        return np.concatenate([boxes, rng.random((n, LAMPS)) < 0.2], axis=1).astype(np.int8)

    def perturb(self, genomes, k, rng, phase=0):
        children = np.repeat(genomes, k, axis=0)
        rows = np.arange(len(children))
        if phase == 1:
            children[rows, BOXES + rng.integers(LAMPS, size=len(rows))] ^= 1
            return children
        moved = children.copy()
        moved[rows, rng.integers(BOXES, size=len(rows))] = rng.integers(PLACES, size=len(rows))
        return np.where(self.valid(moved)[:, None], moved, children)

    def valid(self, genomes):
        genomes = np.asarray(genomes)
        inside = ((genomes >= self.lower_bounds) & (genomes <= self.upper_bounds)).all(axis=1)
        boxes = np.sort(genomes[:, :BOXES], axis=1)
        return inside & (np.diff(boxes, axis=1) != 0).all(axis=1)

    def scores(self, genomes):
        genomes = np.asarray(genomes)
        boxes = np.clip(genomes[:, :BOXES].astype(np.int64), 0, PLACES - 1)
        gaps = boxes[:, None, :] - boxes[:, :, None]
        score = (WEIGHTS * np.tanh(gaps * 0.7)).sum(axis=(1, 2))
        light = LIGHT[:, boxes].sum(axis=2)  # (lamps, n)
        score = self.scale * (score + (genomes[:, BOXES:].T * light).sum(axis=0))
        distance = np.abs(np.diff(boxes, axis=1)).sum(axis=1).astype(np.float64)
        valid = self.valid(genomes)
        return np.where(valid, score, np.nan), np.where(valid, distance, np.nan)

    def measures(self, genomes):
        genomes = np.asarray(genomes)
        return np.stack([genomes[:, BOXES:].sum(axis=1), genomes[:, 0]], axis=1).astype(np.float64)

    def simplifications(self, genome):
        on = [BOXES + lamp for lamp in range(LAMPS) if genome[BOXES + lamp]]
        out = np.tile(genome, (len(on), 1))
        out[np.arange(len(on)), on] = 0
        return out

    def summary(self, genome):
        score, distance = self.scores(np.asarray(genome)[None])
        return {"score": float(score[0]), "distance": float(distance[0])}

    def explain(self, genome):
        return [self.summary(genome)]

    def to_config(self):
        return {"workspace": "tests.support.shelf_workspace:ShelfWorkspace", "scale": self.scale}

    def all_genomes(self):
        grid = itertools.product(*(range(high + 1) for high in self.upper_bounds))
        genomes = np.array(list(grid), dtype=np.int8)
        return genomes[self.valid(genomes)]
