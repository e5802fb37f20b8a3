"""Speed of tables: scoring, searching, playing, drawing, and simulated participants."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from benchmarks.throughput.measure import Figure, alternate, rate, sampler
from benchmarks.throughput.peer_tabletop import stages_of, straight_line_loss, straight_line_losses

if TYPE_CHECKING:
    from benchmarks.throughput.sweep import Settings
    from legible_envs.tabletop import TabletopWorkspace

__all__ = ["replay", "table_drawing", "table_games", "table_people", "table_scoring", "table_searching", "tables_with"]

Deed = tuple[npt.NDArray[np.float32], str | None]
"""An action, and the goal that the hand may then take."""

_TRIES = 1_000


def tables_with(obstacles: int, count: int, seed: int = 0) -> tuple[TabletopWorkspace, npt.NDArray[np.float64]]:
    """A workspace with places for so many obstacles, and ``(count, d)`` random tables of eight cubes that have as many.

    Obstacles are laid one after another as a climb does, wherever the rules allow.
    """
    from legible_envs.tabletop import TabletopWorkspace

    workspace = TabletopWorkspace(condition="both" if obstacles else "placement", max_obstacles=obstacles)
    rng = np.random.default_rng(seed)
    genomes = workspace.sample(count, rng)
    for _ in range(_TRIES):
        waiting = workspace.num_obstacles(genomes) < obstacles
        if not waiting.any():
            return workspace, genomes
        children = workspace.perturb(genomes[waiting], 1, rng, phase=1)
        grown = workspace.num_obstacles(children) > workspace.num_obstacles(genomes[waiting])
        genomes[np.flatnonzero(waiting)[grown]] = children[grown]
        # Where no further obstacle fits, try other cubes.
        stuck = np.flatnonzero(waiting)[~grown & (rng.random(len(grown)) < 0.02)]
        genomes[stuck] = workspace.sample(len(stuck), rng)
    raise RuntimeError(f"no room for {obstacles} obstacles on some of {count} tables")


def table_scoring(settings: Settings) -> list[Figure]:
    """Exact scores of tables per second on one core, and beside them the score of the field's open code."""
    from legible_envs.tabletop import TabletopWorkspace

    samplers: dict[str, Callable[[], float]] = {}
    for obstacles in settings.table_obstacles:
        workspace, genomes = tables_with(obstacles, settings.tables)
        samplers[_key(obstacles)] = sampler(workspace.scorer.score_genomes, genomes, settings.seconds)
    tea = TabletopWorkspace("tea", "placement", max_obstacles=0)
    genomes = tea.sample(settings.tables, np.random.default_rng(0))
    centres, stages = genomes.reshape(len(genomes), -1, 2), stages_of(tea.task)
    start = np.array(tea.task.layout.table.starts[tea.task.graph.start])
    labels, few = range(centres.shape[1]), centres[: settings.oracle_layouts]

    def literal() -> int:
        for one in few:
            straight_line_loss(start, one, labels, stages)
        return len(few)

    samplers["score tea"] = sampler(tea.scorer.score_genomes, genomes, settings.seconds)
    samplers["tea loss"] = lambda: rate(literal, settings.seconds)
    samplers["tea losses"] = sampler(lambda some: straight_line_losses(start, some, stages), centres, settings.seconds)
    samples = alternate(samplers, settings.rounds)
    own, loss, losses = (
        Figure(key, what, "/s", samples[key])
        for key, what in (
            ("score tea", "exact scores, tea task (5 objects), tables"),
            ("tea loss", "cross-entropy at 25, 50, 75 % of straight lines, numpy, tea task, tables"),
            ("tea losses", f"the same of {settings.tables:,} tables in whole-array operations, tables"),
        )
    )
    return [
        *(
            Figure(_key(n), f"exact scores, 8 cubes, {n or 'no'} obstacles, tables", "/s", samples[_key(n)])
            for n in settings.table_obstacles
        ),
        own,
        loss,
        losses,
        own.over(loss, "score tea / tea loss", "exact scores over that cross-entropy, tea task"),
        own.over(losses, "score tea / tea losses", "exact scores over it in whole-array operations"),
    ]


def _key(obstacles: int) -> str:
    return f"score table {obstacles}"


def table_searching(settings: Settings) -> list[Figure]:
    """Seconds that the searches of ``legible optimize tabletop`` take, all three conditions one after another."""
    from legible_envs.tabletop import TabletopWorkspace
    from optimizers import search

    for condition in ("both", "placement", "obstacles"):  # compiles
        search(TabletopWorkspace(condition=condition), iterations=(2, 1), progress=False)
    taken = [
        search(TabletopWorkspace(condition=condition), iterations=settings.table_climbs, progress=False).seconds
        for condition in ("both", "placement", "obstacles")
    ]
    first, climbs = settings.table_climbs
    size = f"tabletop search, {first:,} random tables, {climbs:,} climbs"
    return [
        Figure("table search", size, "s", (taken[0],)),
        Figure("table searches", f"{size}, all three conditions", "s", (sum(taken),)),
    ]


