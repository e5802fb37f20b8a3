"""One participant as rows of an export's tables; whatever cannot be read becomes a row that says so."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.analysis.database import (
    Answer,
    PersonRow,
    VisitRow,
    answers_of,
    needed_screens,
    steps_of,
    visits_of,
)
from benchmarks.study.analysis.played import PlayedVisit, played
from benchmarks.study.analysis.redaction import Redaction
from benchmarks.study.analysis.replaying import game_visits
from benchmarks.study.analysis.scales import attention, score
from benchmarks.study.design.study import Study
from benchmarks.study.store.outcomes import counted_outcome
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import timeline

if TYPE_CHECKING:
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["COLUMNS", "PersonRows", "moment", "rows_of"]

_PLACE: Final = ("participant", "visit", "screen", "kind", "sitting", "condition", "round", "attempt")
TEAM: Final = (
    "reaches", "completion_time", "human_idle", "robot_idle", "concurrent_activity", "functional_delay", "conflicts",
    "goals_lost", "decision_time", "decision_fraction", "decided", "decided_rightly",
)  # fmt: skip
"""What the outcome of a table has beside that of a kitchen."""

COLUMNS: Final[dict[str, tuple[str, ...]]] = {
    "participants": (
        "participant", "state", "included", "joined", "ended", "minutes", "screens_done", "screens", "order_number",
        "order", "attention_passed", "attention_checks", "language", "design",
    ),
    "rounds": (
        *_PLACE, "position", "obstacles", "begun", "ended", "counts", "steps", "done", "finished", "seconds",
        "path_length", "crossings", "idle", "trajectories", *TEAM,
    ),
    "steps": (*_PLACE, "step", "action", "vx", "vy", "before", "key_down", "frame_shown", "received"),
    "pointer": (*_PLACE, "sample", "at", "x", "y"),
    "questionnaires": (
        "participant", "sitting", "condition", "screen", "visit", "questionnaire", "item", "value", "answered",
    ),
    "scales": ("participant", "sitting", "condition", "questionnaire", "scale", "value", "answered", "items"),
    "events": ("participant", "at", "kind", "detail"),
    "problems": ("participant", "table", "row", "problem"),
}  # fmt: skip
"""Tables of an export and their columns; docs/study.md says what they mean."""


@dataclass
class PersonRows:
    """What an export holds of one participant: rows by table, and trajectories."""

    tables: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: {name: [] for name in COLUMNS})
    trajectories: list[Trajectory] = field(default_factory=list)

    def problem(self, participant: str, table: str, row: object, message: str) -> None:
        """Something cannot be read."""
        found = {"participant": participant, "table": table, "row": row, "problem": message}
        self.tables["problems"].append(found)


def moment(at: float | None) -> str | None:
    """A time in ISO 8601 (UTC, milliseconds); None where there is none.

    Raises:
        ValueError: No time.
    """
    if at is None:
        return None
    try:
        return datetime.fromtimestamp(float(at), UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    except (OverflowError, OSError, TypeError) as error:
        raise ValueError(f"{at!r:.60} is no time") from error


def rows_of(
    study: Study, connection: sqlite3.Connection, person: PersonRow, redaction: Redaction, *, included: bool
) -> PersonRows:
    """Everything about a participant.

    Args:
        study: The design.
        connection: To the database.
        person: Whose rows.
        redaction: Applied to every text that a participant or a page wrote.
        included: Whether their trajectories are wanted.
    """
    found, visits = PersonRows(), visits_of(connection, person.participant)
    counting = _counting(visits)
    for visit in visits:
        place = _place(study, visit)
        if visit in game_visits(visits):
            _add_round(found, study, connection, person, visits, visit, visit.visit in counting, included)
            _add_steps(found, connection, study, visit, place)
    passed = _add_answers(found, study, answers_of(connection, person.participant), visits, redaction)
    _add_events(found, connection, person, redaction)
    found.tables["participants"].append(_person(study, person, visits, passed, included))
    if person.state == "complete":
        _look_for_gaps(found, study, person, visits)
    return found


def _counting(visits: Sequence[VisitRow]) -> set[int]:
    """The visits of rounds that were finished, the last of each screen, none that the participant began again."""
    last: dict[int, int] = {}
    for visit in visits:
        with suppress(ValueError):  # the row is listed where its game is read
            if visit.kind == "round" and counted_outcome(visit.finished, visit.outcome) is not None:
                last[visit.screen] = visit.visit
    return set(last.values())


def _place(study: Study, visit: VisitRow) -> dict[str, Any]:
    sittings = study.content.sittings
    return {
        "participant": visit.participant,
        "visit": visit.visit,
        "screen": visit.name,
        "kind": visit.kind,
        "sitting": sittings[visit.sitting].name if visit.sitting < len(sittings) else "",
        "condition": visit.condition,
        "round": visit.round,
        "attempt": visit.attempt,
    }


# -- games ------------------------------------------------------------------------------------------------------------


def _add_round(
    found: PersonRows,
    study: Study,
    connection: sqlite3.Connection,
    person: PersonRow,
    visits: Sequence[VisitRow],
    visit: VisitRow,
    counts: bool,
    included: bool,
) -> None:
    row = _place(study, visit) | {
        "position": person.conditions.index(visit.condition) + 1 if visit.condition in person.conditions else None,
        "obstacles": not study.content.sittings or study.content.sittings[visit.sitting].obstacles,
        "begun": moment(visit.begun),
        "ended": moment(visit.finished),
    }
    again: PlayedVisit | None = None
    try:
        again = played(study, connection, person, visits, visit)
    except (ValueError, RuntimeError, ArithmeticError, LookupError, TypeError) as error:
        found.problem(visit.participant, "visits", visit.visit, f"the game cannot be played again: {error}")
    if again is not None:
        row |= again.measures
        if counts and included:
            found.trajectories += again.trajectories
            row["trajectories"] = len(again.trajectories)
    found.tables["rounds"].append(row | {"counts": counts and again is not None})


def _add_steps(
    found: PersonRows, connection: sqlite3.Connection, study: Study, visit: VisitRow, place: dict[str, Any]
) -> None:
    is_kitchen = study.content.domain == "overcooked"
    for step in steps_of(connection, visit.visit):
        try:
            action = from_row(step.action)
            moved = {"action": action} if is_kitchen else dict(zip(("vx", "vy"), action, strict=True))
            if not all(isinstance(value, int | float) for value in moved.values()):
                raise ValueError(f"{step.action!r:.80} is no action")
            times = {"key_down": step.key_down, "frame_shown": step.frame_shown, "received": moment(step.received)}
            found.tables["steps"].append(place | {"step": step.step, "before": step.before} | moved | times)
        except (ValueError, TypeError, RecursionError) as error:
            found.problem(visit.participant, "steps", f"{visit.visit}/{step.step}", str(error))
    rows = connection.execute("SELECT sample, at, x, y FROM pointer WHERE visit = ? ORDER BY sample", (visit.visit,))
    found.tables["pointer"] += [place | dict(zip(("sample", "at", "x", "y"), row, strict=True)) for row in rows]


# -- answers ----------------------------------------------------------------------------------------------------------


def _add_answers(
    found: PersonRows,
    study: Study,
    answers: Sequence[Answer],
    visits: Sequence[VisitRow],
    redaction: Redaction,
) -> tuple[int, int]:
    """Rows of answers and scales; returns how many attention checks were passed, of how many."""
    by_number = {visit.visit: visit for visit in visits}
    values: dict[int, dict[str, Any]] = {}
    for answer in answers:
        visit = by_number.get(answer.visit)
        try:
            if visit is None:
                raise ValueError(f"there is no visit {answer.visit} of this participant")
            value = redaction(from_row(answer.value))
            told = json.dumps(value, ensure_ascii=False) if isinstance(value, list | dict) else value
            row = {key: value for key, value in _place(study, visit).items() if key in COLUMNS["questionnaires"]}
            row |= {"questionnaire": answer.questionnaire, "item": answer.item, "value": told}
            found.tables["questionnaires"].append(row | {"answered": moment(answer.answered)})
            values.setdefault(answer.visit, {})[answer.item] = value
        except (ValueError, TypeError, RecursionError) as error:
            who = visits[0].participant if visits else ""
            found.problem(who, "answers", f"{answer.visit}/{answer.item}", str(error))
    passed = checks = 0
    for number, given in values.items():
        visit = by_number[number]
        name = next((each.questionnaire for each in answers if each.visit == number), "")
        questionnaire = study.questionnaires.get(name)
        if questionnaire is None:
            continue  # the consent
        row = {key: value for key, value in _place(study, visit).items() if key in COLUMNS["scales"]}
        found.tables["scales"] += [row | {"questionnaire": name} | one._asdict() for one in score(questionnaire, given)]
        own = attention(questionnaire, given)
        passed, checks = passed + own[0], checks + own[1]
    return passed, checks


def _add_events(found: PersonRows, connection: sqlite3.Connection, person: PersonRow, redaction: Redaction) -> None:
    rows = connection.execute(
        "SELECT event, at, kind, detail FROM events WHERE participant = ? ORDER BY event", (person.participant,)
    )
    for event, at, kind, detail in rows:
        try:
            told = json.dumps(redaction(from_row(detail)), ensure_ascii=False)
            row = {"participant": person.participant, "at": moment(at), "kind": redaction(kind), "detail": told}
            found.tables["events"].append(row)
        except (ValueError, TypeError, RecursionError) as error:
            found.problem(person.participant, "events", event, str(error))


# -- the participant --------------------------------------------------------------------------------------------------


def _person(
    study: Study, person: PersonRow, visits: Sequence[VisitRow], passed: tuple[int, int], included: bool
) -> dict[str, Any]:
    done = {visit.screen for visit in visits if visit.finished is not None}
    until = person.ended if person.ended is not None else person.seen
    return {
        "participant": person.participant,
        "state": person.state,
        "included": included,
        "joined": moment(person.joined),
        "ended": moment(person.ended),
        "minutes": round((until - person.joined) / 60, 2),
        "screens_done": len(done),
        "screens": needed_screens(study, person, done),
        "order_number": person.order_number,
        "order": " > ".join(person.conditions),
        "attention_passed": passed[0],
        "attention_checks": passed[1],
        "language": person.language,
        "design": person.design,
    }


def _look_for_gaps(found: PersonRows, study: Study, person: PersonRow, visits: Sequence[VisitRow]) -> None:
    """A participant who counts as complete has finished every screen, but for rounds that were not needed."""
    done = {visit.screen for visit in visits if visit.finished is not None}
    for number, screen in enumerate(timeline(study, person.conditions)):
        needless = screen.kind == "round" and study.content.rounds.reaches and screen.round > 1
        if number not in done and not needless:
            found.problem(person.participant, "visits", "", f"complete, but {screen.name!r} was never finished")
