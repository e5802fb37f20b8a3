"""Score recorded play with every predictor of the sweep."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from benchmarks.human_play.analysis import summarise
from benchmarks.human_play.sweep import CUT, FRACTIONS_OBSERVED, LAYOUTS, PREDICTORS, Setting
from legible_envs.overcooked.recordings import recorded_trajectories
from legible_envs.rollouts import CUTS, Cut
from predictors.evaluation import accuracy_at
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
) -> pd.DataFrame:
    """One row per predictor, recorded walk and fraction observed.

    Neither predictor of the sweep learns anything from walks but the goals' names, so nothing is held out.

    Args:
        folder: Where ``legible humans fetch`` wrote the recordings.
        predictors: Whom to compare.
        layouts: Kitchens, by the names they have in the recordings.
        fractions: Fractions observed.
        cut: Fraction of what; see :data:`legible_envs.rollouts.CUTS`.
        candidate_set: Which goals count as possible; see
            :func:`legible_envs.overcooked.recordings.recorded_trajectories`.

    Returns:
        The columns of :func:`predictors.evaluation.accuracy_at` after a column ``predictor``; its ``attrs`` too.

    Raises:
        RecordingsError: The recordings are not there; the message says how to get them.
    """
    import pandas as pd

    parts = []
    for layout in layouts:
        walks = recorded_trajectories(folder, [layout], candidate_set)
        if not walks:
            continue
        for setting in predictors:
            predictor = make_predictor(setting.predictor, **setting.parameters).fit(walks)
            part = accuracy_at(predictor, walks, fractions, cut=cut)
            part.insert(0, "predictor", setting.label)
            parts.append(part)
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
) -> pd.DataFrame:
    """Accuracy of each predictor in each recorded kitchen against fraction observed; see :func:`score_every_walk`.

    Returns:
        Tidy rows ``layout, predictor, fraction, accuracy, chance, walks, participants``: accuracy is the mean over
        walks with ties shared out, chance that of guessing among the candidates. ``.attrs`` holds ``cut``,
        ``definition`` (of fraction observed, in words), ``ties`` and ``candidate_set``.
    """
    rows = score_every_walk(
        folder, predictors=predictors, layouts=layouts, fractions=fractions, cut=cut, candidate_set=candidate_set
    )
    return summarise(rows)
