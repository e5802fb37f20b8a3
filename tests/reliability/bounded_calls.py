"""Every public count, called with an ordinary number and with absurd ones; run in a process of its own.

Prints a line of JSON per call: what was called, whether it was refused, how many seconds it took, by how many MiB
memory grew, and what came.
"""

from __future__ import annotations

import json
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from click.testing import CliRunner

from benchmarks.cli.app import main as legible
from benchmarks.sweeps import Sweep
from legible_envs.drawing import draw_side_by_side
from legible_envs.overcooked.layouts import RandomLayouts
from legible_envs.overcooked.rendering import draw_layout
from legible_envs.tabletop import Table, TableObject, TabletopLayout, VirtualObstacle
from legible_envs.tabletop.rendering import draw_panels, draw_table
from legible_envs.tasks import Subtask, TaskGraph
from legible_envs.workspace import make_workspace
from optimizers import make_archive, make_emitter, search
from predictors import make_predictor
from predictors.evaluation import evaluate, learning_curve
from predictors.reaching.ellipses import draw_reaches

HUGE = (10**9, 2**63 - 1)

Case = tuple[Callable[[Any], Any], Any, tuple[Any, ...]]


def cases() -> dict[str, Case]:
    """By name: a call, an ordinary number, and absurd ones."""
    rng = np.random.default_rng(0)
    kitchen, table = make_workspace("overcooked", shape=(5, 5)), make_workspace("tabletop")
    spaces = {"kitchen": (kitchen, kitchen.sample(2, rng)), "table": (table, table.sample(2, rng))}
    cook, cups = kitchen.decode(spaces["kitchen"][1][0]), table.decode(spaces["table"][1][0])
    walks, reaches = (ws.simulate(genomes[0], 2, rng) for ws, genomes in spaces.values())
    gaussian = make_predictor("reach-gaussian").fit(reaches)
    found: dict[str, Case] = {}

    def add(name: str, call: Callable[[Any], Any], ordinary: Any = 2, absurd: tuple[Any, ...] = HUGE) -> None:
        found[name] = call, ordinary, absurd

    for which, (ws, genomes) in spaces.items():
        name = {"kitchen": "LegibleOvercooked-v0", "table": "LegibleTabletop-v0"}[which]
        add(f"{which}: num_envs", lambda n, name=name: gym.make_vec(name, num_envs=n))
        add(f"{which}: sample", lambda n, ws=ws: ws.sample(n, rng), 2, (*HUGE, 10**12))
        add(f"{which}: perturb", lambda n, ws=ws, g=genomes: ws.perturb(g, n, rng))
        add(f"{which}: participants", lambda n, ws=ws, g=genomes: ws.simulate(g[0], n, rng), 1, (*HUGE, 10**12))
        add(f"{which}: executions", lambda n, ws=ws, g=genomes: ws.simulate(g[0], 1, rng, executions=n), 1)
        add(f"{which}: both", lambda n, ws=ws, g=genomes: ws.simulate(g[0], n, rng, executions=n), 1, (50_000,))
        add(f"{which}: initial", lambda n, ws=ws: search(ws, initial=n, evaluations=3, progress=False))
        add(f"{which}: iterations", lambda n, ws=ws: search(ws, iterations=(n, 0), progress=False))
        for emitter, options in {
            "improve": ("climbs", "fanout", "initial"),
            "annealing": ("chains", "groups", "initial"),
            "cma-me": ("strategies", "batch_size", "initial"),
            "cma-mae": ("strategies", "batch_size", "initial"),
            "differential-evolution": ("population",),
            "mutation": ("batch_size",),
            "nslc": ("population",),
            "random": ("batch_size",),
        }.items():
            for option in options:
                made = {"workspace": ws, "seed": 0, "evaluations": 2_000}
                add(
                    f"{which}: {emitter} {option}",
                    lambda n, e=emitter, o=option, m=made: make_emitter(
                        e, make_archive(m["workspace"], seed=0), **m, options={o: n}
                    ),
                    6,
                )
    steep = make_workspace("tabletop", condition="placement", second_measure="mean x")
    add(
        "gradient-arborescence batch_size",
        lambda n: make_emitter(
            "gradient-arborescence", make_archive(steep, seed=0), workspace=steep, seed=0, options={"batch_size": n}
        ),
        6,
    )
    large = {"shape": (64, 64)}
    add("kitchens of 64 x 64", lambda n: gym.make_vec("LegibleOvercooked-v0", num_envs=n, **large), 2, (60_000,))
    add("genomes of 64 x 64", lambda n: make_workspace("overcooked", **large).sample(n, rng), 1, (900_000,))
    add("shape", lambda n: make_workspace("overcooked", shape=(5, n)), 5)
    add("shape of a game", lambda n: gym.make("LegibleOvercooked-v0", shape=(5, n)), 5)
    add("shape of a distribution", lambda n: RandomLayouts((5, n)), 5)
    add("num_layouts", lambda n: RandomLayouts((5, 5), num_layouts=n).sample(rng), 2, (*HUGE, 10**6))
    add("cook_time", lambda n: gym.make("LegibleOvercooked-v0", cook_time=n))
    add("horizon", lambda n: make_workspace("overcooked", shape=(5, 5), human="boltzmann", horizon=n), 40)
    add("max_obstacles", lambda n: make_workspace("tabletop", max_obstacles=n))
    add("max_obstacles of a game", lambda n: gym.make("LegibleTabletop-v0", max_obstacles=n), 4)
    add("max_obstacles of a genome", lambda n: cups.to_genome(n), 4)
    add("obstacles", lambda n: TabletopLayout(cups.objects, [VirtualObstacle((0.2, 0.2))] * n), 2, (1_000, 10**7))
    add("objects", lambda n: TabletopLayout([TableObject(f"{i}", (0.2, 0.2)) for i in range(n)]), 2, (10_000,))
    add("size of an object", lambda n: TableObject("cup", (0.2, 0.2), size=(n, 0.1)), 2, (1e9, 1e300))
    add("size of a table", lambda n: Table(size=(n, 1.0)), 2, (1e9, 1e300))
    add("starts", lambda n: Table(starts={f"{i}": (0.1, 0.1) for i in range(n)}), 2, (10_000,))
    add("place of an object", lambda n: TableObject("cup", (n, 0.2)), 0.2, (1e9, 1e300))
    add("rate", lambda n: table.simulate(spaces["table"][1][0], 1, rng, rate=n), 30.0, (1e9, 1e300))
    add("free subtasks", lambda n: free_subtasks(n), 8, (16, 18, 20, 128, 10_000))
    add("free subtasks, one end", lambda n: free_subtasks(n, ("there",)), 8, (17, 20, 128, 10_000))
    add("copies", lambda n: TaskGraph([Subtask("a", ("x",), count=n)], "home"))
    add("copies after one", lambda n: TaskGraph([Subtask("a", ("x",)), Subtask("b", ("y",), ("a",), (), n)], "home"))
    add("goals", lambda n: TaskGraph([Subtask(s, tuple(f"{s}{i}" for i in range(n))) for s in "ab"], "o"), 2, (30_000,))
    for name, options in {
        "reach-gaussian": ("n_samples",),
        "recurrent": ("hidden_size", "num_layers", "members", "batch_size", "max_epochs", "patience"),
        "transformer": ("width", "num_layers", "heads", "members"),
    }.items():
        for option in options:  # networks are checked before they need torch
            add(f"{name}: {option}", lambda n, name=name, o=option: settings_of(name, n, o, reaches), None)
    add("repeats", lambda n: evaluate(["grid-knn"], walks, rare="keep", cv=2, repeats=n), 1)
    add("cv", lambda n: evaluate(["grid-knn"], walks, rare="keep", cv=n), 2)
    add("repeats of a curve", lambda n: learning_curve(["grid-knn"], walks, repeats=n), None)
    add("tile", lambda n: draw_layout(cook, tile=n), 8)
    add("width", lambda n: draw_table(cups, width=n), 120)
    add("height", lambda n: draw_table(TabletopLayout([TableObject("a", (0.05, 0.5))], (), tall(n))), 1.0, (100.0,))
    add("width of panels", lambda n: draw_panels({"a": cups}, table.task, width=n), 120)
    add("gap", lambda n: draw_side_by_side([draw_layout(cook, tile=8)], gap=n))
    add("text", lambda n: draw_side_by_side([draw_layout(cook, tile=8)], ["a"], text=n), 12)
    add("size of a picture of reaches", lambda n: draw_reaches(gaussian, size=n), 64)
    add("seeds of a sweep", lambda n: Sweep.from_dict({"workspaces": ["overcooked"], "seeds": n}), 1)
    add("people of a sweep", lambda n: Sweep.from_dict({"workspaces": ["overcooked"], "people": {"participants": n}}))
    for arguments in (
        "optimize overcooked --evaluations 3 --shape 5 {}",
        "optimize overcooked --iterations {} 1",
        "optimize overcooked --evaluations 3 --emitter-option fanout={}",
        "optimize tabletop --evaluations 3 --set max_obstacles={}",
        "play nowhere --fps {}",
        "score nowhere --folds {}",
        "score nowhere --repeats {}",
        "humans evaluate --repeats {}",
        "reproduce overcooked --seeds {}",
        "reproduce overcooked --workers {}",
    ):
        add(f"legible {arguments}", lambda n, words=arguments: command(words.format(n)), None)
    return found


