"""The file format of trajectories: one ``.npz`` of plain arrays, readable without this package.

=============  ========================================================================================================
``kind``       ``"legible-envs trajectories"``
``schema``     version of the format, an integer
``states``     ``(N, d)`` all states end to end, integers (cells) or floats (positions)
``times``      ``(N,)`` their times
``offsets``    ``(n+1,)`` trajectory ``i`` is rows ``offsets[i]:offsets[i+1]``
``records``    JSON as ASCII bytes (uint8): ``layouts`` (``kind`` and ``text`` each, as the kind writes it) and, per
               trajectory, ``trajectories`` (``start goal candidates participant condition layout layout_name
               candidate_set complete``, ``layout`` being a number in ``layouts`` or null; since schema 2 also
               ``goal_positions``, where they are known)
=============  ========================================================================================================

Schema 1 holds drawings of kitchens alone; schema 3 holds layouts of any kind (:mod:`legible_envs.layout_kinds`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from legible_envs.layout_kinds import LayoutKind, kind_named, kind_of
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.file_kinds import describe_file
from legible_envs.support.files import open_npz, write_npz
from legible_envs.support.stored_arrays import says, stored_array, stored_json, stored_whole

if TYPE_CHECKING:
    from legible_envs.rollouts.records import TrajectoryRecord

__all__ = ["SCHEMA", "is_npz_of_trajectories", "read_npz", "save_trajectories"]

SCHEMA: Final = 3
_KIND: Final = "legible-envs trajectories"
_MOST_BYTES: Final = 2**29
_MOST_CHARACTERS: Final = 32_000_000
_TEXTS: Final = ("start", "goal", "candidates", "participant", "condition", "layout_name", "candidate_set", "complete")


def save_trajectories(path: str | os.PathLike[str], trajectories: Iterable[Trajectory]) -> Path:
    """Write trajectories to one ``.npz``, all or nothing; no pickles.

    Returns:
        The path written.

    Raises:
        ValueError: Cells and positions, or different dimensions, in one file; a layout of no registered kind; more
            than 512 MiB of arrays or 32 million characters of records.
        OSError: The file cannot be written; an earlier file is untouched.
    """
    trajectories = list(trajectories)
    # Empty prefixes have no positions that could be of another kind.
    forms = {(each.states.shape[1], each.states.dtype) for each in trajectories if each.num_states}
    if len(forms) > 1:
        found = sorted(f"{dim}-dimensional {dtype}" for dim, dtype in forms)
        raise ValueError(f"one file holds trajectories of one kind; these are {found}")
    dimension, dtype = forms.pop() if forms else (2, np.dtype("int64"))
    layouts: dict[Any, int] = {}
    records = []
    for trajectory in trajectories:
        record = {name: getattr(trajectory, name) for name in _TEXTS}
        record["layout"] = None
        if trajectory.layout is not None:
            record["layout"] = layouts.setdefault(trajectory.layout, len(layouts))
        if trajectory.goal_positions is not None:
            record["goal_positions"] = trajectory.goal_positions
        records.append(record)
    kinds = [kind_of(layout) for layout in layouts]
    content = {
        "layouts": [
            {"kind": kind.name, "text": kind.to_text(layout)} for kind, layout in zip(kinds, layouts, strict=True)
        ],
        "trajectories": records,
    }
    states = [np.zeros((0, dimension), dtype=dtype), *(each.states for each in trajectories if each.num_states)]
    arrays: dict[str, Any] = {
        "kind": _KIND,
        "schema": _least_schema(kinds, records),
        "states": np.concatenate(states),
        "times": np.concatenate([np.zeros(0), *(each.times for each in trajectories)]),
        "offsets": np.cumsum([0, *(each.num_states for each in trajectories)], dtype=np.int64),
        "records": np.frombuffer(json.dumps(content).encode("ascii"), dtype=np.uint8),
    }
    if len(arrays["records"]) > _MOST_CHARACTERS or sum(np.asarray(a).nbytes for a in arrays.values()) > _MOST_BYTES:
        raise ValueError(f"{len(trajectories):,} trajectories are too much for one file that is read; write several")
    write_npz(path, arrays)
    return Path(path)


def _least_schema(kinds: Iterable[LayoutKind], records: Iterable[dict[str, Any]]) -> int:
    """Files that use nothing new stay readable by older versions."""
    positions = 2 if any("goal_positions" in record for record in records) else 1
    return max([positions, *(kind.schema for kind in kinds)])


def read_npz(path: str | os.PathLike[str]) -> list[Trajectory]:
    """Read trajectories back, equal to those saved and in their order.

    Raises:
        OSError: The file cannot be read.
        ValueError: Not a file of trajectories, damaged, of a newer schema, or with layouts of a kind that is not known.
    """
    try:
        with open_npz(path, most_bytes=_MOST_BYTES) as file:
            if not _is_ours(file):
                raise ValueError(f"it looks like {describe_file(path)}")
            schema = stored_whole(file, "schema", 1)
            if schema > SCHEMA:
                raise ValueError(f"it has schema {schema}; this version reads up to {SCHEMA}")
            return _rebuild(file)
    except ValueError as error:
        raise ValueError(f"cannot read trajectories from {os.fspath(path)}: {error}") from error


def is_npz_of_trajectories(path: str | os.PathLike[str]) -> bool:
    """Whether a file says that it holds trajectories; it may be damaged all the same."""
    try:
        with open_npz(path) as file:
            return _is_ours(file)
    except ValueError:
        return False


def _is_ours(file: Mapping[str, Any]) -> bool:
    return says(file, "kind", _KIND)


def _rebuild(file: Mapping[str, Any]) -> list[Trajectory]:
    from legible_envs.rollouts.records import Records
    from legible_envs.support.models import validated

    content = validated(Records, stored_json(file, "records", most=_MOST_CHARACTERS), "`records`")
    states = stored_array(file, "states", "iuf", (None, None))
    times = stored_array(file, "times", "iuf", (len(states),), finite=True)
    offsets = stored_array(file, "offsets", "iu", (len(content.trajectories) + 1,))
    if offsets[0] != 0 or offsets[-1] != len(states) or (offsets[1:] < offsets[:-1]).any():
        raise ValueError(f"`offsets` must rise from 0 to the number of states, {len(states)}")
    layouts = [_layout(number, each.kind, each.text) for number, each in enumerate(content.layouts)]
    return [
        _trajectory(number, record, layouts, states[begin:end], times[begin:end])
        for number, (record, (begin, end)) in enumerate(
            zip(content.trajectories, pairwise(offsets.tolist()), strict=True)
        )
    ]


def _layout(number: int, kind: str, text: str) -> Any:
    try:
        return kind_named(kind).from_text(text)
    except ValueError as error:
        raise ValueError(f"layout {number}: {error}") from error


def _trajectory(number: int, record: TrajectoryRecord, layouts: Sequence[Any], states: Any, times: Any) -> Trajectory:
    if record.layout is not None and record.layout >= len(layouts):
        raise ValueError(f"trajectory {number} names layout {record.layout}; the file has {len(layouts)}, from 0 on")
    about = {name: getattr(record, name) for name in _TEXTS}
    layout = None if record.layout is None else layouts[record.layout]
    try:
        return Trajectory(states, times, layout=layout, goal_positions=record.goal_positions, **about)
    except ValueError as error:
        raise ValueError(f"trajectory {number}: {error}") from error
