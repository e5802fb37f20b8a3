"""Algorithms 1 and 2 of Tung et al. (HRI 2024) as printed, to hold the lockstep emitter against."""

import numpy as np


class LiteralMapElites:
    """A recursive climb, and a dict for a solution map.

    Args:
        workspace: The design problem.
        evaluate: ``(1, d)`` genomes to scores and measures.
        fanout: Perturbations per step of a climb.
        rng: Source of all randomness.
        cell_of: ``(1, k)`` measures to the cell they are in; by default the measures, as whole numbers.
    """

    def __init__(self, workspace, evaluate, fanout, rng, cell_of=None):
        self.workspace, self.evaluate, self.fanout, self.rng = workspace, evaluate, fanout, rng
        self.cell_of = cell_of or (lambda measures: tuple(int(m) for m in measures[0]))
        self.map, self.evaluated = {}, []

    def run(self, initial, climbs):
        for genome, score, cell in self.scored(initial):
            self.offer(genome, score, cell)
        for _ in range(climbs):
            cells = sorted(self.map)
            genome, score = self.map[cells[self.rng.integers(len(cells), size=1)[0]]]
            for phase in range(self.workspace.phases):
                genome, score = self.improve(genome, score, phase)

    def improve(self, genome, score, phase):
        best, best_score = genome, score
        children = self.workspace.perturb(genome[None], self.fanout, self.rng, phase=phase)
        for child, child_score, cell in self.scored(children):
            self.offer(child, child_score, cell)
            if child_score > best_score:
                best, best_score = child, child_score
        if best_score > score:
            return self.improve(best, best_score, phase)
        return genome, score

    def scored(self, genomes):
        for genome in genomes:
            score, measures = self.evaluate(genome[None])
            self.evaluated.append(genome)
            yield genome, score[0], self.cell_of(measures)

    def offer(self, genome, score, cell):
        if not np.isnan(score) and (cell not in self.map or score > self.map[cell][1]):
            self.map[cell] = genome.copy(), score
