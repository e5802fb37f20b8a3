"""Hands bad arguments to everything public that passes them on to compiled code; run with ``NUMBA_BOUNDSCHECK=1``.

``python -m tests.reliability.doors ATTEMPTS [DOOR ...]`` prints, as JSON, the errors of each door that are not
documented (an index outside an array is one), the kernels that no attempt led to, and those that take a generator.
"""

from __future__ import annotations

import json
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

import gymnasium
import numba
import numpy as np
import numpy.typing as npt

from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.overcooked.game.replay import GameArrays, predict_transitions
from legible_envs.overcooked.humans import (
    BoltzmannWalker,
    PlannerWalker,
    fit_rationality,
)
from legible_envs.overcooked.humans import simulate_participants as simulate_cooks
from legible_envs.overcooked.humans.planner_fitting import fit_planner
from legible_envs.overcooked.layout import FLOOR
from legible_envs.overcooked.partner.needs import put_away_cells, shared_counters
from legible_envs.overcooked.policies import ScriptedPlayer, WalkingPlayer
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.tabletop import TabletopLayout, TabletopWorkspace
from legible_envs.tabletop.geometry.paths import ShortestPaths
from legible_envs.tabletop.humans import Person, simulate_reach
from legible_envs.tabletop.humans import simulate_participants as simulate_reachers
from legible_envs.tabletop.partner.belief import GoalBelief
from predictors import BehaviourCloning, TimeSeriesGaussian, make_predictor
from tests.reliability.compiled_functions import called, kernels, takes_generator
from tests.support.rough_hands import SPEEDS, RoughHand, rough_table

DOCUMENTED = (ValueError, TypeError, gymnasium.error.Error)
NUMBERS = (0, 1, -1, 2, 5, 6, 7, 127, 128, -128, 255, 2**15, 2**31, -(2**31), 2**62, -(2**63))
REALS = (0.0, -0.0, 0.5, 1.0, -1.0, 1.3, 1e-300, 1e9, -1e9, 1e300, -1e300, np.inf, -np.inf, np.nan)
TYPES = ("i1", "i8", "u1", "u8", "f4", "f8", "?", ">f8")


class Chaos:
    """Where arguments come from: good ones, all kinds in turn, or bad ones, at random.

    Args:
        seed: Of the random numbers.
        good: Whether arguments are what they should be; every door then calls all that it has.
    """

    def __init__(self, seed: list[int], *, good: bool) -> None:
        self.rng = np.random.default_rng(seed)
        self.good = good

    def some(self, options: Sequence[Any]) -> Sequence[Any]:
        """All options, or one."""
        return options if self.good else (self.one(options),)

    def one(self, options: Sequence[Any]) -> Any:
        return options[int(self.rng.integers(len(options)))]

    def number(self, good: int) -> Any:
        """Something like a number of a cell, action or goal."""
        if self.good:
            return good
        value = self.one(NUMBERS) if self.rng.random() < 0.8 else self.one(REALS)
        return value if self.rng.random() < 0.7 else np.array(value)[()]

    def point(self, x: float, y: float) -> tuple[float, float]:
        """A place on a table, near its edges and corners, or far from it."""
        if self.good:
            return x, y
        near = self.rng.choice([0.0, 0.025, 0.4, 0.6, 0.775, 0.8, 1.175, 1.2], 2)
        near += self.rng.choice([0.0, 1e-9, -1e-9, 0.1], 2)
        a, b = (float(value) if self.rng.random() < 0.9 else self.one(REALS) for value in near)
        return a, b

    def array(self, good: npt.ArrayLike) -> np.ndarray:
        """An array like a good one: a few entries anything, another type, order, stride or shape."""
        array = np.array(good)
        if self.good or self.rng.random() < 0.1:
            return array
        for _ in range(int(self.rng.integers(4)) if array.size else 0):
            at = tuple(int(self.rng.integers(side)) for side in array.shape)
            array[at] = self.one(REALS) if array.dtype.kind == "f" else np.array(self.one(NUMBERS)).astype(array.dtype)
        match int(self.rng.integers(10)):
            case 0:
                return array.astype(self.one(TYPES))
            case 1:
                return np.asfortranarray(array)
            case 2:
                return np.repeat(array, 2, axis=0)[::2]
            case 3:
                return array[::-1]
            case 4:
                return array[:0]
            case 5:
                return array[..., : int(self.rng.integers(array.shape[-1] + 1))]
        return array


