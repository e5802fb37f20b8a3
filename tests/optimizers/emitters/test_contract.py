"""What every emitter keeps, whatever it is: the contract, the seed, resuming, caps, an empty archive, its options."""

from importlib.util import find_spec

import numpy as np
import pytest
from ribs.emitters import EvolutionStrategyEmitter, GaussianEmitter
from ribs.schedulers import Scheduler

from legible_envs.overcooked import OvercookedWorkspace
from optimizers import (
    AnnealingEmitter,
    CmaMaeEmitter,
    CmaMeEmitter,
    DifferentialEvolutionEmitter,
    EmitterError,
    GradientArborescenceEmitter,
    ImproveWorkspaceEmitter,
    MutationEmitter,
    NoveltyLocalCompetitionEmitter,
    PolicyGradientEmitter,
    RandomWorkspaceEmitter,
    check_emitter,
    list_emitters,
    make_archive,
    make_emitter,
    search,
)
from optimizers.emitters.adapter import GenomeAdapter
from optimizers.evaluator import Evaluator
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.third_party_emitters import Shift, reshuffle
from tests.support.valley_workspace import Valley

SHELF, VALLEY = ShelfWorkspace(), Valley()
KITCHEN = OvercookedWorkspace(shape=(5, 5), prefix="sum")


BUILT_IN = ["annealing", "cma-mae", "cma-me", "differential-evolution", "improve", "mutation", "nslc", "random"]
BUILT_IN += ["ppo"] if find_spec("torch") else []
ADAPTED = {
    "gaussian": (GaussianEmitter, {"sigma": 0.8, "batch_size": 32}),
    "evolution strategy": (EvolutionStrategyEmitter, {"sigma0": 1.0, "batch_size": 32}),
    "evolution strategy by improvement": (
        EvolutionStrategyEmitter,
        {"sigma0": 1.0, "batch_size": 32, "ranker": "imp", "selection_rule": "mu"},
    ),
    "iso line": ("ribs.emitters:IsoLineEmitter", {"batch_size": 32}),
}
PLUGGED_IN = {"entry point": ("crossover", {}), "class": (Shift, {}), "function": (reshuffle, {})}
EMITTERS = {**{name: (name, {}) for name in BUILT_IN}, **ADAPTED, **PLUGGED_IN}
every_emitter = pytest.mark.parametrize(("emitter", "options"), EMITTERS.values(), ids=EMITTERS)


def test_all_that_are_built_in_are_here():
    built_in = {name: info for name, info in list_emitters().items() if info.origin == "built in"}
    # Needs a workspace with gradients; see the tests on the valley below and those of differentiable tables.
    assert set(built_in) - {"gradient-arborescence"} == {*BUILT_IN, "ppo"}
    assert all(info.summary().endswith(".") for info in built_in.values())


@every_emitter
def test_keeps_the_contract(emitter, options):
    check_emitter(emitter, SHELF, options=options)


@pytest.mark.parametrize("emitter", [*BUILT_IN, "crossover", Shift, reshuffle])
def test_keeps_the_contract_in_a_kitchen(emitter):
    check_emitter(emitter, KITCHEN)


@pytest.mark.parametrize("emitter", ["improve", "random"])
def test_keeps_the_contract_where_no_workspace_is_named(emitter):
    check_emitter(emitter)


@pytest.mark.parametrize("emitter", [*BUILT_IN, "gradient-arborescence", "ribs.emitters:IsoLineEmitter"])
def test_keeps_the_contract_with_real_numbers(emitter):
    check_emitter(emitter, VALLEY)


@every_emitter
def test_an_interrupted_search_goes_on_as_if_it_had_not_been(emitter, options, same_archive, tmp_path):
    settings = {"emitter": emitter, "emitter_options": options, "evaluations": 2500, "seed": 3, "initial": 100}
    whole = search(SHELF, **settings)
    for stop in (1, 5, 11):
        stopping = [lambda state, stop=stop: state.iteration >= stop]
        search(SHELF, **settings, checkpoint=tmp_path, resume="auto", callbacks=stopping)
    resumed = search(SHELF, **settings, checkpoint=tmp_path, resume=True)
    assert resumed.evaluations == whole.evaluations
    assert same_archive(resumed.archive, whole.archive)
    assert resumed.config["emitter"] == whole.config["emitter"]


@every_emitter
def test_searches_under_a_distance_cap_and_beats_its_first_layouts(emitter, options):
    settings = {"emitter": emitter, "emitter_options": options, "initial": 60, "seed": 0, "max_distance": 5.0}
    result = search(SHELF, **settings, evaluations=3000)
    start = search(SHELF, **settings, evaluations=60)
    assert (SHELF.distance(result.elites().solution) <= 5.0).all()
    assert result.best_objective > start.best_objective
    assert result.qd_score > start.qd_score


