"""Games played again from their recorded steps, and compared with what was recorded, state by state."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.study.analysis.database import PersonRow, StepRow, VisitRow, people, steps_of, visits_of
from benchmarks.study.design.study import Study
from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.games.base import Game
from benchmarks.study.store.outcomes import RESTARTED, counted_outcome
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import GAMES, Screen, timeline

__all__ = ["Mismatch", "ReplayError", "Verified", "begin", "game_visits", "play", "replay", "screen_of", "verify"]


class ReplayError(ValueError):
    """A game that cannot be played again; the message says at which step and why."""


@dataclass(frozen=True, slots=True)
class Mismatch:
    """Where a game that is played again differs from what was recorded.

    Attributes:
        participant: Whose.
        visit: Number of the visit.
        name: Of the screen.
        step: From 0; -1 where it is not about a step.
        message: What was expected and what came.
    """

    participant: str
    visit: int
    name: str
    step: int
    message: str

    def __str__(self) -> str:
        at = f", step {self.step}" if self.step >= 0 else ""
        return f"{self.participant}, visit {self.visit} ({self.name}){at}: {self.message}"


@dataclass(frozen=True, slots=True)
class Verified:
    """What :func:`verify` saw.

    Attributes:
        participants: How many.
        games: Visits that were played again.
        states: States whose digests were compared.
        mismatches: Every difference; the first of each game.
    """

    participants: int
    games: int
    states: int
    mismatches: tuple[Mismatch, ...]


def screen_of(study: Study, person: PersonRow, visit: VisitRow) -> Screen:
    """The screen that a visit is of.

    Raises:
        ReplayError: The participant's timeline has no such screen there.
    """
    try:
        screens = timeline(study, person.conditions)
    except (KeyError, ValueError) as error:
        raise ReplayError(f"there is no timeline for the conditions {list(person.conditions)}: {error}") from error
    if not 0 <= visit.screen < len(screens) or screens[visit.screen].name != visit.name:
        there = screens[visit.screen].name if 0 <= visit.screen < len(screens) else "nothing"
        raise ReplayError(f"screen {visit.screen} of the timeline is {there!r}, the visit says {visit.name!r}")
    return screens[visit.screen]


def begin(study: Study, person: PersonRow, visits: Sequence[VisitRow], visit: VisitRow) -> Game:
    """The game of a visit before its first step.

    Args:
        study: The design.
        person: Whose.
        visits: All of the participant's, which tell what was done before.
        visit: One of them.

    Raises:
        ReplayError: The visit is of no game, or the game cannot be made.
    """
    screen = screen_of(study, person, visit)
    if screen.kind not in GAMES:
        raise ReplayError(f"{screen.name!r} is no game")
    try:
        left = reaches_left(study, screen, _earlier(study, person, visits, visit))
        return make_game(study, screen, visit.seed, reaches_left=left)
    except Exception as error:  # what an environment raises at a damaged row is its own affair
        raise ReplayError(f"the game cannot be made: {error}") from error


def _earlier(
    study: Study, person: PersonRow, visits: Sequence[VisitRow], visit: VisitRow
) -> list[tuple[Screen, dict[str, Any]]]:
    """The rounds that had been finished and counted when a visit began, and what they came to."""
    return [
        (screen_of(study, person, each), outcome)
        for each in visits
        if each.kind == "round"
        and each.visit < visit.visit
        and (outcome := counted_outcome(each.finished, each.outcome)) is not None
    ]


def play(game: Game, steps: Iterable[StepRow]) -> Iterator[tuple[StepRow, str]]:
    """Take recorded steps; yields each one and the digest of the state that it is taken in, before it is taken.

    Raises:
        ReplayError: A step is missing, is no action, or comes when the round is over.
    """
    for number, row in enumerate(steps):
        if row.step != number:
            raise ReplayError(f"step {number} is missing: the next row is step {row.step}")
        yield row, game.digest()
        try:
            game.step(game.read_action(from_row(row.action)))
        except (ValueError, TypeError, RecursionError) as error:
            raise ReplayError(f"step {number} cannot be taken: {error}") from error


def replay(study: Study, connection: sqlite3.Connection, visit: int) -> Game:
    """A visit played again to its last recorded step; the caller closes the game.

    Args:
        study: The design.
        connection: To the database.
        visit: Number of the visit.

    Raises:
        ReplayError: There is no such visit, or it cannot be played again.
    """
    found = connection.execute("SELECT participant FROM visits WHERE visit = ?", (visit,)).fetchone()
    person = next((row for row in people(connection) if found and row.participant == found[0]), None)
    if person is None:
        raise ReplayError(f"there is no visit {visit} of a participant in this database")
    visits = visits_of(connection, person.participant)
    game = begin(study, person, visits, next(row for row in visits if row.visit == visit))
    for _ in play(game, steps_of(connection, visit)):
        pass
    return game


def game_visits(visits: Sequence[VisitRow]) -> list[VisitRow]:
    """The visits that are of games."""
    return [visit for visit in visits if visit.kind in GAMES]


def verify(
    study: Study,
    connection: sqlite3.Connection,
    persons: Sequence[PersonRow],
    *,
    progress: Callable[[str], object] | None = None,
) -> Verified:
    """Play every game of some participants again, and compare every state and outcome with what was recorded.

    Args:
        study: The design.
        connection: To the database.
        persons: Whose games.
        progress: Called with each participant's name before their games are played.
    """
    games = states = 0
    mismatches: list[Mismatch] = []
    for person in persons:
        if progress is not None:
            progress(person.participant)
        visits = visits_of(connection, person.participant)
        for visit in game_visits(visits):
            games += 1
            count, found = compare(study, person, visits, visit, steps_of(connection, visit.visit))
            states += count
            mismatches += found
    return Verified(len(persons), games, states, tuple(mismatches))


def compare(
    study: Study, person: PersonRow, visits: Sequence[VisitRow], visit: VisitRow, steps: Iterable[StepRow]
) -> tuple[int, list[Mismatch]]:
    """How many states of a game are as recorded, and the first difference, if there is one."""

    def differs(step: int, message: str) -> list[Mismatch]:
        return [Mismatch(person.participant, visit.visit, visit.name, step, message)]

    count, game = 0, None
    try:
        game = begin(study, person, visits, visit)
        for row, digest in play(game, steps):
            if digest != row.before:
                return count, differs(row.step, f"the state before it is {digest}, recorded was {row.before}")
            count += 1
        if visit.finished is None:
            return count, []
        ours, stored = from_row(json.dumps(game.outcome())), visit.result
        stored.pop(RESTARTED, None)  # the server's note that the participant began the round again
        other = [key for key in {**ours, **stored} if ours.get(key) != stored.get(key)]
        if other:
            told = ", ".join(f"{key} is {ours.get(key)!r}, recorded was {stored.get(key)!r}" for key in sorted(other))
            return count, differs(-1, f"the outcome differs: {told}")
        return count, []
    except ValueError as error:  # also a ReplayError, and an outcome that is no JSON
        return count, differs(-1, str(error))
    finally:
        if game is not None:
            game.close()