# -- what is called with them -----------------------------------------------------------------------------------------


@cache
def kitchen_designs() -> tuple[OvercookedWorkspace, ...]:
    costs = np.ones((7, 7))
    costs[2, 2:5] = 3.5
    few: dict[str, Any] = {"stations": ("onion", "dish", "pot", "serving"), "recipes": (("onion",),)}
    few["ranked"] = ("onion", "dish")
    return (
        OvercookedWorkspace(),
        OvercookedWorkspace((5, 9), ties="strict", prefix=0.5),
        OvercookedWorkspace((3, 7), **few),
        OvercookedWorkspace(cell_costs=costs),
        OvercookedWorkspace((4, 6), human="boltzmann", horizon=9, distinct_access=True, **few),
    )


@cache
def table_designs() -> tuple[TabletopWorkspace, ...]:
    return (
        TabletopWorkspace(),
        TabletopWorkspace("tea", "placement", max_obstacles=0, second_measure="mean x"),
        TabletopWorkspace("bins", "obstacles", max_obstacles=6, obstacles_apart=False, max_detour=None),
        TabletopWorkspace("tea", "both", max_obstacles=1, ties="strict", prefix=0.3),
    )


@cache
def genomes_of(ws: Any) -> np.ndarray:
    return ws.sample(6, np.random.default_rng(0))


def designs(chaos: Chaos) -> None:
    for ws in chaos.some((*kitchen_designs(), *table_designs())):
        genomes = ws.perturb(genomes_of(ws), 1, chaos.rng, chaos.one(range(ws.phases)))
        ws.sample(int(chaos.rng.integers(3)), chaos.rng)
        calls: list[Callable[[np.ndarray], object]] = [
            ws.scores,
            ws.measures,
            ws.valid,
            ws.penalty,
            lambda g, ws=ws: ws.decode(g[0] if len(g) else g),
            lambda g, ws=ws: ws.simplifications(g[0] if len(g) else g),
            *(
                lambda g, ws=ws, phase=phase: ws.perturb(g, chaos.one(range(4)), chaos.rng, phase)
                for phase in range(ws.phases)
            ),
            ws.scorer.score_genomes if isinstance(ws, TabletopWorkspace) else ws.relocations,
        ]
        for call in chaos.some(calls):
            call(chaos.array(genomes))


def keys(chaos: Chaos) -> None:
    for ws in chaos.some((*kitchen_designs(), *table_designs())):
        space = ws.continuous()
        vectors = chaos.rng.random((8, space.solution_dim)).round(int(chaos.rng.integers(1, 4)))
        space.legibility(chaos.array(vectors))


def kitchen(chaos: Chaos) -> None:
    for obs_type in chaos.some(("grid", "vector")):
        obstacles = chaos.one(("hard", "soft"))
        options = {"obs_type": obs_type, "virtual_obstacles": obstacles, "layouts": "random", "shaping": True}
        env: Any = gymnasium.make("LegibleOvercooked-v0", disable_env_checker=True, **options)
        walker = chaos.one((BoltzmannWalker(), PlannerWalker()))
        for player in chaos.some((ScriptedPlayer(env, chaos.rng), WalkingPlayer(env, walker, chaos.rng))):
            _, info = env.reset(seed=int(chaos.rng.integers(9)))
            for _ in range(60):
                _, _, over, _, info = env.step(player(None, info))
                if over:
                    break
            env.unwrapped.trajectories(participant="somebody")
            if not over and chaos.rng.random() < 0.5:
                env.step(chaos.number(5))
            player(None, {**info, "goal_mask": chaos.array(info["goal_mask"])})
            env.reset(options={"layout": chaos.array(genomes_of(kitchen_designs()[0])[0])})


