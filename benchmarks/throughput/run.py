"""The measurements, and the command that makes them one after another."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.throughput.analysis import machine, result_table, to_markdown
from benchmarks.throughput.measure import Figure, alternate, rate, sampler
from benchmarks.throughput.peers import IMITATION, IRL_MAXENT, OVERCOOKED_AI, Peer, opened
from benchmarks.throughput.predictors_grid import evaluation_speed, prediction_speed, save_problem
from benchmarks.throughput.predictors_reaching import reach_speed
from benchmarks.throughput.study import study_speed
from benchmarks.throughput.sweep import FULL, OPTIMUM_5X5, QUICK, Settings
from benchmarks.throughput.tabletop import table_drawing, table_games, table_people, table_scoring, table_searching
from benchmarks.throughput.teams import steps_of, team_games, ticks_of

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["games", "run_benchmark", "scoring", "searching", "starting"]


def run_benchmark(
    console: Console,
    *,
    quick: bool = False,
    peers: bool = False,
    peers_folder: Path | None = None,
    out: Path | None = None,
    settings: Settings | None = None,
) -> list[Figure]:
    """Measure everything, print it, and write it as Markdown if ``out`` is given.

    Args:
        console: Where to print.
        quick: Rough figures, with few repeats.
        peers: Whether to measure other packages too: Overcooked-AI, imitation and irl-maxent.
        peers_folder: Where their virtual environments live; None means the user's cache folder.
        out: Markdown file to write.
        settings: Sizes and repeats; None means those of ``quick``.
    """
    settings = settings or (QUICK if quick else FULL)
    remarks = _busy()
    figures: list[Figure] = []
    if not peers:
        remarks.append("Overcooked-AI, imitation and irl-maxent were not measured; --peers does.")
    remarks.append(
        "The cross-entropy at straight lines is what github.com/cairo-robotics/tabletop_workspace_opt scores tables "
        "by, re-implemented (benchmarks/throughput/peer_tabletop.py): 15 observed points, no obstacles."
    )
    with tempfile.TemporaryDirectory() as scratch, contextlib.ExitStack() as stack:
        running: dict[str, Peer] = {}
        if peers:
            problem = str(save_problem(Path(scratch)))
            packages = {OVERCOOKED_AI: (), **{package: (package.name, problem) for package in (IMITATION, IRL_MAXENT)}}
            running = stack.enter_context(opened(packages, peers_folder, remarks, console))
        game = running.pop(OVERCOOKED_AI.name, None)
        groups: tuple[tuple[str, Callable[[], list[Figure]]], ...] = (
            ("scoring layouts", lambda: scoring(settings)),
            ("searching", lambda: searching(settings)),
            ("playing", lambda: games(settings, game)),
            ("playing as teams", lambda: team_games(settings)),
            ("scoring tables", lambda: table_scoring(settings)),
            ("searching tables", lambda: table_searching(settings)),
            ("playing at tables", lambda: table_games(settings)),
            ("drawing tables", lambda: table_drawing(settings)),
            ("participants at tables", lambda: table_people(settings)),
            ("predicting reaches", lambda: reach_speed(settings)),
            ("predicting in kitchens", lambda: prediction_speed(settings, running, remarks)),
            ("evaluating predictors", lambda: evaluation_speed(settings)),
            ("a study's server", lambda: study_speed(settings)),
            ("starting", lambda: starting(settings)),
        )
        for name, measure in groups:
            with console.status(f"measuring: {name}"):
                figures += measure()
    console.print(result_table(figures))
    for line in (*remarks, machine()):
        console.print(line, style="dim", markup=False)
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(to_markdown(figures, remarks, settings), encoding="utf-8")
        console.print(f"table: {out}", markup=False)
    return figures


def _busy() -> list[str]:
    """A remark if other processes keep the machine busy, which lengthens every duration."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    cores = os.cpu_count() or 1
    return (
        [f"The machine was busy (load {load:.1f} on {cores} cores): durations are too long."]
        if load > cores / 2
        else []
    )


