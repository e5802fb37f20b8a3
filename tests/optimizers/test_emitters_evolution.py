"""Differential evolution beside scipy's on a continuous workspace; CMA-ME and CMA-MAE on keys."""

import numpy as np
import pytest
from ribs.schedulers import Scheduler
from scipy.optimize import differential_evolution

from optimizers import CmaMaeEmitter, CmaMeEmitter, DifferentialEvolutionEmitter, make_archive, search
from optimizers.evaluator import Evaluator
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()
LOW, HIGH = np.array([-1.0, -2.0, -1.5, -1.0]), np.array([2.0, 1.0, 1.5, 2.5])


def valley(x):
    """Rosenbrock's function, to be minimised; 0 at ones."""
    x = np.asarray(x)
    return (100.0 * (x[..., 1:] - x[..., :-1] ** 2) ** 2 + (1.0 - x[..., :-1]) ** 2).sum(axis=-1)


class Valley(ShelfWorkspace):
    """A workspace of four real numbers."""

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
        return -valley(genomes), np.ones(len(genomes))

    def measures(self, genomes):
        return np.asarray(genomes)[:, :2]

    def simplifications(self, genome):
        return genome[None][:0]


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


def test_every_rival_is_the_mutant_in_one_gene_at_least_and_within_bounds():
    workspace = Valley()
    archive, evaluate = make_archive(workspace), Evaluator(workspace)
    start = workspace.sample(30, np.random.default_rng(0))
    archive.add(start, *evaluate(start))
    emitter = DifferentialEvolutionEmitter(
        archive, workspace, population=30, strategy="rand1bin", mutation=0.8, recombination=0.0, seed=3
    )
    genomes = emitter.ask()
    assert ((emitter._trials != emitter._keys).sum(axis=1) == 1).all()
    assert ((emitter._trials >= 0) & (emitter._trials <= 1)).all()
    members = emitter._keys.copy()
    for member, rival in zip(members, emitter._trials, strict=True):
        gene = int(np.flatnonzero(member != rival)[0])
        values = members[:, gene]
        mutants = values[:, None, None] + 0.8 * (values[:, None] - values)
        outside = (mutants < 0) | (mutants > 1)
        assert outside.any() or np.isclose(mutants, rival[gene]).any()
    scores = evaluate(genomes)[0]
    scores[:3] = np.nan
    before = emitter._scores.copy()
    emitter.tell(genomes, scores, None, {})
    wins = scores >= before
    assert wins.any()
    np.testing.assert_array_equal(emitter._scores, np.where(wins, scores, before))
    np.testing.assert_array_equal(emitter._keys[~wins], members[~wins])


def test_generations_count_as_iterations():
    result = search(SHELF, emitter="differential-evolution", iterations=(40, 9), emitter_options={"population": 10})
    assert result.evaluations == 40 + 9 * 10
    assert result.stopped == "iterations"


@pytest.mark.parametrize(("name", "share"), [("cma-me", 0.2), ("cma-mae", 0.1)])
def test_evolution_strategies_climb_the_valley(name, share):
    workspace = Valley()
    options = {"strategies": 3, "batch_size": 20}
    result = search(workspace, emitter=name, evaluations=3000, initial=100, seed=0, emitter_options=options)
    sampled = search(workspace, emitter="random", evaluations=3000, initial=100, seed=0)
    assert -result.best_objective < share * -sampled.best_objective
    assert result.config["emitter"]["settings"]["strategies"] == 3


def test_thresholds_of_cma_mae_rise_slowly():
    workspace = Valley()
    archive, evaluate = make_archive(workspace), Evaluator(workspace)
    start = workspace.sample(100, np.random.default_rng(0))
    archive.add(start, *evaluate(start))
    emitter = CmaMaeEmitter(archive, workspace, strategies=2, batch_size=30, learning_rate=0.1, seed=0)
    median = float(np.median(archive.data("objective")))
    for _ in range(10):
        genomes = emitter.ask()
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
    soft = emitter.emitter._soft
    found = soft.data(["threshold", "objective"])
    assert (found["threshold"] > median).all()
    assert (found["threshold"] < found["objective"]).all()


def test_a_batch_goes_on_from_the_elite_a_strategy_restarted_from():
    archive, evaluate = make_archive(SHELF), Evaluator(SHELF)
    start = SHELF.sample(100, np.random.default_rng(0))
    archive.add(start, *evaluate(start))
    emitter = CmaMeEmitter(archive, SHELF, strategies=2, batch_size=10, sigma0=0.01, seed=0)
    restarts = 0
    for _ in range(20):
        genomes = emitter.ask()
        assert SHELF.valid(genomes).all()
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
        members = emitter.emitter._members
        restarts += any(member.restarts for member in members)
        for member in members:
            if member.restarts and member._opt.current_eval == 0:
                np.testing.assert_allclose(
                    member._opt.mean, emitter.emitter.decoder.encode(member.archive.start[None])[0]
                )
    assert restarts


@pytest.mark.parametrize(
    ("emitter", "bad"),
    [
        (DifferentialEvolutionEmitter, {"population": 4}),
        (DifferentialEvolutionEmitter, {"strategy": "best2exp"}),
        (DifferentialEvolutionEmitter, {"recombination": 2.0}),
        (CmaMeEmitter, {"strategies": 0}),
        (CmaMeEmitter, {"sigma0": 0.0}),
        (CmaMaeEmitter, {"learning_rate": 1.5}),
        (CmaMaeEmitter, {"batch_size": 0}),
    ],
)
def test_a_bad_argument_is_named(emitter, bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        emitter(make_archive(SHELF), SHELF, **bad)
