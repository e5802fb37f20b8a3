"""Differential evolution beside scipy's on a continuous workspace."""

import numpy as np
import pytest
from ribs.schedulers import Scheduler
from scipy.optimize import differential_evolution

from optimizers import DifferentialEvolutionEmitter, make_archive, search
from optimizers.evaluator import Evaluator
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.valley_workspace import HIGH, LOW, Valley, valley

SHELF = ShelfWorkspace()
MEMBERS, GENERATIONS = 40, 50


def ours(strategy, seed):
    workspace = Valley()
    archive, evaluate = make_archive(workspace), Evaluator(workspace)
    start = workspace.sample(MEMBERS, np.random.default_rng(seed))
    archive.add(start, *evaluate(start))
    emitter = DifferentialEvolutionEmitter(
        archive, workspace, population=MEMBERS, strategy=strategy, iterations=GENERATIONS, seed=seed + 1000
    )
    scheduler = Scheduler(archive, [emitter])
    while not emitter.done:
        scheduler.tell(*evaluate(scheduler.ask()))
    assert len(scheduler.ask()) == 0
    return np.log10(-archive.stats.obj_max)


def theirs(strategy, seed):
    start = Valley().sample(MEMBERS, np.random.default_rng(seed))
    found = differential_evolution(
        valley,
        list(zip(LOW, HIGH, strict=True)),
        strategy=strategy,
        maxiter=GENERATIONS,
        init=start,
        tol=0.0,
        polish=False,
        updating="deferred",
        vectorized=False,
        rng=np.random.default_rng(seed),
    )
    return np.log10(found.fun)


@pytest.mark.slow
def test_differential_evolution_gets_as_far_as_scipys_with_every_strategy():
    gaps = {}
    for strategy in ("best1bin", "rand1bin", "currenttobest1bin"):
        a = np.array([ours(strategy, seed) for seed in range(8)])
        b = np.array([theirs(strategy, seed) for seed in range(8)])
        gaps[strategy] = b.mean()
        error = np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
        assert abs(a.mean() - b.mean()) < 2.5 * error, strategy
    # The strategies themselves are orders of magnitude apart, so that a wrong one would be noticed.
    assert gaps["rand1bin"] - gaps["best1bin"] > 1.0


def test_every_rival_is_the_mutant_in_one_gene_at_least_and_within_bounds(started, told):
    workspace = Valley()
    archive, evaluate = started(workspace, 30)
    emitter = DifferentialEvolutionEmitter(
        archive, workspace, population=30, strategy="rand1bin", mutation=0.8, recombination=0.0, seed=3
    )
    genomes = emitter.ask()
    before = emitter.state
    rivals = workspace.key_decoder().encode(genomes)
    assert ((rivals > 0) & (rivals < 1)).all()  # drawn anew where out of bounds, not clipped to an end
    differs = ~np.isclose(rivals, before.keys, rtol=0, atol=1e-12)
    assert (differs.sum(axis=1) == 1).all()
    for different, rival in zip(differs, rivals, strict=True):
        gene = int(np.flatnonzero(different)[0])
        values = before.keys[:, gene]
        mutants = values[:, None, None] + 0.8 * (values[:, None] - values)
        outside = (mutants < 0) | (mutants > 1)
        assert outside.any() or np.isclose(mutants, rival[gene]).any()
    scores = told(emitter, evaluate, genomes, unscored=range(3))
    after, wins = emitter.state, scores >= before.scores
    assert wins.any()
    np.testing.assert_array_equal(after.scores, np.where(wins, scores, before.scores))
    np.testing.assert_array_equal(after.genomes, np.where(wins[:, None], genomes, before.genomes))
    np.testing.assert_array_equal(after.keys[~wins], before.keys[~wins])
    np.testing.assert_allclose(after.keys[wins], rivals[wins], atol=1e-12)


def test_generations_count_as_iterations():
    result = search(SHELF, emitter="differential-evolution", iterations=(40, 9), emitter_options={"population": 10})
    assert result.evaluations == 40 + 9 * 10
    assert result.stopped == "iterations"
