"""Learning curves: how accuracy grows with what a predictor has learned from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Cut, Trajectory
from legible_envs.support.validation import choice, entries, integer, is_integer, is_real, real, shown
from predictors.base import FRACTIONS, GoalPredictor, TieCredit, TrajectoryError, check_fractions, correctness
from predictors.evaluation.answers import (
    Specs,
    check_input,
    contract_error,
    fitted_on,
    named_predictors,
    probabilities_of,
    renumbered,
)
from predictors.evaluation.omissions import Omission, no_predictor_left, omission_table
from predictors.evaluation.results import LearningCurve
from predictors.evaluation.splits import MOST_REPEATS, Groups, Split, check_learnable, check_seed, nested_training_sets

__all__ = ["learning_curve"]

_REDRAWS: Final = 1000
"""How many splits are drawn to find those whose smallest training set mentions every goal."""


def learning_curve(
    predictors: Specs,
    X: Sequence[Trajectory],
    *,
    sizes: Sequence[int | float] = (0.1, 0.2, 0.4, 0.7, 1.0),
    test_share: float = 0.25,
    repeats: int = 5,
    fractions: Sequence[float] = FRACTIONS,
    cut: Cut = "steps",
    ties: TieCredit = "fractional",
    groups: Groups | None = None,
    rare: Literal["error", "redraw"] = "error",
    seed: int | np.random.Generator = 0,
) -> LearningCurve:
    """How accuracy grows with the number of trajectories learned from.

    In each repeat a fixed share is held out to evaluate on; training sets are nested, and without groups hold goals in
    proportion. Predictors that cannot be evaluated are left out, as by :func:`evaluate`.

    Args:
        predictors: As for :func:`evaluate`.
        X: Complete trajectories with known goals.
        sizes: Training sizes: whole numbers of trajectories, or shares (floats <= 1) of those not held out
            (with groups, of the fewest in any repeat).
        test_share: Share held out.
        repeats: How often, with other splits.
        fractions: Fractions observed.
        cut: What the fraction is a share of, a key of :data:`legible_envs.rollouts.CUTS`.
        ties: As for :func:`evaluate`.
        groups: As for :func:`evaluate`.
        rare: What keeps predictors from learning: with ``"error"`` a smallest training set that never mentions a goal
            that is held out; ``"redraw"`` draws splits until it mentions every goal (without groups only).
        seed: Of the splits.

    Raises:
        ValueError: Sizes that are no sizes or larger than what is left to learn from; and as for :func:`evaluate`.
    """
    import pandas as pd

    trajectories, fractions = list(X), check_fractions(fractions, cut, distinct=True)
    integer("repeats", repeats, 1, MOST_REPEATS)
    real("test_share", test_share, 0, 1, closed="neither")
    choice("rare", rare, ("error", "redraw"))
    check_input(trajectories, fractions, cut, ties, groups)
    named = named_predictors(predictors)
    rng = check_seed(seed)
    reasons: dict[str, str] = {}
    try:
        splits = _splits(trajectories, sizes, test_share, repeats, rng, groups, rare)
    except _Unlearnable as error:
        reasons = {name: str(error) for name, predictor in named.items() if predictor.learns}
        splits = [nested_training_sets(trajectories, test_share, rng, groups) for _ in range(repeats)]
    # Groups are of different sizes: the smallest pool decides, so that every repeat has the same training sizes.
    counts = _sizes(sizes, min(len(pool) for pool, _ in splits))
    rows = []
    for repeat, (pool, test) in enumerate(splits):
        held_out = [trajectories[i] for i in test]
        for size in counts:
            unknown = _unknown_goals([trajectories[i] for i in pool[:size]], held_out)
            for name, predictor in named.items():
                if unknown and predictor.learns:
                    reasons.setdefault(name, unknown)
                if name in reasons:
                    continue
                try:
                    learned = np.arange(len(trajectories)) if unknown else pool[:size]
                    fitted = fitted_on(predictor, trajectories, learned, contexts=unknown is not None)
                    correct = _accuracies(name, fitted, trajectories, test, fractions, cut, ties)
                except contract_error():
                    raise
                except ValueError as error:
                    reasons[name] = str(error)
                    continue
                for fraction, accuracy in zip(fractions, correct, strict=True):
                    rows.append((name, repeat, size, len(held_out), float(fraction), float(accuracy)))
    omissions = [Omission(name, "", reason) for name, reason in reasons.items()]
    rows = [row for row in rows if row[0] not in reasons]
    if not rows:
        raise no_predictor_left(omissions)
    columns = ["predictor", "repeat", "size", "judged", "fraction", "accuracy"]
    table = pd.DataFrame(rows, columns=columns)
    candidate_set = trajectories[0].candidate_set
    return LearningCurve(table, cut, ties, candidate_set, test_share, omission_table(omissions))


def _accuracies(
    name: str,
    predictor: GoalPredictor,
    trajectories: Sequence[Trajectory],
    numbers: npt.NDArray[np.intp],
    fractions: Sequence[float],
    cut: Cut,
    ties: TieCredit,
) -> npt.NDArray[np.float64]:
    """``(F,)`` mean accuracy on some of the trajectories."""
    held_out = [trajectories[i] for i in numbers]
    try:
        probabilities = probabilities_of(name, predictor, held_out, fractions, cut)
    except TrajectoryError as error:
        raise renumbered(error, numbers) from error
    return correctness(probabilities, predictor.goal_columns(held_out), ties).mean(axis=0)


class _Unlearnable(ValueError):
    """Nothing can be learned from these trajectories, or from any split of them that was tried."""


def _splits(
    trajectories: Sequence[Trajectory],
    sizes: Sequence[int | float],
    test_share: float,
    repeats: int,
    rng: np.random.Generator,
    groups: Groups | None,
    rare: str,
) -> list[Split]:
    """Pools to learn from and test sets, one pair per repeat."""
    try:
        check_learnable(trajectories)
    except ValueError as error:
        raise _Unlearnable(str(error)) from error
    if rare == "error":
        return [nested_training_sets(trajectories, test_share, rng, groups) for _ in range(repeats)]
    if groups is not None:
        raise ValueError("rare='redraw' draws splits of single trajectories; use groups=None")
    names = {name for trajectory in trajectories for name in trajectory.candidates}
    found: list[Split] = []
    for seed in rng.integers(2**31, size=_REDRAWS).tolist():
        pool, test = nested_training_sets(trajectories, test_share, np.random.default_rng(seed))
        least = _sizes(sizes, len(pool))[0]
        if {name for i in pool[:least] for name in trajectories[i].candidates} == names:
            found.append((pool, test))
        if len(found) == repeats:
            return found
    raise _Unlearnable(
        f"in only {len(found)} of {_REDRAWS} splits the {least} trajectories learned from mention every goal; "
        f"{repeats} are needed: begin with a larger size"
    )


def _sizes(sizes: Sequence[int | float], available: int) -> list[int]:
    listed = entries(sizes)
    if not listed:
        raise ValueError(f"`sizes` must name at least one training size, got {shown(sizes)}")
    found = []
    for size in listed:
        count = size if is_integer(size) else round(size * available) if is_real(size) and 0 < size <= 1 else 0
        if not 1 <= count <= available:
            raise ValueError(f"size {size!r} is neither 1..{available} trajectories nor a share in (0, 1] of them")
        found.append(int(count))
    return sorted(set(found))


def _unknown_goals(learned: Sequence[Trajectory], held_out: Sequence[Trajectory]) -> str | None:
    """Why nothing can be said of the held-out trajectories after these; None if all their goals are known."""
    known = {name for trajectory in learned for name in trajectory.candidates}
    unknown = sorted({name for trajectory in held_out for name in trajectory.candidates} - known)
    if not unknown:
        return None
    return f"{len(learned)} trajectories to learn from never mention goals {unknown}; use larger sizes"
