"""search(): what it finds, what it leaves behind, how it stops."""

import csv
import json
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import optimizers
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.support.digests import sealed
from optimizers import EmitterError, SearchError, load_run, make_archive, search
from optimizers.archives import archive_arrays, read_archive
from tests.support.shelf_workspace import ShelfWorkspace
from tests.support.signals import hear_ctrl_c

SHELF = ShelfWorkspace()
OPTIMUM_5X5 = -11.684924681147868  # over all valid 5x5 layouts, prefix="sum", by exhaustive search
COLUMNS = "iteration,phase,evaluations,seconds,best,qd_score,coverage,elites,evaluations_per_second"


def best_per_cell(workspace):
    """The best score of every cell, by brute force over every genome there is."""
    genomes = workspace.all_genomes()
    cells = make_archive(workspace).index_of(workspace.measures(genomes))
    scores = workspace.legibility(genomes)
    return {int(cell): scores[cells == cell].max() for cell in np.unique(cells)}


# -- what it finds -----------------------------------------------------------------------------------------------------


def test_finds_the_best_layout_of_every_cell():
    result = search(SHELF, emitter=["improve", "random"], evaluations=200_000, seed=3)
    found = archive_arrays(result.archive)
    assert dict(zip(found["index"].tolist(), found["objective"], strict=True)) == pytest.approx(best_per_cell(SHELF))
    assert result.best_objective == pytest.approx(max(best_per_cell(SHELF).values()))
    assert result.coverage == 1.0


@pytest.mark.slow
def test_finds_the_exhaustive_optimum_of_5x5_with_default_settings():
    result = search(OvercookedWorkspace(shape=(5, 5), prefix="sum"), seed=0)
    assert result.best_objective == pytest.approx(OPTIMUM_5X5, abs=1e-9)
    assert isinstance(result.best_layout, OvercookedLayout)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 10))
def test_finds_the_exhaustive_optimum_of_5x5_with_any_seed(seed):
    result = search(OvercookedWorkspace(shape=(5, 5), prefix="sum"), seed=seed)
    assert result.best_objective == pytest.approx(OPTIMUM_5X5, abs=1e-9)


def test_improvement_beats_random_layouts():
    workspace = OvercookedWorkspace(shape=(6, 6))
    improved = search(workspace, evaluations=6000, seed=0)
    sampled = search(workspace, evaluations=6000, seed=0, emitter="random")
    assert improved.best_objective > sampled.best_objective + 1
    assert improved.qd_score > sampled.qd_score


def test_best_layout_is_pruned_and_the_archive_is_not():
    # Lamp 2 of the shelf does nothing: cells with every lamp on hold layouts that burn it for nothing.
    class Lit(ShelfWorkspace):
        def sample(self, n, rng):
            genomes = super().sample(n, rng)
            genomes[:, -1] = 1
            return genomes

    result = search(Lit(), emitter="random", evaluations=20_000, seed=0)
    assert result.archive.best_elite["solution"][-1] == 1
    assert result.best_genome[-1] == 0
    assert result.best_objective == pytest.approx(float(result.archive.stats.obj_max))
    assert result.config["result"]["pruned"] is True
    assert result.config["result"]["pruning_changed_best"] is True


# -- the same again ----------------------------------------------------------------------------------------------------


def test_same_seed_same_archive_other_seed_another(same_archive):
    workspace = OvercookedWorkspace(shape=(5, 6))
    a, b, c = (search(workspace, evaluations=4000, seed=s, emitter=["improve", "random"]) for s in (7, 7, 8))
    assert same_archive(a.archive, b.archive)
    assert not same_archive(a.archive, c.archive)
    timing = {"seconds", "evaluations_per_second"}
    rows = [[{k: v for k, v in row.items() if k not in timing} for row in r.history] for r in (a, b)]
    assert rows[0] == rows[1]


def test_leaves_the_global_random_state_alone():
    np.random.seed(5)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    search(SHELF, evaluations=2000)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_a_drawn_seed_is_recorded_and_repeats(same_archive):
    result = search(SHELF, evaluations=1500, initial=50, seed=None)
    again = search(SHELF, evaluations=1500, initial=50, seed=result.config["seed"])
    assert same_archive(result.archive, again.archive)


