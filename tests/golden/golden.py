"""What no refactoring may change: scores, seeded searches, pictures and episodes, kept as figures and digests.

    python tests/golden/golden.py --record    # after a change that is meant to change them; say so in the changelog
    python tests/golden/golden.py --check     # to the last bit, on the kind of machine that recorded them

The test suite compares the same figures with a tolerance of some last digits, since other processors round otherwise.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import legible_envs  # noqa: F401  registers the environments
from legible_envs.overcooked import OvercookedLayout, OvercookedWorkspace
from legible_envs.overcooked.policies import ScriptedPlayer
from legible_envs.overcooked.rendering import draw_ambiguity, draw_layout
from legible_envs.tabletop import TabletopTask, TabletopWorkspace
from legible_envs.tabletop.rendering import draw_configuration, draw_table
from optimizers import search

HERE = Path(__file__).parent
FIGURES, DIGESTS = HERE / "figures.npz", HERE / "digests.json"
EMITTERS = ("improve", "annealing", "nslc", "differential-evolution", "cma-me", "mutation", "random")
KITCHENS, TABLES, STEPS = 2000, 2000, 10_000

Figures = dict[str, np.ndarray]


def kitchen_workspace(**settings: Any) -> OvercookedWorkspace:
    return OvercookedWorkspace(shape=(7, 7), **settings)


def scores() -> Figures:
    """Legibility, distance and measures of 2,000 kitchens and 2,000 tables, in every manner of scoring."""
    kept: Figures = {}
    plain = kitchen_workspace()
    genomes = plain.sample(KITCHENS, np.random.default_rng(1))
    kept["kitchens/genomes"] = genomes
    kept["kitchens/distance"] = plain.distance(genomes)
    kept["kitchens/measures"] = plain.measures(genomes)
    for name, settings in {
        "mean": {},
        "sum": {"prefix": "sum"},
        "fractions": {"prefix": (0.25, 0.5)},
        "strict": {"ties": "strict"},
        "one pot": {"pots": 1},
        "beta": {"beta": 0.5, "c": 2.0},
    }.items():
        kept[f"kitchens/{name}"] = kitchen_workspace(**settings).legibility(genomes)
    few = kitchen_workspace(human="boltzmann").legibility(genomes[:100])
    kept["kitchens/boltzmann"] = few
    table = TabletopWorkspace()
    genomes = table.sample(TABLES, np.random.default_rng(2))
    kept["tables/genomes"] = genomes
    kept["tables/mean"] = table.legibility(genomes)
    kept["tables/fractions"] = TabletopWorkspace(prefix=(0.2, 0.6), beta=10.0).legibility(genomes)
    kept["tables/distance"] = table.distance(genomes)
    kept["tables/measures"] = table.measures(genomes)
    return kept


def searches() -> Figures:
    """Archives of seeded searches, every built-in emitter on a small kitchen, and the paper's on a table."""
    kept: Figures = {}
    for emitter in EMITTERS:
        result = search(OvercookedWorkspace(shape=(5, 6)), emitter=emitter, evaluations=2000, seed=7)
        kept.update(_archive(f"kitchen search/{emitter}", result))
    kept.update(_archive("table search", search(TabletopWorkspace(), evaluations=2000, seed=7)))
    return kept


def _archive(name: str, result: Any) -> Figures:
    data = result.archive.data()
    order = np.argsort(data["index"], kind="stable")
    return {f"{name}/{field}": np.asarray(data[field])[order] for field in ("index", "objective", "solution")}


def pictures() -> list[np.ndarray]:
    """Twenty pictures: layouts, doubts, games and tables."""
    workspace, table = kitchen_workspace(), TabletopWorkspace()
    drawn = []
    for genome in workspace.sample(5, np.random.default_rng(3)):
        layout = workspace.decode(genome)
        drawn.append(draw_layout(layout))
        drawn.append(draw_ambiguity(layout, workspace.ambiguity(genome)))
    for genome in table.sample(4, np.random.default_rng(4)):
        drawn.append(draw_table(table.decode(genome), task=table.task))
    drawn.append(draw_configuration(TabletopTask.named("columns")))
    for name, arguments in (("LegibleOvercooked-v0", {}), ("LegibleTabletop-v0", {"task": "tea"})):
        env = gym.make(name, render_mode="rgb_array", **arguments)
        env.reset(seed=5)
        env.action_space.seed(5)
        for _ in range(5 if "Over" in name else 4):
            for _ in range(12):
                env.step(env.action_space.sample())
            if len(drawn) < 20:
                drawn.append(env.render())
        env.close()
    return drawn[:20]


