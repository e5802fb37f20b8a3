"""Which trajectories a predictor learns from and which it is evaluated on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice, integer, real
from predictors.base import TrajectoryError, check_trajectories
from predictors.grid.base import check_recorded

__all__ = [
    "Groups",
    "Rare",
    "Split",
    "check_candidate_sets",
    "check_evaluable",
    "check_groups",
    "check_learnable",
    "check_seed",
    "folds",
    "nested_training_sets",
]

Groups = Literal["participant"]
Rare = Literal["error", "keep"]
Split = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]

MOST_REPEATS: Final = 1_000
"""Of a cross-validation, and of a learning curve."""
_GROUPS: Final[tuple[Groups | None, ...]] = ("participant", None)


def folds(
    trajectories: Sequence[Trajectory],
    cv: int,
    rng: np.random.Generator,
    *,
    groups: Groups | None = None,
    rare: Rare = "error",
) -> Iterator[Split]:
    """Training and test numbers of a stratified k-fold split.

    Args:
        trajectories: ``n`` trajectories with known goals.
        cv: Number of folds ``k``.
        rng: Of the shuffle.
        groups: ``"participant"`` keeps all trajectories of a participant in one fold.
        rare: Whether goals with fewer examples than folds are refused or kept; kept ones are absent from some folds,
            and a goal's only example is evaluated without one to learn from.

    Yields:
        ``k`` pairs of numbers into ``trajectories``, sorted.

    Raises:
        ValueError: Too few trajectories, goals or participants; see above.
    """
    from sklearn.model_selection import StratifiedGroupKFold, StratifiedKFold

    cv = integer("cv", cv, 2, unit="folds")
    choice("rare", rare, ("error", "keep"))
    check_groups(trajectories, groups)
    goals = check_learnable(trajectories)
    if len(trajectories) < cv:
        raise ValueError(f"{cv} folds need at least {cv} trajectories, got {len(trajectories)}")
    few = {goal: count for goal, count in sorted(Counter(goals).items()) if count < cv}
    if few and rare == "error":
        raise ValueError(
            f"goals with fewer examples than the {cv} folds: {few}; use fewer folds, leave these trajectories out, or "
            "keep them with rare='keep'"
        )
    seed = int(rng.integers(2**31))
    participants: list[str] | None = None
    if groups is None:
        if min(len(trajectories), max(Counter(goals).values())) < cv:
            raise ValueError(f"no goal has an example for each of the {cv} folds; use fewer folds")
        splitter: Any = StratifiedKFold(cv, shuffle=True, random_state=seed)
    else:
        participants = [trajectory.participant for trajectory in trajectories]
        if len(set(participants)) < cv:
            raise ValueError(f"{cv} folds need at least {cv} participants, got {len(set(participants))}")
        splitter = StratifiedGroupKFold(cv, shuffle=True, random_state=seed)
    for train, test in _quietly(splitter, goals, participants):
        _check_fold([trajectories[i] for i in train], [trajectories[i] for i in test])
        yield train, test


def _quietly(splitter: Any, goals: Sequence[str], participants: Sequence[str] | None) -> list[Split]:
    """The splits, without scikit-learn's warning about rare goals that were asked for."""
    import warnings

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="The least populated class")
        return [(np.sort(a), np.sort(b)) for a, b in splitter.split(np.zeros(len(goals)), list(goals), participants)]


def check_groups(trajectories: Sequence[Trajectory], groups: Groups | None) -> None:
    """Check what is kept together, and that it has names.

    Raises:
        ValueError: Unknown groups, or a trajectory that names no participant to group by.
    """
    choice("groups", groups, _GROUPS)
    if groups is not None:
        unnamed = [number for number, trajectory in enumerate(trajectories) if not trajectory.participant]
        if unnamed:
            raise ValueError(f"trajectory {unnamed[0]} names no participant to group by; use groups=None")


def check_seed(seed: int | np.random.Generator) -> np.random.Generator:
    """The generator of a seed.

    Raises:
        ValueError: Neither a whole number >= 0 nor a generator; without one, no result could be repeated.
    """
    if isinstance(seed, np.random.Generator):
        return seed
    return np.random.default_rng(integer("seed", seed, 0, np.inf, also="a numpy Generator"))


