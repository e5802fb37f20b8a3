"""Every registered environment in its main variants, and how to play each; the contract suite runs over them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np

import legible_envs  # noqa: F401
from legible_envs.overcooked import OvercookedLayout
from legible_envs.overcooked.humans import BoltzmannWalker
from legible_envs.overcooked.policies import ScriptedPlayer, WalkingPlayer
from legible_envs.tabletop.humans import sample_person
from legible_envs.tabletop.policies import ReachingPlayer
from tests.legible_envs.tabletop.table_envs import TASK, WALL
from tests.legible_envs.tabletop.table_player import towards

KITCHEN_ID, TABLE_ID, DESIGN_ID = "LegibleOvercooked-v0", "LegibleTabletop-v0", "LegibleDesign-v0"
ALL_IDS = sorted(name for name, spec in gym.registry.items() if str(spec.entry_point).startswith("legible_envs."))
# Those in which a person moves; the tests of goals, policies and recordings are about these.
IDS = [name for name in ALL_IDS if name != DESIGN_ID]
KITCHEN = """\
XXTXOXX
C     D
X  V  X
F 1   P
X     X
X     P
XXXSXXX"""

DESIGNED = """\
XXTXOXX
C     D
X  V  X
F     X
X     X
X     P
XXXSXXX"""

Policy = Callable[[Any, dict[str, Any]], Any]


class RandomCook:
    """Any action at any time."""

    def __init__(self, env: gym.Env[Any, Any], seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def __call__(self, observation: Any, info: dict[str, Any]) -> int:
        return int(self.rng.integers(6))


class RandomHand:
    """A hand that moves about near the objects, fast or slowly, so that something happens."""

    def __init__(self, env: gym.Env[Any, Any], seed: int) -> None:
        self.env, self.rng, self.steps = env, np.random.default_rng(seed), 0

    def __call__(self, observation: Any, info: dict[str, Any]) -> Any:
        if self.steps % 10 == 0:
            self.target = self.rng.uniform((0.1, 0.2), (0.8, 0.7))
            self.speed = self.rng.choice([0.15, 0.6])
        self.steps += 1
        return towards(self.env, self.target, self.speed)


class RandomDesigner:
    """Mostly an edit that the mask allows, now and then any."""

    def __init__(self, env: gym.Env[Any, Any], seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def __call__(self, observation: Any, info: dict[str, Any]) -> int:
        mask = info["action_mask"]
        allowed = np.flatnonzero(mask) if self.rng.random() < 0.8 else np.arange(len(mask))
        return int(self.rng.choice(allowed))


def scripted(env: gym.Env[Any, Any]) -> Policy:
    return ScriptedPlayer(env, np.random.default_rng(0))


def walking(env: gym.Env[Any, Any]) -> Policy:
    return WalkingPlayer(env, BoltzmannWalker(), np.random.default_rng(0))


def reaching(env: gym.Env[Any, Any]) -> Policy:
    rng = np.random.default_rng(0)
    return ReachingPlayer(env, sample_person(rng), rng)


@dataclass(frozen=True)
class Kind:
    """What a test has to know of an environment to play it.

    Attributes:
        random: Policy of random actions, made from an environment and a seed.
        policies: Policies that finish an episode, by name, each made from an environment.
        other: Another layout than the default one.
        subtasks: How many subtasks an environment's episode has.
        still: An action that does nothing.
        move: An action that changes the picture.
    """

    random: Callable[[gym.Env[Any, Any], int], Policy]
    policies: dict[str, Callable[[gym.Env[Any, Any]], Policy]]
    other: Any
    subtasks: Callable[[Any], int]
    still: Any
    move: Any

    def marked(self, layout: Any, mask: Any) -> tuple[str, ...]:
        """Names of the goals that a mask marks, in the order in which ``info["goals"]`` has them."""
        if isinstance(layout, OvercookedLayout):
            assert (mask.shape, mask.dtype) == (layout.shape, np.bool_)
            cells = [tuple(cell) for cell in np.argwhere(mask).tolist()]
            return tuple(layout.station_at(cell) or f"counter@({cell[0]},{cell[1]})" for cell in cells)
        assert (mask.shape, mask.dtype) == ((len(layout.goals),), np.bool_)
        return tuple(sorted(name for name, valid in zip(layout.goals, mask, strict=True) if valid))


KINDS = {
    KITCHEN_ID: Kind(
        random=RandomCook,
        policies={"scripted": scripted, "walking": walking},
        other=OvercookedLayout.from_ascii(KITCHEN),
        subtasks=lambda game: len(game.view().orders) + len(game.view().delivered),
        still=4,
        move=0,
    ),
    TABLE_ID: Kind(
        random=RandomHand,
        policies={"reaching": reaching},
        other=WALL,
        subtasks=lambda game: game.task.graph.length,
        still=np.zeros(2, dtype=np.float32),
        move=np.full(2, 0.5, dtype=np.float32),
    ),
    DESIGN_ID: Kind(
        random=RandomDesigner,
        policies={},
        other=OvercookedLayout.from_ascii(DESIGNED),
        subtasks=lambda game: game.num_edits,
        still=0,
        move=1,
    ),
}


@dataclass(frozen=True)
class Case:
    """An environment and the arguments it is made with.

    Attributes:
        name: Of the test.
        env_id: Of the environment.
        arguments: For ``gymnasium.make``.
    """

    name: str
    env_id: str
    arguments: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.name

    @property
    def kind(self) -> Kind:
        """How it is played."""
        return KINDS[self.env_id]

    def make(self, **more: Any) -> gym.Env[Any, Any]:
        """A new environment."""
        return gym.make(self.env_id, **{**self.arguments, **more})


def results_of(env: gym.Env[Any, Any], policy: Policy, result: Any, steps: int) -> list[Any]:
    """What ``step`` returns from here on, and ``reset`` where an episode is over."""
    results = []
    for _ in range(steps):
        over = len(result) == 5 and (result[2] or result[3])
        result = env.reset() if over else env.step(policy(result[0], result[-1]))
        results.append(result)
    return results


def rollout(case: Case, env: gym.Env[Any, Any], seed: int, steps: int = 120) -> list[Any]:
    """Everything that ``reset`` and ``step`` return while random actions are played."""
    first = env.reset(seed=seed)
    return [first, *results_of(env, case.kind.random(env, seed), first, steps)]


def episode(env: gym.Env[Any, Any], policy: Policy, seed: int = 0) -> list[Any]:
    """Everything that ``reset`` and ``step`` return in one episode."""
    results: list[Any] = [env.reset(seed=seed)]
    while len(results) == 1 or not (results[-1][2] or results[-1][3]):
        results.append(env.step(policy(results[-1][0], results[-1][-1])))
    return results


def digest(case: Case) -> str:
    """What happens in 250 steps, in short."""
    results = rollout(case, case.make(), 7, 250)
    return hashlib.sha256(repr([result[0].tolist() for result in results]).encode()).hexdigest()


SLOW_HAND = {"max_speed": 0.5}
DEFAULTS = [Case(name, name) for name in IDS]
VARIANTS = [
    Case("kitchen-vector", KITCHEN_ID, {"obs_type": "vector"}),
    Case("kitchen-rgb", KITCHEN_ID, {"obs_type": "rgb"}),
    Case("kitchen-soft", KITCHEN_ID, {"virtual_obstacles": "soft", "crossing_cost": 1.0, "shaping": True}),
    Case("kitchen-random", KITCHEN_ID, {"shape": (5, 6), "layouts": "random"}),
    Case("kitchen-split", KITCHEN_ID, {"layouts": {"kind": "random", "split": "test", "num_layouts": 5}}),
    Case("kitchen-recipes", KITCHEN_ID, {"layout": KITCHEN, "recipes": [["onion", "fish"]], "cook_time": 0}),
    Case("table-shaping", TABLE_ID, {"layout": WALL, "shaping": {"discount": 0.99}, **SLOW_HAND}),
    Case("table-soft", TABLE_ID, {"layout": WALL, "virtual_obstacles": "soft", "crossing_cost": 1.0, "max_speed": 2.0}),
    Case("table-contact", TABLE_ID, {"layout": WALL, "contact": "always", **SLOW_HAND}),
    Case("table-belief", TABLE_ID, {"task": "tea", "contact": "never", "predictor": "bayesian", "max_speed": 2.0}),
    Case("table-bins", TABLE_ID, {"task": "bins", "max_obstacles": 0, "max_speed": 2.0}),
    Case("table-robot", TABLE_ID, {"layout": WALL, "partner": "robot", "contact": "always", **SLOW_HAND}),
    Case(
        "table-slow-robot",
        TABLE_ID,
        {"partner": {"max_speed": 0.5}, "threshold": 0.0, "time_cost": 0.0, "max_speed": 2.0},
    ),
]
CASES = [*DEFAULTS, *VARIANTS]
# Design: tests that hold whether or not anybody moves run over these too.
DESIGNS = [
    Case("design", DESIGN_ID),
    Case("design-vector", DESIGN_ID, {"shape": (5, 6), "obs_type": "vector", "edits": 5, "prefix": "sum"}),
    Case("design-capped", DESIGN_ID, {"objective": "efficiency", "max_distance": 150.0, "layout": DESIGNED}),
    Case("design-table", DESIGN_ID, {"workspace": "tabletop", "condition": "placement", "levels": 4, "edits": 12}),
]
EVERY = [*CASES, *DESIGNS]
# What else a spec has to keep: layouts and tasks in all their forms.
FORMS = [
    Case("kitchen-layout", KITCHEN_ID, {"layout": OvercookedLayout.from_ascii(KITCHEN)}),
    Case("kitchen-layouts", KITCHEN_ID, {"layouts": [OvercookedLayout.from_ascii(KITCHEN)]}),
    Case("table-json", TABLE_ID, {"layout": WALL.to_json(), "max_speed": 2.0}),
    Case("table-genome", TABLE_ID, {"layout": WALL.to_genome(), "task": TASK, "max_speed": 2.0}),
    Case("table-task", TABLE_ID, {"task": TASK.to_dict(), "max_speed": 2.0}),
]
BY_NAME = {case.name: case for case in (*EVERY, *FORMS)}
