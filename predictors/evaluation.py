"""How well predictors read people: tidy tables, one row per trajectory and fraction observed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from legible_envs.rollouts import CUTS, Cut, Trajectory
from predictors.base import FRACTIONS, GoalPredictor, Ties, correctness

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["accuracy_at"]


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
    import pandas as pd

    walks = list(X)
    sets = sorted({walk.candidate_set for walk in walks})
    if len(sets) > 1:
        raise ValueError(f"trajectories with different candidate sets {sets} must be judged apart")
    probabilities = predictor.predict_proba_at(walks, fractions, cut)
    goals = predictor.goal_columns(walks)
    correct = correctness(probabilities, goals, ties)
    number, count = len(walks), len(fractions)
    table = pd.DataFrame(
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
            "correct": correct.ravel(),
        }
    )
    table.attrs.update(cut=cut, definition=CUTS[cut], ties=ties, candidate_set=sets[0] if sets else None)
    return table


def _layout_label(walk: Trajectory) -> str:
    return walk.layout_name or (walk.layout.layout_id if walk.layout is not None else "")
