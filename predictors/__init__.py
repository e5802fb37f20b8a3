"""Predictors of a person's next goal, and how well they read recorded or simulated people.

>>> from predictors import BayesianGoalPredictor
>>> predictor = BayesianGoalPredictor().fit(walks)                # doctest: +SKIP
>>> predictor.predict_proba_at(walks, fractions=(0.25, 0.5))      # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from predictors.base import GoalPredictor
    from predictors.grid.bayesian import BayesianGoalPredictor
    from predictors.grid.shortest_distance import ShortestDistance
    from predictors.registry import check_predictor, list_predictors, make_predictor, register_predictor

__all__ = [
    "BayesianGoalPredictor",
    "GoalPredictor",
    "ShortestDistance",
    "check_predictor",
    "list_predictors",
    "make_predictor",
    "register_predictor",
]

# Imported on first use: scikit-learn takes a second that nobody should pay who only wants one module.
_HOME = {
    "BayesianGoalPredictor": "predictors.grid.bayesian",
    "GoalPredictor": "predictors.base",
    "ShortestDistance": "predictors.grid.shortest_distance",
    "check_predictor": "predictors.registry",
    "list_predictors": "predictors.registry",
    "make_predictor": "predictors.registry",
    "register_predictor": "predictors.registry",
}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(__all__))
