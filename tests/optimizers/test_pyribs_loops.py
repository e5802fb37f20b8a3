"""Our workspaces in other people's loops: pyribs' own archive, scheduler and emitters on the continuous face."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from ribs.archives import CVTArchive, GridArchive
from ribs.emitters import (
    EvolutionStrategyEmitter,
    GaussianEmitter,
    GeneticAlgorithmEmitter,
    IsoLineEmitter,
)
from ribs.schedulers import BanditScheduler, Scheduler

from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.tabletop import TabletopWorkspace
from optimizers import EmitterError, check_emitter, load_run, make_archive, make_emitter, search
from optimizers.emitters.adapter import KeyAdapter, KeyArchiveView
from tests.support.shelf_workspace import ShelfWorkspace

KITCHEN = OvercookedWorkspace(shape=(5, 5))
SHELF = ShelfWorkspace()
WORKSPACES = {"kitchen": KITCHEN, "table": TabletopWorkspace(), "shelf": SHELF}


def gaussian(archive, space, **bounds):
    return GaussianEmitter(archive, sigma=0.1, x0=start(space), batch_size=30, seed=1, **bounds)


def iso_line(archive, space, **bounds):
    first = space.sample(30, np.random.default_rng(0))
    return IsoLineEmitter(archive, initial_solutions=first, batch_size=30, seed=1, **bounds)


def genetic(archive, space, **bounds):
    operator = {"operator": "isoline", "operator_kwargs": {"iso_sigma": 0.02, "line_sigma": 0.2}}
    first = space.sample(30, np.random.default_rng(0))
    return GeneticAlgorithmEmitter(archive, initial_solutions=first, batch_size=30, **operator, **bounds)


def strategy(es, ranker="2imp"):
    def make(archive, space, **bounds):
        # pyribs wants no more proposals of the last kind than there are dimensions
        options = {"es": es, "ranker": ranker, "batch_size": 6 if es == "lm_ma_es" else 30, "seed": 1}
        return EvolutionStrategyEmitter(archive, x0=start(space), sigma0=0.2, **options, **bounds)

    return make


def start(space):
    return space.sample(1, np.random.default_rng(0))[0]


EMITTERS = {
    "gaussian": gaussian,
    "iso line": iso_line,
    "genetic": genetic,
    "cma-es": strategy("cma_es"),
    "separable cma-es": strategy("sep_cma_es"),
    "limited memory ma-es": strategy("lm_ma_es"),
    "openai-es": strategy("openai_es"),
    "cma-es, improvement": strategy("cma_es", "imp"),
    "cma-es, random direction": strategy("cma_es", "2rd"),
    "cma-es, objective": strategy("cma_es", "obj"),
}
TAKE_ANY_BOUNDS = ("gaussian", "iso line", "genetic")


def pyribs_loop(workspace, make, rounds=8, *, bounded):
    """The loop of pyribs' tutorial, word for word, with the workspace's continuous face for the objective."""
    space = workspace.continuous()
    archive = GridArchive(
        solution_dim=space.solution_dim,
        dims=space.archive_dims,
        ranges=space.archive_ranges,
        qd_score_offset=space.score_floor,
        seed=0,
    )
    scheduler = Scheduler(archive, [make(archive, space, **({"bounds": space.bounds} if bounded else {}))])
    for _ in range(rounds):
        solutions = scheduler.ask()
        objective, measures = space.legibility(solutions), space.measures(solutions)
        assert np.isfinite(objective).all()
        scheduler.tell(objective, measures)
    return archive


@pytest.mark.slow
@pytest.mark.parametrize("workspace", WORKSPACES.values(), ids=WORKSPACES)
@pytest.mark.parametrize("emitter", EMITTERS)
def test_every_stock_emitter_runs_unchanged(emitter, workspace):
    for bounded in (False, True) if emitter in TAKE_ANY_BOUNDS else (False,):
        archive = pyribs_loop(workspace, EMITTERS[emitter], bounded=bounded)
        assert len(archive) > 1
        space = workspace.continuous()
        keys = archive.data("solution")
        np.testing.assert_allclose(space.legibility(keys), archive.data("objective"))
        np.testing.assert_allclose(space.measures(keys), archive.data("measures"))
        layout = space.layout(archive.best_elite["solution"])
        assert workspace.legibility(workspace.encode(layout)) == pytest.approx(archive.best_elite["objective"])


@pytest.mark.slow
def test_other_archives_and_schedulers_of_pyribs_run_too():
    space = KITCHEN.continuous()
    archive = CVTArchive(solution_dim=space.solution_dim, centroids=50, ranges=space.archive_ranges, seed=0)
    pool = [gaussian(archive, space), iso_line(archive, space), strategy("cma_es")(archive, space)]
    scheduler = BanditScheduler(archive, pool, num_active=2)
    for _ in range(6):
        scheduler.tell(*space.evaluate(scheduler.ask(), space.objective("legible-efficient", max_distance=60)))
    assert len(archive) > 5


def test_our_archive_of_keys_is_pyribs_own():
    space = KITCHEN.continuous()
    archive = make_archive(space, seed=0)
    assert archive.solution_dim == space.solution_dim
    assert archive.dtypes["solution"] == np.float64
    np.testing.assert_array_equal(archive.dims, KITCHEN.archive_dims)
    assert archive.qd_score_offset == KITCHEN.score_floor
    keys = space.sample(40, np.random.default_rng(0))
    archive.add(keys, *space.evaluate(keys))
    emitter = strategy("cma_es")(archive, space)
    for _ in range(3):
        asked = emitter.ask()
        emitter.tell(asked, *space.evaluate(asked), archive.add(asked, *space.evaluate(asked)))


def test_an_archive_of_whole_numbers_does_not_cut_fractions_in_silence():
    archive = make_archive(KITCHEN)
    genomes = KITCHEN.sample(5, np.random.default_rng(0))
    values = KITCHEN.legibility(genomes), KITCHEN.measures(genomes)
    archive.add(genomes.astype(np.float16), *values)
    broken = genomes.astype(np.float64)
    broken[3, 2] += 0.25
    with pytest.raises(ValueError, match=r"whole numbers \(int8\); gene 2 of row 3 is .*25\. .*workspace\.continuous"):
        archive.add(broken, *values)
    broken[3, 2] = np.nan
    with pytest.raises(ValueError, match="gene 2 of row 3 is nan"):
        archive.add(broken, *values)


# -- search on the continuous face -------------------------------------------------------------------------------------

STOCK = {
    "gaussian": (GaussianEmitter, {"sigma": 0.1}),
    "iso line": ("ribs.emitters:IsoLineEmitter", {}),
    "cma-es": (EvolutionStrategyEmitter, {"sigma0": 0.2, "batch_size": 30}),
    "genetic": (GeneticAlgorithmEmitter, {"operator": "gaussian", "operator_kwargs": {"sigma": 0.1}}),
}


@pytest.mark.parametrize(("emitter", "options"), STOCK.values(), ids=STOCK)
def test_stock_emitters_search_and_resume_to_the_same_archive(emitter, options, same_archive, tmp_path):
    space = KITCHEN.continuous()
    settings = {"emitter": emitter, "emitter_options": options, "evaluations": 1500, "initial": 100, "seed": 3}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole = search(space, **settings)
        stopping = [lambda state: state.iteration >= 5]
        search(space, **settings, checkpoint=tmp_path, callbacks=stopping)
        resumed = search(space, **settings, checkpoint=tmp_path, resume=True)
    assert same_archive(resumed.archive, whole.archive)
    assert whole.config["continuous"] is True
    assert whole.workspace is KITCHEN
    assert KITCHEN.valid(whole.elites().solution).all()
    assert same_archive(load_run(tmp_path).archive, whole.archive)
    assert str(load_run(tmp_path).best_layout) == str(whole.best_layout)
    with pytest.warns(UserWarning, match="real numbers"), pytest.raises(RuntimeError, match="continuous"):
        search(KITCHEN, **settings, checkpoint=tmp_path, resume=True)


def test_all_proposals_in_keys_are_valid_and_few_are_without():
    archive = make_archive(KITCHEN, seed=0)
    genomes = KITCHEN.sample(100, np.random.default_rng(0))
    archive.add(genomes, KITCHEN.legibility(genomes), KITCHEN.measures(genomes))
    options = {"sigma": 0.5, "batch_size": 500}
    keyed = make_emitter(GaussianEmitter, archive, KITCHEN.continuous(), seed=0, options=options)
    with pytest.warns(UserWarning, match=r"takes steps in real numbers, and genomes of this workspace are whole"):
        plain = make_emitter(GaussianEmitter, archive, KITCHEN, seed=0, options=options)
    assert isinstance(keyed, KeyAdapter)
    assert len(keyed.ask()) == 500
    assert len(plain.ask()) < 450


def test_a_table_and_emitters_that_know_no_workspace_are_no_reason_to_warn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = WORKSPACES["table"]
        make_emitter(GaussianEmitter, make_archive(table), table, seed=0, options={"sigma": 0.1})
        make_emitter("crossover", make_archive(KITCHEN), KITCHEN, seed=0)


def test_emitters_that_know_the_workspace_share_the_archive():
    result = search(
        KITCHEN.continuous(),
        emitter=[GaussianEmitter, "improve", "cma-me"],
        emitter_options=[{"sigma": 0.1}, {}, {}],
        evaluations=2500,
        initial=100,
    )
    assert KITCHEN.valid(result.elites().solution).all()
    alone = {"emitter": "improve", "evaluations": 2000, "seed": 4}
    assert search(KITCHEN.continuous(), **alone).best_objective == search(KITCHEN, **alone).best_objective


@pytest.mark.parametrize("workspace", [KITCHEN, SHELF], ids=["kitchen", "shelf"])
@pytest.mark.parametrize(("emitter", "options"), list(STOCK.values())[:3], ids=list(STOCK)[:3])
def test_stock_emitters_keep_the_contract_in_keys(emitter, options, workspace):
    check_emitter(emitter, workspace.continuous(), options=options)


class Careless:
    """Proposes keys that are not finite."""

    def __init__(self, archive, seed=None):
        self.archive, self.solution_dim = archive, archive.solution_dim

    def ask(self):
        return np.full((3, self.solution_dim), np.nan)

    def tell(self, *told):
        """Learns nothing."""


def test_keys_that_are_not_finite_are_named_with_their_emitter():
    with pytest.raises(EmitterError, match=r"Careless: ask\(\) proposed .* finite numbers, got nan in row 0, key 0"):
        search(KITCHEN.continuous(), emitter=Careless, evaluations=2000)


def test_the_view_shows_elites_as_keys():
    archive = make_archive(KITCHEN, seed=0)
    genomes = KITCHEN.sample(30, np.random.default_rng(0))
    archive.add(genomes, KITCHEN.legibility(genomes), KITCHEN.measures(genomes))
    space = KITCHEN.continuous()
    view = KeyArchiveView(archive, space)
    assert view.solution_dim == space.solution_dim
    np.testing.assert_array_equal(view.data("solution"), space.encode(archive.data("solution")))
    np.testing.assert_array_equal(view.best_elite["solution"], space.encode(archive.best_elite["solution"]))
    assert view.sample_elites(4)["solution"].shape == (4, space.solution_dim)
    assert next(iter(view))["solution"].shape == (space.solution_dim,)


# -- what is given to a search -----------------------------------------------------------------------------------------


def test_an_emitter_made_already_is_refused_with_what_to_pass():
    made = gaussian(make_archive(KITCHEN.continuous()), KITCHEN.continuous())
    wanted = r"got a GaussianEmitter that is made already; give its class.*emitter=GaussianEmitter, emitter_options="
    for given in (made, ["improve", made]):
        with pytest.raises(EmitterError, match=wanted):
            search(KITCHEN, emitter=given, evaluations=10)
    with pytest.raises(EmitterError, match="an emitter is a name, 'module:Class' or a callable, got int"):
        search(KITCHEN, emitter=7, evaluations=10)


@pytest.mark.parametrize("space", [KITCHEN.continuous(), WORKSPACES["table"]], ids=["keys", "table"])
def test_options_that_are_missing_are_named(space):
    with pytest.raises(EmitterError, match=r"GaussianEmitter needs the emitter option sigma, without a default") as e:
        search(space, emitter="ribs.emitters:GaussianEmitter", evaluations=10)
    assert "emitter_options={'sigma': ...}" in str(e.value)
    assert "its options: batch_size, bounds" in str(e.value)
    with pytest.raises(EmitterError, match="GaussianEmitter has no option sgima; its options: batch_size"):
        search(space, emitter=GaussianEmitter, emitter_options={"sgima": 0.1}, evaluations=10)
    with pytest.raises(EmitterError, match="GaussianEmitter: could not convert string to float: 'a'"):
        search(space, emitter=GaussianEmitter, emitter_options={"sigma": "a"}, evaluations=10)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"emitter_options": 5}, "`emitter_options` must be None, keyword arguments such as .*, got 5"),
        ({"emitter_options": "sigma=1"}, "got 'sigma=1'"),
        ({"emitter_options": [{"a": 1}, None], "emitter": ["improve", "random"]}, "`emitter_options` must be None"),
        (
            {"emitter_options": {}, "emitter": ["improve", "random"]},
            "2 emitters need 2 mappings of `emitter_options`, got 1",
        ),
        ({"emitter": []}, "give at least one emitter"),
        ({"seed": 1.5}, "`seed` must be an integer >= 0, got 1.5"),
        ({"seed": -1}, "`seed` must be an integer >= 0, got -1"),
        ({"iterations": (2.5, 3)}, r"`iterations` must be .*, got \(2.5, 3\)"),
        ({"iterations": 5}, "`iterations` must be .*, got 5"),
        ({"evaluations": 10.5}, "`evaluations` must be an integer >= 1, got 10.5"),
        ({"time_limit": "1h"}, "`time_limit` must be None or a finite number >= 0 seconds, got '1h'"),
        ({"checkpoint_every": None}, "`checkpoint_every` must be a finite number >= 0 seconds, got None"),
        ({"callbacks": [1]}, r"`callbacks` must be functions of the state of the search, got \[1\]"),
        ({"callbacks": print}, "`callbacks` must be functions"),
    ],
)
def test_arguments_of_a_search_are_checked_before_it_begins(arguments, message):
    with pytest.raises(ValueError, match=message):
        search(SHELF, **arguments)


@pytest.mark.parametrize("workspace", ["overcooked", None, ShelfWorkspace])
def test_what_is_no_workspace_is_named(workspace):
    with pytest.raises(TypeError, match=r"`workspace` must be a Workspace or its continuous\(\), got"):
        search(workspace)
