"""Predictors to test and what they learn from: every registered one, and the settings of them that differ in code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
import pytest
from sklearn.base import clone

from legible_envs.overcooked import OvercookedLayout
from legible_envs.rollouts import Trajectory
from predictors import (
    BayesianGoalPredictor,
    BehaviourCloning,
    GoalPredictor,
    GridNeighbours,
    MaxEntIRL,
    ReachLogistic,
    RecurrentPredictor,
    ShortestDistance,
    TimeSeriesGaussian,
    TransformerPredictor,
    UniformPredictor,
    make_predictor,
)
from predictors.checks import example_trajectories

ROOM = OvercookedLayout.from_ascii("XOXTX\nX   X\nX V D\nX   X\nXXSPX")
THREE = ("onion", "tomato", "dish")
PLACES = {"left": (-0.25, 0.3), "middle": (0.0, 0.4), "right": (0.25, 0.3)}
NAMES = tuple(PLACES)
POSITIONS = tuple(PLACES.values())


# -- trajectories -----------------------------------------------------------------------------------------------------


def walk(cells: Any, goal: str | None = "onion", candidates: tuple[str, ...] = THREE, **more: Any) -> Trajectory:
    """A trajectory in ROOM."""
    return Trajectory(np.array(cells), goal=goal, candidates=candidates, **{"layout": ROOM, "start": "serving", **more})


def people() -> list[Trajectory]:
    """Trajectories in ROOM: most to the onions."""
    ways = {
        "onion": [(3, 2), (3, 1), (2, 1), (1, 1), (0, 1)],
        "tomato": [(3, 2), (3, 3), (2, 3), (1, 3), (0, 3)],
        "dish": [(3, 2), (3, 3), (2, 3), (2, 4)],
    }
    return [walk(ways[goal], goal) for goal in ("onion",) * 6 + ("tomato",) * 3 + ("dish",) * 2]


def reach(goal: str, rng: np.random.Generator, *, positions: bool = True, **more: Any) -> Trajectory:
    """A minimum-jerk reach with bow and noise, from a place that differs every time, at irregular times."""
    duration = rng.lognormal(0.0, 0.15)
    times = np.r_[0.0, np.sort(rng.uniform(0, duration, rng.integers(18, 32))), duration]
    share = times / duration
    progress = 10 * share**3 - 15 * share**4 + 6 * share**5
    end = np.array(PLACES[goal]) + rng.normal(0, 0.015, 2)
    bow = rng.normal(-0.1, 0.03) * np.sin(np.pi * progress)[:, None] * np.array([-end[1], end[0]])
    start = rng.uniform(-0.5, 0.5, 2) if not positions else np.zeros(2)
    options: dict[str, Any] = {"candidates": NAMES, "participant": f"p{rng.integers(6)}"}
    if positions:
        options["goal_positions"] = POSITIONS
    return Trajectory(start + progress[:, None] * end + bow, times + 3.0, goal=goal, **{**options, **more})


def reaches(count: int = 12, seed: int = 0, **more: Any) -> list[Trajectory]:
    """So many reaches to each of three places."""
    rng = np.random.default_rng(seed)
    return [reach(goal, rng, **more) for _ in range(count) for goal in NAMES]


def with_two_candidates(found: Trajectory) -> Trajectory:
    """The same reach where only two goals, in another order, are possible."""
    two = ("right", "left") if found.goal != "middle" else ("middle", "left")
    return replace(found, candidates=two, goal_positions=tuple(PLACES[name] for name in two))


# -- predictors -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Case:
    """A predictor and the trajectories it is tested on.

    Attributes:
        predictor: Not fitted.
        kind: What it predicts from.
        name: The name it is registered by, for one that is.
        slack: By how much answers to the same question may differ that are computed in other ways.
        uniform: Whether its prior is uniform after fitting on these trajectories.
        blind: Whether the first state tells it nothing, as DESIGN.md demands.
    """

    predictor: GoalPredictor
    kind: Literal["kitchen", "reaches"]
    name: str = ""
    slack: float = 0.0
    uniform: bool = True
    blind: bool = True

    def __str__(self) -> str:
        return f"{self.kind}-{self.name or repr(self.predictor).replace(chr(10), ' ')[:60]}"

    @property
    def train(self) -> list[Trajectory]:
        """To fit on; goals of reaches are balanced."""
        return [*people(), *example_trajectories()] if self.kind == "kitchen" else _TRAIN

    @property
    def test(self) -> list[Trajectory]:
        """Complete ones, some with fewer candidates than the others."""
        if self.kind == "kitchen":
            return [people()[0], people()[-1], *example_trajectories()]
        return [*_TEST[:6], *map(with_two_candidates, _TEST[:3])]


_TRAIN, _TEST = reaches(), reaches(5, seed=1)
_QUICK: dict[str, Any] = {"members": 2, "max_epochs": 3}


def _registered(name: str, kind: Literal["kitchen", "reaches"], parameters: Any = None, **more: Any) -> Case:
    return Case(make_predictor(name, **(parameters or {})), kind, name, **more)


KITCHEN_CASES = [
    _registered("bayesian", "kitchen"),
    _registered("behaviour-cloning", "kitchen"),
    _registered("grid-knn", "kitchen", uniform=False, blind=False),
    _registered("grid-logistic", "kitchen", uniform=False, blind=False),
    _registered("grid-ngram", "kitchen", uniform=False, blind=False),
    _registered("maxent-irl", "kitchen"),
    _registered("shortest-distance", "kitchen", blind=False),
    Case(ShortestDistance("geodesic"), "kitchen", blind=False),
    Case(BayesianGoalPredictor(beta=0.3), "kitchen"),
    Case(BayesianGoalPredictor(beta=2.0), "kitchen"),
    Case(BayesianGoalPredictor(costs="soft"), "kitchen"),
    Case(BayesianGoalPredictor("fit", costs="soft"), "kitchen"),
    Case(BayesianGoalPredictor("fit", costs="soft", prior="empirical"), "kitchen", uniform=False),
    Case(BayesianGoalPredictor(cell_costs="learned"), "kitchen"),
    Case(BayesianGoalPredictor(costs="soft", cell_costs=MaxEntIRL(l2=2.0)), "kitchen"),
    Case(BayesianGoalPredictor(cell_costs=np.arange(25.0).reshape(5, 5)), "kitchen"),
    Case(MaxEntIRL(prior="empirical"), "kitchen", uniform=False),
    Case(BehaviourCloning(features=("progress", "back"), prior="empirical", trust="fit"), "kitchen", uniform=False),
    Case(GridNeighbours(k=3), "kitchen", uniform=False, blind=False),
]
"""Predictors that need the layout of a kitchen."""

GAUSSIANS = [
    Case(TimeSeriesGaussian(online=online, alignment=alignment, **options), "reaches", slack=1e-12)
    for online, alignment, options in (
        ("open-end", "dba", {"velocity": True, "n_samples": 20, "band": 0.1}),
        ("open-end", "mean", {"band": None, "half_life": 0.1}),
        ("open-end", "medoid", {"band": 0.0}),
        ("index", "none", {"velocity": True, "half_life": 0}),
        ("index", "medoid", {}),
    )
]

REACH_CASES = [
    _registered("reach-gaussian", "reaches", slack=1e-12),
    *GAUSSIANS,
    _registered("reach-bayesian", "reaches", slack=1e-12),
    Case(ShortestDistance("euclidean"), "reaches", slack=1e-12, blind=False),
    _registered("reach-knn", "reaches", slack=1e-12),
    _registered("reach-logistic", "reaches", slack=1e-12),
]
"""Predictors that only take reaches; the learned ones do not know where goals are."""

NEURAL_CASES = [
    _registered("recurrent", "kitchen", {"hidden_size": 8, **_QUICK}, slack=1e-9, uniform=False, blind=False),
    _registered("transformer", "kitchen", {"width": 8, **_QUICK}, slack=1e-9, uniform=False, blind=False),
    Case(
        RecurrentPredictor(6, 2, members=1, max_epochs=3, validation_fraction=0.0),
        "kitchen",
        slack=1e-9,
        uniform=False,
        blind=False,
    ),
    Case(RecurrentPredictor(8, members=1, max_epochs=3), "reaches", slack=1e-9, uniform=False, blind=False),
    Case(TransformerPredictor(8, 1, 2, members=1, max_epochs=3), "reaches", slack=1e-9, uniform=False, blind=False),
]

CASES = [
    *KITCHEN_CASES,
    *REACH_CASES,
    Case(ReachLogistic(degree=2), "reaches", slack=1e-12),
    Case(UniformPredictor(), "kitchen"),
    Case(UniformPredictor(), "reaches"),
    *NEURAL_CASES,
]


@cache
def fitted(case: Case) -> GoalPredictor:
    """The predictor of a case, fitted once; do not fit it again."""
    if case in NEURAL_CASES:
        pytest.importorskip("torch", reason="the extra `torch` is not installed")
    return clone(case.predictor).fit(case.train)


def prefixes(trajectories: Sequence[Trajectory]) -> list[Trajectory]:
    """All prefixes, the empty ones and the whole ones included."""
    return [each.first(count) for each in trajectories for count in range(each.num_states + 1)]
