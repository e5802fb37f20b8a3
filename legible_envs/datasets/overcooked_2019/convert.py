"""From the published tables, one row of text per tick, to arrays."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_2019.games import RecordedGame, RecordingsError
from legible_envs.datasets.overcooked_2019.source import Progress
from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import INGREDIENTS, OvercookedLayout

__all__ = ["convert_tables"]

Table = Mapping[str, npt.NDArray[Any]]

_COLUMNS: Final = (
    "state", "next_state", "joint_action", "layout", "layout_name", "run", "workerid_num",
    "time_elapsed", "reward_norm", "cur_gameloop",
)  # fmt: skip
# Recorded directions are (dx, dy) with y down: north is (0, -1).
_FACING: Final = {(0, -1): 0, (0, 1): 1, (1, 0): 2, (-1, 0): 3}
_ACTIONS: Final = {**{json.dumps(list(step)): code for step, code in _FACING.items()}, "[0, 0]": 4, '"INTERACT"': 5}
_ITEMS: Final = {**{kind: code for code, kind in enumerate(INGREDIENTS, 1)}, "dish": 5, "soup": 6}
_TICK_SECONDS: Final = 0.15


def convert_tables(tables: Mapping[str, Table], progress: Progress | None = None) -> list[RecordedGame]:
    """Games of the published tables, in the order of the tables.

    Args:
        tables: ``{split: {column: (rows,) array}}``.
        progress: Told after every game.

    Raises:
        RecordingsError: Missing columns, or a row that is not a tick of the 2019 game.
    """
    spans = {split: _games_of(table) for split, table in tables.items()}
    total, games = sum(map(len, spans.values())), []
    for split, table in tables.items():
        for first, last in spans[split]:
            games.append(_convert_game(split, table, slice(first, last)))
            if progress is not None:
                progress("converting", len(games), total)
    return games


def _games_of(table: Table) -> list[tuple[int, int]]:
    """Row ranges of the games: consecutive rows of one kitchen and one pair."""
    missing = [name for name in _COLUMNS if name not in table]
    if missing:
        raise RecordingsError(f"the table lacks the columns {missing}")
    keys = list(zip(table["layout_name"], table["run"], table["workerid_num"], strict=True))
    cuts = [0, *(i for i in range(1, len(keys)) if keys[i] != keys[i - 1]), len(keys)]
    return [(a, b) for a, b in pairwise(cuts) if b > a]


def _convert_game(split: str, table: Table, rows: slice) -> RecordedGame:
    name = str(table["layout_name"][rows.start])
    pair = f"{table['run'][rows.start]}/{table['workerid_num'][rows.start]}"
    where = f"{split} game {name} of pair {pair}"
    try:
        layout = OvercookedLayout.from_overcooked_ai({"grid": _grid_rows(str(table["layout"][rows.start]))})
        texts = [*table["state"][rows], table["next_state"][rows.stop - 1]]
        if list(table["next_state"][rows][:-1]) != texts[1:-1]:
            raise RecordingsError(f"{where}: a tick does not begin where the one before ended")
        arrays = _States(layout, len(texts))
        for tick, text in enumerate(texts):
            arrays.write(tick, text)
        seconds = table["time_elapsed"][rows].astype(np.float64)
        return RecordedGame(
            layout_name=name,
            layout=layout,
            pair=pair,
            split=split,
            cells=arrays.cells,
            facing=arrays.facing,
            held=arrays.held,
            counters=arrays.counters,
            pots=arrays.pots,
            actions=np.array([_joint_action(text) for text in table["joint_action"][rows]], dtype=np.int8),
            rewards=table["reward_norm"][rows].astype(np.float32),
            seconds=np.append(seconds, seconds[-1] + _TICK_SECONDS).astype(np.float32),
        )
    except (KeyError, IndexError, ValueError, TypeError, LayoutError) as error:
        raise RecordingsError(f"{where} is not a game of 2019: {type(error).__name__}: {error}") from error


def _grid_rows(text: str) -> Sequence[str]:
    rows: list[str] = _plain(text)
    return rows


def _plain(text: str) -> Any:
    """A Python literal of numbers, strings, lists and dicts, read as JSON: eight times as fast as ``ast``."""
    return json.loads(text.replace("'", '"').replace("False", "false").replace("True", "true"))


def _joint_action(text: str) -> tuple[int, ...]:
    return tuple(_ACTIONS[json.dumps(action)] for action in _plain(text))


class _States:
    """Arrays of a game's states, filled row by row; names and shapes as in :class:`RecordedGame`."""

    def __init__(self, layout: OvercookedLayout, count: int) -> None:
        pots = [layout.stations[name] for name in layout.named("pot")]
        self._pot_at = {cell: number for number, cell in enumerate(pots)}
        self.cells = np.zeros((count, 2, 2), dtype=np.int16)
        self.facing = np.zeros((count, 2), dtype=np.int8)
        self.held = np.zeros((count, 2), dtype=np.int8)
        self.counters = np.zeros((count, *layout.shape), dtype=np.int8)
        self.pots = np.zeros((count, len(pots), 5), dtype=np.int16)

    def write(self, tick: int, text: str) -> None:
        state = _plain(text)
        for number, player in enumerate(state["players"]):
            column, row = player["position"]
            self.cells[tick, number] = row, column
            self.facing[tick, number] = _FACING[tuple(player["orientation"])]
            item = player.get("held_object")
            self.held[tick, number] = _ITEMS[item["name"]] if item else 0
        for item in state["objects"].values():
            column, row = item["position"]
            pot = self._pot_at.get((row, column))
            if pot is None:
                self.counters[tick, row, column] = _ITEMS[item["name"]]
            else:
                kind, amount, ticks = item["state"]
                self.pots[tick, pot, INGREDIENTS.index(kind)] = amount
                self.pots[tick, pot, 4] = ticks
