"""Plugging in predictors: names, entry points, and a check that says what a predictor gets wrong.

A predictor is a subclass of :class:`~predictors.base.GoalPredictor`, known by ``register_predictor("mine", Mine)``, by
an entry point in group ``legible.predictors``, or, without either, as ``"module:Class"``.

The built-in predictors are entry points of this project too (``pyproject.toml``): so the environment of the table,
which must not import this package, finds them by the same names. :data:`BUILT_IN` is their source and holds in every
installation, however old its metadata; an entry point of the same name is the same predictor and is listed once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.contracts import ContractError, refuse
from legible_envs.support.plugins import Plugin, Registry
from predictors.base import GoalPredictor

__all__ = [
    "BUILT_IN",
    "ENTRY_POINT_GROUP",
    "PredictorError",
    "PredictorInfo",
    "check_predictor",
    "list_predictors",
    "make_predictor",
    "register_predictor",
]

ENTRY_POINT_GROUP: Final = "legible.predictors"
PredictorSpec = str | Callable[..., GoalPredictor] | GoalPredictor

PredictorInfo = Plugin


class PredictorError(ContractError):
    """A predictor cannot be found or made, or breaks the contract.

    Attributes:
        problems: One sentence for each thing that :func:`check_predictor` found wrong; empty for other errors.
    """


BUILT_IN: Final = {
    "bayesian": "predictors.grid.bayesian:BayesianGoalPredictor",
    "behaviour-cloning": "predictors.grid.behaviour_cloning:BehaviourCloning",
    "grid-knn": "predictors.grid.baselines:GridNeighbours",
    "grid-logistic": "predictors.grid.baselines:GridLogistic",
    "grid-ngram": "predictors.grid.baselines:GridNGram",
    "maxent-irl": "predictors.grid.maxent_irl:MaxEntIRL",
    "reach-bayesian": "predictors.reaching.bayesian:StraightLineBayesian",
    "reach-gaussian": "predictors.reaching.gaussian:TimeSeriesGaussian",
    "reach-knn": "predictors.reaching.baselines:ReachNeighbours",
    "reach-logistic": "predictors.reaching.baselines:ReachLogistic",
    "recurrent": "predictors.neural.models:RecurrentPredictor",
    "shortest-distance": "predictors.grid.shortest_distance:ShortestDistance",
    "transformer": "predictors.neural.models:TransformerPredictor",
}
"""Name and ``module:Class`` of every predictor that comes with this package."""

_registry = Registry("predictor", ENTRY_POINT_GROUP, BUILT_IN, PredictorError)


def register_predictor(name: str, factory: Callable[..., GoalPredictor], *, overwrite: bool = False) -> None:
    """Make a predictor available by name for the rest of this process.

    Args:
        name: The name; must not be taken unless ``overwrite``.
        factory: The class, or a function that makes a predictor from keyword parameters.
        overwrite: Whether an earlier registration may be replaced. Built-in names never are.

    Raises:
        PredictorError: The name is taken or not a name, or the factory cannot be called.
    """
    _registry.register(name, factory, overwrite=overwrite)


def list_predictors() -> dict[str, PredictorInfo]:
    """Every predictor known by name: built in, installed as an entry point, and registered in this process."""
    return _registry.list()


def make_predictor(spec: PredictorSpec, **parameters: Any) -> GoalPredictor:
    """Make a predictor from a name, ``"module:Class"`` or a class; an instance is returned as it is.

    Raises:
        PredictorError: Nothing of that name, it cannot be imported, it does not take the parameters, or what comes out
            is not a :class:`~predictors.base.GoalPredictor`.
    """
    if isinstance(spec, GoalPredictor):
        if parameters:
            raise PredictorError(f"a predictor that is already made takes no parameters, got {sorted(parameters)}")
        return spec
    factory = _registry.resolve(spec)
    try:
        predictor = factory(**parameters)
    except TypeError as error:
        raise PredictorError(f"predictor {spec!r} cannot be made with {parameters}: {error}") from error
    if not isinstance(predictor, GoalPredictor):
        raise PredictorError(f"predictor {spec!r} must be a GoalPredictor, got {type(predictor).__name__}")
    return predictor


def check_predictor(spec: PredictorSpec, X: Sequence[Trajectory] | None = None, **parameters: Any) -> None:
    """Check that a predictor keeps the contract of :class:`~predictors.base.GoalPredictor`.

    Args:
        spec: The predictor, in any form :func:`make_predictor` takes.
        X: Trajectories to try it on; a few in a small kitchen if None.
        parameters: Its parameters.

    Raises:
        PredictorError: Something is wrong; ``problems`` lists each in a sentence.
    """
    from predictors.checks import find_problems

    predictor = make_predictor(spec, **parameters)
    refuse(predictor, "predictor", find_problems(predictor, X), PredictorError)