# -- scoring and searching ---------------------------------------------------------------------------------------------


def scoring(settings: Settings) -> list[Figure]:
    """Exact scores per second on one core, and how many times faster that is than the readable definition."""
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace
    from legible_envs.overcooked.scoring.explanation import score_layout

    samplers: dict[str, Callable[[], float]] = {}
    for shape in settings.shapes:
        workspace = OvercookedWorkspace(shape=shape)
        genomes = workspace.sample(settings.batch, np.random.default_rng(0))
        samplers[_name(shape)] = sampler(workspace.scores, genomes, settings.seconds)
    workspace = OvercookedWorkspace(shape=(7, 7))
    layouts = [workspace.decode(g) for g in workspace.sample(settings.oracle_layouts, np.random.default_rng(1))]

    def readable() -> int:
        for layout in layouts:
            score_layout(layout, workspace.task)
        return len(layouts)

    samplers["oracle"] = lambda: rate(readable, settings.seconds)
    samples = alternate(samplers, settings.rounds)
    figures = [
        Figure(f"score {_name(shape)}", f"exact scores, {_name(shape)}, layouts", "/s", samples[_name(shape)])
        for shape in settings.shapes
    ]
    oracle = Figure("oracle", "readable definition, 7x7, layouts", "/s", samples["oracle"])
    at_7x7 = [figure for figure in figures if figure.key == "score 7x7"]
    return [
        *figures,
        oracle,
        *(f.over(oracle, "score / oracle", "exact scores over the readable definition") for f in at_7x7),
    ]


def _name(shape: tuple[int, int]) -> str:
    return f"{shape[0]}x{shape[1]}"


def searching(settings: Settings) -> list[Figure]:
    """Time to the known optimum of 5x5 kitchens, and the share of a search's time that is not scoring."""
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace
    from optimizers import search

    small = OvercookedWorkspace(shape=(5, 5), prefix="sum")

    def found(state: Any) -> bool:
        best = state.history[-1]["best"] if state.history else None
        return best is not None and best >= OPTIMUM_5X5 - 1e-9

    search(small, evaluations=2_000, progress=False)  # compiles
    runs = [
        search(small, evaluations=settings.optimum_evaluations, seed=seed, callbacks=[found], progress=False)
        for seed in range(settings.seeds)
    ]
    hits = tuple(float(run.best_objective is not None and run.best_objective >= OPTIMUM_5X5 - 1e-9) for run in runs)
    overheads = []
    for seed in range(settings.rounds):
        with tempfile.TemporaryDirectory() as folder:
            budget = settings.search_evaluations
            whole = search(OvercookedWorkspace(), evaluations=budget, seed=seed, checkpoint=folder, progress=False)
        overheads.append(whole.overhead)
    return [
        Figure("optimum found", f"5x5 optimum found, share of {len(runs)} seeds", "share", (sum(hits) / len(hits),)),
        Figure("optimum seconds", "search until then, slowest seed", "s", (max(run.seconds for run in runs),)),
        Figure("search overhead", "search, 7x7, share of time not spent scoring", "share", tuple(overheads)),
    ]


# -- playing -----------------------------------------------------------------------------------------------------------


