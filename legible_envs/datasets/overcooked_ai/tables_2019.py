"""From tables in the form published in 2019, one row of text per tick, to games."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_ai.games import TICK_SECONDS, Progress, RecordedGame, RecordingsError
from legible_envs.datasets.overcooked_ai.states import StateArrays, read_action, read_literal
from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["convert_tables"]

Table = Mapping[str, npt.NDArray[Any]]

_COLUMNS: Final = (
    "state", "next_state", "joint_action", "layout", "layout_name", "run", "workerid_num",
    "time_elapsed", "reward_norm", "cur_gameloop",
)  # fmt: skip


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
        arrays = StateArrays(layout, len(texts))
        for tick, text in enumerate(texts):
            arrays.write(tick, read_literal(text))
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
            actions=np.array(
                [[read_action(action) for action in read_literal(text)] for text in table["joint_action"][rows]],
                dtype=np.int8,
            ),
            rewards=table["reward_norm"][rows].astype(np.float32),
            seconds=np.append(seconds, seconds[-1] + TICK_SECONDS).astype(np.float32),
        )
    except (KeyError, IndexError, ValueError, TypeError, LayoutError) as error:
        raise RecordingsError(f"{where} is not a game of 2019: {type(error).__name__}: {error}") from error


def _grid_rows(text: str) -> Sequence[str]:
    rows: list[str] = read_literal(text)
    return rows
