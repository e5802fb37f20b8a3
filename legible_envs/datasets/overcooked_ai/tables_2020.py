"""From tables in the form that Overcooked-AI has published since 2020, one row per tick, to games.

Columns: ``state`` and ``joint_action`` (JSON), ``reward``, ``time_elapsed``, ``cur_gameloop``, ``layout`` (the grid as
JSON), ``layout_name``, ``trial_id``, ``player_0_id``, ``player_1_id``, and, where not all players are persons,
``player_0_is_human``, ``player_1_is_human``. The recordings of 2019 are published in this form too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_ai.games import TICK_SECONDS, RecordedGame, RecordingsError, Rules
from legible_envs.datasets.overcooked_ai.states import StateArrays, read_action, read_literal
from legible_envs.errors import LayoutError
from legible_envs.overcooked.layout import OvercookedLayout

__all__ = ["COLUMNS", "convert_table", "game_of_states", "kitchen_of"]

COLUMNS: Final = (
    "state", "joint_action", "reward", "time_elapsed", "cur_gameloop", "layout", "layout_name", "trial_id",
    "player_0_id", "player_1_id",
)  # fmt: skip
Where = Callable[[int], str]
_HUMANS: Final = ("player_0_is_human", "player_1_is_human")
_FLAGS: Final = {"True": True, "False": False, "true": True, "false": False, "1": True, "0": False}


def convert_table(
    table: Mapping[str, Sequence[Any] | npt.NDArray[Any]], where: Where = "row {}".format
) -> list[RecordedGame]:
    """The games of a table, in the order in which they begin.

    A row says a state and what was done in it, so the last row of a game is its last state and its action is lost. A
    game whose rows leave out ticks is cut there into several.

    Args:
        table: ``{column: (rows,) values}``; numbers may be text.
        where: What messages call a row, given its number.

    Raises:
        RecordingsError: Missing columns, or a row that is no tick of the game, with its place.
    """
    if missing := [name for name in COLUMNS if name not in table]:
        raise RecordingsError(f"the table lacks the columns {missing}")
    trials: dict[str, list[int]] = {}
    for row, trial in enumerate(table["trial_id"]):
        trials.setdefault(str(trial), []).append(row)
    games = []
    for trial, rows in trials.items():
        loops = [_number(table, "cur_gameloop", row, where) for row in rows]
        cuts = [0, *(i for i in range(1, len(rows)) if loops[i] != loops[i - 1] + 1), len(rows)]
        parts = [rows[a:b] for a, b in pairwise(cuts)]
        start = table["state"][rows[0]] if loops[0] <= 1 else None
        games += [_game(table, trial, part, start, where) for part in parts if len(part) > 1]
    return games


def _game(table: Mapping[str, Any], trial: str, rows: list[int], start: Any, where: Where) -> RecordedGame:
    first, name = rows[0], str(table["layout_name"][rows[0]])
    for column in ("layout_name", "layout", "player_0_id", "player_1_id"):
        for row in rows:
            if table[column][row] != table[column][first]:
                raise RecordingsError(f"{where(row)}: {column!r} changes within trial {trial}")
    rewards = [_number(table, "reward", row, where) for row in rows]
    seconds = [_number(table, "time_elapsed", row, where) for row in rows]
    for before, after, row in zip(seconds, seconds[1:], rows[1:], strict=False):
        if after < before:
            raise RecordingsError(f"{where(row)}: 'time_elapsed' goes back from {before:g} to {after:g}")
    return game_of_states(
        name,
        table["layout"][first],
        [(where(row), table["state"][row]) for row in rows],
        [(where(row), table["joint_action"][row]) for row in rows[:-1]],
        rewards[:-1],
        seconds,
        start,
        pair=trial,
        participants=tuple(str(table[f"player_{player}_id"][first]) for player in range(2)),
        humans=tuple(_flag(table[column][first], first, where) for column in _HUMANS if column in table),
    )


def game_of_states(
    name: str,
    grid: Any,
    states: Sequence[tuple[str, Any]],
    actions: Sequence[tuple[str, Any]],
    rewards: Sequence[float],
    seconds: Sequence[float] | None,
    start: Any,
    cook_time: int = -1,
    **about: Any,
) -> RecordedGame:
    """A game from its states and joint actions, each with its place in the file, as JSON text or read already.

    Args:
        name: Of the kitchen.
        grid: Its rows, as text or lists.
        states: ``T + 1``.
        actions: ``T``.
        rewards: ``T``.
        seconds: ``T + 1``; None: a tick takes 0.15 s.
        start: The state in which the players stand where the kitchen has them start; None where it is not known.
        cook_time: Of soups whose state does not say; -1: not known.
        **about: Of :class:`.RecordedGame`: ``pair``, ``participants``, ``humans``.

    Raises:
        RecordingsError: Something that is no state or action of the game, with its place.
    """
    place = states[0][0]
    try:
        first = _value(states[0][1])
        layout = kitchen_of(grid, () if start is None else [player["position"] for player in _value(start)["players"]])
        arrays = StateArrays(layout, len(states), len(first["players"]))
        joint = np.empty((len(actions), len(first["players"])), dtype=np.int8)
        for tick, (where, state) in enumerate(states):
            place = where
            arrays.write(tick, _value(state))
        for tick, (where, action) in enumerate(actions):
            place, both = where, _value(action)
            if not isinstance(both, list | tuple) or len(both) != joint.shape[1]:
                raise ValueError(f"expected a list of {joint.shape[1]} actions, got {str(action)[:60]!r}")
            joint[tick] = [read_action(each) for each in both]
    except (KeyError, IndexError, ValueError, TypeError, AttributeError, LayoutError, RecursionError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else error
        raise RecordingsError(f"{place}: no tick of Overcooked-AI: {what}") from error
    times = TICK_SECONDS * np.arange(len(states)) if seconds is None else np.asarray(seconds)
    return RecordedGame(
        layout_name=name,
        layout=layout,
        split="",
        cells=arrays.cells,
        facing=arrays.facing,
        held=arrays.held,
        counters=arrays.counters,
        pots=arrays.pots,
        actions=joint,
        rewards=np.asarray(rewards, dtype=np.float32),
        seconds=times.astype(np.float32),
        rules=_rules(first),
        cook_times=np.where(arrays.cook_times < 0, np.int16(cook_time), arrays.cook_times),
        **about,
    )


def kitchen_of(grid: Any, starts: Sequence[Any] = ()) -> OvercookedLayout:
    """The kitchen of a grid of Overcooked-AI.

    Args:
        grid: Its rows, as text or lists of cells.
        starts: Where each player starts, ``[x, y]``; none: as the grid says, if it does.

    Raises:
        LayoutError: No such grid.
    """
    rows = read_literal(grid) if isinstance(grid, str) and grid.lstrip().startswith("[") else grid
    drawing = [list("".join(map(str, row))) for row in (rows.split("\n") if isinstance(rows, str) else rows)]
    if starts:
        drawing = [[" " if cell.isdigit() else cell for cell in row] for row in drawing]
    for number, (column, row) in enumerate(starts, 1):
        if drawing[row][column] == " ":
            drawing[row][column] = str(number)
    return OvercookedLayout.from_rows(["".join(row) for row in drawing])


def _rules(state: Mapping[str, Any]) -> Rules:
    return "overcooked-ai-2020" if "all_orders" in state else "overcooked-ai-2019"


def _value(text: Any) -> Any:
    return read_literal(text) if isinstance(text, str) else text


def _number(table: Mapping[str, Any], column: str, row: int, where: Where) -> float:
    found = table[column][row]
    try:
        number = float(found)
        if math.isfinite(number) and "_" not in str(found):
            return number
    except (TypeError, ValueError, OverflowError):
        pass
    raise RecordingsError(f"{where(row)}: {column!r} must be a finite number, got {str(found)[:60]!r}")


def _flag(value: Any, row: int, where: Where) -> bool:
    if str(value) in _FLAGS:
        return _FLAGS[str(value)]
    raise RecordingsError(f"{where(row)}: whether a player is human must be True or False, got {str(value)[:60]!r}")