def free_subtasks(count: int, then: tuple[str, ...] = ()) -> TaskGraph:
    """Subtasks in any order."""
    return TaskGraph([Subtask(f"s{i}", (f"g{i}",), then=then) for i in range(count)], "home")


def tall(depth: float) -> Table:
    """A narrow table."""
    return Table((0.1, depth), (0.0, 0.0, 0.1, depth), (0.0, 0.0, 0.1, depth), {"home": (0.05, 0.05)})


def settings_of(name: str, number: int, option: str, reaches: Any) -> None:
    """Check the settings of a predictor as fitting does."""
    make_predictor(name, **{option: number}).fit(reaches)


def command(arguments: str) -> None:
    """Run the command line.

    Raises:
        ValueError: What it says, where the arguments are refused.
    """
    result = CliRunner().invoke(legible, arguments.split())
    if result.exit_code == 2:
        raise ValueError(result.output)


def grown() -> float:
    """MiB of memory at most in use so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def run() -> None:
    """Call everything."""
    made = cases()
    for call, ordinary, _ in made.values():
        if ordinary is not None:
            call(ordinary)
    statm = Path("/proc/self/statm")
    if statm.exists():  # Linux
        used = int(statm.read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + 2**31, used + 2**31))
    for name, (call, _, absurd) in made.items():
        for number in absurd:
            before, started = grown(), time.process_time()
            try:
                call(number)
                came = ["", "nothing"]
            except BaseException as error:
                came = [type(error).__name__, str(error)]
                refused = isinstance(error, ValueError)
            else:
                refused = False
            seconds = time.process_time() - started
            print(json.dumps([f"{name} = {number:g}", refused, seconds, grown() - before, *came]), flush=True)


if __name__ == "__main__":
    run()
