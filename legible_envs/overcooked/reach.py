"""What one person can get to in a kitchen: scores and goals are those of a person.

Kitchens may be divided. Each player of ``asymmetric_advantages`` has a half with stations of their own, and in other
kitchens one of several stations of a type is walled in. A station out of a person's reach is no goal of theirs: scores,
simulated participants, recorded trajectories and predictors all leave it out, by this rule, and so the score is that of
the same kitchen with a counter in place of each station out of reach (:attr:`Reach.kitchen`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np
import numpy.typing as npt

from legible_envs.errors import LayoutError, TaskError
from legible_envs.overcooked.grid import Cell
from legible_envs.overcooked.layout import COUNTER, OvercookedLayout
from legible_envs.subtasks import HUMAN
from legible_envs.support.validation import integer, shown
from legible_envs.tasks import TaskGraph

__all__ = ["Reach", "reach_from", "reach_of"]


@dataclass(frozen=True, eq=False)
class Reach:
    """What one person can get to in a kitchen; made by :func:`reach_of` and :func:`reach_from`.

    A person walks on the floor that is connected with the cell where they start. A station is in reach if one of the
    cells that it is used from is part of this floor. Names are those of the whole kitchen: ``onion@(1,0)`` keeps its
    name where the other onion station is out of reach, so that goals are called alike everywhere.

    Attributes:
        layout: The kitchen.
        start: ``(row, col)`` where the person starts.
        player: Number of the player who starts there, from 1; None where the person is not known as a player.
        floor: ``(H, W)`` read-only, the cells where the person can stand.
        stations: Names of the stations in reach, in reading order.
        out_of_reach: Names of all others, in reading order.
    """

    layout: OvercookedLayout
    start: Cell
    player: int | None
    floor: npt.NDArray[np.bool_]
    stations: tuple[str, ...]
    out_of_reach: tuple[str, ...]

    @cached_property
    def region(self) -> Cell | None:
        """First floor cell in reach, in reading order: the same for all who can get to each other; None without any."""
        cells = np.argwhere(self.floor)
        return (int(cells[0, 0]), int(cells[0, 1])) if len(cells) else None

    @cached_property
    def kitchen(self) -> OvercookedLayout:
        """The same kitchen with a counter in place of each station out of reach."""
        cells = [self.layout.stations[name] for name in self.out_of_reach]
        return self.layout.with_cells(dict.fromkeys(cells, COUNTER)) if cells else self.layout

    def named(self, place: str) -> tuple[str, ...]:
        """Names of the stations in reach that a task means by a place: a station's name, or a type."""
        if place in self.layout.stations:
            return (place,) if place in self.stations else ()
        return tuple(name for name in self.stations if name.partition("@")[0] == place)

    def access(self, name: str) -> tuple[Cell, ...]:
        """Cells where the person can stand to use a station; none where it is out of reach.

        Raises:
            LayoutError: The kitchen has no station of this name.
        """
        return tuple(cell for cell in self.layout.access(name) if self.floor[cell])

    def check_task(self, task: TaskGraph) -> None:
        """Check that the person can do their part of a task: some station of every type they need is in reach.

        Stations that only a robot goes to must be in the kitchen, but not in the person's reach.

        Raises:
            LayoutError: The kitchen lacks a station, or none of its type is in reach; the message names types and
                places.
            TaskError: It is no task.
        """
        if not isinstance(task, TaskGraph):
            raise TaskError(f"`task` must be a TaskGraph, got {shown(task)}")
        absent = [kind for kind in task.places if not _meant(self.layout, kind)]
        if absent:
            needed = _listed([f"{'an' if kind[0] in 'aeiou' else 'a'} {kind} station" for kind in absent])
            lacking = _listed([f"no {kind} station" for kind in absent])
            there = ", ".join(self.layout.stations) or "no station at all"
            raise LayoutError(
                f"the task needs {needed}: there is {lacking} in this kitchen, which has {there}", rule="station"
            )
        shut = {kind: _meant(self.layout, kind) for kind in task.places_of(HUMAN) if not self.named(kind)}
        if shut:
            first = next(iter(shut.values()))
            is_or_are = "is" if len(shut) == len(first) == 1 else "are"
            stations = _listed([_stations_in_words(self.layout, names) for names in shut.values()])
            raise LayoutError(
                f"the task cannot be done in this kitchen by {self._who()}: out of reach {is_or_are} {stations}"
                f"{self._who_else(task)}",
                rule="reachable",
                cell=self.layout.stations[first[0]],
            )

    def _who(self) -> str:
        where = _cell_in_words(self.start)
        return f"a person at {where}" if self.player is None else f"player {self.player}, who starts at {where}"

    def _who_else(self, task: TaskGraph) -> str:
        """Which other players can do the task alone, as the end of a sentence."""
        if self.player is None:
            return ""
        others = (reach_of(self.layout, number) for number in range(1, len(self.layout.starts) + 1))
        able = [f"player {one.player}" for one in others if all(one.named(place) for place in task.places_of(HUMAN))]
        return f"; {_listed(able)} can do it" if able else ""


def reach_of(layout: OvercookedLayout, player: int = 1) -> Reach:
    """What a player can get to from their start.

    Args:
        layout: The kitchen.
        player: Number of the player, from 1, as drawn.

    Raises:
        LayoutError: It is no kitchen, or has no start of this player.

    Example:
        >>> kitchen = OvercookedLayout.from_rows(["XOXXXOX", "X1 P 2X", "XXDXSXX"])
        >>> reach_of(kitchen).stations
        ('onion@(0,1)', 'pot', 'dish')
        >>> reach_of(kitchen, player=2).out_of_reach
        ('onion@(0,1)', 'dish')
    """
    if not isinstance(layout, OvercookedLayout):
        raise LayoutError(f"`layout` must be an OvercookedLayout, got {shown(layout)}", rule="type")
    count = len(layout.starts)
    unit = f"(the kitchen has {count} {'start' if count == 1 else 'starts'})"
    player = integer("player", player, 1, count, unit=unit, error=partial(LayoutError, rule="start"))
    return _reach(layout, layout.starts[player - 1], player)


def reach_from(layout: OvercookedLayout, cell: Sequence[int]) -> Reach:
    """What a person can get to who stands on a floor cell; nothing from any other cell."""
    return _reach(layout, (int(cell[0]), int(cell[1])), None)


@lru_cache(maxsize=1024)
def _reach(layout: OvercookedLayout, start: Cell, player: int | None) -> Reach:
    floor = layout.distances_from([start]) >= 0
    floor.flags.writeable = False
    stations = tuple(name for name in layout.stations if any(floor[cell] for cell in layout.access(name)))
    rest = tuple(name for name in layout.stations if name not in stations)
    return Reach(layout, start, player, floor, stations, rest)


# -- words ------------------------------------------------------------------------------------------------------------


def _meant(layout: OvercookedLayout, place: str) -> tuple[str, ...]:
    """Names of the stations that a task means by a place, wherever they are."""
    return (place,) if place in layout.stations else layout.named(place)


def _stations_in_words(layout: OvercookedLayout, names: Sequence[str]) -> str:
    """Stations of one type with their places."""
    places = "; ".join(_cell_in_words(layout.stations[name]) for name in names)
    return f"the {names[0].partition('@')[0]} station{'' if len(names) == 1 else 's'} ({places})"


def _cell_in_words(cell: Cell) -> str:
    return f"row {cell[0]}, column {cell[1]}"


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(parts[:-1]), *parts[-1:]) if part)
