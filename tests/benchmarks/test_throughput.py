"""The speed benchmark measures what it says; how fast is asserted nowhere."""

from __future__ import annotations

import io
import itertools
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from benchmarks.throughput import peers, run
from benchmarks.throughput.analysis import to_markdown
from benchmarks.throughput.measure import Figure, alternate, rate
from benchmarks.throughput.peer_maxent_irl import tasks
from benchmarks.throughput.peer_tabletop import stages_of, straight_line_loss, straight_line_losses
from benchmarks.throughput.peers import IMITATION, IRL_MAXENT, OVERCOOKED_AI, Peer, PeerError, open_peer, opened
from benchmarks.throughput.predictors_grid import noisy_trajectories, prediction_speed, save_problem
from benchmarks.throughput.sweep import OPTIMUM_5X5, TARGETS, Settings, Target
from benchmarks.throughput.tabletop import _episodes, replay, tables_with
from legible_envs.tabletop import TabletopTask

TINY = Settings(
    rounds=2,
    seconds=0.001,
    batch=20,
    oracle_layouts=1,
    seeds=1,
    optimum_evaluations=100_000,
    search_evaluations=3_000,
    num_envs=2,
    fresh_starts=1,
    trajectories=60,
    evaluations=1,
    tables=8,
    table_climbs=(20, 2),
    table_episodes=1,
    table_people=1,
)


def test_samples_take_turns_after_a_warm_up() -> None:
    calls: list[str] = []
    counter = itertools.count()

    def sampler(name: str) -> float:
        calls.append(name)
        return float(next(counter))

    samples = alternate({"a": lambda: sampler("a"), "b": lambda: sampler("b")}, 3)
    assert calls == ["a", "b"] * 4
    assert samples == {"a": (2.0, 4.0, 6.0), "b": (3.0, 5.0, 7.0)}


def test_ratios_pair_samples() -> None:
    ratio = Figure("a", "a", "/s", (10.0, 30.0, 100.0)).over(Figure("b", "b", "/s", (1.0, 10.0, 50.0)), "r", "ratio")
    assert ratio.samples == (10.0, 3.0, 2.0)
    assert ratio.value == 3.0


def test_rate_counts_what_was_done() -> None:
    done: list[int] = []

    def work() -> int:
        done.append(sum(range(2_000)))
        return 7

    value = rate(work, 0.01)
    assert 0 < value <= 7 * len(done) / 0.01


def test_targets() -> None:
    assert Target(">=", 2.0).met_by(2.0)
    assert not Target(">=", 2.0).met_by(1.9)
    assert Target("<=", 2.0).met_by(2.0)
    assert not Target("<=", 2.0).met_by(2.1)


@pytest.mark.slow
def test_the_whole_benchmark_reports_every_promise(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "starting", lambda settings: [Figure("import", "import", "s", (0.1,)),
                                                           Figure("compile", "compile", "s", (9.0,))])  # fmt: skip
    stream = io.StringIO()
    page = tmp_path / "docs" / "benchmarks.md"
    figures = run.run_benchmark(Console(file=stream, width=140), settings=TINY, out=page)
    keys = {figure.key for figure in figures}
    assert keys >= {key for key in TARGETS if not key.endswith(("/ peer", "/ gradient"))}
    assert all(value > 0 for figure in figures for value in figure.samples)
    text = page.read_text(encoding="utf-8")
    for figure in figures:
        assert f"| {figure.what} |" in text
        assert figure.what in stream.getvalue()
    assert "--peers" in text


@pytest.mark.parametrize("obstacles", [0, 2, 4])
def test_tables_have_the_obstacles_asked_for(obstacles: int) -> None:
    workspace, genomes = tables_with(obstacles, 12)
    assert (workspace.num_obstacles(genomes) == obstacles).all()
    assert workspace.valid(genomes).all()
    assert len(np.unique(genomes, axis=0)) == 12


def loss_of(own: float, other: float, lasts: tuple[int, ...]) -> float:
    """Of a reach to one of two goals at right angles, its last points seen being so many steps of 2 cm away."""
    loss = 0.0
    for share, last in zip((0.25, 0.5, 0.75), lasts, strict=True):
        right, wrong = np.exp(own - (own - 0.02 * last)), np.exp(other - np.hypot(0.02 * last, other))
        loss -= share * np.log(right / (right + wrong))
    return float(loss)