def check_evaluable(trajectories: Sequence[Trajectory]) -> list[str]:
    """The goals of trajectories whose prediction can be evaluated.

    Raises:
        TypeError: Samples that are not trajectories.
        TrajectoryError: A prefix, an unknown goal, or one that does not fit its kitchen (see
            :func:`predictors.grid.base.check_whole`).
        ValueError: No trajectories, or mixed candidate sets.
    """
    if not len(trajectories):
        raise ValueError("no trajectories to evaluate on")
    goals = []
    for number, trajectory in enumerate(check_trajectories(trajectories)):
        if trajectory.goal is None:
            raise TrajectoryError(number, trajectory.participant, "it has no known goal to compare with")
        if not trajectory.complete:
            raise TrajectoryError(number, trajectory.participant, "it is a prefix; give complete trajectories")
        goals.append(trajectory.goal)
    check_candidate_sets(trajectories)
    check_recorded(trajectories)
    return goals


def check_learnable(trajectories: Sequence[Trajectory]) -> list[str]:
    """The goals of trajectories between which there is something to tell apart.

    Raises:
        TypeError: Samples that are not trajectories.
        ValueError: What :func:`check_evaluable` refuses, or one goal only.
    """
    goals = check_evaluable(trajectories)
    if len(set(goals)) == 1:
        raise ValueError(f"all {len(goals)} trajectories go to {goals[0]!r}; there is nothing to tell apart")
    return goals


def check_candidate_sets(trajectories: Sequence[Trajectory]) -> str | None:
    """The candidate set that all trajectories share; None where there are none.

    Raises:
        ValueError: Several sets, whose accuracies must not be averaged.
    """
    sets = sorted({trajectory.candidate_set for trajectory in trajectories})
    if len(sets) > 1:
        raise ValueError(f"trajectories with different candidate sets {sets} must be evaluated apart")
    return sets[0] if sets else None


def _check_fold(train: Sequence[Trajectory], test: Sequence[Trajectory]) -> None:
    goals = {trajectory.goal for trajectory in train}
    if not test or len(goals) < 2:
        what = "is empty" if not test else f"leaves only goal {goals.pop()!r} to learn from"
        raise ValueError(f"a fold {what}; use fewer folds, or other groups")
    unknown = {name for trajectory in test for name in trajectory.candidates} - {
        name for trajectory in train for name in trajectory.candidates
    }
    if unknown:
        raise ValueError(
            f"goals {sorted(unknown)} are candidates only in the held-out part of a fold; use fewer folds, other "
            "groups, or evaluate layouts apart with by='layout'"
        )


def nested_training_sets(
    trajectories: Sequence[Trajectory],
    test_share: float,
    rng: np.random.Generator,
    groups: Groups | None = None,
) -> Split:
    """A test set of a fixed share, and the others in an order whose every beginning holds goals in proportion.

    Returns:
        ``(pool, test)``: learning from the first ``m`` of ``pool`` gives nested training sets.

    Raises:
        ValueError: A share outside (0, 1), fewer than two trajectories or participants.
    """
    from sklearn.model_selection import GroupShuffleSplit

    goals = np.array(check_evaluable(trajectories))
    if len(goals) < 2:
        raise ValueError("a part can be held out of two trajectories or more, got 1")
    test_share = real("test_share", test_share, 0, 1, closed="neither")
    choice("groups", groups, _GROUPS)
    order = rng.permutation(len(trajectories))
    if groups is None:
        place = np.empty(len(trajectories))
        for goal in np.unique(goals):
            mine = order[goals[order] == goal]
            place[mine] = (np.arange(len(mine)) + rng.uniform()) / len(mine)
        count = min(max(round(test_share * len(trajectories)), 1), len(trajectories) - 1)
        order = order[np.argsort(place[order], kind="stable")]
        test, pool = np.sort(order[:count]), order[count:]
    else:
        participants = [trajectory.participant for trajectory in trajectories]
        if len(set(participants)) < 2:
            raise ValueError("grouping by participant needs at least two participants")
        split = GroupShuffleSplit(1, test_size=test_share, random_state=int(rng.integers(2**31)))
        train, test = next(split.split(np.zeros(len(trajectories)), groups=participants))
        pool = order[np.isin(order, train)]
    return pool, test
