"""Which trajectories a predictor learns from and which it is evaluated on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.validation import choice, integer, real
from predictors.base import check_trajectories

__all__ = ["Groups", "Split", "check_candidate_sets", "check_learnable", "folds", "nested_training_sets"]

Groups = Literal["participant"]
Split = tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]

_GROUPS: Final[tuple[Groups | None, ...]] = ("participant", None)


def folds(
    trajectories: Sequence[Trajectory],
    cv: int,
    rng: np.random.Generator,
    *,
    groups: Groups | None = None,
    rare: Literal["error", "keep"] = "error",
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

    goals = check_learnable(trajectories)
    cv = integer("cv", cv, 2, unit="folds")
    if len(trajectories) < cv:
        raise ValueError(f"{cv} folds need at least {cv} trajectories, got {len(trajectories)}")
    choice("rare", rare, ("error", "keep"))
    choice("groups", groups, _GROUPS)
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
        if "" in participants:
            raise ValueError(f"trajectory {participants.index('')} names no participant to group by; use groups=None")
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


def check_learnable(trajectories: Sequence[Trajectory]) -> list[str]:
    """The goals of trajectories between which there is something to tell apart.

    Raises:
        TypeError: Samples that are not trajectories.
        ValueError: None, prefixes, unknown goals, mixed candidate sets, or one goal only.
    """
    if not trajectories:
        raise ValueError("no trajectories to evaluate on")
    goals = []
    for number, trajectory in enumerate(check_trajectories(trajectories)):
        if trajectory.goal is None:
            raise ValueError(f"trajectory {number} has no known goal to compare with")
        if not trajectory.complete:
            raise ValueError(f"trajectory {number} is a prefix; give complete trajectories")
        goals.append(trajectory.goal)
    check_candidate_sets(trajectories)
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
        ValueError: A share outside (0, 1), or a test set or pool of one goal.
    """
    from sklearn.model_selection import GroupShuffleSplit

    goals = np.array(check_learnable(trajectories))
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
