"""Tables through a session: what the pointer does to the hand, and what it cannot do."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from benchmarks.study.games import make_game
from benchmarks.study.timeline import timeline
from tests.benchmarks.study.pages_by_hand import Clock, Page, Served, served
from tests.benchmarks.study.participants import HOME, SLOTS
from tests.benchmarks.study.small_studies import BAR, PLACES, small_table

STEP = 1000 / 30
SAMPLE = 1000 / 60
RESTS = 18
WALL = {**BAR, "at": [0.40, 0.19], "size": [0.5, 0.02]}
ACROSS = [0.40, 0.40]


class Pointer:
    """The pointer of a page: it glides, and tells where it was once it is there."""

    def __init__(self, page: Page, clock: Clock, at: Sequence[float] = HOME, time: float = 0.0) -> None:
        self.page = page
        self.clock = clock
        self.at = list(at)
        self.time = time

    def way(self, to: Sequence[float], speed: float = 0.5) -> list[list[float]]:
        """Samples on the way to a point."""
        count = max(2, math.ceil(math.dist(self.at, to) / speed * 60))
        way = np.linspace(self.at, to, count + 1)[1:]
        return [[self.time + (k + 1) * SAMPLE, float(x), float(y)] for k, (x, y) in enumerate(way)]

    def tell(self, samples: Sequence[Sequence[float]]) -> dict[str, Any]:
        """Send samples; the answer, after which a screen may come."""
        answer = self.page.say("pointer", n=self.page.state["n"], samples=list(map(list, samples)), shown=1.0)
        if answer["type"] == "state" and answer["state"]["over"]:
            self.page.read()
        return answer

    def move(self, to: Sequence[float], speed: float = 0.5) -> dict[str, Any]:
        """Glide to a point, while as much time passes."""
        samples = self.way(to, speed)
        samples += [[samples[-1][0] + k * SAMPLE, *to] for k in range(1, RESTS + 1)]  # hands stop before they grasp
        self.clock.time += (samples[-1][0] - self.time) / 1000
        self.time, self.at = samples[-1][0], list(to)
        return self.tell(samples)

    def bring(self, condition: str, number: int) -> None:
        """Take a cube to its place, and let the hand arrive there."""
        self.move(PLACES[condition][number])
        assert self.page.state["holding"] == number
        self.move(SLOTS[number])


@contextmanager
def at_table(study: Any) -> Iterator[tuple[Served, Clock, str, Page]]:
    """A page in the practice of a table."""
    clock = Clock()
    with served(study, clock=clock) as server:
        token = server.join()
        with server.page(token) as page:
            page.agree()
            assert page.say("next")["clock"] == 0
            yield server, clock, token, page


def actions(server: Served) -> list[Any]:
    return [json.loads(row[0]) for row in server.rows("SELECT action FROM steps ORDER BY visit, step")]


def replayed(study: Any, server: Served) -> Any:
    """The open visit's game, played again from its rows; each digest has to be the stored one."""
    visit = server.rows("SELECT * FROM visits ORDER BY visit DESC LIMIT 1")[0]
    game = make_game(study, timeline(study, study.conditions)[visit["screen"]], visit["seed"])
    for row in server.rows("SELECT * FROM steps WHERE visit = ? ORDER BY step", visit["visit"]):
        assert row["before"] == game.digest()
        game.step(json.loads(row["action"]))
    return game


def test_a_practice_by_pointer_leaves_samples_steps_and_an_outcome(write_study: Callable[..., Any]) -> None:
    study = write_study("tabletop")
    with at_table(study) as (server, clock, _, page):
        Pointer(page, clock).bring("Baseline", 0)
        assert page.name == "round#Legible#1"
        outcome = json.loads(server.rows("SELECT outcome FROM visits WHERE kind = 'practice'")[0][0])
        assert outcome["reaches"] == 1
        assert len(actions(server)) == outcome["steps"]
        times = [row[0] for row in server.rows("SELECT at FROM pointer ORDER BY sample")]
        assert np.allclose(np.diff(times), SAMPLE)
        assert times[-1] >= outcome["steps"] * STEP - 1e-6


def test_samples_ahead_of_real_time_wait_for_it(write_study: Callable[..., Any]) -> None:
    """A page whose clock runs away plays no faster than time passes: a second ahead at most, none is lost."""
    study = write_study("tabletop")
    with at_table(study) as (server, clock, _, page):
        pointer = Pointer(page, clock)
        samples = pointer.way([0.50, 0.06], speed=0.02)  # five seconds, told at once
        assert pointer.tell(samples)["t"] == pytest.approx(30 * STEP)
        assert len(server.rows("SELECT * FROM pointer")) == len(samples)
        clock.time += 2.0
        held = pointer.tell([[samples[-1][0] + 1, 0.50, 0.06]])
        assert held["t"] == pytest.approx(int(2.0 * 1.05 * 30 + 30) * STEP, abs=2 * STEP)
        x = page.state["hand"][0]
        assert x == pytest.approx(0.40 + 0.02 * held["t"] / 1000, abs=0.003)
        clock.time += 10.0
        assert pointer.tell([[samples[-1][0] + 2, 0.50, 0.06]])["t"] == pytest.approx(5000, abs=STEP)
        # What is an hour ahead is no clock of a page at all.
        before = len(server.rows("SELECT * FROM pointer"))
        assert pointer.tell([[3.6e6, 0.2, 0.2]])["t"] == pytest.approx(5000, abs=STEP)
        assert len(server.rows("SELECT * FROM pointer")) == before


