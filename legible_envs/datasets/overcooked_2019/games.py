"""The file in which the recorded games of 2019 are kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_ai.games import PER_STATE, PER_TICK, RecordedGame, RecordingsError
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.support.files import open_npz, write_npz
from legible_envs.support.stored_arrays import says, stored_array, stored_text, stored_whole

__all__ = ["read_games", "write_games"]

SCHEMA: Final = 1
_KIND: Final = "legible-envs recorded games"
_MOST_ARRAYS: Final = 4096
_MOST_TICKS: Final = 32_767
_MOST_SECONDS: Final = 10**9


def write_games(path: Path, games: Sequence[RecordedGame], extra: Mapping[str, str] | None = None) -> None:
    """Write games to one ``.npz`` without pickles, all or nothing.

    Per kitchen ``k`` the arrays of its games lie end to end under ``k/cells`` and so on; ``k/ticks`` has each game's
    number of ticks, ``k/pair`` and ``k/split`` its origin, ``k/layout`` the drawing.
    """
    arrays: dict[str, Any] = {"kind": _KIND, "schema": SCHEMA, **(extra or {})}
    names = list(dict.fromkeys(game.layout_name for game in games))
    arrays["layouts"] = np.array(names, dtype=np.str_)
    for name in names:
        here = [(number, game) for number, game in enumerate(games) if game.layout_name == name]
        arrays[f"{name}/layout"] = here[0][1].layout.to_ascii()
        arrays[f"{name}/order"] = np.array([number for number, _ in here])
        arrays[f"{name}/ticks"] = np.array([game.num_ticks for _, game in here])
        for field in ("pair", "split"):
            arrays[f"{name}/{field}"] = np.array([getattr(game, field) for _, game in here], dtype=np.str_)
        for field in PER_STATE + PER_TICK:
            arrays[f"{name}/{field}"] = np.concatenate([getattr(game, field) for _, game in here])
    write_npz(path, arrays)


def read_games(path: Path, layouts: Iterable[str] | None = None) -> list[RecordedGame]:
    """Read games back, all or those of some kitchens, in the order they were written.

    Raises:
        RecordingsError: The file is damaged, of another kind or schema, or lacks a kitchen asked for.
    """
    try:
        with open_npz(path, most_arrays=_MOST_ARRAYS) as file:
            if not says(file, "kind", _KIND):
                raise RecordingsError(f"{path} does not hold recorded games")
            schema = stored_whole(file, "schema", 1)
            if schema != SCHEMA:
                raise RecordingsError(f"{path} has schema {schema}; this version reads {SCHEMA}")
            known = [str(name) for name in stored_array(file, "layouts", "U", (None,))]
            wanted = known if layouts is None else list(layouts)
            if unknown := [name for name in wanted if name not in known]:
                raise RecordingsError(f"no recordings of {unknown}; there are {known}")
            found = [entry for name in wanted for entry in _read_kitchen(file, name)]
    except (OSError, ValueError) as error:  # a LayoutError is a ValueError
        raise RecordingsError(f"{path} is damaged: {error}") from error
    return [game for _, game in sorted(found, key=lambda entry: entry[0])]


def _read_kitchen(file: Mapping[str, Any], name: str) -> list[tuple[int, RecordedGame]]:
    """The games of a kitchen, each with its place among all.

    Raises:
        ValueError: Arrays that do not fit each other, or hold what no game has.
    """
    layout = OvercookedLayout.from_ascii(stored_text(file, f"{name}/layout"))
    orders = stored_array(file, f"{name}/order", "iu", (None,))
    counts = stored_array(file, f"{name}/ticks", "iu", orders.shape)
    if len(counts) and not 0 <= counts.min() <= counts.max() <= _MOST_TICKS:
        raise ValueError(f"`{name}/ticks` must be numbers from 0 to {_MOST_TICKS:,}")
    pairs, splits = (stored_array(file, f"{name}/{field}", "U", orders.shape) for field in ("pair", "split"))
    arrays = _arrays(file, name, layout, int(counts.sum()), len(counts))
    found, tick, state = [], 0, 0
    for number, (order, ticks) in enumerate(zip(orders.tolist(), counts.tolist(), strict=True)):
        parts: dict[str, Any] = {field: arrays[field][state : state + ticks + 1] for field in PER_STATE}
        parts |= {field: arrays[field][tick : tick + ticks] for field in PER_TICK}
        game = RecordedGame(
            layout_name=name, layout=layout, pair=str(pairs[number]), split=str(splits[number]), **parts
        )
        found.append((order, game))
        tick, state = tick + ticks, state + ticks + 1
    return found


def _arrays(
    file: Mapping[str, Any], name: str, layout: OvercookedLayout, ticks: int, games: int
) -> dict[str, npt.NDArray[Any]]:
    """The arrays of all games of a kitchen end to end; shapes and what their numbers may be as in a RecordedGame."""
    height, width = layout.shape
    pots = len(layout.named("pot"))
    states = ticks + games
    wanted: dict[str, tuple[str, tuple[int, ...], int]] = {
        "cells": ("iu", (states, 2, 2), max(height, width) - 1),
        "facing": ("iu", (states, 2), 3),
        "held": ("iu", (states, 2), 6),
        "counters": ("iu", (states, height, width), 6),
        "pots": ("iu", (states, pots, 5), _MOST_TICKS),
        "seconds": ("f", (states,), _MOST_SECONDS),
        "actions": ("iu", (ticks, 2), 5),
        "rewards": ("f", (ticks,), _MOST_SECONDS),
    }
    arrays = {}
    for field, (kinds, shape, most) in wanted.items():
        array = stored_array(file, f"{name}/{field}", kinds, shape, finite=True)
        least = -most if kinds == "f" else 0
        if array.size and not least <= float(array.min()) <= float(array.max()) <= most:
            raise ValueError(f"`{name}/{field}` must be numbers from {least} to {most}")
        arrays[field] = array
    cells = arrays["cells"].reshape(-1, 2)
    if len(cells) and (cells.max(axis=0) >= layout.shape).any():
        raise ValueError(f"`{name}/cells` must be cells of the kitchen, {height} x {width}")
    return arrays
