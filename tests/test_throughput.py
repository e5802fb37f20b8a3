"""The speed benchmark measures what it says; how fast is asserted nowhere."""

from __future__ import annotations

import io
import itertools
import sys
from pathlib import Path

import pytest
from rich.console import Console

from benchmarks.throughput import run
from benchmarks.throughput.analysis import to_markdown
from benchmarks.throughput.measure import Figure, alternate, rate
from benchmarks.throughput.peers import Peer, PeerError
from benchmarks.throughput.sweep import OPTIMUM_5X5, TARGETS, Settings, Target

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


def test_the_whole_benchmark_reports_every_promise(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "starting", lambda settings: [Figure("import", "import", "s", (0.1,)),
                                                           Figure("compile", "compile", "s", (9.0,))])  # fmt: skip
    stream = io.StringIO()
    page = tmp_path / "docs" / "benchmarks.md"
    figures = run.run_benchmark(Console(file=stream, width=140), settings=TINY, out=page)
    keys = {figure.key for figure in figures}
    assert keys >= {key for key in TARGETS if not key.endswith("/ peer")}
    assert all(value > 0 for figure in figures for value in figure.samples)
    text = page.read_text(encoding="utf-8")
    for figure in figures:
        assert f"| {figure.what} |" in text
        assert figure.what in stream.getvalue()
    assert "--peers" in text


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
        Peer(Path(sys.executable))


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
