"""Whether a participant is complete: decided by the rows that are there, never by what a page says."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from benchmarks.study.design.questionnaires import answered_names
from benchmarks.study.games import reaches_left
from benchmarks.study.store.outcomes import counted_outcome
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import GAMES, Screen, timeline

if TYPE_CHECKING:
    from benchmarks.study.design.models import StudyContent
    from benchmarks.study.design.study import Study
    from benchmarks.study.store import Store

__all__ = ["counted_rounds", "is_complete", "is_practised", "missing"]


def is_complete(store: Store, study: Study, participant: str) -> bool:
    """Whether every row of a whole session is there."""
    return not missing(store, study, participant)


def is_practised(content: StudyContent, outcome: Mapping[str, Any]) -> bool:
    """Whether an attempt of the practice was enough to go on: the task done, or the reaches made that it asks for."""
    wanted = content.practice.reaches if content.practice is not None and content.domain == "tabletop" else 0
    return bool(outcome["finished"]) or bool(wanted and outcome.get("reaches", 0) >= wanted)


def counted_rounds(screens: Sequence[Screen], visits: Iterable[sqlite3.Row]) -> list[tuple[Screen, dict[str, Any]]]:
    """Finished rounds and what they came to; those that a reload made begin again do not count.

    Args:
        screens: The participant's timeline.
        visits: Their visits, in order.
    """
    return [
        (screens[visit["screen"]], outcome)
        for visit in visits
        if visit["kind"] == "round" and (outcome := _outcome(visit)) is not None
    ]


def _outcome(visit: sqlite3.Row) -> dict[str, Any] | None:
    return counted_outcome(visit["finished"], visit["outcome"])


def missing(store: Store, study: Study, participant: str) -> list[str]:
    """Names of the screens whose rows are not all there, in order.

    A screen needs a finished visit; a game as many steps, numbered from 0, as its outcome says; the practice an attempt
    that was enough; a questionnaire all its answers; the consent its answer.

    Args:
        store: The database.
        study: The design.
        participant: Whose. ``["participant"]`` where there is none.
    """
    row = store.read("SELECT conditions FROM participants WHERE participant = ?", (participant,))
    if not row:
        return ["participant"]
    screens = timeline(study, from_row(row[0]["conditions"]))
    visits = store.read("SELECT * FROM visits WHERE participant = ? ORDER BY visit", (participant,))
    last = {visit["screen"]: visit for visit in visits if _outcome(visit) is not None}
    rounds = counted_rounds(screens, visits)
    found = []
    for index, screen in enumerate(screens):
        if index not in last:
            is_needless = screen.kind == "round" and reaches_left(study, screen, rounds) == 0
            if not is_needless:
                found.append(screen.name)
        elif not _is_whole(store, study, screen, last[index]):
            found.append(screen.name)
    return found


def _is_whole(store: Store, study: Study, screen: Screen, visit: sqlite3.Row) -> bool:
    """Whether a finished visit has all its rows."""
    number, outcome = visit["visit"], from_row(visit["outcome"])
    if screen.kind in GAMES:
        # By visit, which is the key of the table: the cost does not grow with the participants.
        found = store.read("SELECT COUNT(*), MAX(step) FROM steps WHERE visit = ?", (number,))[0]
        steps = outcome["steps"]
        is_enough = screen.kind == "round" or is_practised(study.content, outcome)
        return is_enough and (found[0], -1 if found[1] is None else found[1]) == (steps, steps - 1)
    if screen.kind not in ("questionnaire", "consent"):
        return True
    items = {row["item"] for row in store.read("SELECT item FROM answers WHERE visit = ?", (number,))}
    if screen.kind == "consent":
        return "consent" in items
    return items.issuperset(answered_names(study.questionnaires[screen.questionnaire]))
