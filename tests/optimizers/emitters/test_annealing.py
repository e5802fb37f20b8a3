"""Annealed chains: against a literal one, their temperature, and what they find."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import AnnealingEmitter, make_archive, search
from optimizers.emitters.draws import draw_elites, perturbed
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


@pytest.mark.parametrize("cap", [None, 5.0])
def test_one_chain_is_simulated_annealing_as_in_the_book(cap, started, told):
    """Metropolis' rule with a literal linear schedule, drawing from the same generator in the same order."""
    archive, evaluate = started(SHELF, max_distance=cap)
    emitter = AnnealingEmitter(archive, SHELF, chains=1, cycle=60, heat=0.5, cold=0.1, seed=7)
    visited = []
    for _ in range(150):
        told(emitter, evaluate, emitter.ask())
        visited.append((emitter.state.genomes[0, 0], emitter.state.scores[0, 0]))
    assert emitter.cycles == 3

    archive, evaluate = started(SHELF, max_distance=cap)
    rng, changes, losses = np.random.default_rng(7), [], 0
    for step in range(150):
        if step % 60 == 0:
            genomes, (score,) = draw_elites(archive, 1, rng)
            genome = genomes[0]
        child = perturbed(SHELF, genome[None], rng)
        (new,), measures = evaluate(child)
        archive.add(child, [new], measures)
        if not np.isnan(new) and new != score:
            changes.append(abs(new - score))
        temperature = np.inf
        if changes:
            temperature = 0.5 * np.median(changes) * (1 - (step % 60) / 60 * 0.9)
        luck = rng.random(1)[0]
        if not np.isnan(new) and (new >= score or luck < np.exp((new - score) / temperature)):
            losses += new < score
            genome, score = child[0], new
        np.testing.assert_array_equal(visited[step][0], genome)
        assert visited[step][1] == score
    assert losses > 5


def test_resampling_shares_chains_out_in_proportion(started, told):
    """After drawing anew, a chain has as many copies as its weight asks for, rounded up or down."""
    archive, evaluate = started(SHELF)
    emitter = AnnealingEmitter(archive, SHELF, chains=40, cycle=4000, resamplings=10, cold=0.03, seed=5)
    copies = 0
    for step in range(60):
        before = emitter.state.scores[0]
        genomes = emitter.ask()
        if step and step % 10 == 0:
            now, then = (1.0 - at / 100 * (1.0 - 0.03) for at in (step, step - 10))
            temperature = emitter.temperature
            weights = np.exp((before - before.max()) * (1 / temperature - 1 / (temperature * then / now)))
            weights *= 40 / weights.sum()
            after = emitter.state.scores[0]
            for score in np.unique(before):
                share = weights[before == score].sum()
                assert abs((after == score).sum() - share) < 2
            copies += (np.sort(before) != np.sort(after)).any()
            np.testing.assert_array_equal(after, evaluate.score(emitter.state.genomes[0]))
        told(emitter, evaluate, genomes)
    assert copies


def test_chains_accept_independently_and_never_what_is_not_allowed(started, told):
    archive, evaluate = started(SHELF, max_distance=4.0)
    emitter = AnnealingEmitter(archive, SHELF, chains=30, cycle=3000, heat=100.0, seed=1)
    for _ in range(100):
        told(emitter, evaluate, emitter.ask())
        genomes, scores = emitter.state.genomes[0], emitter.state.scores[0]
        assert (SHELF.distance(genomes) <= 4.0).all()
        np.testing.assert_array_equal(scores, evaluate.score(genomes))
    assert len(np.unique(genomes, axis=0)) > 5


def test_the_temperature_has_the_unit_of_the_objective():
    temperatures = []
    for scale in (1.0, 1000.0):
        workspace = ShelfWorkspace(scale=scale)
        result = []
        search(workspace, emitter="annealing", evaluations=2000, seed=2, callbacks=[result.append])
        temperatures.append(result[-1].scheduler.emitters[0].temperature)
    assert temperatures[1] == pytest.approx(1000 * temperatures[0])


@given(st.integers(1, 3_000_000), st.integers(1, 2000))
def test_default_cycles_fill_the_budget(evaluations, initial):
    emitter = AnnealingEmitter(make_archive(SHELF), SHELF, evaluations=evaluations, initial=initial)
    left = evaluations - min(initial, evaluations // 2)
    assert 4 <= emitter.chains <= 16
    assert 1 <= emitter.groups <= 8
    assert emitter.cycle >= 16 * 6**2 or emitter.cycle == max(1, left)
    together = emitter.groups * emitter.cycle
    assert left % together < max(1, left // together) * emitter.groups


def test_groups_resample_within_themselves(started, told):
    archive, evaluate = started(SHELF)
    emitter = AnnealingEmitter(archive, SHELF, chains=8, groups=5, cycle=800, resamplings=10, seed=5)
    foreign = 0
    for step in range(100):
        before = emitter.state.scores
        genomes = emitter.ask()
        after = emitter.state.scores
        if step:
            assert all(np.isin(now, then).all() for now, then in zip(after, before, strict=True))
            foreign += (~np.isin(before[1:], before[0])).sum()
        told(emitter, evaluate, genomes)
    assert foreign > 100  # groups do hold what others lack


@pytest.mark.slow
def test_annealing_beats_climbing_at_equal_evaluations():
    workspace = OvercookedWorkspace(shape=(9, 9), prefix="sum")
    scores = {
        name: [search(workspace, emitter=name, evaluations=20_000, seed=seed).best_objective for seed in range(3)]
        for name in ("annealing", "improve")
    }
    assert np.mean(scores["annealing"]) > np.mean(scores["improve"]) + 5
