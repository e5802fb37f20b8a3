"""Where several players start, and whether they can cook together in a kitchen."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError
from legible_envs.overcooked.game.dynamics import usable
from legible_envs.overcooked.game.goals import missing_station
from legible_envs.overcooked.game.vectors import HEIGHT, POT_CELL, WIDTH, Kitchen, Vector
from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.grid_kernels import steps_from
from legible_envs.overcooked.layout import COUNTER, FLOOR, STATION_TYPES, OvercookedLayout

__all__ = ["MAX_PLAYERS", "check_playable", "player_starts"]

MAX_PLAYERS: Final = 4


def player_starts(layout: OvercookedLayout, count: int) -> tuple[Cell, ...]:
    """Where each player starts.

    The layout's own starts come first. Every further player starts on the floor cell, of those that the first player
    can walk to, whose nearest other player is farthest away by steps; of several the first in reading order.

    Args:
        layout: The kitchen.
        count: Number of players.

    Returns:
        ``count`` cells ``(row, col)``, all different.

    Raises:
        LayoutError: There is no free floor for so many.
    """
    height, width = layout.shape
    starts = list(layout.starts[:count])
    floor = (layout.cells == FLOOR).ravel()
    steps = np.empty(height * width, dtype=np.int32)
    while len(starts) < count:
        sources = np.array([row * width + col for row, col in starts])
        # From the first player alone: nobody is put where the layout's own player cannot go.
        steps_from(sources[:1], floor, height, width, steps)
        within = steps >= 0
        steps_from(sources, floor, height, width, steps)
        steps[~within] = 0
        farthest = int(np.argmax(steps))
        if steps[farthest] <= 0:
            raise LayoutError(
                f"{count} players need as many floor cells that the first one can walk to; there are {len(starts)}",
                rule="start",
            )
        starts.append((farthest // width, farthest % width))
    return tuple(starts)


def check_playable(layout: OvercookedLayout, kitchen: Kitchen, rules: Vector, starts: tuple[Cell, ...]) -> None:
    """Refuse a kitchen in which the recipes cannot be cooked.

    One player has to reach every station that the recipes need. Several need not, as long as each station is reached by
    somebody and counters or pots that two of them reach join all of them.

    Args:
        layout: The kitchen.
        kitchen: Its vector.
        rules: The rules' vector.
        starts: Where the players start.

    Raises:
        LayoutError: A needed station is absent or out of everybody's reach, or players who depend on each other have
            nothing to hand things over on.
    """
    missing = [int(missing_station(kitchen, rules, player)) for player in range(len(starts))]
    if not all(missing):
        return  # somebody can do it alone
    cells = int(rules[HEIGHT] * rules[WIDTH])
    regions = kitchen[cells : 2 * cells][[row * layout.shape[1] + col for row, col in starts]]
    for player in range(len(starts)):
        _check_somebody_reaches(layout, kitchen, rules, regions, missing[player], starts)
    if not _are_joined(kitchen, rules, regions):
        raise LayoutError(
            "players who need each other's stations have no counter or pot in common to hand things over on",
            rule="reachable",
        )


def _check_somebody_reaches(
    layout: OvercookedLayout,
    kitchen: Kitchen,
    rules: Vector,
    regions: npt.NDArray[np.int16],
    code: int,
    starts: tuple[Cell, ...],
) -> None:
    kind = STATION_TYPES[code - 3]
    names = layout.named(kind)
    if not names:
        raise LayoutError(
            f"the kitchen has no {kind} station, which the recipes need; `recipes=` orders others", rule="station"
        )
    width = layout.shape[1]
    for name in names:
        row, col = layout.stations[name]
        if any(usable(row * width + col, region, kitchen, rules) for region in regions):
            return
    row, col = layout.stations[names[0]]
    whose = "the player's start" if len(starts) == 1 else "any player's start, the first"
    raise LayoutError(
        f"row {row}, column {col}: the {kind} station cannot be reached from {whose} at row {starts[0][0]}, "
        f"column {starts[0][1]}",
        rule="reachable",
        cell=(row, col),
    )


def _are_joined(kitchen: Kitchen, rules: Vector, regions: npt.NDArray[np.int16]) -> bool:
    """Whether the players' parts of the kitchen hang together by counters and pots."""
    groups = {int(region): {int(region)} for region in regions}
    cells = int(rules[HEIGHT] * rules[WIDTH])
    for cell in np.flatnonzero(np.isin(kitchen[:cells], (COUNTER, POT_CELL))).tolist():
        beside = [region for region in groups if usable(cell, region, kitchen, rules)]
        for region in beside[1:]:
            joined = groups[beside[0]] | groups[region]
            for member in joined:
                groups[member] = joined
    return len({frozenset(group) for group in groups.values()}) == 1
