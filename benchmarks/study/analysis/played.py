"""A game as it was played: its trajectories at the times of the participant's keys, and what it came to."""

from __future__ import annotations

import dataclasses
import itertools
import math
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.study.analysis.database import PersonRow, StepRow, VisitRow, steps_of
from benchmarks.study.analysis.replaying import ReplayError, begin, play
from benchmarks.study.design.study import Study
from benchmarks.study.store.values import from_row

if TYPE_CHECKING:
    from benchmarks.study.games.base import Game
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["IDLE_SECONDS", "IDLE_SPEED", "PlayedVisit", "cell_of_cook", "key_times", "named", "played", "setting_name"]

IDLE_SECONDS: Final = 1.0
"""Kitchens: pauses between keys longer than this are idle time."""
IDLE_SPEED: Final = 0.01
"""Tables: a hand slower than this share of its greatest speed (3 cm/s) is idle."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlayedVisit:
    """A visit of a game, played again.

    Attributes:
        visit: Its row.
        seconds: ``(steps + 1,)`` when each state was reached, since the first was shown.
        trajectories: Of the participant, in order; none in a practice.
        measures: ``steps, done, finished, seconds, path_length, crossings, idle``, and of tables what their outcome
            has more: ``reaches`` and the measures of the team.
    """

    visit: VisitRow
    seconds: Floats
    trajectories: list[Trajectory]
    measures: dict[str, Any]


def setting_name(study: Study, condition: str, sitting: int) -> str:
    """What tables call a condition: its name; where there are several sittings, with the sitting's."""
    sittings = study.content.sittings
    return f"{condition} / {sittings[sitting].name}" if len(sittings) > 1 and sitting < len(sittings) else condition


def played(
    study: Study, connection: sqlite3.Connection, person: PersonRow, visits: Sequence[VisitRow], visit: VisitRow
) -> PlayedVisit:
    """Play a visit again.

    Raises:
        ReplayError: It cannot be, or a state is not as it was recorded.
    """
    steps, cells = list(steps_of(connection, visit.visit)), []
    game = begin(study, person, visits, visit)
    is_kitchen = study.content.domain == "overcooked"
    try:
        for row, digest in play(game, steps):
            if digest != row.before:
                raise ReplayError(f"the state before step {row.step} is {digest}, recorded was {row.before}")
            if is_kitchen:
                cells.append(cell_of_cook(game))
        seconds = key_times(steps, visit.begun) if is_kitchen else np.arange(len(steps) + 1) / 30.0
        outcome = game.outcome()
        if is_kitchen:
            cells.append(cell_of_cook(game))
            outcome["path_length"] = float(sum(a != b for a, b in itertools.pairwise(cells)))
        outcome["seconds"] = float(seconds[-1])
        outcome["idle"] = _kitchen_idle(seconds) if is_kitchen else _table_idle(game, steps)
        found = []
        if visit.kind == "round":
            found = game.trajectories(
                participant=person.participant, condition=visit.condition, seconds=seconds if is_kitchen else None
            )
        return PlayedVisit(visit, seconds, named(found, setting_name(study, visit.condition, visit.sitting)), outcome)
    finally:
        game.close()


def cell_of_cook(game: Game) -> int:
    """Where the participant stands in a kitchen: the number of a cell, from the vector, which a view is slow beside."""
    from legible_envs.overcooked.game.vectors import AT_PLAYERS

    state = game.env.arrays()[0]
    return int(state[AT_PLAYERS])


def named(trajectories: list[Trajectory], layout_name: str) -> list[Trajectory]:
    """Trajectories with another name of their layout."""
    return [dataclasses.replace(each, layout_name=layout_name) for each in trajectories]


def _kitchen_idle(seconds: Floats) -> float:
    gaps = np.diff(seconds)
    total = float(gaps.sum())
    return float(gaps[gaps > IDLE_SECONDS].sum()) / total if total > 0 else math.nan


def _table_idle(game: Game, steps: Sequence[StepRow]) -> float:
    speeds = [math.hypot(*game.read_action(from_row(row.action))) for row in steps]
    return float(np.mean(np.array(speeds) < IDLE_SPEED)) if speeds else math.nan


# -- times ------------------------------------------------------------------------------------------------------------


def key_times(steps: Sequence[StepRow], begun: float) -> Floats:
    """``(steps + 1,)`` seconds at which each state of a kitchen was reached, never decreasing, the first 0.

    A state is reached when its key went down, by the clock of the page. That clock begins anew with every page: where
    it jumps back, the participant had reloaded, and the page's clock is set to the server's by the step that came
    through fastest. A step that no key made, such as waiting, has the time at which it was received, less as much as
    others took.

    Args:
        steps: The rows.
        begun: When the visit was, by the server's clock; it is the first state's time where the page told none.
    """
    if not steps:
        return np.zeros(1)
    absolute, delays = np.full(len(steps), np.nan), []
    for part in _pages(steps):
        keyed = [i for i in part if steps[i].key_down is not None]
        if not keyed:
            continue
        offset = min(steps[i].received - float(steps[i].key_down or 0.0) / 1000 for i in keyed)
        for i in keyed:
            absolute[i] = float(steps[i].key_down or 0.0) / 1000 + offset
            delays.append(steps[i].received - absolute[i])
        if part[0] == 0 and steps[0].frame_shown is not None:
            begun = min(float(steps[0].frame_shown) / 1000 + offset, absolute[keyed[0]])
    usual = float(np.median(delays)) if delays else 0.0
    received = np.array([row.received for row in steps])
    absolute = np.where(np.isnan(absolute), received - usual, absolute)
    found = np.maximum.accumulate(np.concatenate([[min(begun, absolute[0])], absolute]))
    return np.asarray(found - found[0], dtype=np.float64)


def _pages(steps: Sequence[StepRow]) -> list[list[int]]:
    """Numbers of the steps that one page's clock timed."""
    parts: list[list[int]] = [[]]
    last = -math.inf
    for i, row in enumerate(steps):
        if row.key_down is not None:
            if row.key_down < last:
                parts.append([])
            last = row.key_down
        parts[-1].append(i)
    return parts