def test_the_loss_of_the_field_is_what_its_definition_says() -> None:
    start, centres = np.zeros(2), np.array([[0.21, 0.0], [0.0, 0.11], [0.0, 0.31]])
    # 11, 6 and 16 steps: 12, 7 and 17 points with the goal.
    expected = loss_of(0.21, 0.11, (2, 5, 8)) + loss_of(0.11, 0.21, (0, 2, 4))
    assert straight_line_loss(start, centres[:2], (0, 1), [[0, 1]]) == pytest.approx(expected, abs=1e-12)
    assert straight_line_losses(start, centres[None, :2], [[0, 1]])[0] == pytest.approx(expected, abs=1e-12)
    assert straight_line_loss(start, centres[:2], (0, 1), [[0], [1]]) == 0.0
    # A second object of a label, farther away: reached for too, but never what others are mistaken for.
    expected += loss_of(0.31, 0.21, (3, 7, 11))
    assert straight_line_loss(start, centres, (0, 1, 1), [[0, 1]]) == pytest.approx(expected, abs=1e-12)


def test_both_forms_of_the_fields_loss_agree() -> None:
    task = TabletopTask.named("tea")
    stages = stages_of(task)
    assert [[task.layout.goals[i] for i in stage] for stage in stages] == [
        ["cup", "teabag"],
        ["kettle", "milk", "sugar"],
    ]
    rng = np.random.default_rng(0)
    centres = rng.uniform((0.1, 0.2), (0.8, 0.7), (30, 5, 2))
    start = np.array([0.6, 0.05])
    centres[0, 0] = start + np.array([0.03, 0.0])  # nothing is seen of it at 25 %
    centres[1, 0] = start + np.array([2.5, 0.0])  # seen up to 2 m only
    one_by_one = [straight_line_loss(start, one, range(5), stages) for one in centres]
    np.testing.assert_allclose(straight_line_losses(start, centres, stages), one_by_one, atol=1e-12)
    # A legible table loses less than one on which everything lies the same way.
    apart = np.array([[0.1, 0.3], [0.8, 0.3], [0.1, 0.3], [0.45, 0.7], [0.8, 0.3]])
    same_way = start + np.linspace(0.3, 0.5, 5)[:, None] * [-0.6, 0.8]
    losses = straight_line_losses(start, np.stack([apart, same_way]), stages)
    assert losses[0] < losses[1]


@pytest.mark.parametrize("arguments", [{}, {"partner": "robot"}])
def test_what_people_did_at_tables_repeats_itself(arguments: dict[str, Any]) -> None:
    env, layouts, recorded = _episodes(arguments, 2)
    for seed, (layout, deeds) in enumerate(zip(layouts, recorded, strict=True)):
        assert len(layout.obstacles) == 4
        assert not replay(env, layout, seed, deeds[:-1])
        assert replay(env, layout, seed, deeds)
    env.close()


def test_the_optimum_is_recognised() -> None:
    found, seconds, overhead = run.searching(TINY)
    assert found.samples == (1.0,)
    assert seconds.value > 0
    assert 0 < overhead.value < 1
    assert pytest.approx(-11.684924681147868, abs=0) == OPTIMUM_5X5


def test_markdown_marks_missed_promises() -> None:
    page = to_markdown([Figure("import", "importing", "s", (0.9,)), Figure("other", "else", "x", (150.0,))], [], TINY)
    assert "| importing | 0.90 s | <= 0.30 s | no |" in page
    assert "| else | 150x |  |  |" in page


def test_an_interpreter_without_the_peer_is_an_error_that_says_so() -> None:
    with pytest.raises(PeerError, match="overcooked_ai_py"):
        Peer(Path(sys.executable), OVERCOOKED_AI)


def test_what_cannot_be_installed_is_left_out_with_a_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(python: Path, requirements: object) -> None:
        raise PeerError("no package index can be reached")

    monkeypatch.setattr(peers, "_pip_install", refuse)
    monkeypatch.setattr(peers.venv, "create", lambda home, **_: home.mkdir(parents=True))
    remarks: list[str] = []
    with opened({IMITATION: ("imitation", "problem.npz")}, tmp_path, remarks, Console(file=io.StringIO())) as found:
        assert found == {}
    assert remarks == ["imitation was not measured: no package index can be reached"]


