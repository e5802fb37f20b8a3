"""Recordings in the formats of Overcooked-AI, which a user has downloaded or recorded.

    >>> games = read_recording("2020_hh_trials.csv")                                       # doctest: +SKIP
    >>> [check_replay(game).moves_replay for game in games]                                # doctest: +SKIP
    >>> trajectories = trajectories_of_games(games)                                        # doctest: +SKIP

Read are the tables of human-human and human-AI play, as CSV or as pickled pandas tables of any age, in the form of 2019
and in that of 2020; and trajectory files in JSON. Pickles are read without importing or running what they name. The
games published in 2019 need no file: :mod:`legible_envs.datasets.overcooked_2019` fetches them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_ai.games import RecordedGame, RecordingsError
from legible_envs.datasets.overcooked_ai.replay import ReplayCheck, check_replay
from legible_envs.datasets.overcooked_ai.trajectories import trajectories_of_games
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.csv_table import CsvSyntaxError, read_records
from legible_envs.support.file_kinds import describe_file
from legible_envs.support.plain_data import parse_json
from legible_envs.support.text import decode_text

__all__ = [
    "RecordedGame",
    "RecordingsError",
    "ReplayCheck",
    "check_replay",
    "read_recording",
    "read_trajectories",
    "trajectories_of_games",
]

_MOST_CHARACTERS: Final = 32_000_000
_EXPECTED: Final = (
    "expected a recording of Overcooked-AI: a table with the columns 'state', 'joint_action', 'layout', … as CSV or as "
    "a pickled pandas table, or a trajectory file in JSON with 'ep_states', 'ep_actions', …"
)


def read_recording(
    path: str | os.PathLike[str], *, layouts: Mapping[str, OvercookedLayout] | None = None
) -> list[RecordedGame]:
    """The games in a file of Overcooked-AI, whatever its name.

    Args:
        path: A table of play (CSV or a pickle) or a trajectory file (JSON).
        layouts: Kitchens by their names, for trajectory files of 2019, which name them only.

    Returns:
        The games in the order in which they begin.

    Raises:
        FileNotFoundError: No such file.
        RecordingsError: It is something else, with what it looks like, or damaged, with the place.
    """
    games = _read(Path(path), layouts or {})
    if games is None:
        raise RecordingsError(f"{os.fspath(path)} looks like {describe_file(path)}; {_EXPECTED}")
    return games


def read_trajectories(path: Path) -> list[Trajectory] | None:
    """The trajectories of the persons in a file of Overcooked-AI, or None where the file is something else.

    This is how :func:`legible_envs.rollouts.load_trajectories` reads recordings.

    Raises:
        ValueError: A damaged recording, or a game whose players do not move as the rules say.
    """
    try:
        games = _read(path, {})
    except RecordingsError as error:
        raise ValueError(str(error)) from error
    if games is None:
        return None
    for game in games:
        check = check_replay(game)
        if not check.moves_replay:
            raise ValueError(
                f"{path}: in the game {game.pair} of {game.layout_name}, {check.ticks - check.positions} of "
                f"{check.ticks} ticks do not move the players as the rules say (first: {check.first_difference}); "
                "ticks may be missing or the file edited. `read_recording` gives its games all the same"
            )
    return trajectories_of_games(games)


def _read(path: Path, layouts: Mapping[str, OvercookedLayout]) -> list[RecordedGame] | None:
    data = path.read_bytes()
    try:
        if data[:1] == b"\x80" and data[1:2] in (b"\x02", b"\x03", b"\x04", b"\x05"):
            return _of_pickle(data)
        try:
            text = decode_text(data, os.fspath(path), unify=False)
        except ValueError:
            return None
        if text.lstrip()[:1] == "{":
            return _of_json(text, layouts)
        return _of_csv(text)
    except RecordingsError as error:
        raise RecordingsError(f"{path} looks like {describe_file(path)}: {error}") from error


def _of_pickle(data: bytes) -> list[RecordedGame]:
    from legible_envs.datasets.overcooked_ai.unpickle import read_table

    return _of_table(read_table(data), "row {}".format)


def _of_table(table: Mapping[str, npt.NDArray[Any]], where: Callable[[int], str]) -> list[RecordedGame]:
    from legible_envs.datasets.overcooked_ai.tables_2019 import convert_tables
    from legible_envs.datasets.overcooked_ai.tables_2020 import convert_table

    if "next_state" in table and "trial_id" not in table:
        return convert_tables({"": table})
    return convert_table(table, where)


def _of_json(text: str, layouts: Mapping[str, OvercookedLayout]) -> list[RecordedGame] | None:
    from legible_envs.datasets.overcooked_ai.trajectory_json import convert_episodes, is_trajectory_json

    if len(text) > _MOST_CHARACTERS:
        raise RecordingsError(f"it has {len(text):,} characters; JSON of at most {_MOST_CHARACTERS:,} is read")
    try:
        content = parse_json(text, finite=False, most=_MOST_CHARACTERS)
    except ValueError:
        return None
    return convert_episodes(content, layouts) if is_trajectory_json(content) else None


def _of_csv(text: str) -> list[RecordedGame] | None:
    header = text[:10_000].lstrip().split("\n", 1)[0]
    if "joint_action" not in header or "state" not in header:
        return None
    try:
        records = list(read_records(text))
    except CsvSyntaxError as error:
        raise RecordingsError(str(error)) from error
    names, rows = records[0].values, records[1:]
    if doubled := sorted({name for name in names if name and names.count(name) > 1}):
        raise RecordingsError(f"line {records[0].line}: the columns {doubled} are there twice")
    for record in rows:
        if len(record.values) != len(names):
            raise RecordingsError(
                f"line {record.line}: the header names {len(names)} columns, this row has {len(record.values)} values"
            )
    columns = {name: np.array([record.values[at] for record in rows], dtype=object) for at, name in enumerate(names)}
    return _of_table(columns, lambda row: f"line {rows[row].line}")
