"""What a robot in the kitchen does next: the cells it may go to, given what the person brings or may bring."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from legible_envs.overcooked.game.vectors import DISH, SOUP
from legible_envs.overcooked.layout import COUNTER
from legible_envs.overcooked.partner.interface import PARTNER, PERSON, Senses
from legible_envs.overcooked.partner.needs import item_at, needed_beside, put_away_cells, used_cells
from legible_envs.overcooked.partner.ways import Floor

__all__ = ["Job", "choose_job"]

Flags = npt.NDArray[np.bool_]


class Job(NamedTuple):
    """Where a robot goes, and why.

    Attributes:
        state: ``"fetch"``, ``"use"``, ``"away"``, or ``"wait"``.
        target: Cell of the station or counter, -1 while it waits.
    """

    state: str = "wait"
    target: int = -1


class _Bringing(NamedTuple):
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


def _with_full_hands(senses: Senses, floor: Floor, held: int) -> tuple[str, Flags]:
    if held >= SOUP:
        return "use", senses.partner_goals
    cells = np.zeros(len(senses.partner_goals), dtype=np.bool_)
    used_cells(senses.state, senses.kitchen, senses.rules, PARTNER, held, cells)
    if cells.any() and not _comes_second(senses, floor, held, cells):
        return "use", cells
    put_away_cells(senses.state, senses.kitchen, senses.rules, PARTNER, held, cells)
    return "away", cells


def _comes_second(senses: Senses, floor: Floor, held: int, pots: Flags) -> bool:
    """Whether the person holds what makes the robot's item useless, and is not farther from the pot."""
    here, person = senses.player(PARTNER)[0], senses.player(PERSON)
    if not 0 < person[2] <= DISH or needed_beside(senses.state, senses.rules, PARTNER, held, person[2]):
        return False
    mine, theirs = (_least(floor, pots, cell) for cell in (here, person[0]))
    return 1 < mine and theirs <= mine


def _least(floor: Floor, goals: Flags, cell: int) -> float:
    """Fewest steps from a cell into one of the goals."""
    steps = [int(floor.steps_from(goal)[cell]) for goal in np.flatnonzero(goals).tolist()]
    return min((count for count in steps if count >= 0), default=float("inf"))


def _known(senses: Senses, predicted: int) -> list[_Bringing]:
    """What the person brings, as far as it is seen or predicted."""
    held = senses.player(PERSON)[2]
    if held:
        return [_Bringing(-1, held)]
    return [_bringing(senses, predicted)] if predicted >= 0 else []


def _possible(senses: Senses) -> list[_Bringing]:
    """All that the person may fetch."""
    return [_bringing(senses, cell) for cell in np.flatnonzero(senses.person_goals).tolist()]


def _bringing(senses: Senses, cell: int) -> _Bringing:
    return _Bringing(cell, int(item_at(senses.state, senses.kitchen, senses.rules, cell)))


def _needed(senses: Senses, brought: list[_Bringing]) -> Flags:
    """The cells whose item is needed beside each thing brought, and is not that very thing."""
    jobs = senses.partner_goals.copy()
    beside: dict[tuple[int, int], bool] = {}
    for cell in np.flatnonzero(jobs).tolist():
        item = _bringing(senses, cell).item
        for other in brought:
            if (item, other.item) not in beside:
                beside[item, other.item] = bool(
                    needed_beside(senses.state, senses.rules, PARTNER, item, other.item)
                )
            is_the_same = other.cell == cell and senses.kitchen[cell] == COUNTER
            if is_the_same or not beside[item, other.item]:
                jobs[cell] = False
    return jobs


def _nearest(state: str, cells: Flags, floor: Floor, here: int, before: Job) -> Job:
    """The job until now if it is among the cells, else the nearest of them."""
    if before.state == state and before.target >= 0 and cells[before.target]:
        return before
    steps = {cell: int(floor.steps_from(cell)[here]) for cell in np.flatnonzero(cells).tolist()}
    near = [cell for cell, count in steps.items() if count >= 0]
    return Job(state, min(near, key=lambda cell: (steps[cell], cell))) if near else Job()