def kitchens(chaos: Chaos) -> None:
    for obs_type in chaos.some(("grid", "vector")):
        mode = chaos.one(("NextStep", "SameStep", "Disabled"))
        settings: dict[str, Any] = {"obs_type": obs_type, "autoreset_mode": mode, "max_episode_steps": 4}
        envs: Any = gymnasium.make_vec("LegibleOvercooked-v0", 3, layouts="random", **settings)
        envs.reset(seed=1)
        for _ in range(6):
            envs.step(chaos.rng.integers(6, size=3))
            if mode == "Disabled":
                envs.reset()
        envs.unwrapped.action_masks()
        if chaos.rng.random() < 0.5:
            envs.step(chaos.array([1, 5, 4]))
        envs.reset(options={"layout": chaos.array(genomes_of(kitchen_designs()[0])[:3])})


def transitions(chaos: Chaos) -> None:
    layout = kitchen_designs()[0].decode(genomes_of(kitchen_designs()[0])[0])
    count, (height, width) = 4, layout.shape
    states = GameArrays(
        np.full((count, 2, 2), (1, 2), dtype=np.int16),
        chaos.rng.integers(4, size=(count, 2)).astype(np.int8),
        chaos.rng.integers(7, size=(count, 2)).astype(np.int8),
        np.zeros((count, height, width), dtype=np.int8),
        np.zeros((count, 1, 5), dtype=np.int16),
    )
    name = chaos.one(GameArrays._fields[:5])
    states = states._replace(**{name: chaos.array(getattr(states, name))})
    rules = chaos.one(("legible", "overcooked-ai-2019"))
    predict_transitions(layout, states, chaos.array(chaos.rng.integers(6, size=(count, 2))), rules)


def teams(chaos: Chaos) -> None:
    """A person beside a robot, and two cooks who must hand things over."""
    divided = "XXXXXXX\nT 1X  P\nO  X 2D\nC  X  S\nF  X  X\nX  X  X\nXXXXXXX"
    layout = kitchen_designs()[0].decode(chaos.one(tuple(genomes_of(kitchen_designs()[0])[:5])))
    for kitchen_layout, arguments in (
        (layout, {"partner": "robot"}),
        (divided, {"partner": "robot"}),
        (divided, {"num_players": 2}),
    ):
        env: Any = gymnasium.make("LegibleOvercooked-v0", layout=kitchen_layout, obs_type="vector", **arguments)
        _, info = env.reset(seed=0)
        person = ScriptedPlayer(env, chaos.rng) if "partner" in arguments else None
        for step in range(600 if chaos.good else 20):
            scripted = person is not None and step % 200 < 120  # at other times anything
            action = person(None, info) if scripted else env.action_space.sample()
            _, _, terminated, truncated, info = env.step(action)
            if terminated or truncated:
                _, info = env.reset()
        env.step(chaos.array(np.array([1, 5]) if person is None else np.array([5])))
        state, kitchen_vector, rules = env.unwrapped.arrays()
        cells = np.zeros(layout.cells.size, dtype=np.bool_)
        shared_counters(state, kitchen_vector, rules, cells)
        put_away_cells(state, kitchen_vector, rules, 1, int(chaos.rng.integers(1, 6)), cells)


def clones(chaos: Chaos) -> None:
    """People's steps are learned, and inverted."""
    recorded = list(walks())
    cloning = BehaviourCloning().fit(recorded)
    cloning.predict_proba([changed(recorded, chaos)] if not chaos.good else recorded)
    simulate_cooks(recorded[0].layout, 2, chaos.rng, population="cloned")
    env: Any = gymnasium.make("LegibleOvercooked-v0", layout=recorded[0].layout)
    _, info = env.reset(seed=0)
    player = WalkingPlayer(env, cloning.walker(), chaos.rng)
    for _ in range(20):
        info = env.step(player(None, info))[4]


