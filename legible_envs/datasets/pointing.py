"""Real centre-out pointing with a mouse (Freihaut and Göritz, 2021, doi 10.5281/zenodo.3941808) as trajectories.

The data are no part of this project. The file is a table (``.csv`` or ``.csv.gz``) of the study's movements, a row per
sample: ``participant, condition, trial, target, target_x, target_y, t_ms, x, y``, in pixels from the centre.
"""

from __future__ import annotations

import os
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.file_kinds import describe_file
from legible_envs.support.validation import shown

__all__ = ["METRES_PER_PIXEL", "RATE", "load_pointing"]

RATE: Final = 30.0
"""Samples per second after resampling."""
METRES_PER_PIXEL: Final = 1e-3
"""So that the targets lie 0.3 m away."""
_MEASURED: Final = ("target_x", "target_y", "t_ms", "x", "y")
_COLUMNS: Final = ("participant", "condition", "trial", "target", "target_x", "target_y", "t_ms", "x", "y")


def load_pointing(path: str | os.PathLike[str]) -> list[Trajectory]:
    """Movements from onset to rest, relative to their first sample (which otherwise gives away the target).

    Args:
        path: The table.

    Raises:
        FileNotFoundError: No such file.
        ValueError: It is no such table: what it looks like, which columns are missing or doubled, or which row of a
            column holds no finite number; or a movement without motion.
    """
    table = _read_table(path)
    targets = table.groupby("target")[["target_x", "target_y"]].first() * METRES_PER_PIXEL
    names = tuple(f"target{number}" for number in targets.index)
    places = tuple(map(tuple, targets.to_numpy().tolist()))
    movements = []
    for (participant, condition, number), trial in table.groupby(["participant", "condition", "trial"]):
        if not (trial[["x", "y"]].nunique() > 1).any() or trial["t_ms"].nunique() < 2:
            raise ValueError(
                f"{os.fspath(path)}: trial {number} of participant {participant}, condition {condition}, has no motion"
            )
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


def _read_table(path: str | os.PathLike[str]) -> Any:
    import pandas as pd

    name = os.fspath(path)
    try:
        table = pd.read_csv(path)
    except FileNotFoundError:
        raise
    except Exception as error:  # whatever pandas and the archives it opens may raise on a file of another kind
        raise ValueError(
            f"{name} is no table of pointing: it looks like {describe_file(name)}; expected CSV (.csv or .csv.gz) with "
            f"the columns {list(_COLUMNS)}"
        ) from error
    if missing := [column for column in _COLUMNS if column not in table]:
        raise ValueError(
            f"{name} is no table of pointing: the columns {missing} are missing; it looks like {describe_file(name)}"
        )
    # pandas renames a doubled column to "x.1"
    if doubled := [column for column in _COLUMNS if f"{column}.1" in table]:
        raise ValueError(f"{name}: the columns {doubled} are there twice")
    for column in _COLUMNS:
        bad = table[column].isna().to_numpy()
        if column in _MEASURED:
            numbers = pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=np.float64)
            bad = ~np.isfinite(numbers)
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            wanted, found = "a finite number" if column in _MEASURED else "given", table[column].iloc[row]
            raise ValueError(f"{name}, row {row + 1} of data: {column!r} must be {wanted}, got {shown(found)}")
    return table.astype(dict.fromkeys(_MEASURED, np.float64))


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
