"""Fitting predictors and asking them: what cross-validation and learning curves share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import get_args

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Cut, Trajectory
from legible_envs.support.validation import choice
from predictors.base import GoalPredictor, TieCredit, TrajectoryError, prefix_lengths
from predictors.evaluation.splits import Groups, check_evaluable, check_groups
from predictors.outputs import probability_fault

__all__ = [
    "Specs",
    "check_input",
    "contract_error",
    "fitted_on",
    "named_predictors",
    "probabilities_of",
    "renumbered",
]

Spec = str | GoalPredictor | Callable[..., GoalPredictor]
Specs = Spec | Sequence[Spec] | Mapping[str, Spec]


def check_input(
    trajectories: Sequence[Trajectory], fractions: Sequence[float], cut: Cut, ties: TieCredit, groups: Groups | None
) -> None:
    """Check what does not depend on the predictors.

    Raises:
        TrajectoryError: A trajectory of which no fractions can be taken, with its number.
        ValueError: What :func:`~predictors.evaluation.splits.check_evaluable` or ``check_groups`` refuses.
    """
    choice("ties", ties, get_args(TieCredit))
    check_evaluable(trajectories)
    check_groups(trajectories, groups)
    prefix_lengths(trajectories, fractions, cut)


def named_predictors(specs: Specs) -> dict[str, GoalPredictor]:
    """Predictors by the names that tables use."""
    from predictors.registry import make_predictor

    if isinstance(specs, Mapping):
        named = {str(name): make_predictor(spec) for name, spec in specs.items()}
        if len(named) < len(specs):
            raise ValueError(f"several predictors have the same name in {list(specs)}")
    else:
        listed: Sequence[Spec] = [specs] if isinstance(specs, str | GoalPredictor) or callable(specs) else list(specs)
        named = {}
        for spec in listed:
            made = make_predictor(spec)
            name = spec if isinstance(spec, str) else type(made).__name__
            if name in named:
                raise ValueError(f"several predictors are called {name!r}; give a mapping of names to predictors")
            named[name] = made
    if not named:
        raise ValueError("no predictors to evaluate")
    for name, predictor in named.items():
        try:
            predictor._check_parameters()
        except ValueError as error:
            raise ValueError(f"predictor {name!r}: {error}") from error
    return named


def fitted_on(
    predictor: GoalPredictor,
    trajectories: Sequence[Trajectory],
    numbers: npt.NDArray[np.intp],
    *,
    contexts: bool = False,
) -> GoalPredictor:
    """A fitted copy; with ``contexts`` it is shown what is known before anybody moves only."""
    from sklearn.base import clone

    learned = [trajectories[i] for i in numbers]
    try:
        return clone(predictor).fit([replace(one.first(0), goal=None) for one in learned] if contexts else learned)
    except TrajectoryError as error:
        raise renumbered(error, numbers) from error


def renumbered(error: TrajectoryError, numbers: npt.NDArray[np.intp]) -> TrajectoryError:
    """An error about a part of the trajectories, with the number among all."""
    return TrajectoryError(int(numbers[error.number]), error.participant, error.reason)


def probabilities_of(
    name: str, predictor: GoalPredictor, trajectories: Sequence[Trajectory], fractions: Sequence[float], cut: Cut
) -> npt.NDArray[np.float64]:
    """``(n, F, K)`` what a predictor says, if these are probabilities.

    Raises:
        PredictorError: They are not.
    """
    probabilities = predictor.predict_proba_at(trajectories, fractions, cut)
    fault = probability_fault(probabilities, trajectories, predictor.classes_, (len(fractions),))
    if fault:
        raise contract_error()(f"predictor {name!r}: {fault}")
    return probabilities


def contract_error() -> type[Exception]:
    """What a broken predictor raises, which is no fact of the data."""
    from predictors.registry import PredictorError

    return PredictorError
