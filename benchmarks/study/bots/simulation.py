"""Simulated participants through the real server, which has a process of its own; every row they leave is checked."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.bots.link import BotError
from benchmarks.study.bots.participant import Pace, Participant
from benchmarks.study.bots.people import POPULATIONS, Person
from benchmarks.study.bots.process import ServerProcess, without_gaps
from benchmarks.study.errors import StudyError
from benchmarks.study.store import database_path, open_readonly
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import timeline

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.study.design.study import Study

__all__ = ["Summary", "names_of", "simulate"]

_AT_ONCE: Final = 16
"""Bots that play at the same time."""


@dataclass(frozen=True)
class Summary:
    """What a simulation came to.

    Attributes:
        participants: Their names in the database, in the order of the people's numbers.
        first: Number of the first person: the participants that the database had before.
        endings: How many ended how; ``left`` are those who went away.
        orders: How many of those who stayed met the conditions in which order.
        steps: Of all games.
        seconds: That it took, the server's start left out.
        states: Digests of states that a replay compared.
        had_gaps: Whether the study has gaps between sittings, which were left out.
    """

    participants: list[str]
    first: int
    endings: dict[str, int]
    orders: dict[tuple[str, ...], int]
    steps: int
    seconds: float
    states: int
    had_gaps: bool


def simulate(
    study: Study,
    participants: int,
    *,
    seed: int = 0,
    population: str = "boltzmann",
    drop_out: float = 0.0,
    pace: float = 0.0,
    at_once: int = _AT_ONCE,
    progress: Callable[[int, int], object] | None = None,
) -> Summary:
    """Let simulated people take part in a study, as debug participants, and check every row that they leave.

    A simulation on top of another one adds participants: people with further numbers. Gaps between sittings are left
    out.

    Args:
        study: The design; its folder is served.
        participants: How many.
        seed: Of the people; the same seed and numbers are the same people.
        population: In kitchens: ``"boltzmann"`` or ``"planner"``.
        drop_out: Share of people who go away somewhere on the way.
        pace: 0: as fast as the server answers; 1: as fast as people.
        at_once: How many play at the same time.
        progress: Called with ``(participants who are done, steps)``.

    Returns:
        What it came to.

    Raises:
        StudyError: The server does not start, a bot sees another state than its own, a row is missing, or a game that
            is played again from the database comes to another state.
    """
    if population not in POPULATIONS:
        raise StudyError(f"`population` must be one of {', '.join(POPULATIONS)}, got {population!r}")
    with ServerProcess(study.folder) as server:
        first = _count(study)
        people = [Person(seed, first + number, population) for number in range(participants)]
        bare = without_gaps(study)
        screens = len(timeline(bare, study.conditions))
        bots = [
            Participant(bare, person, server.link, pace=Pace(pace), leaves_at=_leaving(person, drop_out, screens))
            for person in people
        ]
        begun = time.monotonic()
        asyncio.run(_run_all(bots, at_once, progress))
        seconds = time.monotonic() - begun
    return _summary(study, bots, first, seconds)


def _leaving(person: Person, drop_out: float, screens: int) -> tuple[float, int] | None:
    """How far on, and after how many steps of a game there, a person goes away; None for those who stay."""
    rng = person.rng("leaving")
    leaves, share, steps = rng.random() < drop_out, rng.random(), int(rng.integers(60))
    return (float(share) * (screens - 2) / screens, steps) if leaves else None


def _count(study: Study) -> int:
    with open_readonly(database_path(study.folder, "debug")) as connection:
        return int(connection.execute("SELECT COUNT(*) FROM participants").fetchone()[0])


async def _run_all(bots: Sequence[Participant], at_once: int, progress: Callable[[int, int], object] | None) -> None:
    """All bots, so many at a time; the first that fails ends the others."""
    places, done = asyncio.Semaphore(at_once), 0

    async def run(bot: Participant) -> None:
        nonlocal done
        async with places:
            await bot.run()
        done += 1

    async def watch() -> None:
        while progress is not None:
            progress(done, sum(bot.steps for bot in bots))
            await asyncio.sleep(0.25)

    try:
        async with asyncio.TaskGroup() as group:
            watcher = group.create_task(watch())
            await asyncio.gather(*(run(bot) for bot in bots))
            watcher.cancel()
    except* (StudyError, TimeoutError) as errors:
        first = errors.exceptions[0]
        raise first if isinstance(first, StudyError) else BotError(str(first)) from None
    if progress is not None:
        progress(done, sum(bot.steps for bot in bots))


# -- what is in the database ------------------------------------------------------------------------------------------


def names_of(study: Study, bots: Sequence[Participant]) -> list[str]:
    """The participants that bots are in the debug database; empty texts for those who have not joined."""
    from benchmarks.study.server.secrets import fingerprint

    with open_readonly(database_path(study.folder, "debug")) as connection:
        known = dict(connection.execute("SELECT token_sha256, participant FROM participants").fetchall())
    return [known.get(fingerprint(bot.token), "") for bot in bots]


def _summary(study: Study, bots: Sequence[Participant], first: int, seconds: float) -> Summary:
    from benchmarks.study.analysis.database import people
    from benchmarks.study.analysis.replaying import verify

    names = names_of(study, bots)
    ending = dict(zip(names, (bot.ending for bot in bots), strict=True))
    with open_readonly(database_path(study.folder, "debug")) as connection:
        persons = [person for person in people(connection) if person.participant in ending]
        problems = _row_problems(study, connection, ending)
        verified = verify(study, connection, persons)
    problems += [str(mismatch) for mismatch in verified.mismatches]
    if problems:
        more = f" ({len(problems) - 1} more)" if len(problems) > 1 else ""
        raise BotError(f"the database is not what the bots did: {problems[0]}{more}")
    orders = Counter(person.conditions for person in persons if ending[person.participant] != "left")
    return Summary(
        names,
        first,
        dict(Counter(ending.values())),
        dict(orders),
        sum(bot.steps for bot in bots),
        seconds,
        verified.states,
        any(sitting.min_gap_hours for sitting in study.content.sittings),
    )


class _Rows:
    """A connection that reads as a store does."""

    def __init__(self, connection: Any) -> None:
        self._connection = connection

    def read(self, sql: str, values: Sequence[Any] = ()) -> Any:
        return self._connection.execute(sql, values).fetchall()


def _row_problems(study: Study, connection: Any, ending: dict[str, str]) -> list[str]:
    """Where the database says something else than the bots."""
    from benchmarks.study.server.completion import missing

    stored = {
        row["participant"]: row for row in connection.execute("SELECT participant, state, conditions FROM participants")
    }
    found = []
    for name, expected in ending.items():
        if name not in stored:
            found.append(f"a bot that joined is no participant ({expected})")
            continue
        row = stored[name]
        if row["state"] != ("active" if expected == "left" else expected):
            found.append(f"{name} has state {row['state']!r}, the bot saw {expected!r}")
        if sorted(from_row(row["conditions"])) != sorted(study.conditions):
            found.append(f"{name} has conditions {row['conditions']}")
        if expected == "complete" and (gone := missing(_Rows(connection), study, name)):  # type: ignore[arg-type]
            found.append(f"{name} is complete without rows of {', '.join(gone)}")
    return found
