"""Real human pointing (Freihaut and Göritz, 2021), for tests; it lies beside the repository and is no part of it."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest
from sklearn.model_selection import GroupKFold

from legible_envs.rollouts import Trajectory
from predictors import GoalPredictor

RATE = 30.0  # Hz
METRES_PER_PIXEL = 1e-3  # so that the targets lie 0.3 m away
FILE = "centerout_mouse.csv.gz"


def path_of_file() -> Path | None:
    """The data beside the repository, or in the folder that LEGIBLE_SHARED_DATA names; None where it is not."""
    named = os.environ.get("LEGIBLE_SHARED_DATA")
    folder = Path(named) if named else Path(__file__).parents[2] / "shared" / "data"
    return folder / FILE if (folder / FILE).is_file() else None


needs_pointing = pytest.mark.skipif(
    path_of_file() is None, reason=f"needs ../shared/data/{FILE} beside the repository, or LEGIBLE_SHARED_DATA"
)


@cache
def load_pointing() -> tuple[Trajectory, ...]:
    """Movements from onset to rest at 30 Hz, relative to their first sample, ten targets each."""
    path = path_of_file()
    assert path is not None
    table = pd.read_csv(path)
    targets = table.groupby("target")[["target_x", "target_y"]].first() * METRES_PER_PIXEL
    names = tuple(f"target{number}" for number in targets.index)
    places = tuple(map(tuple, targets.to_numpy().tolist()))
    movements = []
    for (participant, condition, _), trial in table.groupby(["participant", "condition", "trial"]):
        times, points = _trimmed(trial["t_ms"].to_numpy() / 1000.0, trial[["x", "y"]].to_numpy(dtype=np.float64))
        clock = np.arange(int((times[-1] - times[0]) * RATE + 1e-6) + 1) / RATE
        states = np.stack([np.interp(times[0] + clock, times, column) for column in points.T], axis=1)
        movements.append(
            Trajectory(
                (states - states[0]) * METRES_PER_PIXEL,
                clock,
                start="centre",
                goal=f"target{trial['target'].iloc[0]}",
                candidates=names,
                participant=f"p{participant}",
                condition=str(condition),
                goal_positions=places,
            )
        )
    return tuple(movements)


def _trimmed(
    times: npt.NDArray[np.float64], points: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """From 5 % of the peak speed to the last change of position."""
    fresh = np.r_[True, np.diff(times) > 0]
    times, points = times[fresh], points[fresh]
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    speeds = steps / np.diff(times)
    onset = np.flatnonzero(speeds > 0.05 * speeds.max())[0]
    rest = np.flatnonzero(steps > 0)[-1] + 2
    return times[onset:rest], points[onset:rest]


def grouped_accuracy(predictor: GoalPredictor, folds: int = 4) -> float:
    """Mean accuracy over 10..90 % of movements by people whom the predictor has not seen."""
    walks = np.array(load_pointing(), dtype=object)
    people = [walk.participant for walk in walks]
    scores = np.zeros(len(walks))
    for train, test in GroupKFold(folds).split(walks, groups=people):
        scores[test] = predictor.fit(list(walks[train])).score(list(walks[test]))
    return float(scores.mean())
