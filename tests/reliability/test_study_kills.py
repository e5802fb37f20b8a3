"""A study's server is killed (-9) under load: no acknowledged step is lost, and every game goes on where it was.

Each simulated participant keeps its own log of what the server has acknowledged, plays every game on a board of its
own, and compares the two after every acknowledgement, so also the first after a kill. What a kill of a process cannot
show is a loss of power: for that the database commits with ``synchronous=FULL`` before a step is acknowledged.
"""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.study.analysis.database import people
from benchmarks.study.analysis.replaying import replay, verify
from benchmarks.study.bots.direct import play_directly
from benchmarks.study.bots.participant import Participant
from benchmarks.study.bots.people import Person
from benchmarks.study.bots.process import ServerProcess
from benchmarks.study.bots.simulation import names_of
from benchmarks.study.design.study import Study, load_study
from benchmarks.study.store import database_path, open_readonly
from tests.support.repeats import Repeats
from tests.support.small_studies import small_study

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")]
PATIENCE = 180.0


async def _kill_under_load(
    server: ServerProcess,
    make_bot: Callable[[int], Participant],
    *,
    kills: int,
    at_once: int,
    rng: np.random.Generator,
) -> list[Participant]:
    """Kill the server so many times while so many bots are in their games; all that took part, all at their end."""
    taken: list[Participant] = []
    is_over = asyncio.Event()

    async def play() -> None:
        while not is_over.is_set():
            bot = make_bot(len(taken))
            taken.append(bot)
            await bot.run()

    def playing() -> int:
        return sum(bot.steps > 0 and not bot.ending for bot in taken)

    async def kill() -> None:
        for number in range(kills):
            steps = sum(bot.steps for bot in taken)
            while playing() < 0.9 * at_once or sum(bot.steps for bot in taken) == steps:
                await asyncio.sleep(0.005)
            # Some kills come among the first steps after the server is back, when everybody connects again.
            await asyncio.sleep(float(rng.uniform(0, 0.05 if number % 3 == 0 else 1.5)))
            server.kill()
            await asyncio.to_thread(server.start)
        is_over.set()

    async with asyncio.TaskGroup() as group:
        for _ in range(at_once):
            group.create_task(play())
        group.create_task(kill())
    return taken


def _check(study: Study, bots: list[Participant]) -> tuple[int, int]:
    """Compare the database with the bots' logs; how many steps they hold, and how many states a replay compared."""
    names = dict(zip(names_of(study, bots), bots, strict=True))
    assert len(names) == len(bots), "no bot became two participants"
    acknowledged = 0
    with open_readonly(database_path(study.folder, "debug")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone()[0] == "ok"
        stored = {
            (row["participant"], row["name"], row["attempt"], row["step"]): json.loads(row["action"])
            for row in connection.execute(
                "SELECT v.participant, v.name, v.attempt, s.step, s.action FROM steps s JOIN visits v USING (visit)"
            )
        }
        rows = connection.execute("SELECT COUNT(*) FROM steps").fetchone()[0]
        assert len(stored) == rows, "no step is there twice"
        for name, bot in names.items():
            assert bot.log is not None
            for each in bot.log:
                assert stored.get((name, each.screen, each.attempt, each.step)) == each.action, (name, each)
            acknowledged += len(bot.log)
        persons = [person for person in people(connection) if person.participant in names]
        verified = verify(study, connection, persons)
        assert not verified.mismatches, verified.mismatches[:3]
        assert verified.states == rows >= acknowledged
        assert {person.state for person in persons} == {
            "active" if bot.ending == "left" else "complete" for bot in bots
        }
    return acknowledged, verified.states


@pytest.mark.parametrize("domain", ["overcooked", "tabletop"])
def test_a_killed_server_loses_no_acknowledged_step(domain: str, tmp_path: Path, repeats: Repeats) -> None:
    study = load_study(small_study(tmp_path / "study", domain))
    kills, rng = repeats(2, 40), np.random.default_rng(3)
    with ServerProcess(study.folder) as server:

        def make_bot(number: int) -> Participant:
            return Participant(study, Person(1, number), server.link, keep_log=True, patience=PATIENCE)

        bots = asyncio.run(_kill_under_load(server, make_bot, kills=kills, at_once=6, rng=rng))
    assert {bot.ending for bot in bots} == {"complete"}
    broken = sum(bot.lost for bot in bots)
    assert broken >= kills, "connections were open when the server died"
    acknowledged, states = _check(study, bots)
    # Uninterrupted, without a server: the same people come to the same states.
    with open_readonly(database_path(study.folder, "debug")) as connection:
        for bot, name in [*zip(bots, names_of(study, bots), strict=True)][:8]:
            for screen, attempt, game in play_directly(study, bot.person, study.conditions):
                (visit,) = connection.execute(
                    "SELECT visit FROM visits WHERE participant = ? AND name = ? AND attempt = ?",
                    (name, screen.name, attempt),
                ).fetchone()
                assert replay(study, connection, visit).digest() == game.digest()
    print(
        f"{domain}: {kills} kills, {len(bots)} participants, {broken} connections broken, "
        f"{acknowledged:,} acknowledged steps, {states:,} states alike"
    )


def test_a_server_killed_in_a_storm_of_commits_loses_nothing(tmp_path: Path, repeats: Repeats) -> None:
    """200 connections step as fast as they are answered; many steps share a commit."""
    study = load_study(small_study(tmp_path / "study", "overcooked"))
    kills, rng = repeats(1, 5), np.random.default_rng(4)
    with ServerProcess(study.folder) as server:

        def make_bot(number: int) -> Participant:
            person = Person(2, number)
            return Participant(study, person, server.link, keep_log=True, patience=PATIENCE, leaves_at=(0.45, 40))

        bots = asyncio.run(_kill_under_load(server, make_bot, kills=kills, at_once=200, rng=rng))
    assert {bot.ending for bot in bots} == {"left"}
    assert sum(bot.lost for bot in bots) > 100 * kills
    acknowledged, states = _check(study, bots)
    print(f"{kills} kills, {len(bots)} participants, {acknowledged:,} acknowledged steps, {states:,} states alike")