# -- objectives --------------------------------------------------------------------------------------------------------


def count_lamps(genomes):
    """A user's own objective."""
    scores = genomes[:, 3:].sum(axis=1).astype(float)
    scores[genomes[:, 0] == 5] = -np.inf
    return scores


def test_any_callable_is_an_objective_and_what_it_forbids_stays_out():
    result = search(SHELF, objective=count_lamps, evaluations=3000)
    assert result.best_objective == 3.0
    assert result.config["objective"]["name"] == f"{__name__}:count_lamps"
    assert not (result.archive.data("solution")[:, 0] == 5).any()
    assert len(result.archive) == 4 * 5


@pytest.mark.parametrize("objective", ["legibility", "efficiency", "legible-efficient", count_lamps])
def test_a_distance_cap_holds_for_every_elite(objective):
    result = search(SHELF, objective=objective, max_distance=4.0, evaluations=3000)
    elites = result.archive.data("solution")
    assert len(elites) > 10
    assert (SHELF.distance(elites) <= 4.0).all()
    assert result.config["objective"]["max_distance"] == 4.0


def test_a_cap_nothing_meets_gives_no_layout_and_says_so():
    with pytest.warns(UserWarning, match="max_distance too small"):
        result = search(SHELF, max_distance=0.5, evaluations=2500)
    assert result.best_layout is None
    assert result.best_objective is None
    assert len(result.archive) == 0
    with pytest.raises(SearchError, match="max_distance too small"):
        search(SHELF, max_distance=0.5, iterations=(10, 10))


@pytest.mark.parametrize(
    ("objective", "message"),
    [
        (lambda g: np.zeros((len(g), 2)), r"must return one number per genome, shape \(1000,\)"),
        (lambda g: np.full(len(g), np.inf), r"\+inf"),
        (3, "a name or a callable"),
    ],
)
def test_a_wrong_objective_is_named(objective, message):
    with pytest.raises((ValueError, TypeError), match=message):
        search(SHELF, objective=objective)


class FailsLater:
    """An objective that breaks in the third batch."""

    calls = 0
    name = "fails-later"

    def __call__(self, genomes):
        self.calls += 1
        if self.calls == 3:
            raise ZeroDivisionError("the third batch")
        return SHELF.legibility(genomes)


def test_an_error_keeps_its_type_and_brings_the_result_so_far(tmp_path):
    with pytest.raises(ZeroDivisionError, match="third batch") as caught:
        search(SHELF, objective=FailsLater(), initial=20, evaluations=5000, checkpoint=tmp_path / "run")
    partial = caught.value.partial
    assert partial.stopped == "error"
    assert len(partial.archive) > 0
    assert SHELF.legibility(partial.best_genome) == partial.best_objective
    assert len(read_archive(tmp_path / "run" / "archive.npz")["index"]) == len(partial.archive)


# -- budgets -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("evaluations", [1, 5, 999, 1000, 1001, 2345])
def test_stops_at_the_first_batch_end_that_reaches_the_budget(evaluations):
    result = search(SHELF, evaluations=evaluations, emitter_options={"climbs": 2, "fanout": 8})
    assert evaluations <= result.evaluations <= evaluations + 16
    if evaluations <= 1000:
        assert result.evaluations == evaluations
    assert result.stopped == "evaluations"


def test_the_papers_budget_counts_random_layouts_and_climbs():
    seen = []
    result = search(
        SHELF,
        iterations=(100, 30),
        callbacks=[lambda s: seen.append((s.evaluations, s.scheduler.emitters[0].finished))],
    )
    assert seen[0] == (100, 0)
    assert seen[-1] == (result.evaluations, 30)
    assert result.stopped == "iterations"
    assert result.config["iterations"] == [100, 30]


