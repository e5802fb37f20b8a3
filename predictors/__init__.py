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
    from predictors.grid.knn import GridNeighbours
    from predictors.grid.logistic import GridLogistic
    from predictors.grid.maxent_irl import MaxEntIRL
    from predictors.grid.ngram import GridNGram
    from predictors.grid.shortest_distance import ShortestDistance
    from predictors.neural.recurrent import RecurrentPredictor
    from predictors.neural.transformer import TransformerPredictor
    from predictors.reaching.baselines import ReachLogistic, ReachNeighbours
    from predictors.reaching.bayesian import StraightLineBayesian
    from predictors.reaching.gaussian import TimeSeriesGaussian
    from predictors.registry import check_predictor, list_predictors, make_predictor, register_predictor
    from predictors.streaming import ThresholdDecision

__all__ = [
    "BayesianGoalPredictor",
    "GoalPredictor",
    "GridLogistic",
    "GridNGram",
    "GridNeighbours",
    "MaxEntIRL",
    "ReachLogistic",
    "ReachNeighbours",
    "RecurrentPredictor",
    "ShortestDistance",
    "StraightLineBayesian",
    "ThresholdDecision",
    "TimeSeriesGaussian",
    "TransformerPredictor",
    "check_predictor",
    "list_predictors",
    "make_predictor",
    "register_predictor",
]

# Imported on first use: scikit-learn takes a second that nobody should pay who only wants one module.
_HOME = {
    "BayesianGoalPredictor": "predictors.grid.bayesian",
    "GoalPredictor": "predictors.base",
    "GridLogistic": "predictors.grid.logistic",
    "GridNGram": "predictors.grid.ngram",
    "GridNeighbours": "predictors.grid.knn",
    "MaxEntIRL": "predictors.grid.maxent_irl",
    "ReachLogistic": "predictors.reaching.baselines",
    "ReachNeighbours": "predictors.reaching.baselines",
    "RecurrentPredictor": "predictors.neural.recurrent",
    "ShortestDistance": "predictors.grid.shortest_distance",
    "StraightLineBayesian": "predictors.reaching.bayesian",
    "ThresholdDecision": "predictors.streaming",
    "TimeSeriesGaussian": "predictors.reaching.gaussian",
    "TransformerPredictor": "predictors.neural.transformer",
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
