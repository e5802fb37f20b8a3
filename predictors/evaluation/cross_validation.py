"""Cross-validation of predictors: each trajectory is judged by one that was not fitted on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import CUTS, Cut, Trajectory
from predictors.base import FRACTIONS, GoalPredictor, Ties, correctness
from predictors.evaluation.comparison import Comparison, compare_conditions
from predictors.evaluation.metrics import tied_shares
from predictors.evaluation.results import Evaluation, LearningCurve
from predictors.evaluation.splits import Groups, Split, check_learnable, folds, nested_training_sets

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
    ties: Ties = "fractional",
) -> pd.DataFrame:
    """Judge a fitted predictor on trajectories it has not learned from.

    Args:
        predictor: A fitted predictor.
        X: ``n`` complete trajectories with known goals.
        fractions: ``F`` fractions observed.
        cut: Fraction of what; see :data:`legible_envs.rollouts.CUTS`.
        ties: How a true goal that shares the top counts; see :func:`predictors.base.correctness`.

    Returns:
        ``n * F`` rows: ``trajectory`` (its number in ``X``), ``participant``, ``condition``, ``layout``,
        ``candidates`` (how many), ``goal``, ``fraction``, ``states`` (how many were observed), ``probability`` (of the
        true goal) and ``correct`` (0 to 1). ``.attrs`` holds ``cut``, ``definition``, ``ties`` and ``candidate_set``.

    Raises:
        ValueError: Prefixes, unknown goals, or mixed candidate sets, whose accuracies must not be averaged.
    """
    walks = list(X)
    sets = sorted({walk.candidate_set for walk in walks})
    if len(sets) > 1:
        raise ValueError(f"trajectories with different candidate sets {sets} must be judged apart")
    probabilities = predictor.predict_proba_at(walks, fractions, cut)
    table = _rows(walks, probabilities, predictor.goal_columns(walks), fractions, cut, ties)
    table.attrs.update(cut=cut, definition=CUTS[cut], ties=ties, candidate_set=sets[0] if sets else None)
    return table


def _rows(
    walks: Sequence[Trajectory],
    probabilities: npt.NDArray[np.float64],
    goals: npt.NDArray[np.intp],
    fractions: Sequence[float],
    cut: Cut,
    ties: Ties,
) -> pd.DataFrame:
    import pandas as pd

    number, count = len(walks), len(fractions)
    return pd.DataFrame(
        {
            "trajectory": np.repeat(np.arange(number), count),
            "participant": np.repeat([walk.participant for walk in walks], count),
            "condition": np.repeat([walk.condition for walk in walks], count),
            "layout": np.repeat([_layout_label(walk) for walk in walks], count),
            "candidates": np.repeat([len(walk.candidates) for walk in walks], count),
            "goal": np.repeat([walk.goal or "" for walk in walks], count),
            "fraction": np.tile(np.asarray(fractions, dtype=np.float64), number),
            "states": [walk.prefix_length(fraction, cut) for walk in walks for fraction in fractions],
            "probability": probabilities[np.arange(number)[:, None], np.arange(count), goals[:, None]].ravel(),
            "correct": correctness(probabilities, goals, ties).ravel(),
        }
    )


def _layout_label(walk: Trajectory) -> str:
    return walk.layout_name or (walk.layout.layout_id if walk.layout is not None else "")


# -- cross-validation -------------------------------------------------------------------------------------------------


def evaluate(
    predictors: Specs,
    X: Sequence[Trajectory],
    *,
    cv: int = 4,
    repeats: int = 3,
    fractions: Sequence[float] = FRACTIONS,
    cut: Cut = "steps",
    ties: Ties = "fractional",
    groups: Groups | None = None,
    by: Part | None = None,
    rare: Literal["error", "keep"] = "error",
    seed: int | np.random.Generator = 0,
) -> Evaluation:
    """Judge predictors by stratified cross-validation: every trajectory is predicted once per repeat, unseen.

    All predictors see the same splits.

    Args:
        predictors: One predictor or several: instances, registered names, ``"module:Class"`` or classes; a mapping
            gives them the names that tables use.
        X: Complete trajectories with known goals.
        cv: Folds, in each of which every goal has its share.
        repeats: How often, with other splits.
        fractions: Fractions observed.
        cut: Fraction of what; see :data:`legible_envs.rollouts.CUTS`.
        ties: How a true goal that shares the top counts; see :func:`predictors.base.correctness`.
        groups: ``"participant"``: nobody is both learned from and judged. None: trajectories are split singly.
        by: ``"condition"`` or ``"layout"``: learn and judge within each apart, as for comparing layouts.
        rare: ``"error"`` refuses goals with fewer examples than folds; ``"keep"`` judges them all the same.
        seed: Of the splits.

    Returns:
        The result; its tables are tidy.

    Raises:
        PredictorError: A predictor that cannot be found or made.
        ValueError: Trajectories that cannot be split so, with the reason; unknown options.
        TypeError: Something else than trajectories.
    """
    import pandas as pd
    from sklearn.base import clone

    walks = list(X)
    check_learnable(walks)
    _check_options(fractions, cut, repeats)
    named = _named(predictors)
    parts = _parts(walks, by)
    rng = np.random.default_rng(seed)
    tables, confusions = [], []
    for part, members in parts.items():
        for repeat in range(repeats):
            try:
                splits = list(folds([walks[i] for i in members], cv, rng, groups=groups, rare=rare))
            except ValueError as error:
                raise ValueError(f"{by} {part!r}: {error}" if by else str(error)) from error
            for fold, (train, test) in enumerate(splits):
                learned, judged = ([walks[members[i]] for i in half] for half in (train, test))
                for name, predictor in named.items():
                    fitted = clone(predictor).fit(learned)
                    rows, confusion = _judge(fitted, judged, fractions, cut, ties)
                    rows["trajectory"] = members[test][rows["trajectory"].to_numpy()]
                    labels = {"predictor": name, "repeat": repeat, "fold": fold}
                    tables.append(_labelled(rows, labels))
                    confusions.append(_labelled(confusion, labels | ({by: part} if by else {})))
    return Evaluation(
        table=pd.concat(tables, ignore_index=True),
        confusion=pd.concat(confusions, ignore_index=True),
        cut=cut,
        ties=ties,
        candidate_set=walks[0].candidate_set,
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
    if isinstance(repeats, bool) or not isinstance(repeats, int | np.integer) or repeats < 1:
        raise ValueError(f"`repeats` must be a number >= 1, got {repeats!r}")


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


def _parts(walks: Sequence[Trajectory], by: Part | None) -> dict[str, npt.NDArray[np.intp]]:
    if by not in (None, "condition", "layout"):
        raise ValueError(f"`by` must be 'condition', 'layout' or None, got {by!r}")
    labels = np.array([walk.condition if by == "condition" else _layout_label(walk) if by else "" for walk in walks])
    return {str(label): np.flatnonzero(labels == label) for label in dict.fromkeys(labels.tolist())}


def _judge(
    predictor: GoalPredictor, walks: Sequence[Trajectory], fractions: Sequence[float], cut: Cut, ties: Ties
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows as of :func:`accuracy_at` with ``confidence``, and confusions as ``fraction, goal, predicted, count``."""
    import pandas as pd

    probabilities = predictor.predict_proba_at(walks, fractions, cut)
    goals = predictor.goal_columns(walks)
    rows = _rows(walks, probabilities, goals, fractions, cut, ties)
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
    ties: Ties = "fractional",
    groups: Groups | None = None,
    rare: Literal["error", "redraw"] = "error",
    seed: int | np.random.Generator = 0,
) -> LearningCurve:
    """How accuracy grows with the number of trajectories learned from.

    In each repeat a fixed share is held out and judged; training sets are nested, and without groups hold goals in
    proportion.

    Args:
        predictors: As for :func:`evaluate`.
        X: Complete trajectories with known goals.
        sizes: Training sizes: whole numbers of trajectories, or shares (floats <= 1) of those not held out
            (with groups, of the fewest in any repeat).
        test_share: Share held out.
        repeats: How often, with other splits.
        fractions: Fractions observed.
        cut: Fraction of what; see :data:`legible_envs.rollouts.CUTS`.
        ties: As for :func:`evaluate`.
        groups: As for :func:`evaluate`.
        rare: ``"error"`` refuses splits whose smallest training set never mentions a goal that is held out;
            ``"redraw"`` draws splits until it mentions every goal (without groups only).
        seed: Of the splits.

    Raises:
        ValueError: Sizes that are no sizes or larger than what is left to learn from; goals that the smallest training
            set has not heard of, and that hardly any other split would mention; and as for :func:`evaluate`.
    """
    import pandas as pd
    from sklearn.base import clone

    walks = list(X)
    check_learnable(walks)
    _check_options(fractions, cut, repeats)
    named = _named(predictors)
    rng = np.random.default_rng(seed)
    rows = []
    splits = _splits(walks, sizes, test_share, repeats, rng, groups, rare)
    # Groups are of different sizes: the smallest pool decides, so that every repeat has the same training sizes.
    counts = _sizes(sizes, min(len(pool) for pool, _ in splits))
    for repeat, (pool, test) in enumerate(splits):
        judged = [walks[i] for i in test]
        for size in counts:
            learned = [walks[i] for i in pool[:size]]
            _check_known(learned, judged)
            for name, predictor in named.items():
                fitted = clone(predictor).fit(learned)
                probabilities = fitted.predict_proba_at(judged, fractions, cut)
                correct = correctness(probabilities, fitted.goal_columns(judged), ties).mean(axis=0)
                for fraction, accuracy in zip(fractions, correct, strict=True):
                    rows.append((name, repeat, size, len(judged), float(fraction), float(accuracy)))
    columns = ["predictor", "repeat", "size", "judged", "fraction", "accuracy"]
    return LearningCurve(pd.DataFrame(rows, columns=columns), cut, ties, walks[0].candidate_set, test_share)


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
    if rare != "redraw":
        raise ValueError(f"`rare` must be 'error' or 'redraw', got {rare!r}")
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
        whole = isinstance(size, int | np.integer) and not isinstance(size, bool)
        count = int(size) if whole else round(size * available)
        if isinstance(size, bool) or (not whole and not 0 < size <= 1) or not 1 <= count <= available:
            raise ValueError(f"size {size!r} is neither 1..{available} trajectories nor a share in (0, 1] of them")
        found.append(count)
    if not found:
        raise ValueError("`sizes` must name at least one training size")
    return sorted(set(found))


def _check_known(learned: Sequence[Trajectory], judged: Sequence[Trajectory]) -> None:
    known = {name for walk in learned for name in walk.candidates}
    unknown = sorted({name for walk in judged for name in walk.candidates} - known)
    if unknown:
        raise ValueError(f"{len(learned)} trajectories to learn from never mention goals {unknown}; use larger sizes")