def episodes() -> dict[str, list[Any]]:
    """10,000 steps of each environment by random actions, and a soup kitchen cooked by script."""
    kept: dict[str, list[Any]] = {}
    for name, arguments in {
        "LegibleOvercooked-v0": {},
        "LegibleOvercooked-v0 random": {"layouts": "random", "obs_type": "vector"},
        "LegibleTabletop-v0": {},
        "LegibleTabletop-v0 robot": {"partner": "robot"},
    }.items():
        env = gym.make(name.split()[0], **arguments)
        env.action_space.seed(6)
        obs, _ = env.reset(seed=6)
        rows = [obs]
        for _ in range(STEPS if "robot" not in name else STEPS // 5):
            obs, reward, terminated, truncated, _ = env.step(env.action_space.sample())
            rows.append((obs, float(reward), bool(terminated), bool(truncated)))
            if terminated or truncated:
                rows.append(env.reset()[0])
        kept[name] = rows
    env = gym.make("LegibleOvercooked-v0", shape=(5, 5), layout=OvercookedLayout.from_ascii(SMALL))
    player, rows = ScriptedPlayer(env, np.random.default_rng(8)), []
    obs, info = env.reset(seed=8)
    done = False
    while not done:
        obs, reward, terminated, truncated, info = env.step(player(obs, info))
        rows.append((obs, float(reward)))
        done = terminated or truncated
    kept["scripted cook"] = rows
    return kept


def people() -> Figures:
    """Simulated participants of both environments, and what predictors say of them."""
    from legible_envs.overcooked.humans import simulate_participants as cooks
    from legible_envs.tabletop.humans import simulate_participants as reachers
    from predictors import make_predictor

    kept: Figures = {}
    workspace, task = kitchen_workspace(), TabletopTask.named("columns")
    walks = cooks(workspace.decode(workspace.sample(1, np.random.default_rng(9))[0]), 4, np.random.default_rng(9))
    reaches = reachers(task.layout, 4, np.random.default_rng(9), task=task)
    for kind, trajectories, names in (
        ("walks", walks, ("shortest-distance", "bayesian", "maxent-irl", "grid-ngram", "grid-knn", "grid-logistic")),
        ("reaches", reaches, ("reach-gaussian", "reach-bayesian", "reach-logistic")),
    ):
        kept[f"people/{kind}"] = np.concatenate([trajectory.states for trajectory in trajectories])
        for name in names:
            chances = make_predictor(name).fit(trajectories).predict_proba_at(trajectories, fractions=(0.3, 0.7))
            kept[f"people/{name}"] = np.asarray(chances)
    return kept


SMALL = "XTXOX\nC   D\nX   P\nF   X\nXXSXX"


def digest(value: Any) -> str:
    """Of arrays, numbers and their nests: dtype, shape and bytes."""
    running = hashlib.sha256()
    _feed(running, value)
    return running.hexdigest()


def _feed(running: Any, value: Any) -> None:
    if isinstance(value, dict):
        for key in sorted(value):
            running.update(str(key).encode())
            _feed(running, value[key])
    elif isinstance(value, list | tuple):
        for part in value:
            _feed(running, part)
    else:
        array = np.asarray(value)
        running.update(f"{array.dtype.str}{array.shape}".encode())
        running.update(np.ascontiguousarray(array).tobytes())


def figures() -> Figures:
    """Every figure that is kept as it is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return scores() | searches() | people()


def digests() -> dict[str, str]:
    """A digest for each picture and each environment's steps."""
    kept = {f"picture {i:02d}": digest(picture) for i, picture in enumerate(pictures())}
    return kept | {f"steps {name}": digest(rows) for name, rows in episodes().items()}


def main() -> None:
    """Record or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--record", action="store_true")
    what.add_argument("--check", action="store_true")
    recording = parser.parse_args().record
    _do: Callable[[], int] = _record if recording else _check
    sys.exit(_do())


def _record() -> int:
    kept = figures()
    np.savez_compressed(FIGURES, **{name.replace("/", "|"): array for name, array in kept.items()})
    DIGESTS.write_text(json.dumps(digests(), indent=1, sort_keys=True) + "\n")
    print(f"{len(kept)} arrays in {FIGURES.name}, digests in {DIGESTS.name}")
    return 0


def read_figures() -> Figures:
    """The figures that were recorded."""
    with np.load(FIGURES) as file:
        return {name.replace("|", "/"): file[name] for name in file.files}


def _check() -> int:
    then, now = read_figures(), figures()
    wrong = sorted(set(then) ^ set(now))
    wrong += [name for name in then if name in now and digest(then[name]) != digest(now[name])]
    before, after = json.loads(DIGESTS.read_text()), digests()
    wrong += sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
    for name in wrong:
        print(f"changed: {name}")
    print(f"{len(then)} arrays, {len(before)} digests: {len(wrong)} changed")
    return int(bool(wrong))


if __name__ == "__main__":
    main()
