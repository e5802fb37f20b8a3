"""Emitters: the lockstep climb against a literal Algorithm 1 + 2, and emitters that know no workspace."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ribs.emitters import EvolutionStrategyEmitter, GaussianEmitter
from ribs.schedulers import Scheduler

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import EmitterError, ImproveWorkspaceEmitter, RandomWorkspaceEmitter, make_archive, make_emitter
from optimizers.emitters.adapter import FloatArchiveView, GenomeAdapter
from optimizers.evaluator import Evaluator
from tests.support.shelf_workspace import ShelfWorkspace

SHELF = ShelfWorkspace()


class LiteralMapElites:
    """Algorithms 1 and 2 of Tung et al. (HRI 2024) as printed: a recursive climb, a dict for a solution map."""

    def __init__(self, workspace, evaluate, fanout, rng):
        self.workspace, self.evaluate, self.fanout, self.rng = workspace, evaluate, fanout, rng
        self.map, self.evaluated, self.climbs = {}, [], 0

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
            yield genome, score[0], tuple(int(m) for m in measures[0])

    def offer(self, genome, score, cell):
        if not np.isnan(score) and (cell not in self.map or score > self.map[cell][1]):
            self.map[cell] = genome.copy(), score


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


def test_lockstep_moves_every_climb_as_it_would_move_alone():
    rng, evaluate = np.random.default_rng(5), Evaluator(SHELF, "legibility")
    archive = make_archive(SHELF)
    start = SHELF.sample(30, rng)
    archive.add(start, *evaluate(start))
    emitter = ImproveWorkspaceEmitter(archive, SHELF, climbs=9, fanout=4, seed=1)
    moved = ended = 0
    for _ in range(60):
        genomes = emitter.ask()
        before, where, phases = emitter._scores.copy(), emitter._genomes.copy(), emitter._phase.copy()
        scores, measures = evaluate(genomes)
        scores[rng.random(len(scores)) < 0.1] = np.nan
        emitter.tell(genomes, scores, measures, archive.add(genomes, scores, measures))
        for climb in range(9):
            mine = [(s, i) for i, s in enumerate(scores[climb * 4 : climb * 4 + 4]) if s > before[climb]]
            if mine:
                best = max(mine, key=lambda pair: (pair[0], -pair[1]))
                assert emitter._scores[climb] == best[0]
                np.testing.assert_array_equal(emitter._genomes[climb], genomes[climb * 4 + best[1]])
                assert emitter._phase[climb] == phases[climb]
                moved += 1
            else:
                np.testing.assert_array_equal(emitter._genomes[climb], where[climb])
                assert emitter._phase[climb] == phases[climb] + 1
                assert emitter._climbing[climb] == (phases[climb] + 1 < SHELF.phases)
                ended += phases[climb] + 1 == SHELF.phases
    assert moved > 20
    assert emitter.finished == ended > 20
    assert emitter.started - emitter.finished == emitter._climbing.sum()


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


@pytest.mark.parametrize("bad", [{"climbs": 0}, {"fanout": 0}, {"initial": 0}, {"iterations": -1}])
def test_improve_names_a_bad_argument(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        ImproveWorkspaceEmitter(make_archive(SHELF), SHELF, **bad)


# -- emitters that know no workspace ----------------------------------------------------------------------------------


class Scripted:
    """Proposes what it is given, and remembers what it is told."""

    solution_dim = SHELF.genome_size

    def __init__(self, batches):
        self.batches, self.told = list(batches), []

    def ask(self):
        return self.batches.pop(0)

    def tell(self, solution, objective, measures, add_info):
        self.told.append((solution, objective, measures, add_info))


def started_archive():
    archive = make_archive(SHELF, seed=0)
    genomes = SHELF.sample(50, np.random.default_rng(0))
    archive.add(genomes, SHELF.legibility(genomes), SHELF.measures(genomes))
    return archive


def test_adapter_rounds_clips_filters_and_reports_back_the_whole_batch():
    raw = np.array(
        [
            [0.4, 1.4, 2.4, 0.4, -3.0, 9.0],  # rounds and clips to 0 1 2 | 0 0 1
            [3.0, 3.2, 5.0, 0.0, 0.0, 0.0],  # two boxes on place 3: left out
            [-9.0, 99.0, 3.0, np.nan, 0.0, 1.0],  # 0 5 3 | 0 0 1
            [1.0, 2.0, 3.0, 0.0, 0.0, 0.0],  # will have no score
        ]
    )
    archive = started_archive()
    inner = Scripted([raw])
    adapter = GenomeAdapter(archive, SHELF, inner, name="scripted")
    genomes = adapter.ask()
    np.testing.assert_array_equal(genomes, [[0, 1, 2, 0, 0, 1], [0, 5, 3, 0, 0, 1], [1, 2, 3, 0, 0, 0]])
    assert genomes.dtype == np.int8
    scores = np.array([1.5, -20.0, np.nan])
    info = archive.add(genomes, scores, SHELF.measures(genomes))
    adapter.tell(genomes, scores, SHELF.measures(genomes), info)
    solution, objective, measures, told = inner.told[0]
    np.testing.assert_array_equal(solution, raw)
    np.testing.assert_array_equal(objective, [1.5, -20.0, -20.0, -20.0])
    np.testing.assert_array_equal(measures[[0, 2]], SHELF.measures(genomes[:2]))
    np.testing.assert_array_equal(told["status"][[1, 3]], [0, 0])
    assert (told["value"][[1, 3]] <= told["value"].min()).all()
    assert np.isfinite(objective).all()
    assert np.isfinite(measures).all()
    assert np.isfinite(told["value"]).all()


def test_adapter_asks_again_until_something_is_valid_and_gives_up_in_words():
    wrong = np.full((5, SHELF.genome_size), 2.0)
    right = np.array([[0, 1, 2, 0, 0, 0]])
    inner = Scripted([wrong] * 3 + [right])
    adapter = GenomeAdapter(started_archive(), SHELF, inner)
    np.testing.assert_array_equal(adapter.ask(), right)
    assert len(inner.told) == 3
    with pytest.raises(EmitterError, match="stubborn: no valid layout in 100 consecutive batches"):
        GenomeAdapter(started_archive(), SHELF, Scripted([wrong] * 200), name="stubborn").ask()


@pytest.mark.parametrize("wrong", [np.zeros((4, 3)), np.zeros(6), np.array([["a"] * 6])])
def test_adapter_says_what_shape_it_expected(wrong):
    with pytest.raises(EmitterError, match=r"mine: ask\(\) must return numbers of shape \(n, 6\), it returned"):
        GenomeAdapter(started_archive(), SHELF, Scripted([wrong]), name="mine").ask()


def test_adapter_starts_an_empty_archive_with_random_layouts():
    adapter = GenomeAdapter(make_archive(SHELF), SHELF, Scripted([]), initial=12)
    genomes = adapter.ask()
    assert len(genomes) == 12
    assert SHELF.valid(genomes).all()
    adapter.tell(genomes, SHELF.legibility(genomes), SHELF.measures(genomes), {})


def test_view_shows_integer_elites_as_real_numbers():
    archive = started_archive()
    view = FloatArchiveView(archive)
    assert view.dtypes["solution"] == np.float64
    assert view.sample_elites(3)["solution"].dtype == np.float64
    assert view.best_elite["solution"].dtype == np.float64
    assert view.data("solution").dtype == np.float64
    assert view.data(["solution", "index"])["index"].dtype == archive.dtypes["index"]
    assert view.retrieve(SHELF.measures(SHELF.sample(2, np.random.default_rng(0))))[1]["solution"].dtype == np.float64
    assert len(view) == len(archive) == len(list(view))
    assert next(iter(view))["solution"].dtype == np.float64
    assert FloatArchiveView(make_archive(SHELF)).best_elite is None
    assert view.empty is False


@pytest.mark.parametrize(
    ("emitter", "options"),
    [
        (GaussianEmitter, {"sigma": 0.8, "batch_size": 32}),
        (EvolutionStrategyEmitter, {"sigma0": 1.0, "batch_size": 32}),
        (EvolutionStrategyEmitter, {"sigma0": 1.0, "batch_size": 32, "ranker": "imp", "selection_rule": "mu"}),
        ("ribs.emitters:IsoLineEmitter", {"batch_size": 32}),
    ],
)
def test_pyribs_own_emitters_search_integer_layouts(emitter, options):
    archive = started_archive()
    before = float(archive.stats.qd_score)
    adapted = make_emitter(emitter, archive, SHELF, seed=4, options=options)
    assert isinstance(adapted, GenomeAdapter)
    scheduler, evaluate = Scheduler(archive, [adapted]), Evaluator(SHELF, max_distance=6.0)
    for _ in range(12):
        genomes = scheduler.ask()
        assert SHELF.valid(genomes).all()
        assert genomes.dtype == np.int8
        scheduler.tell(*evaluate(genomes))
    assert float(archive.stats.qd_score) > before
