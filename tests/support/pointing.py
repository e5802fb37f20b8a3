"""Real human pointing (Freihaut and Göritz, 2021), for tests; it lies beside the repository and is no part of it."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from sklearn.model_selection import GroupKFold

from legible_envs.datasets.pointing import load_pointing as read_pointing
from legible_envs.rollouts import Trajectory
from predictors import GoalPredictor

FILE = "centerout_mouse.csv.gz"


def path_of_file() -> Path | None:
    """The data beside the repository, or in the folder that LEGIBLE_SHARED_DATA names; None where it is not."""
    named = os.environ.get("LEGIBLE_SHARED_DATA")
    folder = Path(named) if named else Path(__file__).parents[3] / "shared" / "data"
    return folder / FILE if (folder / FILE).is_file() else None


needs_pointing = pytest.mark.skipif(
    path_of_file() is None, reason=f"needs ../shared/data/{FILE} beside the repository, or LEGIBLE_SHARED_DATA"
)


@cache
def load_pointing() -> tuple[Trajectory, ...]:
    """All movements, ten targets each."""
    path = path_of_file()
    assert path is not None
    return tuple(read_pointing(path))


def grouped_accuracy(predictor: GoalPredictor, folds: int = 4) -> float:
    """Mean accuracy over 10..90 % of movements by participants that the predictor has not seen."""
    movements = np.array(load_pointing(), dtype=object)
    participants = [movement.participant for movement in movements]
    scores = np.zeros(len(movements))
    for train, test in GroupKFold(folds).split(movements, groups=participants):
        scores[test] = predictor.fit(list(movements[train])).score(list(movements[test]))
    return float(scores.mean())
