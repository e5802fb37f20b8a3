"""Recorded games as immutable arrays, and the file they are kept in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import OvercookedLayout
from legible_envs.support.files import open_npz, write_npz

if TYPE_CHECKING:
    from legible_envs.overcooked.game.replay import GameArrays

__all__ = ["RecordedGame", "RecordingsError", "read_games", "write_games"]

SCHEMA: Final = 1
_KIND: Final = "legible-envs recorded games"
_PER_STATE: Final = ("cells", "facing", "held", "counters", "pots", "seconds")
_PER_TICK: Final = ("actions", "rewards")


class RecordingsError(RuntimeError):
    """The recorded games cannot be found, downloaded, trusted or read."""


@dataclass(frozen=True, eq=False)
class RecordedGame:
    """One recorded two-player game of ``T`` ticks: ``T + 1`` states and the ``T`` joint actions between them.

    All arrays are read-only. How long a soup cooked before it was taken out is not kept: nothing depends on it.

    Attributes:
        layout_name: Name of the kitchen in the recordings, such as ``"cramped_room"``.
        layout: The kitchen, with ``K`` pots in reading order.
        pair: Who played: the session and the pair's number in it, ``"run-1/2"``.
        split: ``"train"`` or ``"test"``, as published.
        cells: ``(T+1, 2, 2)`` row and column of each player.
        facing: ``(T+1, 2)`` 0 N, 1 S, 2 E, 3 W.
        held: ``(T+1, 2)`` 0 nothing, 1 tomato, 2 onion, 3 cabbage, 4 fish, 5 dish, 6 soup.
        counters: ``(T+1, H, W)`` item on each counter, coded like ``held``.
        pots: ``(T+1, K, 5)`` number of tomatoes, onions, cabbages, fish; ticks cooked.
        actions: ``(T, 2)`` 0 N, 1 S, 2 E, 3 W, 4 STAY, 5 INTERACT.
        rewards: ``(T,)`` 20 per delivery.
        seconds: ``(T+1,)`` time since the game began.
    """

    layout_name: str
    layout: OvercookedLayout
    pair: str
    split: str
    cells: npt.NDArray[np.int16]
    facing: npt.NDArray[np.int8]
    held: npt.NDArray[np.int8]
    counters: npt.NDArray[np.int8]
    pots: npt.NDArray[np.int16]
    actions: npt.NDArray[np.int8]
    rewards: npt.NDArray[np.float32]
    seconds: npt.NDArray[np.float32]

    def __post_init__(self) -> None:
        ticks = len(self.actions)
        for name in _PER_STATE + _PER_TICK:
            array = getattr(self, name)
            expected = ticks + (name in _PER_STATE)
            if len(array) != expected:
                raise ValueError(f"`{name}` has {len(array)} rows; {ticks} ticks need {expected}")
            array = array.view()
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def num_ticks(self) -> int:
        """Number of ticks (transitions)."""
        return len(self.actions)

    @property
    def num_players(self) -> int:
        """Number of players."""
        return int(self.held.shape[1])

    def participant(self, player: int) -> str:
        """Name of a player: the pair and the player's place in it, ``"run-1/2/0"``."""
        return f"{self.pair}/{player}"

    def states(self) -> GameArrays:
        """All ``T + 1`` states in the form that :func:`.predict_transitions` takes."""
        from legible_envs.overcooked.game.replay import GameArrays

        return GameArrays(self.cells, self.facing, self.held, self.counters, self.pots)


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
        for field in _PER_STATE + _PER_TICK:
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
    arrays = {field: file[f"{name}/{field}"] for field in _PER_STATE + _PER_TICK}
    pairs, splits = file[f"{name}/pair"], file[f"{name}/split"]
    found, tick, state = [], 0, 0
    for number, (order, ticks) in enumerate(zip(file[f"{name}/order"], file[f"{name}/ticks"], strict=True)):
        parts = {field: arrays[field][state : state + ticks + 1] for field in _PER_STATE}
        parts |= {field: arrays[field][tick : tick + ticks] for field in _PER_TICK}
        game = RecordedGame(
            layout_name=name, layout=layout, pair=str(pairs[number]), split=str(splits[number]), **parts
        )
        found.append((int(order), game))
        tick, state = tick + int(ticks), state + int(ticks) + 1
    return found
