"""Trajectories from whatever holds some: the door that every user and the command line come through.

A source is a file, a Minari data set's folder, or the data set's id. Files are told apart by what is in them; their
names only help to say what is wrong. Formats beside ``.npz``, CSV and Minari are plug-ins: functions ``read(path)``
that return the trajectories of a file, or None where the file is in another format. A package adds one with a line of
``pyproject.toml``, under the entry point group ``legible.trajectories``. Two are built in: play recorded with ``legible
play --record``, and recordings of Overcooked-AI.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.file_kinds import describe_file
from legible_envs.support.plugins import Registry
from legible_envs.support.text import decode_text

__all__ = ["TrajectoryFormat", "load_trajectories", "register_trajectory_format"]

TrajectoryFormat = Callable[[Path], list[Trajectory] | None]

_CSV_SUFFIXES: Final = (".csv", ".tsv")
_EXPECTED: Final = (
    "expected an .npz of `save_trajectories`, a CSV with the columns 'trajectory', 'goal' and row, col or x, y, "
    "play recorded by `legible play --record`, an Overcooked-AI recording (.json, .csv, .pickle), or the folder or id "
    "of a Minari data set"
)

_registry: Final = Registry(
    "trajectory format",
    "legible.trajectories",
    {
        "recorded play": "legible_envs.overcooked.human_play:read_played",
        "overcooked-ai": "legible_envs.datasets.overcooked_ai:read_trajectories",
    },
    ValueError,
)


def register_trajectory_format(name: str, read: TrajectoryFormat, *, overwrite: bool = False) -> None:
    """Let :func:`load_trajectories` read another format, for the rest of this process.

    Args:
        name: Of the format.
        read: Called with a path; returns the trajectories in the file, or None where it has another format.
        overwrite: Whether it may replace an earlier registration of that name.

    Raises:
        ValueError: The name is taken, or ``read`` cannot be called.
    """
    _registry.register(name, read, overwrite=overwrite)


def load_trajectories(source: str | os.PathLike[str], *, layout: Any = None) -> list[Trajectory]:
    """Read the trajectories of a file, or of a Minari data set.

    Args:
        source: An ``.npz`` of :func:`~legible_envs.rollouts.save_trajectories`; a CSV
            (:mod:`~legible_envs.rollouts.csv_files`); recorded play; an Overcooked-AI recording; or a Minari data set,
            by its folder or its id (:func:`~legible_envs.rollouts.from_minari`).
        layout: The layout of CSV trajectories that name none.

    Returns:
        The trajectories in their order; those saved by this package equal the ones that were written.

    Raises:
        FileNotFoundError: There is no such file, folder or data set.
        OSError: The file cannot be read.
        ValueError: It holds no trajectories, or damaged ones: what it looks like, what was expected, and where.
    """
    path = Path(source)
    if not path.exists():
        return _by_id(source)
    if path.is_dir():
        return _of_folder(path)
    from legible_envs.rollouts.csv_files import is_csv_of_trajectories, read_csv
    from legible_envs.rollouts.npz_files import is_npz_of_trajectories, read_npz

    if is_npz_of_trajectories(path):
        return read_npz(path)
    if is_csv_of_trajectories(_beginning(path)):
        return read_csv(path, layout=layout)
    for name in _registry.list():
        found = _registry.resolve(name)(path)
        if found is not None:
            return list(found)
    if path.suffix.lower() in _CSV_SUFFIXES:
        return read_csv(path, layout=layout)  # says what is wrong with it
    raise ValueError(f"cannot read trajectories from {path}: it looks like {describe_file(path)}; {_EXPECTED}")


def _beginning(path: Path) -> str:
    """The first lines of a text; empty where it is none."""
    with path.open("rb") as file:
        head = file.read(100_000)
    try:
        return decode_text(head[: head.rfind(b"\n") + 1] or head, unify=False)
    except ValueError:
        return ""


def _by_id(source: str | os.PathLike[str]) -> list[Trajectory]:
    from legible_envs.rollouts.minari_files import find_dataset, from_minari

    name = os.fspath(source)
    dataset = find_dataset(name) if isinstance(source, str) else None
    if dataset is None:
        raise FileNotFoundError(f"there is no file {name}, and no Minari data set of this id here")
    return from_minari(dataset)


def _of_folder(path: Path) -> list[Trajectory]:
    from legible_envs.rollouts.minari_files import from_minari, is_minari_folder

    if not is_minari_folder(path):
        raise ValueError(f"cannot read trajectories from {path}: it is a folder, but no Minari data set; {_EXPECTED}")
    return from_minari(path)