def games(settings: Settings, peer: Peer | None = None) -> list[Figure]:
    """Steps per second of one game and of many, resets to new kitchens, and Overcooked-AI in turn with them."""
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers)
    from legible_envs.overcooked.design.workspace import OvercookedWorkspace

    rng = np.random.default_rng(0)
    workspace = OvercookedWorkspace()
    layouts = [workspace.decode(genome) for genome in workspace.sample(256, rng)]
    env = gym.make("LegibleOvercooked-v0", layout=layouts[0].to_ascii())
    envs = gym.make_vec("LegibleOvercooked-v0", num_envs=settings.num_envs, vectorization_mode="vector_entry_point",
                        layout=layouts[0].to_ascii())  # fmt: skip
    samplers = {
        "env": lambda: rate(steps_of(env, rng), settings.seconds),
        "vector env": lambda: rate(ticks_of(envs, rng), settings.seconds),
        "reset": lambda: 1 / rate(_resetter(env, layouts), settings.seconds),
    }
    if peer is not None:
        samplers["peer"] = lambda: peer.steps_per_second(settings.seconds, observe=False)
        samplers["peer observed"] = lambda: peer.steps_per_second(settings.seconds, observe=True)
    samples = alternate(samplers, settings.rounds)
    env.close()
    envs.close()
    figures = [
        Figure("env", "steps of one game through gym.make", "/s", samples["env"]),
        Figure("vector env", f"steps of {settings.num_envs} games through gym.make_vec", "/s", samples["vector env"]),
        Figure("reset", "reset to a new kitchen", "s", samples["reset"]),
    ]
    if "peer" in samples:
        bare = Figure("peer", "steps of Overcooked-AI, without observations", "/s", samples["peer"])
        observed = Figure(
            "peer observed", "steps of Overcooked-AI, with grid observations", "/s", samples["peer observed"]
        )
        figures += [bare, observed]
        for own, name in ((figures[0], "one game"), (figures[1], f"{settings.num_envs} games")):
            figures.append(own.over(bare, f"{own.key} / peer", f"{name} over Overcooked-AI without observations"))
            figures.append(own.over(observed, f"{own.key} / observed", f"{name} over Overcooked-AI with observations"))
    return figures


def _resetter(env: Any, layouts: list[Any]) -> Callable[[], int]:
    def reset() -> int:
        for layout in layouts:
            env.reset(options={"layout": layout})
        return len(layouts)

    return reset


# -- starting ----------------------------------------------------------------------------------------------------------

_IMPORT = """
import time
start = time.perf_counter()
import gymnasium
between = time.perf_counter()
import legible_envs
print(between - start, time.perf_counter() - between)
"""
_FIRST_SCORE = """
import time
start = time.perf_counter()
import numpy as np
from legible_envs.overcooked import OvercookedWorkspace
workspace = OvercookedWorkspace()
workspace.legibility(workspace.sample(10, np.random.default_rng(0)))
print(time.perf_counter() - start)
"""
_FIRST_STEP = """
import time
start = time.perf_counter()
import gymnasium as gym, legible_envs
env = gym.make("LegibleOvercooked-v0")
env.reset(seed=0)
env.step(0)
print(time.perf_counter() - start)
"""


def starting(settings: Settings) -> list[Figure]:
    """Seconds to import, to the first score and to the first step, with and without compiled code at hand."""
    imports = [_fresh(_IMPORT) for _ in range(settings.fresh_starts)]
    cold, warm = [], []
    for _ in range(max(1, settings.fresh_starts // 3)):
        with tempfile.TemporaryDirectory() as cache:
            cold.append(tuple(_fresh(code, NUMBA_CACHE_DIR=cache)[0] for code in (_FIRST_SCORE, _FIRST_STEP)))
            warm.append(tuple(_fresh(code, NUMBA_CACHE_DIR=cache)[0] for code in (_FIRST_SCORE, _FIRST_STEP)))
    return [
        Figure("gymnasium", "import gymnasium", "s", tuple(first for first, _ in imports)),
        Figure("import", "import legible_envs on top of it", "s", tuple(second for _, second in imports)),
        Figure("compile", "first score, nothing compiled yet", "s", tuple(score for score, _ in cold)),
        Figure("compiled", "first score afterwards", "s", tuple(score for score, _ in warm)),
        Figure("compile env", "first step of a game, its part not compiled yet", "s", tuple(step for _, step in cold)),
        Figure("compiled env", "first step of a game afterwards", "s", tuple(step for _, step in warm)),
    ]


def _fresh(code: str, **environment: str) -> tuple[float, ...]:
    """The numbers that a new Python process prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, check=False
    )
    if done.returncode:
        raise RuntimeError(f"a process of the benchmark failed: {done.stderr.strip().splitlines()[-1:]}")
    return tuple(float(part) for part in done.stdout.split())