@cache
def walks() -> tuple[Trajectory, ...]:
    ws, rng = kitchen_designs()[0], np.random.default_rng(2)
    layouts = [ws.decode(genome) for genome in genomes_of(ws)[:2]]
    return tuple(walk for layout in layouts for walk in simulate_cooks(layout, 3, rng, population="planner"))


def changed(recorded: Sequence[Trajectory], chaos: Chaos) -> Trajectory:
    """A recorded trajectory with other states, or in another layout."""
    one = chaos.one(recorded)
    layout = one.layout if chaos.good or chaos.rng.random() < 0.8 else chaos.one(recorded).layout
    return Trajectory(chaos.array(one.states), None, one.start, one.goal, one.candidates, layout=layout)


def walkers(chaos: Chaos) -> None:
    layout = walks()[0].layout
    cell = np.argwhere(layout.cells == FLOOR)[0].tolist()
    for walker in chaos.some((BoltzmannWalker(), PlannerWalker(2))):
        walker.sample(layout, "serving", ("pot", "onion"), 2, chaos.rng)
        layout.distances_from([(chaos.number(cell[0]), chaos.number(cell[1]))])
        walker.walk(layout, (chaos.number(cell[0]), chaos.number(cell[1])), "pot", chaos.rng)


def fits(chaos: Chaos) -> None:
    trajectories = [changed(walks(), chaos) for _ in range(2)]
    grid = {"depth": (1, 2), "turn_cost": (0.5,), "recency": (1.0,), "fade": (0.5,)}
    for fit in chaos.some((fit_rationality, lambda walked: fit_planner(walked, grid))):
        fit(trajectories)


def predict(predictors: Sequence[Any], recorded: Sequence[Trajectory], chaos: Chaos) -> None:
    for predictor in chaos.some(predictors):
        predictor.fit([changed(recorded, chaos) if chaos.rng.random() < 0.02 else whole for whole in recorded])
        stream = predictor.stream(recorded[0].first(1))
        for state in recorded[0].states[1:4]:
            stream.update(state if chaos.good else chaos.array(state))
        predictor.predict_proba([recorded[0].prefix(0.5, "cells" if recorded[0].is_grid else "time")])
        predictor.predict_proba([changed(recorded, chaos)])


def grid_predictors(chaos: Chaos) -> None:
    names = (
        "bayesian",
        "maxent-irl",
        "shortest-distance",
        "grid-knn",
        "grid-logistic",
        "grid-ngram",
        "behaviour-cloning",
    )
    predict([make_predictor(name) for name in names], walks(), chaos)


def reach_predictors(chaos: Chaos) -> None:
    names = ("reach-bayesian", "reach-gaussian", "reach-knn", "reach-logistic")
    options: dict[str, Any] = {"n_samples": chaos.one((2, 5, 50)), "band": chaos.one((None, 0.05, 1.0))}
    options["online"] = chaos.one(("open-end", "index"))
    aligned = [TimeSeriesGaussian(alignment=alignment, **options) for alignment in ("none", "medoid", "dba")]
    predict([*map(make_predictor, names), *aligned], reaches(), chaos)


@cache
def tables() -> tuple[TabletopLayout, ...]:
    rng = np.random.default_rng(3)
    found = [(ws, genome) for ws in table_designs() for genome in ws.perturb(genomes_of(ws), 1, rng, ws.phases - 1)]
    return tuple(ws.decode(genome) for ws, genome in found[::2])


@cache
def reaches() -> tuple[Trajectory, ...]:
    return tuple(simulate_reachers(tables()[0], 3, np.random.default_rng(1)))