def test_environments_are_made_anew_where_other_versions_are_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed: list[tuple[str, ...]] = []
    monkeypatch.setattr(peers, "_pip_install", lambda python, requirements: installed.append(requirements))
    monkeypatch.setattr(peers.venv, "create", lambda home, **_: home.mkdir(parents=True, exist_ok=True))
    monkeypatch.setattr(peers, "Peer", lambda python, package, arguments: arguments)
    for _ in range(2):
        assert open_peer(IMITATION, tmp_path, ("one",)) == ("one",)
    assert installed == list(IMITATION.requirements)
    (tmp_path / "imitation" / "installed").write_text("imitation==0.1\n", encoding="utf-8")
    open_peer(IMITATION, tmp_path)
    assert installed == 2 * list(IMITATION.requirements)


def expected_visits(moves: Any, starts: Any, reward: Any) -> Any:
    """How often walks to a station enter or begin in each cell, by dense algebra: an oracle."""
    count = len(reward) - 2
    weights = np.exp(reward)[:, None] * moves.sum(axis=1)
    sums = np.linalg.solve(np.eye(count) - weights[:count, :count], weights[:count, count])
    flow = np.linalg.solve((np.eye(count) - weights[:count, :count]).T, starts[:count] / sums)
    return flow * sums


def test_other_packages_are_given_the_same_problem(tmp_path: Path) -> None:
    from predictors.grid.walk_likelihood import collect_evidence

    (evidence,) = collect_evidence(noisy_trajectories(200, np.random.default_rng(0))).values()
    with np.load(save_problem(tmp_path)) as problem:
        expected = sum(expected_visits(*task) for task in tasks(problem))
        _, gradient = evidence.loss(-problem["rewards"])
        np.testing.assert_allclose(problem["visits"] - expected, gradient, atol=1e-9)
        assert problem["starts"].sum() == 200


@pytest.mark.parametrize("right", [True, False])
def test_other_packages_are_measured_if_they_agree(
    right: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "irl_maxent").mkdir()
    (tmp_path / "irl_maxent" / "__init__.py").touch()
    stand_in = f"""
        import numpy as np

        def compute_expected_svf(p_transition, p_initial, terminal, reward):
            goal = terminal[0]
            weights = np.exp(reward)[:, None] * p_transition.sum(axis=2)
            rest = np.eye(goal) - weights[:goal, :goal]
            sums = np.linalg.solve(rest, weights[:goal, goal])
            flow = np.linalg.solve(rest.T, p_initial[:goal] / sums) * {1.0 if right else 1.1}
            return np.append(flow * sums, 1.0)
    """
    (tmp_path / "irl_maxent" / "maxent.py").write_text(textwrap.dedent(stand_in), encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    peer = Peer(Path(sys.executable), IRL_MAXENT, ("irl-maxent", str(save_problem(tmp_path))))
    remarks: list[str] = []
    figures = {figure.key: figure for figure in prediction_speed(TINY, {"irl-maxent": peer}, remarks)}
    peer.close()
    assert ("irl-maxent" in figures) == right
    assert bool(remarks) != right
    if right:
        ratio, own = figures["irl-maxent / gradient"], figures["maxent gradient"]
        assert ratio.samples == tuple(a / b for a, b in zip(figures["irl-maxent"].samples, own.samples, strict=True))
    else:
        assert "irl-maxent was not measured: its gradient differs" in remarks[0]


def test_starting_runs_fresh_processes_with_and_without_compiled_code(monkeypatch: pytest.MonkeyPatch) -> None:
    # Stands for compiling: slow where the cache folder is empty, quick afterwards.
    code = (
        "import os, pathlib\n"
        "mark = pathlib.Path(os.environ['NUMBA_CACHE_DIR'], '{}')\n"
        "print(1.0 if mark.exists() else 9.0)\n"
        "mark.touch()"
    )
    monkeypatch.setattr(run, "_FIRST_SCORE", code.format("score"))
    monkeypatch.setattr(run, "_FIRST_STEP", code.format("step"))
    figures = {figure.key: figure.value for figure in run.starting(TINY)}
    assert (figures["compile"], figures["compile env"]) == (9.0, 9.0)
    assert (figures["compiled"], figures["compiled env"]) == (1.0, 1.0)
    assert figures["import"] > 0
    assert figures["gymnasium"] > 0


def test_a_failing_process_is_an_error_that_quotes_it() -> None:
    with pytest.raises(RuntimeError, match="no such thing"):
        run._fresh("raise SystemExit('no such thing')")


@pytest.mark.parametrize("name", ["_FIRST_SCORE", "_FIRST_STEP"])
def test_the_programs_that_are_timed_run(name: str) -> None:
    assert run._fresh(getattr(run, name))[0] > 0
