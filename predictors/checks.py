"""What :func:`predictors.registry.check_predictor` looks at."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from copy import deepcopy

import numpy as np
from sklearn.base import clone

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from predictors.base import GoalPredictor

__all__ = ["example_walks", "find_problems"]

_KITCHEN = """
XOXTX
X   X
X   D
X   X
XXSPX
"""


def example_walks() -> list[Trajectory]:
    """Eight walks in a small kitchen, some with fewer candidates than others."""
    layout = OvercookedLayout.from_ascii(_KITCHEN)
    three, two = ("onion", "tomato", "dish"), ("tomato", "onion")
    walks = [
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
            np.array(cells), start="serving", goal=goal, candidates=candidates, participant=f"p{i % 4}", layout=layout
        )
        for i, (cells, goal, candidates) in enumerate(walks)
    ]


def find_problems(predictor: GoalPredictor, X: Sequence[Trajectory] | None = None) -> list[str]:
    """Everything that a predictor gets wrong, in words; empty if nothing."""
    walks = example_walks() if X is None else list(X)
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
    attempt("fit", lambda: _check_fit(predictor, walks, fitted))
    if fitted:
        attempt("predict_proba", lambda: _check_probabilities(fitted[0], walks))
        attempt("empty prefix", lambda: _check_probabilities(fitted[0], [walk.first(0) for walk in walks]))
        attempt("independence of samples", lambda: _check_independence(fitted[0], walks))
        attempt("ignorance of the goal", lambda: _check_ignorance(fitted[0], walks))
        attempt("stream", lambda: _check_stream(fitted[0], walks[0]))
        attempt("pickling", lambda: _check_pickle(fitted[0], walks))
    return problems


def _check_parameters(predictor: GoalPredictor) -> str | None:
    twin = clone(predictor)
    if repr(twin.get_params()) != repr(predictor.get_params()):
        return "`__init__` must store its parameters unchanged, under their own names"
    learned = [name for name in vars(twin) if name.endswith("_") and not name.startswith("_")]
    return f"`__init__` must not set learned attributes, found {learned}" if learned else None


def _check_fit(predictor: GoalPredictor, walks: Sequence[Trajectory], fitted: list[GoalPredictor]) -> str | None:
    copy = deepcopy(predictor)
    result = copy.fit(walks)
    if result is not copy:
        return f"must return self, returned {type(result).__name__}"
    names = sorted({name for walk in walks for name in walk.candidates})
    if not hasattr(copy, "classes_") or list(copy.classes_) != names:
        return f"`classes_` must hold the sorted names {names}; call super().fit(X)"
    fitted.append(copy)
    return None


def _check_probabilities(predictor: GoalPredictor, walks: Sequence[Trajectory]) -> str | None:
    rows = predictor.predict_proba(walks)
    expected = (len(walks), len(predictor.classes_))
    if not isinstance(rows, np.ndarray) or rows.shape != expected:
        return f"expected an array of shape {expected}, got {getattr(rows, 'shape', type(rows).__name__)}"
    if not np.isfinite(rows).all() or (rows < 0).any():
        return "probabilities must be finite and >= 0"
    if not np.allclose(rows.sum(axis=1), 1.0):
        return f"rows must sum to 1, got {rows.sum(axis=1).round(6).tolist()}"
    for row, walk in zip(rows, walks, strict=True):
        others = [
            name for name, p in zip(predictor.classes_, row, strict=True) if p > 0 and name not in walk.candidates
        ]
        if others:
            return f"{others} got probability without being candidates {walk.candidates}"
    return None


def _check_independence(predictor: GoalPredictor, walks: Sequence[Trajectory]) -> str | None:
    together = predictor.predict_proba(walks)
    alone = np.concatenate([predictor.predict_proba([walk]) for walk in reversed(walks)])[::-1]
    return None if np.allclose(together, alone, atol=1e-6) else "the answer depends on the other samples or their order"


def _check_ignorance(predictor: GoalPredictor, walks: Sequence[Trajectory]) -> str | None:
    """A predictor that peeks at the true goal is perfect and worthless."""
    prefixes = [walk.first(1) for walk in walks]
    blind = [_with_goal(walk, None) for walk in prefixes]
    same = np.allclose(predictor.predict_proba(prefixes), predictor.predict_proba(blind), atol=1e-9)
    return None if same else "the answer depends on the trajectory's goal, which is what it should predict"


def _with_goal(walk: Trajectory, goal: str | None) -> Trajectory:
    return Trajectory(
        states=walk.states,
        times=walk.times,
        start=walk.start,
        goal=goal,
        candidates=walk.candidates,
        participant=walk.participant,
        condition=walk.condition,
        layout=walk.layout,
        layout_name=walk.layout_name,
        candidate_set=walk.candidate_set,
        complete=walk.complete,
        goal_positions=walk.goal_positions,
    )


def _check_stream(predictor: GoalPredictor, walk: Trajectory) -> str | None:
    stream = predictor.stream(walk)
    for count, (state, time) in enumerate(zip(walk.states, walk.times, strict=True), 1):
        belief = stream.update(state, float(time))
        row = predictor.predict_proba([walk.first(count)])[0]
        expected = {name: row[list(predictor.classes_).index(name)] for name in walk.candidates}
        if belief.keys() != expected.keys() or any(abs(belief[name] - expected[name]) > 1e-9 for name in expected):
            return f"after {count} states the belief is {belief}, predict_proba of the same prefix {expected}"
    return None


def _check_pickle(predictor: GoalPredictor, walks: Sequence[Trajectory]) -> str | None:
    copy = pickle.loads(pickle.dumps(predictor))
    same = np.array_equal(copy.predict_proba(walks), predictor.predict_proba(walks))
    return None if same else "a pickled copy answers differently"