def table_games(settings: Settings) -> list[Figure]:
    """Steps per second at tables with four obstacles, replaying episodes of simulated participants."""
    kinds: dict[str, tuple[str, dict[str, Any]]] = {
        "table env": ("steps of one table, a person alone", {}),
        "table env belief": ("the same with the built-in Bayesian belief", {"predictor": "bayesian"}),
        "table env robot": ("the same with the robot and its belief", {"partner": "robot"}),
    }
    samplers: dict[str, Callable[[], float]] = {}
    for key, (_, arguments) in kinds.items():
        samplers[key] = _replayer(arguments, settings)
    samplers["table player"] = _player(settings)
    samples = alternate(samplers, settings.rounds)
    figures = [Figure(key, what, "/s", samples[key]) for key, (what, _) in kinds.items()]
    what = "the same, while the simulated person decides and plans"
    return [*figures, Figure("table player", what, "/s", samples["table player"])]


def _episodes(arguments: dict[str, Any], count: int) -> tuple[Any, list[Any], list[list[Deed]]]:
    """An environment, layouts, and a participant's actions on each until the task was done."""
    import gymnasium as gym

    import legible_envs  # noqa: F401  (registers)

    workspace, genomes = tables_with(4, count)
    layouts = [workspace.decode(genome) for genome in genomes]
    env = gym.make("LegibleTabletop-v0", **arguments)
    return env, layouts, [list(_deeds(env, layout, seed)) for seed, layout in enumerate(layouts)]


def _deeds(env: Any, layout: Any, seed: int) -> Iterator[Deed]:
    """Play one episode, and yield each action with its goal, which a replay needs too."""
    from legible_envs.tabletop.humans.simulation import sample_person
    from legible_envs.tabletop.policies import ReachingPlayer

    rng = np.random.default_rng(seed)
    player = ReachingPlayer(env, sample_person(rng), rng)
    obs, info = env.reset(seed=seed, options={"layout": layout})
    over = False
    while not over:
        action = player(obs, info)
        deed = action, env.unwrapped.goal
        obs, _, terminated, truncated, info = env.step(action)
        over = terminated or truncated
        yield deed


def replay(env: Any, layout: Any, seed: int, deeds: Sequence[Deed]) -> bool:
    """Repeat an episode's actions; whether they complete the task."""
    env.reset(seed=seed, options={"layout": layout})
    table = env.unwrapped
    terminated = False
    for action, goal in deeds:
        if table.goal != goal:
            table.goal = goal
        _, _, terminated, _, _ = env.step(action)
    return terminated


def _replayer(arguments: dict[str, Any], settings: Settings) -> Callable[[], float]:
    env, layouts, recorded = _episodes(arguments, settings.table_episodes)

    def play() -> int:
        for seed, (layout, deeds) in enumerate(zip(layouts, recorded, strict=True)):
            replay(env, layout, seed, deeds)
        return sum(len(deeds) for deeds in recorded)

    return lambda: rate(play, settings.seconds)


def _player(settings: Settings) -> Callable[[], float]:
    env, layouts, _ = _episodes({"partner": "robot"}, settings.table_episodes)

    def play() -> int:
        return sum(1 for seed, layout in enumerate(layouts) for _ in _deeds(env, layout, seed))

    return lambda: rate(play, settings.seconds)


def table_drawing(settings: Settings) -> list[Figure]:
    """Pictures per second, 640 pixels wide, of a person and the robot at tables with four obstacles."""
    from legible_envs.tabletop.rendering import draw_scene

    env, layouts, _ = _episodes({"partner": "robot"}, settings.table_episodes)
    views = [
        env.unwrapped.view() for seed, layout in enumerate(layouts) for _ in _deeds(env, layout, seed)
    ][::3]  # fmt: skip

    def draw() -> int:
        for view in views:
            draw_scene(view, width=640)
        return len(views)

    samples = alternate({"table frames": lambda: rate(draw, settings.seconds)}, settings.rounds)
    what = "pictures of a table at 640 pixels, with robot, belief and trail"
    return [Figure("table frames", what, "/s", samples["table frames"])]


def table_people(settings: Settings) -> list[Figure]:
    """Simulated participants per second, each doing the whole task at a table with four obstacles."""
    workspace, genomes = tables_with(4, 1)
    rng = np.random.default_rng(0)

    def simulate() -> int:
        workspace.simulate(genomes[0], settings.table_people, rng)
        return settings.table_people

    samples = alternate({"table people": lambda: rate(simulate, settings.seconds)}, settings.rounds)
    what = "simulated participants who do the whole task round 4 obstacles"
    return [Figure("table people", what, "/s", samples["table people"])]
