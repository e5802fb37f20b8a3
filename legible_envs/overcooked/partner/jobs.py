"""What a robot in the kitchen does next: the cells it may go to, given what the person brings or may bring."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import AT_ITEMS, DISH, POT_CELL, SERVING_CELL, SOUP
from legible_envs.overcooked.layout import COUNTER
from legible_envs.overcooked.partner.interface import PARTNER, PERSON, Senses
from legible_envs.overcooked.partner.needs import (
    can_use,
    item_at,
    needed_beside,
    put_away_cells,
    shared_counters,
    used_cells,
)
from legible_envs.overcooked.partner.ways import Floor

__all__ = ["Job", "choose_job"]

Flags = npt.NDArray[np.bool_]

_NOWHERE: Final = -1
_MOST_HANDED: Final = 4  # items that lie ready for the other; more need not be counted exactly


class Job(NamedTuple):
    """Where a robot goes, and why.

    Attributes:
        state: ``"fetch"``, ``"use"``, ``"away"``, or ``"wait"``.
        target: Cell of the station or counter, -1 while it waits.
    """

    state: str = "wait"
    target: int = _NOWHERE


class _Brought(NamedTuple):
    """Something the person brings or may bring: where it comes from (-1: they hold it), and the item."""

    cell: int
    item: int


def choose_job(senses: Senses, floor: Floor, before: Job, predicted: int, *, impatient: bool) -> Job:
    """What to do in this tick.

    Args:
        senses: What the robot senses.
        floor: Of the kitchen.
        before: The job until now, which goes on while it is still of use.
        predicted: Cell of the station that the person goes for, where the robot is sure of it, else -1.
        impatient: Whether to go by what is known alone where the robot is not sure.
    """
    here, _, held = senses.player(PARTNER)
    if held:
        state, cells = _with_full_hands(senses, floor, held)
        return _nearest(state, cells, floor, here, before)
    known = _known(senses, predicted)
    jobs = _needed(senses, known)
    if before.state == "fetch" and jobs[before.target]:
        return before
    if not known and not impatient:
        jobs = _needed(senses, _possible(senses))
    return _nearest("fetch", jobs, floor, here, before)


# -- full hands -------------------------------------------------------------------------------------------------------


def _with_full_hands(senses: Senses, floor: Floor, held: int) -> tuple[str, Flags]:
    """What to do with what the robot holds, and the cells where it can be done."""
    cells = np.zeros(len(senses.partner_goals), dtype=np.bool_)
    if not _can_use(senses, PARTNER, held):
        cells = _free_shared_counters(senses)
        if cells.any() and needed_beside(senses.state, senses.rules, held, _items(_on_shared_counters(senses))):
            return "use", cells
    elif held >= SOUP:
        return "use", senses.partner_goals
    else:
        used_cells(senses.state, senses.kitchen, senses.rules, PARTNER, held, cells)
        if cells.any() and not _comes_second(senses, floor, held, cells):
            return "use", cells
    put_away_cells(senses.state, senses.kitchen, senses.rules, PARTNER, held, cells)
    return "away", cells


def _comes_second(senses: Senses, floor: Floor, held: int, pots: Flags) -> bool:
    """Whether the person holds what makes the robot's item useless, and is not farther from the pot."""
    here, person = senses.player(PARTNER)[0], senses.player(PERSON)
    if not _can_use(senses, PERSON, held) or needed_beside(senses.state, senses.rules, held, _items([person[2]])):
        return False
    mine, theirs = (_least(floor, pots, cell) for cell in (here, person[0]))
    return mine > 1 and theirs <= mine


def _least(floor: Floor, goals: Flags, cell: int) -> float:
    """Fewest steps from a cell into one of the goals."""
    steps = [int(floor.steps_from(goal)[cell]) for goal in np.flatnonzero(goals).tolist()]
    return min((count for count in steps if count >= 0), default=float("inf"))


# -- empty hands ------------------------------------------------------------------------------------------------------


def _known(senses: Senses, predicted: int) -> list[_Brought]:
    """What the person brings, as far as it is seen or predicted."""
    held = senses.player(PERSON)[2]
    if held:
        return [_Brought(_NOWHERE, held)]
    return [_brought(senses, predicted)] if predicted >= 0 else []


def _possible(senses: Senses) -> list[_Brought]:
    """All that the person may fetch."""
    return [_brought(senses, cell) for cell in np.flatnonzero(senses.person_goals).tolist()]


def _brought(senses: Senses, cell: int) -> _Brought:
    return _Brought(cell, int(item_at(senses.state, senses.kitchen, senses.rules, cell)))


def _needed(senses: Senses, brought: list[_Brought]) -> Flags:
    """The robot's goals whose item is needed beside each thing brought, and is not that very thing."""
    jobs = senses.partner_goals.copy()
    beside: dict[tuple[int, int], bool] = {}
    for cell in np.flatnonzero(jobs).tolist():
        item = _brought(senses, cell).item
        handed: list[int] = []
        if not _can_use(senses, PARTNER, item):
            handed = _on_shared_counters(senses)
            if _shared(senses)[cell]:  # it lies where the person can take it
                jobs[cell] = False
                continue
        for other in brought or [_Brought(_NOWHERE, 0)]:
            # What the person cannot use themselves, they bring for the robot.
            theirs = other.item if _can_use(senses, PERSON, other.item) else 0
            if (item, theirs) not in beside:
                others = _items([theirs, *handed])
                beside[item, theirs] = bool(needed_beside(senses.state, senses.rules, item, others))
            is_the_same = other.cell == cell and senses.kitchen[cell] == COUNTER
            if is_the_same or not beside[item, theirs]:
                jobs[cell] = False
    return jobs


# -- divided kitchens -------------------------------------------------------------------------------------------------


def _can_use(senses: Senses, player: int, item: int) -> bool:
    """Whether a player can get to where an item is used: a pot, or for soups a serving station."""
    code = SERVING_CELL if item >= SOUP else POT_CELL
    return bool(can_use(senses.kitchen, senses.rules, senses.player(player)[0], code))


def _shared(senses: Senses) -> Flags:
    cells = np.zeros(len(senses.partner_goals), dtype=np.bool_)
    shared_counters(senses.state, senses.kitchen, senses.rules, cells)
    return cells


def _free_shared_counters(senses: Senses) -> Flags:
    at = int(senses.rules[AT_ITEMS])
    cells: Flags = _shared(senses) & (senses.state[at : at + len(senses.partner_goals)] == 0)
    return cells


def _on_shared_counters(senses: Senses) -> list[int]:
    """Items that lie ready for the other."""
    at = int(senses.rules[AT_ITEMS])
    items = senses.state[at : at + len(senses.partner_goals)][_shared(senses)]
    return [int(item) for item in items if 0 < item <= DISH][:_MOST_HANDED]


def _items(listed: list[int]) -> npt.NDArray[np.int64]:
    return np.array(listed, dtype=np.int64)


def _nearest(state: str, cells: Flags, floor: Floor, here: int, before: Job) -> Job:
    """The job until now if it is among the cells, else the nearest of them."""
    if before.state == state and before.target >= 0 and cells[before.target]:
        return before
    steps = {cell: int(floor.steps_from(cell)[here]) for cell in np.flatnonzero(cells).tolist()}
    near = [cell for cell, count in steps.items() if count >= 0]
    return Job(state, min(near, key=lambda cell: (steps[cell], cell))) if near else Job()