def test_samples_out_of_order_are_left_out(write_study: Callable[..., Any]) -> None:
    study = write_study("tabletop")
    with at_table(study) as (server, clock, _, page):
        clock.time += 1
        pointer = Pointer(page, clock)
        x, y = HOME
        pointer.tell([[50, x, y], [20, x, 0.4], [50, x, 0.4], [100, x + 0.02, y], [-5, 0, 0], [90, x, 0.4]])
        pointer.tell([[60, x, 0.4], [150, x + 0.03, y]])
        kept = [tuple(row) for row in server.rows("SELECT sample, at, x, y FROM pointer ORDER BY sample")]
        assert kept == [(0, 50.0, x, y), (1, 100.0, x + 0.02, y), (2, 150.0, x + 0.03, y)]
        # Four steps are played, up to a third of the way before the last sample.
        assert len(actions(server)) == 4
        assert page.state["hand"] == pytest.approx([x + 0.02 + 0.01 * 2 / 3, y], abs=1e-4)


@pytest.mark.parametrize("speed", [0.5, 3.0, 1000.0], ids=["slowly", "as fast as a hand", "in one jump"])
def test_no_pointer_takes_the_hand_through_a_hard_obstacle(write_study: Callable[..., Any], speed: float) -> None:
    study = write_study("tabletop", files={"layouts/practice.json": small_table("Baseline", [WALL])})
    with at_table(study) as (server, clock, _, page):
        pointer = Pointer(page, clock)
        pointer.move([0.40, 0.10])
        pointer.move(ACROSS, speed)
        for _ in range(3):  # and rests behind it, or swings
            pointer.move([0.45, 0.41])
            pointer.move(ACROSS)
        game = replayed(study, server)
        below = WALL["at"][1] - WALL["size"][1] / 2
        assert game.env.game.hand[1] < below
        assert page.state["hand"][1] < below
        assert page.state["crossings"] == 0


def test_crossings_of_soft_obstacles_are_counted(write_study: Callable[..., Any]) -> None:
    study = write_study(
        "tabletop",
        {"table.virtual_obstacles": "soft"},
        files={"layouts/practice.json": small_table("Baseline", [WALL])},
    )
    with at_table(study) as (server, clock, _, page):
        pointer = Pointer(page, clock)
        for crossings, to in enumerate((ACROSS, [0.42, 0.06], ACROSS), 1):
            pointer.move(to, speed=0.1)
            pointer.move(to)
            assert page.state["crossings"] == crossings
        assert replayed(study, server).outcome()["crossings"] == 3


@pytest.mark.parametrize("starts_again", [False, True], ids=["same server", "server starts again"])
def test_a_reload_goes_on_where_the_table_was(write_study: Callable[..., Any], starts_again: bool) -> None:
    study = write_study("tabletop")
    with at_table(study) as (server, clock, token, page):
        pointer = Pointer(page, clock)
        pointer.move(PLACES["Baseline"][0])
        pointer.move([0.40, 0.32])
        state, played = page.state, len(actions(server)) * STEP
        assert state["holding"] == 0
        if not starts_again:
            _go_on(server, clock, token, state, played)
    if starts_again:
        with served(study, clock=clock) as again:
            _go_on(again, clock, token, state, played)


def _go_on(server: Served, clock: Clock, token: str, state: Any, played: float) -> None:
    clock.time += 600.0
    with server.page(token, tab="after the reload") as page:
        assert page.screen["clock"] == pytest.approx(played)
        assert page.state == state
        pointer = Pointer(page, clock, at=state["hand"], time=page.screen["clock"])
        # The ten minutes that nobody was here are not time to catch up on.
        ahead = pointer.tell([[played + 5000, *state["hand"]]])
        assert ahead["t"] == pytest.approx(played + 1000, abs=0.05 * played + STEP)
    with server.page(token, tab="and again") as page:
        Pointer(page, clock, at=state["hand"], time=page.screen["clock"]).move(SLOTS[0])
        assert page.name == "round#Legible#1"
        numbers = [row[0] for row in server.rows("SELECT sample FROM pointer WHERE visit = 4 ORDER BY sample")]
        assert numbers == list(range(len(numbers)))


def test_the_robot_moves_beside_the_hand(write_study: Callable[..., Any]) -> None:
    study = write_study("tabletop", {"partner": {"kind": "robot"}, "practice.reaches": 2})
    with at_table(study) as (server, clock, _, page):
        assert page.screen["scene"]["robot"] is True
        before = page.state["robot"]
        pointer = Pointer(page, clock)
        x, y = PLACES["Baseline"][0]
        pointer.move([x, y - 0.06], speed=0.3)  # all the way to the red cube
        assert page.state["robot"][:2] != before[:2]
        assert page.state["robot"][3] == 1  # so that the robot goes for the blue one
        game = replayed(study, server)
        assert game.state() == page.state
