"""Cross-validation of predictors: each trajectory is predicted by one that was not fitted on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import CUTS, Cut, Trajectory
from legible_envs.support.validation import choice, entries, integer, is_integer, is_real, real, shown
from predictors.base import (
    FRACTIONS,
    GoalPredictor,
    TieCredit,
    TrajectoryError,
    check_fractions,
    correctness,
    prefix_lengths,
)
from predictors.evaluation.comparison import Comparison, compare_conditions
from predictors.evaluation.metrics import tied_shares
from predictors.evaluation.omissions import Omission, no_predictor_left, omission_table
from predictors.evaluation.results import Evaluation, LearningCurve
from predictors.evaluation.splits import (
    Groups,
    Rare,
    Split,
    check_evaluable,
    check_groups,
    check_learnable,
    check_seed,
    folds,
    nested_training_sets,
)
from predictors.outputs import probability_fault

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

Spec = str | GoalPredictor | Callable[..., GoalPredictor]
Specs = Spec | Sequence[Spec] | Mapping[str, Spec]
Part = Literal["condition", "layout"]

_REDRAWS: Final = 1000
"""How many splits are drawn to find those whose smallest training set mentions every goal."""


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
    probabilities = _probabilities(type(predictor).__name__, predictor, trajectories, fractions, cut)
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
    integer("repeats", repeats, 1)
    choice("rare", rare, get_args(Rare))
    _check_trajectories(trajectories, fractions, cut, ties, groups)
    named = _named(predictors)
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


def _check_trajectories(
    trajectories: Sequence[Trajectory], fractions: Sequence[float], cut: Cut, ties: TieCredit, groups: Groups | None
) -> None:
    choice("ties", ties, get_args(TieCredit))
    check_evaluable(trajectories)
    check_groups(trajectories, groups)
    prefix_lengths(trajectories, fractions, cut)


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
                    fitted = _fit(predictor, trajectories, members[train], contexts=no_splits is not None)
                    rows, confusion = _predict_rows(name, fitted, trajectories, members[test], plan)
                except _contract_errors():
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


def _contract_errors() -> type[Exception]:
    """What a broken predictor raises, which is no fact of the data."""
    from predictors.registry import PredictorError

    return PredictorError


def _fit(
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
        raise _renumbered(error, numbers) from error


def _renumbered(error: TrajectoryError, numbers: npt.NDArray[np.intp]) -> TrajectoryError:
    """An error about a part of the trajectories, with the number among all."""
    return TrajectoryError(int(numbers[error.number]), error.participant, error.reason)


def _probabilities(
    name: str, predictor: GoalPredictor, trajectories: Sequence[Trajectory], fractions: Sequence[float], cut: Cut
) -> npt.NDArray[np.float64]:
    """``(n, F, K)`` what a predictor says, if these are probabilities.

    Raises:
        PredictorError: They are not.
    """
    probabilities = predictor.predict_proba_at(trajectories, fractions, cut)
    fault = probability_fault(probabilities, trajectories, predictor.classes_, (len(fractions),))
    if fault:
        raise _contract_errors()(f"predictor {name!r}: {fault}")
    return probabilities


def _named(specs: Specs) -> dict[str, GoalPredictor]:
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
        probabilities = _probabilities(name, predictor, held_out, fractions, plan.cut)
        goals = predictor.goal_columns(held_out)
    except TrajectoryError as error:
        raise _renumbered(error, numbers) from error
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


# -- learning curves --------------------------------------------------------------------------------------------------


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
    integer("repeats", repeats, 1)
    real("test_share", test_share, 0, 1, closed="neither")
    choice("rare", rare, ("error", "redraw"))
    _check_trajectories(trajectories, fractions, cut, ties, groups)
    named = _named(predictors)
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
                    fitted = _fit(predictor, trajectories, learned, contexts=unknown is not None)
                    correct = _accuracies(name, fitted, trajectories, test, fractions, cut, ties)
                except _contract_errors():
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
        probabilities = _probabilities(name, predictor, held_out, fractions, cut)
    except TrajectoryError as error:
        raise _renumbered(error, numbers) from error
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