def test_emitters_that_do_not_count_propose_that_many_layouts():
    result = search(SHELF, iterations=(100, 50), emitter="random", emitter_options={"batch_size": 10})
    assert result.evaluations == 150


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"evaluations": 0}, "`evaluations` must be an integer >= 1, got 0"),
        ({"evaluations": 5, "iterations": (1, 1)}, "either evaluations or iterations"),
        ({"iterations": (0, 5)}, "random layouts"),
        ({"initial": 0}, "`initial` must be an integer from 1 to 1000000, got 0"),
        ({"resume": True}, "resume needs checkpoint="),
        ({"resume": "yes", "checkpoint": "x"}, "`resume` must be one of \\[True, False, 'auto'\\], got 'yes'"),
        ({"emitter": []}, "at least one emitter"),
        ({"emitter": ["improve", "random"], "emitter_options": {"climbs": 1}}, "2 emitters need 2"),
        ({"objective": "speed"}, "speed"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        search(SHELF, **arguments)


def test_callbacks_see_every_batch_and_can_stop():
    seen = []

    def watch(state):
        seen.append((state.iteration, state.evaluations, len(state.archive)))
        return state.iteration == 4

    result = search(SHELF, evaluations=100_000, callbacks=[watch, lambda state: None])
    assert [iteration for iteration, _, _ in seen] == [0, 1, 2, 3, 4]
    assert result.stopped == "callback"
    assert result.iterations == 4
    assert result.history[-1]["iteration"] == 4


def test_a_time_limit_stops_at_a_batch_end():
    result = search(SHELF, evaluations=10**9, time_limit=0.0, emitter_options={"climbs": 4})
    assert result.stopped == "time limit"
    assert result.evaluations == 1000


# -- what it leaves behind ---------------------------------------------------------------------------------------------


def test_a_run_folder_holds_manifest_metrics_archive_and_drawing(tmp_path, same_archive):
    workspace = OvercookedWorkspace(shape=(5, 6), prefix="sum")
    result = search(workspace, evaluations=3000, seed=4, checkpoint=tmp_path / "a" / "run", max_distance=400.0)
    folder = tmp_path / "a" / "run"
    assert {p.name for p in folder.iterdir()} == {"config.json", "metrics.csv", "archive.npz", "best.txt", "checkpoint"}

    config = json.loads((folder / "config.json").read_text())
    assert config == sealed(result.config)
    assert config["schema"] == 2
    assert config["workspace"] == workspace.to_config()
    assert config["objective"] == {"name": "legibility", "max_distance": 400.0}
    assert config["emitter"]["name"] == "improve"
    assert config["emitter"]["settings"] == {"climbs": 3, "fanout": 24}
    assert config["archive"]["dims"] == [13, 24]
    assert (config["seed"], config["evaluations"], config["initial"]) == (4, 3000, 1000)
    assert {"legible-envs", "ribs", "numpy", "python"} <= config["versions"].keys()
    assert config["result"]["best_objective"] == result.best_objective
    assert config["result"]["best_genome"] == result.best_genome.tolist()
    assert config["calibration"].keys() == workspace.calibration.keys()

    text = (folder / "metrics.csv").read_text()
    assert text.startswith(COLUMNS + "\n")
    rows = list(csv.DictReader(text.splitlines()))
    assert len(rows) == len(result.history)
    assert rows[0]["phase"] == "initial"
    assert int(rows[-1]["evaluations"]) == result.evaluations
    best = [float(row["best"]) for row in rows]
    assert best == sorted(best)

    assert OvercookedLayout.from_ascii((folder / "best.txt").read_text()) == result.best_layout
    assert workspace.legibility(result.best_genome) == result.best_objective
    assert same_archive(load_run(folder).archive, result.archive)


def test_a_run_is_not_replaced_unless_told_to(tmp_path, same_archive):
    first = search(SHELF, evaluations=1500, seed=1, checkpoint=tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(SearchError, match=r"already holds a run.*resume=True.*overwrite=True"):
        search(SHELF, evaluations=1500, seed=2, checkpoint=tmp_path)
    assert same_archive(load_run(tmp_path).archive, first.archive)
    second = search(SHELF, evaluations=1500, seed=2, checkpoint=tmp_path, overwrite=True)
    assert load_run(tmp_path).config["seed"] == 2
    assert same_archive(load_run(tmp_path).archive, second.archive)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    search(SHELF, evaluations=1500)
    assert list(tmp_path.iterdir()) == []


def test_progress_is_quiet_without_a_terminal_and_shown_on_request(capfd):
    search(SHELF, evaluations=1500)
    assert capfd.readouterr() == ("", "")
    search(SHELF, evaluations=1500, progress=True)
    shown = capfd.readouterr()
    assert shown.out == ""
    assert "best" in shown.err
    assert "coverage" in shown.err
    search(SHELF, iterations=(10, 10), progress=True)
    assert "climbs" in capfd.readouterr().err


@pytest.mark.slow
def test_history_of_a_long_search_stays_short():
    result = search(SHELF, evaluations=3000, initial=5, emitter_options={"climbs": 1, "fanout": 1})
    assert result.iterations > 2900
    assert 900 <= len(result.history) <= 1100


# -- stopping by hand --------------------------------------------------------------------------------------------------


@pytest.fixture
def ctrl_c_interrupts():
    """Jobs in the background of a shell ignore Ctrl-C, and so do their children: there it would test nothing."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c_interrupts")
def test_ctrl_c_finishes_the_batch_saves_and_brings_the_result(tmp_path, same_archive):
    def press(state):
        if state.iteration == 3:
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt, match="continue with resume=True") as caught:
        search(SHELF, evaluations=100_000, checkpoint=tmp_path, callbacks=[press])
    assert signal.getsignal(signal.SIGINT) is before
    partial = caught.value.partial
    assert isinstance(caught.value, optimizers.SearchInterrupted)
    assert (partial.stopped, partial.iterations) == ("interrupted", 3)
    assert same_archive(load_run(tmp_path).archive, partial.archive)
    assert load_run(tmp_path).config["result"]["stopped"] == "interrupted"
    assert (tmp_path / "best.txt").exists()
    whole = search(SHELF, evaluations=100_000, checkpoint=tmp_path, resume=True)
    assert same_archive(whole.archive, search(SHELF, evaluations=100_000).archive)


@pytest.mark.slow
@pytest.mark.usefixtures("ctrl_c_interrupts")
def test_ctrl_c_from_outside_leaves_a_usable_run(tmp_path):
    program = textwrap.dedent("""
        import sys
        from tests.support.shelf_workspace import ShelfWorkspace
        from optimizers import search
        started = lambda state: state.iteration == 5 and print("running", flush=True)
        search(ShelfWorkspace(), evaluations=10**9, checkpoint=sys.argv[1], callbacks=[started],
               emitter_options={"climbs": 8})
    """)
    child = subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        preexec_fn=hear_ctrl_c,
    )
    assert child.stdout.readline() == "running\n"
    child.send_signal(signal.SIGINT)
    try:
        _, errors = child.communicate(timeout=60)
    finally:
        child.kill()
    assert child.returncode != 0
    assert "SearchInterrupted: interrupted after" in errors
    run = load_run(tmp_path)
    assert run.stopped == "interrupted"
    assert len(run.archive) > 0
    assert run.best_layout is not None


def test_works_outside_the_main_thread(same_archive):
    results = []
    thread = threading.Thread(target=lambda: results.append(search(SHELF, evaluations=1500)))
    thread.start()
    thread.join(timeout=60)
    assert same_archive(results[0].archive, search(SHELF, evaluations=1500).archive)


# -- the package -------------------------------------------------------------------------------------------------------


def test_importing_optimizers_does_not_import_pyribs():
    program = (
        "import sys, optimizers; from optimizers import register_emitter, list_emitters; list_emitters(); "
        "assert not {'ribs', 'numba', 'sklearn', 'torch', 'pandas', 'rich'} & set(sys.modules), sorted(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_every_public_name_is_there():
    for name in optimizers.__all__:
        assert getattr(optimizers, name).__name__ == name
        assert name in dir(optimizers)
    with pytest.raises(AttributeError, match="no_such_name"):
        optimizers.no_such_name  # noqa: B018


class Silent:
    """An emitter that never proposes anything."""

    solution_dim = SHELF.genome_size
    emits_valid = True

    def __init__(self, archive, workspace, seed):
        self.archive = archive

    def ask(self):
        return np.zeros((0, self.solution_dim), dtype=np.int8)

    def tell(self, *args, **kwargs):
        pass


def test_an_emitter_that_falls_silent_is_named_instead_of_waited_for():
    started = time.monotonic()
    with pytest.raises(EmitterError, match=r"Silent: ask\(\) proposed nothing") as caught:
        search(SHELF, emitter=Silent)
    assert time.monotonic() - started < 60
    assert caught.value.partial.evaluations == 1000
