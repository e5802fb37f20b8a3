"""Score recorded play, and real pointing, with every predictor of the sweep."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from benchmarks.experiments.prediction.analysis import summarise
from benchmarks.experiments.prediction.sweep import POINTING_PREDICTORS, Experiment
from benchmarks.experiments.predictor_settings import PredictorSetting
from legible_envs.datasets.overcooked_2019 import recorded_trajectories
from legible_envs.datasets.pointing import load_pointing
from legible_envs.rollouts.trajectory import CUTS
from predictors.evaluation.cross_validation import evaluate

if TYPE_CHECKING:
    import pandas as pd

    from predictors.base import GoalPredictor

__all__ = ["score_every_trajectory", "score_pointing", "score_recorded_play"]

Tell = Callable[[str], None]


def score_every_trajectory(
    folder: str | os.PathLike[str] | None = None,
    experiment: Experiment | None = None,
    *,
    tell: Tell | None = None,
    **changes: Any,
) -> pd.DataFrame:
    """One row per predictor, repeat, recorded trajectory and fraction observed.

    The goal of every trajectory is predicted by predictors that have learned from others in the same kitchen
    (stratified cross-validation; all predictors see the same splits).

    Args:
        folder: Where ``legible humans fetch`` wrote the recordings.
        experiment: What is evaluated, and how.
        tell: Called with what comes next, before it begins.
        changes: Attributes of the experiment to change: ``score_every_trajectory(repeats=1)``.

    Returns:
        The rows of :func:`predictors.evaluation.evaluate`: ``predictor``, ``repeat``, ``fold`` and the columns of
        :func:`predictors.evaluation.accuracy_at`; the ``attrs`` of the latter too.

    Raises:
        RecordingsError: The recordings are not there; the message says how to get them.
        TypeError: A change to something else than an attribute of the experiment.
    """
    import pandas as pd

    plan = replace(experiment or Experiment(), **changes)
    parts = []
    for layout in plan.layouts:
        trajectories = recorded_trajectories(folder, [layout], plan.candidate_set)
        if not trajectories:
            continue
        for repeats, made in _by_repeats(plan.predictors, plan.repeats):
            if tell is not None:
                tell(f"{layout}: {', '.join(made)}")
            found = evaluate(
                made,
                trajectories,
                cv=plan.folds,
                repeats=repeats,
                fractions=plan.fractions,
                cut=plan.cut,
                rare="keep",
                seed=plan.seed,
            )
            parts.append(found.table)
    if not parts:
        raise ValueError(
            f"no trajectories to evaluate in {list(plan.layouts)} with candidate set {plan.candidate_set!r}"
        )
    rows = pd.concat(parts, ignore_index=True)
    rows.attrs.update(cut=plan.cut, definition=CUTS[plan.cut], ties="fractional", candidate_set=plan.candidate_set)
    return rows


def _by_repeats(
    settings: Sequence[PredictorSetting], repeats: int
) -> Iterator[tuple[int, Mapping[str, GoalPredictor]]]:
    """Predictors by label, neighbours together that are evaluated equally often."""
    together: list[tuple[int, dict[str, GoalPredictor]]] = []
    for setting in settings:
        own = setting.repeats(repeats)
        if not together or together[-1][0] != own:
            together.append((own, {}))
        together[-1][1][setting.label] = setting.make()
    return iter(together)


def score_recorded_play(
    folder: str | os.PathLike[str] | None = None,
    experiment: Experiment | None = None,
    *,
    tell: Tell | None = None,
    **changes: Any,
) -> pd.DataFrame:
    """Accuracy of each predictor in each recorded kitchen against fraction observed.

    Arguments are those of :func:`score_every_trajectory`.

    Returns:
        Tidy rows ``layout, predictor, fraction, accuracy, chance, walks, participants, repeats``: accuracy is the mean
        over trajectories with ties shared out, chance that of guessing among the candidates. ``.attrs`` holds ``cut``,
        ``definition`` (of fraction observed, in words), ``ties`` and ``candidate_set``.
    """
    return summarise(score_every_trajectory(folder, experiment, tell=tell, **changes))


def score_pointing(
    path: str | os.PathLike[str],
    *,
    predictors: Sequence[PredictorSetting] = POINTING_PREDICTORS,
    folds: int = 4,
    seed: int = 0,
    tell: Tell | None = None,
) -> pd.DataFrame:
    """Accuracy of each predictor on real pointing of participants it has not learned from.

    Args:
        path: The file of :func:`legible_envs.datasets.pointing.load_pointing`.
        predictors: Which predictors to compare.
        folds: How many parts the participants are split into.
        seed: Of the split.
        tell: Called with what comes next, before it begins.

    Returns:
        The rows of :func:`score_recorded_play`, with ``layout`` ``"pointing"``.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Not a table of pointing.
    """
    import pandas as pd

    trajectories = load_pointing(path)
    parts = []
    for repeats, made in _by_repeats(predictors, 1):
        if tell is not None:
            tell(f"pointing: {', '.join(made)}")
        parts.append(evaluate(made, trajectories, cv=folds, repeats=repeats, groups="participant", seed=seed).table)
    rows = pd.concat(parts, ignore_index=True).assign(layout="pointing")
    rows.attrs.update(parts[0].attrs)
    return summarise(rows)
