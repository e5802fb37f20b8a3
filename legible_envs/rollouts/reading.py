"""Trajectories from any file that holds some.

Formats of recordings beside ``.npz`` and CSV are plug-ins: functions ``read(path)`` that return the trajectories of a
file, or None where the file is in another format. Recorded play of the kitchen is the one built in.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from legible_envs.rollouts.npz_files import load_trajectories
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.plugins import Registry

__all__ = ["TrajectoryFormat", "read_any", "register_trajectory_format"]

TrajectoryFormat = Callable[[Path], list[Trajectory] | None]

_registry: Final = Registry(
    "trajectory format",
    "legible.trajectories",
    {"recorded play": "legible_envs.overcooked.human_play:read_played"},
    ValueError,
)


def register_trajectory_format(name: str, read: TrajectoryFormat, *, overwrite: bool = False) -> None:
    """Let :func:`read_any` read another format, for the rest of this process.

    Args:
        name: Of the format.
        read: Called with a path; returns the trajectories in the file, or None where it has another format.
        overwrite: Whether it may replace an earlier registration of that name.

    Raises:
        ValueError: The name is taken, or ``read`` cannot be called.
    """
    _registry.register(name, read, overwrite=overwrite)


def read_any(path: str | os.PathLike[str], *, layout: Any = None) -> list[Trajectory]:
    """Trajectories of an ``.npz`` of :func:`~legible_envs.rollouts.save_trajectories`, a CSV, or recorded play.

    Args:
        path: The file; ``.csv`` is read as CSV, others by what is in them.
        layout: The layout of CSV trajectories that name none.

    Raises:
        OSError: The file cannot be read.
        ValueError: It holds no trajectories; what is wrong with it.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        from legible_envs.rollouts.csv_files import read_csv

        return read_csv(path, layout=layout)
    try:
        return load_trajectories(path)
    except ValueError:
        for name in _registry.list():
            found = _registry.resolve(name)(path)
            if found is not None:
                return list(found)
        raise
