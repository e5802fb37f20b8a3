"""The checks that :func:`predictors.registry.check_predictor` makes."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import replace

import numpy as np
from sklearn.base import clone

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import GoalPredictor
from predictors.outputs import probability_fault

__all__ = ["example_trajectories", "find_problems"]

_KITCHEN = """
XOXTX
X   X
X   D
X   X
XXSPX
"""
_START = {(3, 2): "serving", (3, 3): "pot"}


def example_trajectories() -> list[Trajectory]:
    """Eight trajectories in a small kitchen, some with fewer candidates than others."""
    layout = OvercookedLayout.from_ascii(_KITCHEN)
    three, two = ("onion", "tomato", "dish"), ("tomato", "onion")
    trajectories = [
        (((3, 2), (2, 2), (1, 2), (1, 1), (0, 1)), "onion", three),
        (((3, 2), (3, 1), (2, 1), (1, 1), (0, 1)), "onion", two),
        (((3, 2), (3, 3), (2, 3), (1, 3), (0, 3)), "tomato", three),
        (((3, 2), (2, 2), (2, 3), (1, 3), (0, 3)), "tomato", two),
        (((3, 2), (2, 2), (2, 3), (2, 4)), "dish", three),
        (((3, 2), (3, 3), (2, 3), (2, 4)), "dish", three),
        (((3, 3), (2, 3), (1, 3), (0, 3)), "tomato", three),
        (((3, 3), (2, 3), (2, 2), (1, 2), (1, 1), (0, 1)), "onion", three),
    ]
    return [
        Trajectory(
            np.array(cells),
            start=_START[cells[0]],
            goal=goal,
            candidates=candidates,
            participant=f"p{i % 4}",
            layout=layout,
        )
        for i, (cells, goal, candidates) in enumerate(trajectories)
    ]


def find_problems(predictor: GoalPredictor, X: Sequence[Trajectory] | None = None) -> list[str]:
    """Everything that a predictor gets wrong, in words; empty if nothing."""
    trajectories = example_trajectories() if X is None else list(X)
    problems: list[str] = []

    def attempt(what: str, check: Callable[[], str | None]) -> None:
        try:
            wrong = check()
        except Exception as error:  # a plug-in may raise anything; the report goes on
            wrong = f"raised {type(error).__name__}: {error}"
        if wrong:
            problems.append(f"{what}: {wrong}")

    attempt("parameters", lambda: _check_parameters(predictor))
    fitted: list[GoalPredictor] = []
    attempt("fit", lambda: _check_fit(predictor, trajectories, fitted))
    if fitted:
        attempt("predict_proba", lambda: _check_probabilities(fitted[0], trajectories))
        attempt(
            "empty prefix",
            lambda: _check_probabilities(fitted[0], [trajectory.first(0) for trajectory in trajectories]),
        )
        attempt("independence of samples", lambda: _check_independence(fitted[0], trajectories))
        attempt("ignorance of the goal", lambda: _check_ignorance(fitted[0], trajectories))
        attempt("stream", lambda: _check_stream(fitted[0], trajectories[0]))
        attempt("pickling", lambda: _check_pickle(fitted[0], trajectories))
    return problems


def _check_parameters(predictor: GoalPredictor) -> str | None:
    twin = clone(predictor)
    if repr(twin.get_params()) != repr(predictor.get_params()):
        return "`__init__` must store its parameters unchanged, under their own names"
    learned = [name for name in vars(twin) if name.endswith("_") and not name.startswith("_")]
    return f"`__init__` must not set learned attributes, found {learned}" if learned else None


def _check_fit(predictor: GoalPredictor, trajectories: Sequence[Trajectory], fitted: list[GoalPredictor]) -> str | None:
    copy = deepcopy(predictor)
    result = copy.fit(trajectories)
    if result is not copy:
        return f"must return self, returned {type(result).__name__}"
    names = sorted({name for trajectory in trajectories for name in trajectory.candidates})
    if not hasattr(copy, "classes_") or list(copy.classes_) != names:
        return f"`classes_` must hold the sorted names {names}; call super().fit(X)"
    fitted.append(copy)
    return None


def _check_probabilities(predictor: GoalPredictor, trajectories: Sequence[Trajectory]) -> str | None:
    return probability_fault(predictor.predict_proba(trajectories), trajectories, predictor.classes_)


def _check_independence(predictor: GoalPredictor, trajectories: Sequence[Trajectory]) -> str | None:
    together = predictor.predict_proba(trajectories)
    alone = np.concatenate([predictor.predict_proba([trajectory]) for trajectory in reversed(trajectories)])[::-1]
    return None if np.allclose(together, alone, atol=1e-6) else "the answer depends on the other samples or their order"


def _check_ignorance(predictor: GoalPredictor, trajectories: Sequence[Trajectory]) -> str | None:
    """A predictor that peeks at the true goal is perfect and worthless."""
    prefixes = [trajectory.first(1) for trajectory in trajectories]
    blind = [replace(trajectory, goal=None) for trajectory in prefixes]
    same = np.allclose(predictor.predict_proba(prefixes), predictor.predict_proba(blind), atol=1e-9)
    return None if same else "the answer depends on the trajectory's goal, which is what it should predict"


def _check_stream(predictor: GoalPredictor, trajectory: Trajectory) -> str | None:
    stream = predictor.stream(trajectory)
    for count, (state, time) in enumerate(zip(trajectory.states, trajectory.times, strict=True), 1):
        belief = stream.update(state, float(time))
        row = predictor.predict_proba([trajectory.first(count)])[0]
        expected = {name: row[list(predictor.classes_).index(name)] for name in trajectory.candidates}
        if belief.keys() != expected.keys() or any(abs(belief[name] - expected[name]) > 1e-9 for name in expected):
            return f"after {count} states the belief is {belief}, predict_proba of the same prefix {expected}"
    return None


def _check_pickle(predictor: GoalPredictor, trajectories: Sequence[Trajectory]) -> str | None:
    copy = pickle.loads(pickle.dumps(predictor))
    same = np.array_equal(copy.predict_proba(trajectories), predictor.predict_proba(trajectories))
    return None if same else "a pickled copy answers differently"
