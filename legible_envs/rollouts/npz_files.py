"""The file format of trajectories: one ``.npz`` of plain arrays, readable without this package.

=============  ========================================================================================================
``kind``       ``"legible-envs trajectories"``
``schema``     version of the format, an integer
``states``     ``(N, d)`` all states end to end, integers (cells) or floats (positions)
``times``      ``(N,)`` their times
``offsets``    ``(n+1,)`` trajectory ``i`` is rows ``offsets[i]:offsets[i+1]``
``records``    JSON as ASCII bytes (uint8): ``layouts`` (``kind`` and ``text`` each: ``"overcooked"`` and its drawing
               or, since schema 3, ``"tabletop"`` and its JSON) and, per trajectory, ``trajectories`` (``start goal
               candidates participant condition layout layout_name candidate_set complete``, ``layout`` being a number
               in ``layouts`` or null; since schema 2 also ``goal_positions``, where they are known)
=============  ========================================================================================================
"""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np

from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.rollouts.trajectory import Trajectory
from legible_envs.support.files import write_npz
from legible_envs.tabletop.layout import TabletopLayout

__all__ = ["SCHEMA", "read", "write"]

SCHEMA: Final = 3
_KIND: Final = "legible-envs trajectories"
_TEXTS: Final = ("start", "goal", "candidates", "participant", "condition", "layout_name", "candidate_set", "complete")
_LAYOUT_READERS: Final[dict[str, Callable[[str], Any]]] = {
    "overcooked": OvercookedLayout.from_ascii,
    "tabletop": TabletopLayout.from_json,
}


def write(path: str | os.PathLike[str], trajectories: Iterable[Trajectory]) -> Path:
    """See :func:`legible_envs.rollouts.save_trajectories`."""
    walks = list(trajectories)
    # Empty prefixes have no positions that could be of another kind.
    kinds = {(walk.states.shape[1], walk.states.dtype) for walk in walks if walk.num_states} or {(2, np.dtype("int64"))}
    if len(kinds) > 1:
        found = sorted(f"{dim}-dimensional {dtype}" for dim, dtype in kinds)
        raise ValueError(f"one file holds trajectories of one kind; these are {found}")
    dimension, dtype = kinds.pop()
    layouts: dict[Any, int] = {}
    records = []
    for walk in walks:
        record = {name: getattr(walk, name) for name in _TEXTS}
        record["layout"] = None if walk.layout is None else layouts.setdefault(walk.layout, len(layouts))
        if walk.goal_positions is not None:
            record["goal_positions"] = walk.goal_positions
        records.append(record)
    content = {
        "layouts": [_described(layout) for layout in layouts],
        "trajectories": records,
    }
    states = [np.zeros((0, dimension), dtype=dtype), *(walk.states for walk in walks if walk.num_states)]
    write_npz(
        path,
        {
            "kind": _KIND,
            "schema": _least_schema(layouts, records),
            "states": np.concatenate(states),
            "times": np.concatenate([np.zeros(0), *(walk.times for walk in walks)]),
            "offsets": np.cumsum([0, *(walk.num_states for walk in walks)], dtype=np.int64),
            "records": np.frombuffer(json.dumps(content).encode("ascii"), dtype=np.uint8),
        },
    )
    return Path(path)


def _described(layout: OvercookedLayout | TabletopLayout) -> dict[str, str]:
    if isinstance(layout, TabletopLayout):
        return {"kind": "tabletop", "text": layout.to_json()}
    return {"kind": "overcooked", "text": layout.to_ascii()}


def _least_schema(layouts: Iterable[Any], records: Iterable[dict[str, Any]]) -> int:
    """Files that use nothing new stay readable by older versions."""
    if any(isinstance(layout, TabletopLayout) for layout in layouts):
        return 3
    return 2 if any("goal_positions" in record for record in records) else 1


def read(path: str | os.PathLike[str]) -> list[Trajectory]:
    """See :func:`legible_envs.rollouts.load_trajectories`."""
    name = os.fspath(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            if not isinstance(file, np.lib.npyio.NpzFile) or "kind" not in file or str(file["kind"]) != _KIND:
                raise ValueError("it is not a file of trajectories")
            if int(file["schema"]) > SCHEMA:
                raise ValueError(f"it has schema {int(file['schema'])}; this version reads up to {SCHEMA}")
            arrays = {key: file[key] for key in ("states", "times", "offsets", "records")}
        return _rebuild(**arrays)
    except FileNotFoundError:
        raise
    except (OSError, EOFError, KeyError, ValueError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise ValueError(f"cannot read trajectories from {name}: {error}") from error


def _rebuild(states: Any, times: Any, offsets: Any, records: Any) -> list[Trajectory]:
    content = json.loads(records.tobytes().decode("ascii"))
    unknown = sorted({str(entry["kind"]) for entry in content["layouts"]} - _LAYOUT_READERS.keys())
    if unknown:
        raise ValueError(f"it has layouts of the kinds {unknown}; this version reads {list(_LAYOUT_READERS)}")
    layouts = [_LAYOUT_READERS[entry["kind"]](entry["text"]) for entry in content["layouts"]]
    found = content["trajectories"]
    if len(offsets) != len(found) + 1 or offsets[0] != 0 or offsets[-1] != len(states) or (np.diff(offsets) < 0).any():
        raise ValueError("its offsets do not fit its states")
    walks = []
    for record, begin, end in zip(found, offsets, offsets[1:], strict=False):
        number = record.pop("layout")
        record["candidates"] = tuple(record["candidates"])
        layout = None if number is None else layouts[number]
        walks.append(Trajectory(states=states[begin:end], times=times[begin:end], layout=layout, **record))
    return walks
