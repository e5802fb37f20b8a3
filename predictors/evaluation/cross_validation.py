"""Cross-validation of predictors: each trajectory is predicted by one that was not fitted on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import CUTS, Cut, Trajectory
from legible_envs.support.validation import choice, integer, is_integer, is_real
from predictors.base import FRACTIONS, GoalPredictor, TieCredit, correctness
from predictors.evaluation.comparison import Comparison, compare_conditions
from predictors.evaluation.metrics import tied_shares
from predictors.evaluation.results import Evaluation, LearningCurve
from predictors.evaluation.splits import (
    Groups,
    Split,
    check_candidate_sets,
    check_learnable,
    folds,
    nested_training_sets,
)

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
        ValueError: Prefixes, unknown goals, or mixed candidate sets, whose accuracies must not be averaged.
    """
    trajectories = list(X)
    candidate_set = check_candidate_sets(trajectories)
    probabilities = predictor.predict_proba_at(trajectories, fractions, cut)
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
    rare: Literal["error", "keep"] = "error",
    seed: int | np.random.Generator = 0,
) -> Evaluation:
    """Evaluate predictors by stratified cross-validation: every trajectory is predicted once per repeat, unseen.

    All predictors see the same splits.

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
        rare: ``"error"`` refuses goals with fewer examples than folds; ``"keep"`` evaluates on them all the same.
        seed: Of the splits.

    Returns:
        The result; its tables are tidy.

    Raises:
        PredictorError: A predictor that cannot be found or made.
        ValueError: Trajectories that cannot be split so, with the reason; unknown options.
        TypeError: Samples that are not trajectories.
    """
    import pandas as pd
    from sklearn.base import clone

    trajectories = list(X)
    check_learnable(trajectories)
    _check_options(fractions, cut, repeats)
    named = _named(predictors)
    parts = _parts(trajectories, by)
    rng = np.random.default_rng(seed)
    tables, confusions = [], []
    for part, members in parts.items():
        for repeat in range(repeats):
            try:
                splits = list(folds([trajectories[i] for i in members], cv, rng, groups=groups, rare=rare))
            except ValueError as error:
                raise ValueError(f"{by} {part!r}: {error}" if by else str(error)) from error
            for fold, (train, test) in enumerate(splits):
                learned, held_out = ([trajectories[members[i]] for i in half] for half in (train, test))
                for name, predictor in named.items():
                    fitted = clone(predictor).fit(learned)
                    rows, confusion = _predict_rows(fitted, held_out, fractions, cut, ties)
                    rows["trajectory"] = members[test][rows["trajectory"].to_numpy()]
                    labels = {"predictor": name, "repeat": repeat, "fold": fold}
                    tables.append(_labelled(rows, labels))
                    confusions.append(_labelled(confusion, labels | ({by: part} if by else {})))
    return Evaluation(
        table=pd.concat(tables, ignore_index=True),
        confusion=pd.concat(confusions, ignore_index=True),
        cut=cut,
        ties=ties,
        candidate_set=trajectories[0].candidate_set,
        cv=cv,
        repeats=repeats,
        groups=groups,
        by=by,
    )


def _check_options(fractions: Sequence[float], cut: Cut, repeats: int) -> None:
    if cut not in CUTS:
        raise ValueError(f"unknown cut {cut!r}; expected one of {list(CUTS)}")
    if not len(fractions) or len(set(fractions)) != len(fractions):
        raise ValueError(f"`fractions` must be at least one, each once, got {fractions!r}")
    integer("repeats", repeats, 1)


def _named(specs: Specs) -> dict[str, GoalPredictor]:
    """Predictors by the names that tables use."""
    from predictors.registry import make_predictor

    if isinstance(specs, Mapping):
        named = {str(name): make_predictor(spec) for name, spec in specs.items()}
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
    predictor: GoalPredictor, trajectories: Sequence[Trajectory], fractions: Sequence[float], cut: Cut, ties: TieCredit
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows as of :func:`accuracy_at` with ``confidence``, and confusions as ``fraction, goal, predicted, count``."""
    import pandas as pd

    probabilities = predictor.predict_proba_at(trajectories, fractions, cut)
    goals = predictor.goal_columns(trajectories)
    rows = _rows(trajectories, probabilities, goals, fractions, cut, ties)
    rows["confidence"] = probabilities.max(axis=-1).ravel()
    names = np.asarray(predictor.classes_)
    counts = np.zeros((len(fractions), len(names), len(names)))
    for goal, shares in zip(goals, tied_shares(probabilities, ties), strict=True):
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
    proportion.

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
        rare: ``"error"`` refuses splits whose smallest training set never mentions a goal that is held out;
            ``"redraw"`` draws splits until it mentions every goal (without groups only).
        seed: Of the splits.

    Raises:
        ValueError: Sizes that are no sizes or larger than what is left to learn from; goals that the smallest training
            set does not mention, nor hardly any other split would; and as for :func:`evaluate`.
    """
    import pandas as pd
    from sklearn.base import clone

    trajectories = list(X)
    check_learnable(trajectories)
    _check_options(fractions, cut, repeats)
    named = _named(predictors)
    rng = np.random.default_rng(seed)
    rows = []
    splits = _splits(trajectories, sizes, test_share, repeats, rng, groups, rare)
    # Groups are of different sizes: the smallest pool decides, so that every repeat has the same training sizes.
    counts = _sizes(sizes, min(len(pool) for pool, _ in splits))
    for repeat, (pool, test) in enumerate(splits):
        held_out = [trajectories[i] for i in test]
        for size in counts:
            learned = [trajectories[i] for i in pool[:size]]
            _check_known(learned, held_out)
            for name, predictor in named.items():
                fitted = clone(predictor).fit(learned)
                probabilities = fitted.predict_proba_at(held_out, fractions, cut)
                correct = correctness(probabilities, fitted.goal_columns(held_out), ties).mean(axis=0)
                for fraction, accuracy in zip(fractions, correct, strict=True):
                    rows.append((name, repeat, size, len(held_out), float(fraction), float(accuracy)))
    columns = ["predictor", "repeat", "size", "judged", "fraction", "accuracy"]
    return LearningCurve(pd.DataFrame(rows, columns=columns), cut, ties, trajectories[0].candidate_set, test_share)


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
    if rare == "error":
        return [nested_training_sets(trajectories, test_share, rng, groups) for _ in range(repeats)]
    choice("rare", rare, ("error", "redraw"))
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
    raise ValueError(
        f"in only {len(found)} of {_REDRAWS} splits the {least} trajectories learned from mention every goal; "
        f"{repeats} are needed: begin with a larger size"
    )


def _sizes(sizes: Sequence[int | float], available: int) -> list[int]:
    found = []
    for size in sizes:
        count = size if is_integer(size) else round(size * available) if is_real(size) and 0 < size <= 1 else 0
        if not 1 <= count <= available:
            raise ValueError(f"size {size!r} is neither 1..{available} trajectories nor a share in (0, 1] of them")
        found.append(int(count))
    if not found:
        raise ValueError("`sizes` must name at least one training size")
    return sorted(set(found))


def _check_known(learned: Sequence[Trajectory], held_out: Sequence[Trajectory]) -> None:
    known = {name for trajectory in learned for name in trajectory.candidates}
    unknown = sorted({name for trajectory in held_out for name in trajectory.candidates} - known)
    if unknown:
        raise ValueError(f"{len(learned)} trajectories to learn from never mention goals {unknown}; use larger sizes")
