"""The lockstep climb against a literal Algorithm 1 + 2, alone and beside other climbs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ribs.schedulers import Scheduler

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import ImproveWorkspaceEmitter, RandomWorkspaceEmitter, make_archive
from optimizers.evaluator import Evaluator
from tests.oracles.map_elites_oracle import LiteralMapElites
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


KITCHENS = [OvercookedWorkspace(shape=(5, 5)), OvercookedWorkspace(shape=(4, 7), prefix="sum", pots=1)]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("workspace", "fanout", "cap"),
    [(SHELF, 4, None), (SHELF, 3, 5.0), (KITCHENS[0], 6, None), (KITCHENS[1], 5, 130.0)],
    ids=["shelf", "shelf-capped", "5x5", "4x7-capped"],
)
def test_one_climb_is_the_literal_algorithm(workspace, fanout, cap, seed):
    evaluate = Evaluator(workspace, "legibility", max_distance=cap)
    initial = workspace.sample(40, np.random.default_rng(seed + 100))
    literal = LiteralMapElites(workspace, evaluate, fanout, np.random.default_rng(seed))
    literal.run(initial, climbs=25)

    archive = make_archive(workspace)
    archive.add(initial, *evaluate(initial))
    emitter = ImproveWorkspaceEmitter(archive, workspace, climbs=1, fanout=fanout, iterations=25, seed=seed)
    scheduler, evaluated = Scheduler(archive, [emitter]), [initial]
    while not emitter.done:
        genomes = scheduler.ask()
        evaluated.append(genomes)
        scheduler.tell(*evaluate(genomes))

    np.testing.assert_array_equal(np.concatenate(evaluated), np.array(literal.evaluated))
    found = archive.data(["solution", "objective", "measures"])
    cells = [tuple(int(m) for m in row) for row in found["measures"]]
    assert set(cells) == set(literal.map)
    for cell, genome, score in zip(cells, found["solution"], found["objective"], strict=True):
        np.testing.assert_array_equal(genome, literal.map[cell][0])
        assert score == literal.map[cell][1]
    assert len(literal.evaluated) > 40 + 25 * fanout  # some climbs did take steps


def test_lockstep_moves_every_climb_as_it_would_move_alone(started, told):
    rng = np.random.default_rng(5)
    archive, evaluate = started(SHELF, 30)
    emitter = ImproveWorkspaceEmitter(archive, SHELF, climbs=9, fanout=4, seed=1)
    moved = ended = 0
    for _ in range(60):
        genomes = emitter.ask()
        before = emitter.state
        scores = told(emitter, evaluate, genomes, unscored=np.flatnonzero(rng.random(len(genomes)) < 0.1))
        after = emitter.state
        for climb in range(9):
            mine = [(s, i) for i, s in enumerate(scores[climb * 4 : climb * 4 + 4]) if s > before.scores[climb]]
            if mine:
                best = max(mine, key=lambda pair: (pair[0], -pair[1]))
                assert after.scores[climb] == best[0]
                np.testing.assert_array_equal(after.genomes[climb], genomes[climb * 4 + best[1]])
                assert after.phases[climb] == before.phases[climb]
                moved += 1
            else:
                np.testing.assert_array_equal(after.genomes[climb], before.genomes[climb])
                assert after.phases[climb] == before.phases[climb] + 1
                assert after.climbing[climb] == (before.phases[climb] + 1 < SHELF.phases)
                ended += before.phases[climb] + 1 == SHELF.phases
    assert moved > 20
    assert emitter.finished == ended > 20
    assert emitter.started - emitter.finished == emitter.state.climbing.sum()


def test_its_state_is_a_copy_that_cannot_be_written_to():
    state = ImproveWorkspaceEmitter(make_archive(SHELF), SHELF, climbs=2).state
    with pytest.raises(ValueError, match="read-only"):
        state.scores[0] = 7.0


@given(st.integers(1, 5_000_000), st.integers(1, 300))
def test_default_climbs_leave_forty_rounds(evaluations, fanout):
    emitter = ImproveWorkspaceEmitter(make_archive(SHELF), SHELF, evaluations=evaluations, fanout=fanout)
    assert emitter.climbs == 1 or 40 * emitter.climbs * fanout <= evaluations
    assert emitter.climbs * fanout <= 2048


@pytest.mark.parametrize("iterations", [0, 1, 7, 23])
def test_runs_exactly_the_climbs_asked_for(iterations):
    archive = make_archive(SHELF)
    scheduler = Scheduler(archive, [ImproveWorkspaceEmitter(archive, SHELF, climbs=5, fanout=3, iterations=iterations)])
    evaluate = Evaluator(SHELF)
    scheduler.tell(*evaluate(scheduler.ask()))
    emitter = scheduler.emitters[0]
    for _ in range(1000):
        if emitter.done:
            break
        genomes = scheduler.ask()
        assert len(genomes) <= 3 * 5
        scheduler.tell(*evaluate(genomes))
    assert emitter.done
    assert emitter.started == emitter.finished == iterations
    assert emitter.ask().shape == (0, SHELF.genome_size)


def test_works_in_a_plain_pyribs_scheduler_from_an_empty_archive():
    workspace = OvercookedWorkspace(shape=(5, 5))
    archive = make_archive(workspace, seed=0)
    emitters = [
        ImproveWorkspaceEmitter(archive, workspace, climbs=8, seed=1, initial=50),
        RandomWorkspaceEmitter(archive, workspace, batch_size=20, seed=2),
    ]
    scheduler = Scheduler(archive, emitters)
    first = scheduler.ask()
    assert first.shape == (70, workspace.genome_size)
    for _ in range(10):
        scheduler.tell(workspace.legibility(first), workspace.measures(first))
        first = scheduler.ask()
        assert first.dtype == np.int8
        assert workspace.valid(first).all()
    assert len(first) == 8 * 24 + 20