def paths(chaos: Chaos) -> None:
    for layout in chaos.some(tables()):
        boxes = [(*chaos.point(0.5, 0.5), chaos.rng.normal(), *abs(chaos.rng.normal(size=2))) for _ in range(3)]
        found = ShortestPaths([chaos.point(0.1, 0.1), (0.3, 0.3)], chaos.array(boxes))
        for each in chaos.some((layout.paths, found)):
            for ask in chaos.some((each.is_free, each.nearest_free, each.lengths)):
                ask(chaos.array([chaos.point(0.2, 0.6) for _ in range(3)]))
            each.polylines(chaos.point(0.2, 0.6))


def reach(chaos: Chaos) -> None:
    for layout in chaos.some(tables()):
        person, rate = Person(crossing_rate=chaos.one((0.0, 1.0))), chaos.one((1.0, 30.0, 100.0))
        simulate_reach(layout, chaos.point(0.6, 0.05), chaos.point(0.3, 0.6), person, chaos.rng, rate=rate)
        belief = GoalBelief(layout, start=chaos.point(0.6, 0.05), positions=chaos.array(layout.centres))
        belief.update(chaos.point(0.6, 0.2))


def table(chaos: Chaos) -> None:
    layouts = table_designs()[0].perturb(genomes_of(table_designs()[0]), 1, chaos.rng, 1)
    for obstacles in chaos.some(("hard", "soft")):
        settings: dict[str, Any] = {"virtual_obstacles": obstacles, "partner": "robot", "disable_env_checker": True}
        env: Any = gymnasium.make("LegibleTabletop-v0", **settings)
        env.reset(seed=1, options={"layout": chaos.array(layouts[0]) if chaos.rng.random() < 0.5 else layouts[0]})
        for _ in range(3):
            env.step(env.action_space.sample())
        env.step(chaos.array(np.array([1.0, -1.0], dtype=np.float32)))


def pushes(chaos: Chaos) -> None:
    """Hands that press objects into others and into the rim, and put them down on others."""
    for number in range(6) if chaos.good else (int(chaos.rng.integers(100)),):
        speed = chaos.one(SPEEDS)
        env, layout = rough_table(number, speed, chaos.rng)
        env.reset(seed=number, options={"layout": layout})
        hand = RoughHand(env, chaos.rng)
        for _ in range(200 if chaos.good else 10):
            if env.step(hand())[2]:
                break
        env.step(chaos.array(np.array([1.0, -1.0], dtype=np.float32)))


DOORS: tuple[tuple[Callable[[Chaos], None], int], ...] = (
    (designs, 20),
    (keys, 5),
    (kitchen, 2),
    (kitchens, 2),
    (transitions, 20),
    (teams, 1),
    (clones, 1),
    (walkers, 5),
    (fits, 10),
    (grid_predictors, 1),
    (reach_predictors, 1),
    (paths, 20),
    (reach, 5),
    (table, 1),
    (pushes, 1),
)
"""Every door, and how often it is tried for one try of the slowest."""


def wrong(door: Callable[[Chaos], None], attempts: int) -> Iterator[str]:
    """Errors at good arguments, and those at bad ones that are not documented."""
    for attempt in range(attempts + 1):
        good = attempt == attempts
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                door(Chaos([attempt, len(door.__name__)], good=good))
        except Exception as error:
            if good or not isinstance(error, DOCUMENTED):
                last = traceback.extract_tb(error.__traceback__)[-1]
                place = f"{last.filename.rpartition('/')[2]}:{last.lineno}"
                yield f"{type(error).__name__} at {place} in attempt {attempt} of {attempts}: {error}"


def main(attempts: int, names: Sequence[str]) -> dict[str, Any]:
    """What went wrong, and what was not tried."""
    errors = {door.__name__: list(wrong(door, share * attempts)) for door, share in DOORS if door.__name__ in names}
    return {
        "checked": bool(numba.config.BOUNDSCHECK),
        "errors": {name: found for name, found in errors.items() if found},
        "never called": sorted(kernels().keys() - called()),
        "take a generator": sorted(name for name, kernel in kernels().items() if takes_generator(kernel)),
    }


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]), sys.argv[2:] or [door.__name__ for door, _ in DOORS]), indent=1))
