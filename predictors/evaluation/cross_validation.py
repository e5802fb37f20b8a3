"""Cross-validation of predictors: each trajectory is predicted by one that was not fitted on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import CUTS, Cut, Trajectory
from legible_envs.support.validation import choice, integer
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
from predictors.evaluation.comparison import Comparison, compare_conditions
from predictors.evaluation.learning_curves import learning_curve
from predictors.evaluation.metrics import tied_shares
from predictors.evaluation.omissions import Omission, no_predictor_left, omission_table
from predictors.evaluation.results import Evaluation, LearningCurve
from predictors.evaluation.splits import MOST_REPEATS, Groups, Rare, Split, check_evaluable, check_seed, folds

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "Comparison",
    "Evaluation",
    "LearningCurve",
    "accuracy_at",
    "compare_conditions",
    "evaluate",
    "learning_curve",
]

Part = Literal["condition", "layout"]


def accuracy_at(
    predictor: GoalPredictor,
    X: Sequence[Trajectory],
    fractions: Sequence[float] = FRACTIONS,
    *,
    cut: Cut = "steps",
    ties: TieCredit = "fractional",
) -> pd.DataFrame:
    """Evaluate a fitted predictor on trajectories it has not learned from.

    Args:
        predictor: A fitted predictor.
        X: ``n`` complete trajectories with known goals.
        fractions: ``F`` fractions observed.
        cut: What the fraction is a share of, a key of :data:`legible_envs.rollouts.CUTS`.
        ties: How a true goal that shares the top counts; see :func:`predictors.base.correctness`.

    Returns:
        ``n * F`` rows: ``trajectory`` (its number in ``X``), ``participant``, ``condition``, ``layout``,
        ``candidates`` (how many), ``goal``, ``fraction``, ``states`` (how many were observed), ``probability`` (of the
        true goal) and ``correct`` (0 to 1). ``.attrs`` holds ``cut``, ``definition``, ``ties`` and ``candidate_set``.

    Raises:
        PredictorError: The predictor's answer is no probabilities of the candidates.
        ValueError: Prefixes, unknown goals, mixed candidate sets, whose accuracies must not be averaged, or bad
            fractions.
    """
    trajectories, fractions = list(X), check_fractions(fractions, cut, distinct=True)
    choice("ties", ties, get_args(TieCredit))
    if trajectories:
        check_evaluable(trajectories)
    candidate_set = trajectories[0].candidate_set if trajectories else None
    probabilities = probabilities_of(type(predictor).__name__, predictor, trajectories, fractions, cut)
    table = _rows(trajectories, probabilities, predictor.goal_columns(trajectories), fractions, cut, ties)
    table.attrs.update(cut=cut, definition=CUTS[cut], ties=ties, candidate_set=candidate_set)
    return table


def _rows(
    trajectories: Sequence[Trajectory],
    probabilities: npt.NDArray[np.float64],
    goals: npt.NDArray[np.intp],
    fractions: Sequence[float],
    cut: Cut,
    ties: TieCredit,
) -> pd.DataFrame:
    import pandas as pd

    number, count = len(trajectories), len(fractions)
    return pd.DataFrame(
        {
            "trajectory": np.repeat(np.arange(number), count),
            "participant": np.repeat([trajectory.participant for trajectory in trajectories], count),
            "condition": np.repeat([trajectory.condition for trajectory in trajectories], count),
            "layout": np.repeat([_layout_label(trajectory) for trajectory in trajectories], count),
            "candidates": np.repeat([len(trajectory.candidates) for trajectory in trajectories], count),
            "goal": np.repeat([trajectory.goal or "" for trajectory in trajectories], count),
            "fraction": np.tile(np.asarray(fractions, dtype=np.float64), number),
            "states": [
                trajectory.prefix_length(fraction, cut) for trajectory in trajectories for fraction in fractions
            ],
            "probability": probabilities[np.arange(number)[:, None], np.arange(count), goals[:, None]].ravel(),
            "correct": correctness(probabilities, goals, ties).ravel(),
        }
    )


def _layout_label(trajectory: Trajectory) -> str:
    return trajectory.layout_name or (trajectory.layout.layout_id if trajectory.layout is not None else "")


# -- cross-validation -------------------------------------------------------------------------------------------------


def evaluate(
    predictors: Specs,
    X: Sequence[Trajectory],
    *,
    cv: int = 4,
    repeats: int = 3,
    fractions: Sequence[float] = FRACTIONS,
    cut: Cut = "steps",
    ties: TieCredit = "fractional",
    groups: Groups | None = None,
    by: Part | None = None,
    rare: Rare = "error",
    seed: int | np.random.Generator = 0,
) -> Evaluation:
    """Evaluate predictors by stratified cross-validation: every trajectory is predicted once per repeat, unseen.

    All predictors see the same splits. A predictor that cannot be evaluated on these trajectories is left out, with the
    reason in ``omitted``, and the results of the others stand: one that learns, where all people chose one goal or
    there is no way to split the trajectories; and one that refuses them, such as a predictor of reaches in a kitchen. A
    predictor that learns nothing (:attr:`~predictors.base.GoalPredictor.learns`) needs no splits; where there are none,
    it is told the goals, starts and layouts only, and its rows have fold 0.

    Args:
        predictors: One predictor or several: instances, registered names, ``"module:Class"`` or classes; a mapping
            gives them the names that tables use.
        X: Complete trajectories with known goals.
        cv: Folds, in each of which every goal has its share.
        repeats: How often, with other splits.
        fractions: Fractions observed.
        cut: What the fraction is a share of, a key of :data:`legible_envs.rollouts.CUTS`.
        ties: How a true goal that shares the top counts; see :func:`predictors.base.correctness`.
        groups: ``"participant"``: no participant is on both sides of a split. None: trajectories are split singly.
        by: ``"condition"`` or ``"layout"``: fit and evaluate within each apart, as for comparing layouts.
        rare: What keeps predictors from learning: with ``"error"`` goals with fewer examples than folds; ``"keep"``
            evaluates on them all the same.
        seed: Of the splits.

    Returns:
        The result; its tables are tidy.

    Raises:
        PredictorError: A predictor that cannot be found or made, or whose answers are no probabilities.
        TrajectoryError: A prefix, an unknown goal, or a trajectory that does not fit its kitchen.
        ValueError: None of the predictors can be evaluated, with the reasons; bad parameters of one; no trajectories,
            mixed candidate sets, unknown options.
        TypeError: Samples that are not trajectories.
    """
    import pandas as pd

    trajectories, fractions = list(X), check_fractions(fractions, cut, distinct=True)
    integer("cv", cv, 2, unit="folds")
    integer("repeats", repeats, 1, MOST_REPEATS)
    choice("rare", rare, get_args(Rare))
    check_input(trajectories, fractions, cut, ties, groups)
    named = named_predictors(predictors)
    rng = check_seed(seed)
    plan = _Plan(cv, repeats, fractions, cut, ties, groups, rare)
    results: list[_FoldResult] = []
    omissions: list[Omission] = []
    unsplit: dict[str, str] = {}
    for part, members in _parts(trajectories, by).items():
        found, reasons, no_splits = _cross_validate(named, trajectories, members, plan, rng)
        if no_splits is not None and found:
            unsplit[part] = no_splits
        results += [result.of_part(by, part) for result in found]
        omissions += [Omission(name, part, reason) for name, reason in reasons.items()]
    if not results:
        raise no_predictor_left(omissions, by)
    return Evaluation(
        table=pd.concat([result.rows for result in results], ignore_index=True),
        confusion=pd.concat([result.confusion for result in results], ignore_index=True),
        cut=cut,
        ties=ties,
        candidate_set=trajectories[0].candidate_set,
        cv=cv,
        repeats=repeats,
        groups=groups,
        by=by,
        omitted=omission_table(omissions, by),
        unsplit=unsplit,
    )


@dataclass(frozen=True)
class _Plan:
    """How predictors are evaluated; see :func:`evaluate`."""

    cv: int
    repeats: int
    fractions: tuple[float, ...]
    cut: Cut
    ties: TieCredit
    groups: Groups | None
    rare: Rare


class _FoldResult(NamedTuple):
    """What one predictor said of the held-out part of one fold, as rows of the tables of an evaluation."""

    rows: pd.DataFrame
    confusion: pd.DataFrame

    def of_part(self, by: Part | None, part: str) -> _FoldResult:
        """The same, with a column that says which part of the trajectories this is."""
        if by is not None:
            self.confusion.insert(3, by, part)
        return self


def _cross_validate(
    named: Mapping[str, GoalPredictor],
    trajectories: Sequence[Trajectory],
    members: npt.NDArray[np.intp],
    plan: _Plan,
    rng: np.random.Generator,
) -> tuple[list[_FoldResult], dict[str, str], str | None]:
    """Results on some of the trajectories, why predictors have none, and why there are no folds."""
    results: dict[str, list[tuple[int, _FoldResult]]] = {name: [] for name in named}
    reasons: dict[str, str] = {}
    unsplit: str | None = None
    place = 0
    for repeat in range(plan.repeats):
        splits, no_splits = _splits_or_reason([trajectories[i] for i in members], plan, rng)
        unsplit = unsplit or no_splits
        for fold, (train, test) in enumerate(splits):
            for name, predictor in named.items():
                if no_splits is not None and predictor.learns:
                    reasons.setdefault(name, no_splits)
                if name in reasons:
                    continue
                try:
                    fitted = fitted_on(predictor, trajectories, members[train], contexts=no_splits is not None)
                    rows, confusion = _predict_rows(name, fitted, trajectories, members[test], plan)
                except contract_error():
                    raise
                except ValueError as error:
                    reasons[name] = str(error)
                    continue
                labels = {"predictor": name, "repeat": repeat, "fold": fold}
                results[name].append((place, _FoldResult(_labelled(rows, labels), _labelled(confusion, labels))))
                place += 1
    kept = [each for name, found in results.items() if name not in reasons for each in found]
    return [result for _, result in sorted(kept, key=lambda each: each[0])], reasons, unsplit


def _splits_or_reason(
    trajectories: Sequence[Trajectory], plan: _Plan, rng: np.random.Generator
) -> tuple[list[Split], str | None]:
    """The folds; or a single one of all trajectories, and why they cannot be split."""
    try:
        return list(folds(trajectories, plan.cv, rng, groups=plan.groups, rare=plan.rare)), None
    except ValueError as error:
        every = np.arange(len(trajectories))
        return [(every, every)], str(error)


def _parts(trajectories: Sequence[Trajectory], by: Part | None) -> dict[str, npt.NDArray[np.intp]]:
    if by is not None:
        choice("by", by, ("condition", "layout"), also="None")
    labels = np.array(
        [
            trajectory.condition if by == "condition" else _layout_label(trajectory) if by else ""
            for trajectory in trajectories
        ]
    )
    return {str(label): np.flatnonzero(labels == label) for label in dict.fromkeys(labels.tolist())}


def _predict_rows(
    name: str,
    predictor: GoalPredictor,
    trajectories: Sequence[Trajectory],
    numbers: npt.NDArray[np.intp],
    plan: _Plan,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows as of :func:`accuracy_at` with ``confidence``, and confusions as ``fraction, goal, predicted, count``."""
    import pandas as pd

    held_out, fractions = [trajectories[i] for i in numbers], plan.fractions
    try:
        probabilities = probabilities_of(name, predictor, held_out, fractions, plan.cut)
        goals = predictor.goal_columns(held_out)
    except TrajectoryError as error:
        raise renumbered(error, numbers) from error
    rows = _rows(held_out, probabilities, goals, fractions, plan.cut, plan.ties)
    rows["trajectory"] = numbers[rows["trajectory"].to_numpy()]
    rows["confidence"] = probabilities.max(axis=-1).ravel()
    names = np.asarray(predictor.classes_)
    counts = np.zeros((len(fractions), len(names), len(names)))
    for goal, shares in zip(goals, tied_shares(probabilities, plan.ties), strict=True):
        counts[:, goal] += shares
    where = np.nonzero(counts)
    confusion = pd.DataFrame(
        {
            "fraction": np.asarray(fractions, dtype=np.float64)[where[0]],
            "goal": names[where[1]],
            "predicted": names[where[2]],
            "count": counts[where],
        }
    )
    return rows, confusion


def _labelled(table: pd.DataFrame, labels: Mapping[str, Any]) -> pd.DataFrame:
    for place, (name, value) in enumerate(labels.items()):
        table.insert(place, name, value)
    return table
