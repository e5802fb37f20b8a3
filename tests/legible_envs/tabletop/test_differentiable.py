"""The differentiable score of tables is the compiled one, has its slopes, and gradients lead a search uphill."""

import subprocess
import sys

import numpy as np
import pytest

from legible_envs.observer import ObserverModel
from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.tabletop import TabletopScorer, TabletopWorkspace
from legible_envs.tabletop.design.differentiable import DifferentiableTable
from legible_envs.workspace import make_workspace
from legible_envs.workspace_checks import check_workspace
from optimizers import EmitterError, check_emitter, search
from optimizers.archives import archive_arrays

torch = pytest.importorskip("torch")

STEP = 1e-6
ALL = ("legibility", "distance", "least_distance", "mean_x")


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def ws():
    return TabletopWorkspace(condition="placement", second_measure="mean x")


def layouts(task, count, seed=0):
    """``(n, M, 2)`` anywhere on the table, rules or not."""
    scorer = TabletopScorer(task, max_obstacles=0)
    width, depth = scorer.task.layout.table.size
    rng = np.random.default_rng(seed)
    return rng.uniform((0, 0), (width, depth), (count, scorer.genome_size // 2, 2))


def differences(function, centres):
    """Central differences of ``(n, M, 2) -> (n,)``, ``(n, M, 2)``."""
    found = np.empty_like(centres)
    for i, k in np.ndindex(centres.shape[1:]):
        ends = []
        for sign in (1, -1):
            moved = centres.copy()
            moved[:, i, k] += sign * STEP
            ends.append(function(moved))
        found[:, i, k] = (ends[0] - ends[1]) / (2 * STEP)
    return found


@pytest.mark.parametrize("task", ["columns", "tea", "bins"])
@pytest.mark.parametrize(
    "settings",
    [{}, {"prefix": (0.2, 0.5, 1.0), "ties": "strict", "c": 2.0}, {"beta": 0.0}, {"beta": 400.0, "prefix": 0.3}],
    ids=["defaults", "strict", "flat", "sharp"],
)
def test_is_the_compiled_score(task, settings):
    scorer = TabletopScorer(task, max_obstacles=0, observer=ObserverModel.in_metres(**settings))
    table = DifferentiableTable(scorer)
    centres = layouts(task, 1 if task == "bins" else 40)
    found = scorer.score_genomes(centres.reshape(len(centres), -1))
    tensor = torch.tensor(centres)
    np.testing.assert_allclose(table.legibility(tensor), found.legibility, atol=1e-9, rtol=0)
    np.testing.assert_allclose(table.distance(tensor), found.distance, atol=1e-9, rtol=0)


@pytest.mark.parametrize("ties", ["expected", "strict"])
def test_is_the_compiled_score_where_goals_tie(ties):
    scorer = TabletopScorer("columns", max_obstacles=0, observer=ObserverModel.in_metres(ties=ties))
    centres = layouts("columns", 5)
    centres[0] = 0.3  # all in one place
    centres[1, :] = np.array([0.6, 0.05]) + np.linspace(0.1, 0.5, 8)[:, None] * [-0.6, 0.8]  # behind one another
    centres[2, 5] = centres[2, 4]
    centres[3, :4] = centres[3, 0]
    centres[4, 0] = scorer.task.layout.table.starts["home"]  # nothing to see on the way
    found = scorer.score_genomes(centres.reshape(5, -1)).legibility
    table = DifferentiableTable(scorer)
    np.testing.assert_allclose(table.legibility(torch.tensor(centres)), found, atol=1e-9, rtol=0)
    assert np.isfinite(table.gradients(centres, *ALL)[1]).all()


@pytest.mark.parametrize(("task", "count"), [("columns", 8), ("tea", 20), ("bins", 1)])
def test_gradients_are_slopes_of_the_compiled_score(task, count):
    scorer = TabletopScorer(task, max_obstacles=0)
    centres = layouts(task, count, seed=1)
    table = DifferentiableTable(scorer)
    values, slopes = table.gradients(centres, *ALL)
    assert values.shape == (count, 4)
    assert slopes.shape == (count, 4, *centres.shape[1:])
    size = centres[0].size
    for k, field in enumerate(("legibility", "distance")):
        expected = differences(lambda x, f=field: getattr(scorer.score_genomes(x.reshape(-1, size)), f), centres)
        np.testing.assert_allclose(slopes[:, k], expected, atol=1e-5 * max(1.0, np.abs(expected).max()))
        assert np.abs(expected).max() > 0.01


def test_measures_are_those_of_the_workspace_and_have_their_slopes(ws):
    for workspace in (ws, TabletopWorkspace("bins", "placement", second_measure="mean x")):
        genomes = workspace.sample(20, np.random.default_rng(2))
        table = DifferentiableTable(workspace.scorer, ranked=workspace.ranked)
        centres = genomes[:, : table.home.size].reshape(len(genomes), -1, 2)
        values, slopes = table.gradients(centres, "least_distance", "mean_x")
        np.testing.assert_allclose(values, workspace.measures(genomes), atol=1e-12)
        rest = genomes[:, table.home.size :]
        for k in range(2):
            expected = differences(
                lambda x, w=workspace, k=k, rest=rest: w.measures(np.column_stack([x.reshape(len(x), -1), rest]))[:, k],
                centres,
            )
            np.testing.assert_allclose(slopes[:, k], expected, atol=1e-6)


def test_rows_do_not_touch_one_another():
    table = DifferentiableTable("tea")
    centres = layouts("tea", 6)
    values, slopes = table.gradients(centres, *ALL)
    broken = centres.copy()
    broken[2, 1, 0], broken[4, 0, 1] = np.nan, np.inf
    others, other_slopes = table.gradients(broken, *ALL)
    fine = [0, 1, 3, 5]
    np.testing.assert_array_equal(others[fine], values[fine])
    np.testing.assert_array_equal(other_slopes[fine], slopes[fine])
    assert np.isnan(others[[2, 4], 0]).all()
    for i in fine:
        one, slope = table.gradients(centres[i : i + 1], *ALL)
        np.testing.assert_allclose(one[0], values[i], atol=1e-12)
        np.testing.assert_allclose(slope[0], slopes[i], atol=1e-12)


def test_objects_that_stay_have_no_gradient_but_count():
    table = DifferentiableTable("bins")
    assert table.home.shape == (2, 2)
    on_piece = table.home.copy()
    on_piece[0] = table.scorer.task.layout.place("piece-3")
    assert table.least_distance(torch.tensor(on_piece[None])).item() == 0.0


def test_float32_is_computed_in_float64():
    table = DifferentiableTable("tea")
    centres = torch.tensor(table.home[None], dtype=torch.float32, requires_grad=True)
    value = table.legibility(centres)
    value.sum().backward()
    assert value.dtype == torch.float64
    assert centres.grad.dtype == torch.float32


def test_bad_input_is_named():
    table = DifferentiableTable("tea")
    with pytest.raises(ValueError, match=r"\(n, 5, 2\): 5 movable objects; got \(1, 4, 2\)"):
        table.legibility(torch.zeros(1, 4, 2))
    with pytest.raises(ValueError, match="'spoon'"):
        DifferentiableTable("tea", ranked=("cup", "spoon"))


def test_without_torch_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ImportError, match=r"pip install legible-envs\[torch\]"):
        DifferentiableTable("tea")


def test_torch_is_loaded_only_when_asked_for():
    code = (
        "import sys; from legible_envs.tabletop import DifferentiableTable, TabletopWorkspace;"
        "TabletopWorkspace(condition='placement', second_measure='mean x'); assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


# -- searching ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_workspace_with_continuous_measures_is_one(ws):
    check_workspace(ws)
    again = make_workspace(ws.to_config())
    assert again == ws != TabletopWorkspace(condition="placement")
    assert ws.order_names == ()
    (low, high), cells = ws.archive_ranges[1], ws.archive_dims[1]
    assert (low, high, cells) == (pytest.approx(0.10), pytest.approx(0.80), 35)
    with pytest.raises(ValueError, match="'placement', not 'both'"):
        TabletopWorkspace(second_measure="mean x")
    with pytest.raises(ValueError, match="`second_measure` must be 'order' or 'mean x', got 'x'"):
        TabletopWorkspace(condition="placement", second_measure="x")
    with pytest.raises(ValueError, match="no gradient"):
        TabletopWorkspace(condition="placement").gradients(np.zeros((1, 32)))


@pytest.mark.parametrize("objective", ["legibility", "efficiency", "legible-efficient"])
def test_gradients_of_genomes_are_slopes_of_the_objective(ws, objective):
    genomes = ws.sample(3, np.random.default_rng(3))
    gradients = ws.gradients(genomes, objective)
    assert gradients.shape == (3, 3, ws.genome_size)
    assert not gradients[:, :, 16:].any()  # obstacles
    score = ws.objective(objective)
    for gene in (0, 7, 15):
        step = np.eye(ws.genome_size)[gene] * STEP
        slope = (score(genomes + step) - score(genomes - step)) / (2 * STEP)
        np.testing.assert_allclose(gradients[:, 0, gene], slope, atol=1e-4)


@pytest.mark.slow
def test_gradients_lead_a_search_uphill(ws):
    settings = {"evaluations": 1500, "initial": 200, "progress": False}
    led = search(ws, emitter="gradient-arborescence", seed=0, **settings)
    first = led.history[0]["best"]
    blind = search(ws, emitter="random", seed=0, **settings)
    assert led.best_objective > first + 1.0
    assert led.best_objective > blind.best_objective
    assert led.qd_score > blind.qd_score
    assert ws.valid(led.archive.data("solution")).all()
    assert led.config["emitter"]["settings"]["objective"] == "legibility"


@pytest.mark.slow
def test_the_emitter_keeps_the_contract_and_resumes(ws, tmp_path):
    check_emitter("gradient-arborescence", ws)
    settings = {"emitter": "gradient-arborescence", "evaluations": 1200, "initial": 200, "seed": 4, "progress": False}
    whole = search(ws, **settings)
    for stop in (1, 4):
        search(ws, checkpoint=tmp_path, resume="auto", callbacks=[lambda s, n=stop: s.iteration >= n], **settings)
    resumed = search(ws, checkpoint=tmp_path, resume=True, **settings)
    one, two = archive_arrays(whole.archive), archive_arrays(resumed.archive)
    assert all(np.array_equal(one[name], two[name]) for name in one)


def test_workspaces_without_gradients_are_refused():
    with pytest.raises(EmitterError, match="OvercookedWorkspace offers no gradients"):
        search(OvercookedWorkspace(shape=(5, 5)), emitter="gradient-arborescence", evaluations=10, initial=5)
    plain = TabletopWorkspace(condition="placement")
    with pytest.raises(EmitterError, match="second_measure='mean x'"):
        search(plain, emitter="gradient-arborescence", evaluations=200, initial=50)


@pytest.mark.parametrize(
    ("option", "value"), [("sigma0", 0.0), ("lr", -1.0), ("batch_size", 0), ("initial", 0), ("objective", "speed")]
)
def test_bad_options_are_named(ws, option, value):
    with pytest.raises(EmitterError, match=option):
        search(ws, emitter="gradient-arborescence", emitter_options={option: value}, evaluations=200, initial=50)
