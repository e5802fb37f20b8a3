"""Score recorded play with every predictor of the sweep."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from benchmarks.human_play.analysis import summarise
from benchmarks.human_play.sweep import CUT, FOLDS, FRACTIONS_OBSERVED, LAYOUTS, PREDICTORS, REPEATS, Setting
from legible_envs.overcooked.recordings import recorded_trajectories
from legible_envs.rollouts import CUTS, Cut
from predictors.evaluation import evaluate
from predictors.registry import make_predictor

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["score_every_walk", "score_recorded_play"]


def score_every_walk(
    folder: str | os.PathLike[str] | None = None,
    *,
    predictors: Sequence[Setting] = PREDICTORS,
    layouts: Sequence[str] = LAYOUTS,
    fractions: Sequence[float] = FRACTIONS_OBSERVED,
    cut: Cut = CUT,
    candidate_set: Literal["game", "all"] = "all",
    folds: int = FOLDS,
    repeats: int = REPEATS,
    seed: int = 0,
) -> pd.DataFrame:
    """One row per predictor, repeat, recorded walk and fraction observed.

    Every walk is judged by predictors that have learned from other walks in the same kitchen (stratified
    cross-validation; all predictors see the same splits).

    Args:
        folder: Where ``legible humans fetch`` wrote the recordings.
        predictors: Whom to compare.
        layouts: Kitchens, by the names they have in the recordings.
        fractions: Fractions observed.
        cut: Fraction of what; see :data:`legible_envs.rollouts.CUTS`.
        candidate_set: Which goals count as possible; see
            :func:`legible_envs.overcooked.recordings.recorded_trajectories`.
        folds: How many parts the walks are split into.
        repeats: How often, with other splits.
        seed: Of the splits.

    Returns:
        The rows of :func:`predictors.evaluation.evaluate`: ``predictor``, ``repeat``, ``fold`` and the columns of
        :func:`predictors.evaluation.accuracy_at`; the ``attrs`` of the latter too.

    Raises:
        RecordingsError: The recordings are not there; the message says how to get them.
    """
    import pandas as pd

    parts = []
    made = {setting.label: make_predictor(setting.predictor, **setting.parameters) for setting in predictors}
    for layout in layouts:
        walks = recorded_trajectories(folder, [layout], candidate_set)
        if walks:
            found = evaluate(
                made, walks, cv=folds, repeats=repeats, fractions=fractions, cut=cut, rare="keep", seed=seed
            )
            parts.append(found.table)
    if not parts:
        raise ValueError(f"no walks to score in {list(layouts)} with candidate set {candidate_set!r}")
    rows = pd.concat(parts, ignore_index=True)
    rows.attrs.update(cut=cut, definition=CUTS[cut], ties="fractional", candidate_set=candidate_set)
    return rows


def score_recorded_play(
    folder: str | os.PathLike[str] | None = None,
    *,
    predictors: Sequence[Setting] = PREDICTORS,
    layouts: Sequence[str] = LAYOUTS,
    fractions: Sequence[float] = FRACTIONS_OBSERVED,
    cut: Cut = CUT,
    candidate_set: Literal["game", "all"] = "all",
    folds: int = FOLDS,
    repeats: int = REPEATS,
    seed: int = 0,
) -> pd.DataFrame:
    """Accuracy of each predictor in each recorded kitchen against fraction observed; see :func:`score_every_walk`.

    Returns:
        Tidy rows ``layout, predictor, fraction, accuracy, chance, walks, participants``: accuracy is the mean over
        walks with ties shared out, chance that of guessing among the candidates. ``.attrs`` holds ``cut``,
        ``definition`` (of fraction observed, in words), ``ties`` and ``candidate_set``.
    """
    rows = score_every_walk(
        folder,
        predictors=predictors,
        layouts=layouts,
        fractions=fractions,
        cut=cut,
        candidate_set=candidate_set,
        folds=folds,
        repeats=repeats,
        seed=seed,
    )
    return summarise(rows)