@every_emitter
def test_starts_from_an_empty_archive_under_a_cap_nothing_met_yet(emitter, options):
    # Hardly any random layout is allowed: the emitter has to propose random ones itself until one is.
    settings = {"emitter": emitter, "emitter_options": options, "initial": 1, "seed": 1, "max_distance": 2.0}
    result = search(SHELF, **settings, evaluations=400)
    assert result.best_genome is None or SHELF.distance(result.best_genome) <= 2.0
    assert result.evaluations >= 400


@every_emitter
def test_fills_the_archive_in_a_plain_pyribs_scheduler(emitter, options, started):
    archive, _ = started(SHELF, 50)
    before = float(archive.stats.qd_score)
    made = make_emitter(emitter, archive, SHELF, seed=4, options=options)
    assert made.emits_valid
    if emitter not in BUILT_IN:
        assert isinstance(made, GenomeAdapter)
    scheduler, evaluate = Scheduler(archive, [made]), Evaluator(SHELF, max_distance=6.0)
    for _ in range(12):
        genomes = scheduler.ask()
        assert SHELF.valid(genomes).all()
        assert genomes.dtype == np.int8
        scheduler.tell(*evaluate(genomes))
    assert float(archive.stats.qd_score) > before


@every_emitter
def test_an_option_it_does_not_have_is_refused_by_name(emitter, options):
    with pytest.raises(EmitterError, match=r"has no option fan_out; its options: .*"):
        search(SHELF, emitter=emitter, emitter_options={**options, "fan_out": 3})


@pytest.mark.parametrize(
    ("emitter", "bad"),
    [
        (AnnealingEmitter, {"chains": 0}),
        (AnnealingEmitter, {"cycle": 0}),
        (AnnealingEmitter, {"groups": 0}),
        (AnnealingEmitter, {"heat": 0.0}),
        (AnnealingEmitter, {"cold": 0.0}),
        (AnnealingEmitter, {"initial": 0}),
        (AnnealingEmitter, {"resamplings": -1}),
        (CmaMaeEmitter, {"learning_rate": 1.5}),
        (CmaMaeEmitter, {"batch_size": 0}),
        (CmaMeEmitter, {"strategies": 0}),
        (CmaMeEmitter, {"sigma0": 0.0}),
        (DifferentialEvolutionEmitter, {"population": 4}),
        (DifferentialEvolutionEmitter, {"strategy": "best2exp"}),
        (DifferentialEvolutionEmitter, {"recombination": 2.0}),
        (DifferentialEvolutionEmitter, {"iterations": -1}),
        (GradientArborescenceEmitter, {"lr": 0.0}),
        (GradientArborescenceEmitter, {"batch_size": 0}),
        (ImproveWorkspaceEmitter, {"climbs": 0}),
        (ImproveWorkspaceEmitter, {"fanout": 0}),
        (ImproveWorkspaceEmitter, {"initial": 0}),
        (ImproveWorkspaceEmitter, {"iterations": -1}),
        (MutationEmitter, {"batch_size": 0}),
        (NoveltyLocalCompetitionEmitter, {"population": 1}),
        (NoveltyLocalCompetitionEmitter, {"neighbours": 0}),
        (NoveltyLocalCompetitionEmitter, {"crossover": 1.5}),
        (NoveltyLocalCompetitionEmitter, {"remember": -0.1}),
        (PolicyGradientEmitter, {"designs": 0}),
        (PolicyGradientEmitter, {"horizon": 0}),
        (PolicyGradientEmitter, {"best": 0.0}),
        (PolicyGradientEmitter, {"levels": 1}),
        (PolicyGradientEmitter, {"learning_rate": 0.0}),
        (PolicyGradientEmitter, {"discount": 1.5}),
        (PolicyGradientEmitter, {"entropy": -1.0}),
        (RandomWorkspaceEmitter, {"batch_size": 0}),
    ],
    ids=lambda value: value.__name__ if callable(value) else next(iter(value)),
)
def test_a_bad_argument_is_named(emitter, bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        emitter(make_archive(VALLEY), VALLEY, **bad)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["annealing", "mutation", "nslc"])
def test_finds_the_exhaustive_optimum_of_5x5(name):
    result = search(KITCHEN, emitter=name, evaluations=100_000, seed=0)
    assert result.best_objective == pytest.approx(-11.684924681147868, abs=1e-9)
