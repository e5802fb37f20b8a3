"""Simulated participants go through the real server, and come to what the same people come to without one."""

from __future__ import annotations

import asyncio
import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.study.analysis.replaying import replay
from benchmarks.study.bots.direct import play_directly, simulate_directly
from benchmarks.study.bots.link import BotError
from benchmarks.study.bots.participant import Participant
from benchmarks.study.bots.people import Person, make_player
from benchmarks.study.bots.process import ServerProcess
from benchmarks.study.bots.simulation import names_of, simulate
from benchmarks.study.design.study import Study, load_study
from benchmarks.study.errors import StudyError
from benchmarks.study.games import make_game
from benchmarks.study.store import database_path, open_readonly
from benchmarks.study.timeline import timeline
from tests.support.signals import hear_ctrl_c
from tests.support.small_studies import small_study

DOMAINS = ("overcooked", "tabletop")


@pytest.fixture(scope="module", params=DOMAINS)
def study(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study(small_study(tmp_path_factory.mktemp("study") / request.param, request.param))


def test_bots_come_to_what_the_same_people_come_to_without_a_server(study: Study) -> None:
    """Every action, every state and every trajectory, whatever the order of conditions and the seeds of the server."""
    simulate(study, 1, seed=4)
    found = simulate(study, 2, seed=4)
    assert found.endings == {"complete": 2}
    assert found.first == 1, "a second simulation adds people"
    assert found.states == found.steps > 100
    expected: dict[tuple[str, str], list[Any]] = {}
    for each in simulate_directly(study, 2, 4, first=1):
        expected.setdefault((each.participant, each.condition), []).append(each)
    with open_readonly(database_path(study.folder, "debug")) as connection:
        for number, name in enumerate(found.participants, 1):
            order = connection.execute("SELECT conditions FROM participants WHERE participant = ?", (name,)).fetchone()
            for screen, attempt, game in play_directly(study, Person(4, number), json.loads(order[0])):
                visit, outcome = connection.execute(
                    "SELECT visit, outcome FROM visits WHERE participant = ? AND name = ? AND attempt = ?",
                    (name, screen.name, attempt),
                ).fetchone()
                assert json.loads(outcome) == json.loads(json.dumps(game.outcome()))
                copy = replay(study, connection, visit)
                assert copy.digest() == game.digest()
                ours = copy.trajectories(participant=str(number), condition=screen.condition)
                assert screen.kind == "practice" or ours == expected.pop((str(number), screen.condition))
    assert not expected
    assert not list(study.folder.glob("data/live*")), "bots are debug participants"


def test_who_drops_out_leaves_whole_rows_and_is_no_completed_participant(study: Study) -> None:
    found = simulate(study, 4, seed=5, drop_out=1.0)
    assert found.endings == {"left": 4}
    assert not found.orders
    with open_readonly(database_path(study.folder, "debug")) as connection:
        states = {
            row["state"]
            for row in connection.execute("SELECT participant, state FROM participants")
            if row["participant"] in found.participants
        }
    assert states == {"active"}


def test_a_bot_notices_a_server_that_plays_another_game(study: Study) -> None:
    """What a bot compares can fail: with another layout on its own board, it does."""
    layouts, (first, second) = study.layouts, (entry.layout for entry in study.content.conditions)
    other = dataclasses.replace(study, layouts={**layouts, first: layouts[second], second: layouts[first]})
    with ServerProcess(study.folder) as server, pytest.raises(BotError, match="differs from the server in"):
        asyncio.run(Participant(other, Person(0, 0), server.link).run())


def test_the_order_of_conditions_changes_nothing_that_a_person_does(study: Study) -> None:
    person, names = Person(2, 7), study.conditions
    played = [
        {screen.name: game.digest() for screen, _, game in play_directly(study, person, order)}
        for order in (names, names[::-1])
    ]
    assert played[0] == played[1]
    assert len(played[0]) == len(names) + 1


def test_people_differ_from_each_other(study: Study) -> None:
    screen = next(screen for screen in timeline(study, study.conditions) if screen.kind == "round")
    seen = set()
    for person in (Person(0, 0), Person(0, 1), Person(1, 0)):
        game = make_game(study, screen, 0)
        player = make_player(study, game, person, screen, 1)
        moves = []
        for _ in range(60):
            moves.append(player.choose())
            game.step(moves[-1] if isinstance(moves[-1], int) else game.action_to(*moves[-1]))  # type: ignore[attr-defined]
        seen.add(tuple(moves))
    assert len(seen) == 3


@pytest.mark.slow
def test_a_stopped_command_takes_its_server_along(study: Study) -> None:
    """Ctrl-C while bots play: one line, the exit code of a stop, and no process that stays."""
    command = "import sys; from benchmarks.cli.study_simulate import simulate; simulate(sys.argv[1:])"
    process = subprocess.Popen(
        [sys.executable, "-c", command, str(study.folder), "--participants", "500"],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=hear_ctrl_c,
    )  # fmt: skip
    path = database_path(study.folder, "debug")

    def steps() -> int:
        try:
            with open_readonly(path) as connection:
                return int(connection.execute("SELECT COUNT(*) FROM steps").fetchone()[0])
        except StudyError:
            return 0

    before, deadline = steps(), time.monotonic() + 120
    while steps() < before + 20 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert re.fullmatch(r"stopped; the participants so far are in the debug database\..*\n", said), said
    simulate(study, 1)  # the lock on the database is free: nobody serves it any more


@pytest.mark.slow
def test_a_study_of_bots_gives_the_result_of_the_people_themselves(tmp_path: Path) -> None:
    """Accuracy of Eq. 1 at half of the way: bots through the server, and other people of the population directly."""
    from predictors import make_predictor

    soups = '[["tomato", "tomato", "onion"], ["onion", "onion", "cabbage"]]'
    study = load_study(small_study(tmp_path / "study", "overcooked", conditions=1, soups=soups))
    found = simulate(study, 8, seed=100)
    through: list[Any] = []
    with open_readonly(database_path(study.folder, "debug")) as connection:
        for row in connection.execute("SELECT visit, participant FROM visits WHERE kind = 'round'").fetchall():
            game = replay(study, connection, row["visit"])
            through.append(game.trajectories(participant=row["participant"], condition="c"))
    directly = [simulate_directly(study, 1, 200, first=number) for number in range(40)]

    def accuracies(people: list[Any]) -> Any:
        means = []
        for own in people:
            kept = [each for each in own if len(each.candidates) > 1]
            fitted = make_predictor("bayesian").fit(kept)
            prefixes = [each.prefix(0.5) for each in kept]
            means.append(np.mean([a == each.goal for a, each in zip(fitted.predict(prefixes), kept, strict=True)]))
        return np.array(means)

    ours, theirs = accuracies(through), accuracies(directly)
    assert len(ours) == found.endings["complete"] == 8
    spread = np.hypot(ours.std(ddof=1) / np.sqrt(len(ours)), theirs.std(ddof=1) / np.sqrt(len(theirs)))
    assert 0 < spread < 0.2
    assert abs(ours.mean() - theirs.mean()) < 3 * spread, (ours.mean(), theirs.mean(), spread)


def test_names_of_bots_are_those_of_their_tokens(study: Study) -> None:
    found = simulate(study, 1)
    bot = Participant(study, Person(0, 0), "")
    assert names_of(study, [bot]) == [""]
    assert found.participants[0].startswith("D")
