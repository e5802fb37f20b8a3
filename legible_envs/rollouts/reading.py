"""Trajectories from whatever file they are in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from legible_envs.rollouts.trajectory import Trajectory, load_trajectories

if TYPE_CHECKING:
    from legible_envs.overcooked.layout import OvercookedLayout
    from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["read_any"]


def read_any(
    path: str | os.PathLike[str], *, layout: OvercookedLayout | TabletopLayout | None = None
) -> list[Trajectory]:
    """Trajectories of an ``.npz`` of :func:`~legible_envs.rollouts.save_trajectories`, a CSV, or a recorded play.

    Args:
        path: The file; ``.csv`` is read as CSV, others by what is in them.
        layout: Kitchen or table of CSV trajectories that name none.

    Raises:
        OSError: The file cannot be read.
        ValueError: It holds no trajectories; what is wrong with it.
    """
    if Path(path).suffix.lower() == ".csv":
        from legible_envs.rollouts.csv_files import read_csv

        return read_csv(path, layout=layout)
    try:
        return load_trajectories(path)
    except ValueError as error:
        from legible_envs.overcooked.human_play import load_played
        from legible_envs.overcooked.trajectories import trajectories_from_played

        try:
            played = load_played(path)
        except ValueError:
            raise error from None
        return trajectories_from_played(played, participant=Path(path).stem)
