"""The file in which the recorded games of 2019 are kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from legible_envs.datasets.overcooked_ai.games import PER_STATE, PER_TICK, RecordedGame, RecordingsError
from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.support.files import open_npz, write_npz

__all__ = ["read_games", "write_games"]

SCHEMA: Final = 1
_KIND: Final = "legible-envs recorded games"


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
        with open_npz(path) as file:
            if "kind" not in file or str(file["kind"]) != _KIND:
                raise RecordingsError(f"{path} does not hold recorded games")
            if int(file["schema"]) != SCHEMA:
                raise RecordingsError(f"{path} has schema {int(file['schema'])}; this version reads {SCHEMA}")
            known = [str(name) for name in file["layouts"]]
            wanted = known if layouts is None else list(layouts)
            if unknown := [name for name in wanted if name not in known]:
                raise RecordingsError(f"no recordings of {unknown}; there are {known}")
            found = [entry for name in wanted for entry in _read_kitchen(file, name)]
    except (OSError, KeyError, ValueError, TypeError, LayoutError) as error:
        raise RecordingsError(f"{path} is damaged: {type(error).__name__}: {error}") from error
    return [game for _, game in sorted(found, key=lambda entry: entry[0])]


def _read_kitchen(file: Mapping[str, Any], name: str) -> list[tuple[int, RecordedGame]]:
    layout = OvercookedLayout.from_ascii(str(file[f"{name}/layout"]))
    arrays = {field: file[f"{name}/{field}"] for field in PER_STATE + PER_TICK}
    pairs, splits = file[f"{name}/pair"], file[f"{name}/split"]
    found, tick, state = [], 0, 0
    for number, (order, ticks) in enumerate(zip(file[f"{name}/order"], file[f"{name}/ticks"], strict=True)):
        parts = {field: arrays[field][state : state + ticks + 1] for field in PER_STATE}
        parts |= {field: arrays[field][tick : tick + ticks] for field in PER_TICK}
        game = RecordedGame(
            layout_name=name, layout=layout, pair=str(pairs[number]), split=str(splits[number]), **parts
        )
        found.append((int(order), game))
        tick, state = tick + int(ticks), state + int(ticks) + 1
    return found
