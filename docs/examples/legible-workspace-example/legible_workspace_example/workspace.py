"""The design problem: into which bays of an aisle to put the goods, so that a picker's goal can be told early."""

from functools import cache

import numpy as np

from legible_envs.errors import LayoutError
from legible_envs.legibility import From, optimal_costs, task_legibility
from legible_envs.tasks import Subtask, TaskGraph
from legible_envs.workspace import Workspace

from .layout import BAYS, GOODS, Aisle

PICK_ALL = TaskGraph([Subtask(name, (name,)) for name in GOODS.values()], start="entrance")
"""One of each of the goods, in any order."""


class AisleWorkspace(Workspace):
    """Where goods lie along a warehouse aisle; a genome is the bay of each, the upper shelf's bays first.

    Args:
        heavy: Whether boxes are heavy, so that they may only lie on the lower shelf.
    """

    name = "aisle"
    measure_names = ("goods on the upper shelf", "bays between the outermost goods")

    def __init__(self, heavy=False):
        self.heavy = bool(heavy)

    # -- genomes -------------------------------------------------------------------------------------------------------

    genome_dtype = property(lambda self: np.dtype(np.int8))
    lower_bounds = property(lambda self: np.zeros(len(GOODS), dtype=np.int8))
    upper_bounds = property(lambda self: np.full(len(GOODS), 2 * BAYS - 1, dtype=np.int8))

    def valid(self, genomes):
        genomes = np.asarray(genomes)
        inside = ((genomes >= 0) & (genomes < 2 * BAYS) & (genomes == np.floor(genomes))).all(axis=1)
        apart = (np.diff(np.sort(genomes, axis=1), axis=1) != 0).all(axis=1)
        boxes = genomes[:, list(GOODS).index("B")]
        return inside & apart & (boxes >= BAYS if self.heavy else True)

    def sample(self, n, rng):
        found = np.zeros((0, len(GOODS)), dtype=np.int8)
        while len(found) < n:
            drawn = rng.permuted(np.tile(np.arange(2 * BAYS, dtype=np.int8), (n, 1)), axis=1)[:, : len(GOODS)]
            found = np.concatenate([found, drawn[self.valid(drawn)]])
        return found[:n]

    def perturb(self, genomes, k, rng, phase=0):
        parents = np.repeat(genomes, k, axis=0)
        rows = np.arange(len(parents))
        children = parents.copy()
        children[rows, rng.integers(len(GOODS), size=len(rows))] = rng.integers(2 * BAYS, size=len(rows))
        return np.where(self.valid(children)[:, None], children, parents)

    def simplifications(self, genome):
        """None: an aisle has no obstacles that could be left out."""
        return np.zeros((0, len(GOODS)), dtype=np.int8)

    def decode(self, genome):
        genome = np.asarray(genome, dtype=float)
        if genome.shape != (len(GOODS),) or not self.valid(genome[None])[0]:
            raise LayoutError(f"not an aisle under the rules: {genome.tolist()}", rule="genome")
        bays = ["."] * (2 * BAYS)
        for letter, bay in zip(GOODS, genome.astype(int), strict=True):
            bays[bay] = letter
        return Aisle("".join(bays[:BAYS]), "".join(bays[BAYS:]))

    def encode(self, layout):
        bays = layout.upper + layout.lower
        genome = np.array([bays.index(letter) for letter in GOODS], dtype=np.int8)
        if not self.valid(genome[None])[0]:
            raise LayoutError("boxes are heavy: they lie on the lower shelf", rule="heavy")
        return genome

    # -- scores --------------------------------------------------------------------------------------------------------

    def scores(self, genomes):
        genomes = np.asarray(genomes)
        rows = [
            _score(tuple(int(bay) for bay in genome)) if good else (np.nan, np.nan)
            for genome, good in zip(genomes, self.valid(genomes), strict=True)
        ]
        legibility, distance = np.array(rows, dtype=np.float64).reshape(-1, 2).T
        return legibility, distance

    def measures(self, genomes):
        genomes = np.asarray(genomes)
        return np.stack([(genomes < BAYS).sum(axis=1), np.ptp(genomes % BAYS, axis=1)], axis=1).astype(np.float64)

    archive_dims = property(lambda self: (len(GOODS) + 1, BAYS))
    archive_ranges = property(lambda self: [(-0.5, len(GOODS) + 0.5), (-0.5, BAYS - 0.5)])

    def summary(self, genome):
        return {"score": self.legibility(genome), "distance": self.distance(genome)}

    def explain(self, genome):
        """How far each of the goods is from the entrance."""
        self.decode(genome)
        graph = _graph(tuple(int(bay) for bay in genome))
        return [
            {"goods": name, "bay": int(bay), "steps from the entrance": optimal_costs(graph, name)[From("entrance")]}
            for name, bay in zip(GOODS.values(), genome, strict=True)
        ]

    def to_config(self):
        return {"workspace": self.name, "heavy": self.heavy}


def _graph(bays):
    """Steps of cost 1 between floor cells, from the entrance and from each of the goods, and to them."""
    cells = [(row, column) for row in (1, 2) for column in range(BAYS)]
    graph = {cell: {} for cell in cells}
    for row, column in cells:
        for near in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if near in graph:
                graph[row, column][near] = 1.0
    graph[From("entrance")] = {(1, 0): 1.0, (2, 0): 1.0}
    for name, bay in zip(GOODS.values(), bays, strict=True):
        front = (1 if bay < BAYS else 2, bay % BAYS)
        graph[name] = {}
        graph[front][name] = 1.0
        graph[From(name)] = {front: 1.0}
    return graph


@cache
def _score(bays):
    """Eq. 3 by its definition in plain Python, and the expected steps of the whole task."""
    graph = _graph(bays)
    costs = {name: optimal_costs(graph, name) for name in GOODS.values()}
    distance = sum(stage.weight * costs[goal][From(stage.start)] for stage in PICK_ALL.stages() for goal in stage.goals)
    return task_legibility(graph, PICK_ALL), distance
