"""The search of tables: the generic emitter knows no table, climbs in two phases, and resumes exactly."""

import numpy as np
import pytest
from ribs.schedulers import Scheduler

from legible_envs.tabletop import TabletopWorkspace
from optimizers import ImproveWorkspaceEmitter, make_archive, search
from optimizers.evaluator import Evaluator
from tests.oracles.map_elites_oracle import LiteralMapElites

CONDITIONS = ("both", "placement", "obstacles")


@pytest.mark.parametrize("condition", CONDITIONS)
def test_one_climb_is_the_literal_algorithm(condition):
    ws = TabletopWorkspace("tea", condition)
    evaluate = Evaluator(ws)
    initial = ws.sample(20, np.random.default_rng(1))
    archive = make_archive(ws)
    literal = LiteralMapElites(
        ws, evaluate, 6, np.random.default_rng(2), cell_of=lambda measures: int(archive.index_of(measures)[0])
    )
    literal.run(initial, climbs=8)

    archive.add(initial, *evaluate(initial))
    emitter = ImproveWorkspaceEmitter(archive, ws, climbs=1, fanout=6, iterations=8, seed=2)
    scheduler, evaluated = Scheduler(archive, [emitter]), [initial]
    while not emitter.done:
        genomes = scheduler.ask()
        evaluated.append(genomes)
        scheduler.tell(*evaluate(genomes))

    assert np.array_equal(np.concatenate(evaluated), np.array(literal.evaluated))
    found = archive.data(["index", "solution", "objective"])
    assert dict(zip(found["index"].tolist(), found["objective"].tolist(), strict=True)) == {
        cell: score for cell, (_, score) in literal.map.items()
    }
    for cell, genome in zip(found["index"], found["solution"], strict=True):
        assert np.array_equal(genome, literal.map[cell][0])
    assert len(literal.evaluated) > 20 + 8 * 6 * ws.phases  # some climbs did take steps


@pytest.mark.slow
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_search_that_was_stopped_ends_like_one_that_was_not(condition, tmp_path):
    ws = TabletopWorkspace("columns", condition)
    settings = {"evaluations": 3000, "initial": 300, "seed": 4, "progress": False}
    whole = search(ws, **settings)
    first = search(ws, **settings, checkpoint=tmp_path, callbacks=[lambda state: state.evaluations > 1500])
    assert first.stopped == "callback"
    second = search(ws, **settings, checkpoint=tmp_path, resume=True)
    assert second.evaluations == whole.evaluations
    for field in ("solution", "objective", "index"):
        assert np.array_equal(second.archive.data(field), whole.archive.data(field))
    assert np.array_equal(second.best_genome, whole.best_genome)
    assert whole.best_objective > Evaluator(ws)(ws.sample(300, np.random.default_rng(0)))[0].max()
    assert whole.best_objective == pytest.approx(ws.summary(whole.best_genome)["objective"])


@pytest.mark.benchmark
@pytest.mark.parametrize(("condition", "least"), [("placement", 11.8), ("obstacles", 11.0), ("both", 14.2)])
def test_the_papers_budget_reaches_the_scores_known(condition, least):
    """1,000 random layouts and 1,000 climbs."""
    found = search(TabletopWorkspace("columns", condition), iterations=(1000, 1000), progress=False)
    assert found.best_objective > least
