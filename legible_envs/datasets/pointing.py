"""Real centre-out pointing with a mouse (Freihaut and Göritz, 2021, doi 10.5281/zenodo.3941808) as trajectories.

The data are no part of this project. The file is a table (``.csv`` or ``.csv.gz``) of the study's movements, a row per
sample: ``participant, condition, trial, target, target_x, target_y, t_ms, x, y``, in pixels from the centre.
"""

from __future__ import annotations

import os
from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["METRES_PER_PIXEL", "RATE", "load_pointing"]

RATE: Final = 30.0
"""Samples per second after resampling."""
METRES_PER_PIXEL: Final = 1e-3
"""So that the targets lie 0.3 m away."""
_COLUMNS: Final = ("participant", "condition", "trial", "target", "target_x", "target_y", "t_ms", "x", "y")


def load_pointing(path: str | os.PathLike[str]) -> list[Trajectory]:
    """Movements from onset to rest, relative to their first sample (which otherwise gives away the target).

    Args:
        path: The table.

    Raises:
        FileNotFoundError: No such file.
        ValueError: Columns are missing.
    """
    import pandas as pd

    table = pd.read_csv(path)
    missing = [name for name in _COLUMNS if name not in table]
    if missing:
        raise ValueError(f"{os.fspath(path)} is no table of pointing: the columns {missing} are missing")
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
    return movements


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
