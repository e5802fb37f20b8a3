"""Plugging in predictors: names, entry points, and a check that says what a predictor gets wrong.

A predictor is a subclass of :class:`~predictors.base.GoalPredictor`, known by ``register_predictor("mine", Mine)``, by
an entry point in group ``legible.predictors``, or, without either, as ``"module:Class"``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final

from legible_envs.rollouts import Trajectory
from predictors.base import GoalPredictor

__all__ = [
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

_BUILT_IN: Final = {
    "bayesian": "predictors.grid.bayesian:BayesianGoalPredictor",
    "shortest-distance": "predictors.grid.shortest_distance:ShortestDistance",
}
_REGISTERED: dict[str, Callable[..., GoalPredictor]] = {}


class PredictorError(ValueError):
    """A predictor cannot be found, made, or breaks the contract."""


@dataclass(frozen=True)
class PredictorInfo:
    """A predictor that can be used by name.

    Attributes:
        name: What to call it by.
        origin: ``"built in"``, ``"registered"``, or ``"entry point of PACKAGE VERSION"``.
        target: Where it is defined, ``module:Name``.
    """

    name: str
    origin: str
    target: str


def register_predictor(name: str, factory: Callable[..., GoalPredictor], *, overwrite: bool = False) -> None:
    """Make a predictor available by name for the rest of this process.

    Args:
        name: The name; must not be taken unless ``overwrite``.
        factory: The class, or a function that makes a predictor from keyword parameters.
        overwrite: Whether an earlier registration may be replaced. Built-in names never are.

    Raises:
        PredictorError: The name is taken or not a name, or the factory cannot be called.
    """
    if not isinstance(name, str) or not name or ":" in name:
        raise PredictorError(f"a predictor's name must be a non-empty string without ':', got {name!r}")
    if not callable(factory):
        raise PredictorError(f"predictor {name!r}: the factory must be callable, got {type(factory).__name__}")
    if name in _BUILT_IN or (not overwrite and name in _REGISTERED):
        raise PredictorError(f"the predictor name {name!r} is taken; choose another")
    _REGISTERED[name] = factory


def list_predictors() -> dict[str, PredictorInfo]:
    """Every predictor known by name: built in, installed as an entry point, and registered in this process."""
    found = {name: PredictorInfo(name, "built in", target) for name, target in _BUILT_IN.items()}
    for name, point in sorted(_installed().items()):
        package = f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"
        found.setdefault(name, PredictorInfo(name, f"entry point of {package}", point.value))
    for name, factory in _REGISTERED.items():
        target = f"{factory.__module__}:{getattr(factory, '__qualname__', type(factory).__name__)}"
        found[name] = PredictorInfo(name, "registered", target)
    return found


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
    factory = _resolve(spec)
    try:
        predictor = factory(**parameters)
    except TypeError as error:
        raise PredictorError(f"predictor {spec!r} cannot be made with {parameters}: {error}") from error
    if not isinstance(predictor, GoalPredictor):
        raise PredictorError(f"predictor {spec!r} must be a GoalPredictor, got {type(predictor).__name__}")
    return predictor


def _resolve(spec: str | Callable[..., GoalPredictor]) -> Callable[..., GoalPredictor]:
    if not isinstance(spec, str):
        if callable(spec):
            return spec
        raise PredictorError(f"a predictor is a name, 'module:Class' or a class, got {type(spec).__name__}")
    if spec in _REGISTERED:
        return _REGISTERED[spec]
    if spec in _BUILT_IN:
        return _load(_BUILT_IN[spec])
    installed = _installed()
    if spec in installed:
        return _load(installed[spec].value)
    if ":" in spec:
        return _load(spec)
    known = ", ".join(sorted(list_predictors()))
    raise PredictorError(f"no predictor named {spec!r}; known: {known}; or use 'module:Class'")


def _installed() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}


def _load(target: str) -> Callable[..., GoalPredictor]:
    module, _, name = target.partition(":")
    try:
        found: Any = import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError, ValueError) as error:
        raise PredictorError(f"predictor {target!r} cannot be imported: {error}") from error
    if not callable(found):
        raise PredictorError(f"predictor {target!r} is not a class or function but {type(found).__name__}")
    return found  # type: ignore[no-any-return]


def check_predictor(spec: PredictorSpec, X: Sequence[Trajectory] | None = None, **parameters: Any) -> None:
    """Check that a predictor keeps the contract of :class:`~predictors.base.GoalPredictor`.

    Args:
        spec: The predictor, in any form :func:`make_predictor` takes.
        X: Trajectories to try it on; a few walks in a small kitchen if None.
        parameters: Its parameters.

    Raises:
        PredictorError: Listing everything that is wrong.
    """
    from predictors.checks import find_problems

    predictor = make_predictor(spec, **parameters)
    problems = find_problems(predictor, X)
    if problems:
        raise PredictorError(
            f"{type(predictor).__name__} breaks the contract:\n" + "\n".join(f"- {p}" for p in problems)
        )
