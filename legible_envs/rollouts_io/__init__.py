"""Rollouts and trajectories in and out: environments and play, CSV, Minari.

>>> from legible_envs.rollouts_io import RecordRollouts, write_csv
>>> env = RecordRollouts(gym.make("LegibleOvercooked-v0"))      # doctest: +SKIP
>>> gymnasium.utils.play.play(env)                              # doctest: +SKIP
>>> write_csv("walks.csv", env.trajectories(participant="p1"))  # doctest: +SKIP
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from legible_envs.rollouts_io.csv_files import read_csv, write_csv
    from legible_envs.rollouts_io.episodes import Episode, RecordRollouts, trajectories_from_played
    from legible_envs.rollouts_io.minari_files import to_minari
    from legible_envs.rollouts_io.reading import read_any

__all__ = ["Episode", "RecordRollouts", "read_any", "read_csv", "to_minari", "trajectories_from_played", "write_csv"]

_HOME = {
    "Episode": "episodes",
    "RecordRollouts": "episodes",
    "read_any": "reading",
    "read_csv": "csv_files",
    "to_minari": "minari_files",
    "trajectories_from_played": "episodes",
    "write_csv": "csv_files",
}


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
