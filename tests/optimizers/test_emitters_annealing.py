"""Annealed walks: against a literal one, their temperature, and what they find."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import AnnealingEmitter, make_archive, search
from optimizers.emitters.draws import crossed, draw_elites, perturbed
from optimizers.evaluator import Evaluator
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


def started(cap=None):
    archive, evaluate = make_archive(SHELF), Evaluator(SHELF, max_distance=cap)
    start = SHELF.sample(40, np.random.default_rng(0))
    archive.add(start, *evaluate(start))
    return archive, evaluate


@pytest.mark.parametrize("cap", [None, 5.0])
def test_one_chain_is_simulated_annealing_as_in_the_book(cap):
    """Metropolis' rule with a literal linear schedule, drawing from the same generator in the same order."""
    archive, evaluate = started(cap)
    emitter = AnnealingEmitter(archive, SHELF, chains=1, cycle=60, heat=0.5, cold=0.1, seed=7)
    visited = []
    for _ in range(150):
        genomes = emitter.ask()
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
        visited.append((emitter._genomes[0].copy(), emitter._scores[0]))
    assert emitter.cycles == 3

    archive, evaluate = started(cap)
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


def test_resampling_shares_walks_out_in_proportion():
    """After drawing anew, a walk has as many copies as its weight asks for, rounded up or down."""
    archive, evaluate = started()
    emitter = AnnealingEmitter(archive, SHELF, chains=40, cycle=4000, resamplings=10, seed=5)
    copies = 0
    for step in range(60):
        before, temperature = emitter._scores.copy(), emitter._temperature(step - 10)
        genomes = emitter.ask()
        if step and step % 10 == 0:
            weights = np.exp((before - before.max()) * (1 / emitter.temperature - 1 / temperature))
            weights *= 40 / weights.sum()
            for score in np.unique(before):
                share = weights[before == score].sum()
                assert abs((emitter._scores == score).sum() - share) < 2
            copies += (np.sort(before) != np.sort(emitter._scores)).any()
            np.testing.assert_array_equal(emitter._scores, evaluate.score(emitter._genomes))
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
    assert copies


def test_chains_accept_independently_and_never_what_is_not_allowed():
    archive, evaluate = started(cap=4.0)
    emitter = AnnealingEmitter(archive, SHELF, chains=30, cycle=3000, heat=100.0, seed=1)
    for _ in range(100):
        genomes = emitter.ask()
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
        assert (SHELF.distance(emitter._genomes) <= 4.0).all()
        np.testing.assert_array_equal(emitter._scores, evaluate.score(emitter._genomes))
    assert len(np.unique(emitter._genomes, axis=0)) > 5


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


def test_groups_resample_within_themselves():
    archive, evaluate = started()
    emitter = AnnealingEmitter(archive, SHELF, chains=8, groups=5, cycle=800, resamplings=10, seed=5)
    foreign = 0
    for step in range(100):
        before = emitter._scores.reshape(5, 8).copy()
        genomes = emitter.ask()
        after = emitter._scores.reshape(5, 8)
        if step:
            assert all(np.isin(now, then).all() for now, then in zip(after, before, strict=True))
            foreign += (~np.isin(before[1:], before[0])).sum()
        scores, measures = evaluate(genomes)
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
    assert foreign > 100  # groups do hold what others lack


@pytest.mark.slow
def test_annealing_beats_climbing_at_equal_evaluations():
    workspace = OvercookedWorkspace(shape=(9, 9), prefix="sum")
    scores = {
        name: [search(workspace, emitter=name, evaluations=20_000, seed=seed).best_objective for seed in range(3)]
        for name in ("annealing", "improve")
    }
    assert np.mean(scores["annealing"]) > np.mean(scores["improve"]) + 5


@pytest.mark.parametrize(
    "bad",
    [{"chains": 0}, {"cycle": 0}, {"groups": 0}, {"heat": 0.0}, {"cold": 0.0}, {"initial": 0}, {"resamplings": -1}],
)
def test_a_bad_argument_is_named(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        AnnealingEmitter(make_archive(SHELF), SHELF, **bad)


# -- draws shared by emitters ------------------------------------------------------------------------------------------


def test_elites_are_drawn_by_cell_and_not_by_arrival():
    archive, evaluate = started()
    again = make_archive(SHELF)
    data = archive.data(["solution", "objective", "measures"])
    order = np.random.default_rng(3).permutation(len(data["objective"]))
    again.add(data["solution"][order], data["objective"][order], data["measures"][order])
    for replace in (True, False):
        drawn = [draw_elites(a, 15, np.random.default_rng(1), replace=replace) for a in (archive, again)]
        np.testing.assert_array_equal(drawn[0][0], drawn[1][0])
        np.testing.assert_array_equal(drawn[0][1], evaluate.score(drawn[0][0]))
    everyone, _ = draw_elites(archive, 10_000, np.random.default_rng(1), replace=False)
    assert len(np.unique(everyone, axis=0)) == len(everyone) == len(archive)


def test_every_phase_is_perturbed_and_crossings_are_valid():
    rng = np.random.default_rng(0)
    parents = SHELF.sample(400, rng)
    children = perturbed(SHELF, parents, rng)
    boxes, lamps = (children[:, :3] != parents[:, :3]).any(axis=1), (children[:, 3:] != parents[:, 3:]).any(axis=1)
    assert boxes.mean() > 0.2
    assert lamps.mean() > 0.4
    assert not (boxes & lamps).any()
    assert perturbed(SHELF, parents[:0], rng).shape == (0, 6)
    others = SHELF.sample(400, rng)
    mixed = crossed(SHELF, parents, others, rng)
    assert SHELF.valid(mixed).all()
    assert ((mixed == parents) | (mixed == others)).all()
    assert (mixed != parents).any()
    assert (mixed != others).any()
