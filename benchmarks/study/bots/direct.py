"""The same simulated people without any server: what a study of bots must come to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.study.bots.people import Person, advance, make_player
from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.timeline import GAMES, Screen, timeline

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from benchmarks.study.design.study import Study
    from benchmarks.study.games.base import Game
    from legible_envs.rollouts.trajectory import Trajectory

__all__ = ["play_directly", "simulate_directly"]


def play_directly(study: Study, person: Person, order: Sequence[str]) -> Iterator[tuple[Screen, int, Game]]:
    """Every game that a person plays, one after another.

    Args:
        study: The design.
        person: Who plays.
        order: Of the conditions.

    Yields:
        ``(screen, attempt, game)``: the game when it is over; it is closed when the next one is asked for. A person who
        fails the practice plays no more.
    """
    earlier: list[tuple[Screen, dict[str, Any]]] = []
    for screen in timeline(study, order):
        if screen.kind not in GAMES:
            continue
        left = reaches_left(study, screen, earlier)
        if left == 0:
            continue
        practice = study.content.practice if screen.kind == "practice" else None
        for attempt in range(1, (practice.attempts if practice else 1) + 1):
            game = make_game(study, screen, 0, reaches_left=left)
            player = make_player(study, game, person, screen, attempt)
            while not game.is_over:
                advance(game, player.choose())
            yield screen, attempt, game
            outcome = game.outcome()
            game.close()
            if practice is None or outcome["finished"] or 0 < practice.reaches <= outcome.get("reaches", 0):
                break
        else:
            return
        earlier.append((screen, outcome))


def simulate_directly(
    study: Study, participants: int, seed: int, *, population: str = "boltzmann", first: int = 0
) -> list[Trajectory]:
    """The trajectories of the rounds of simulated people.

    Args:
        study: The design.
        participants: How many.
        seed: As of :func:`~benchmarks.study.bots.simulation.simulate`.
        population: In kitchens: how they walk.
        first: Number of the first person.

    Returns:
        Those of all participants, named by their numbers; with 0.15 s a step in kitchens.
    """
    found = []
    for number in range(first, first + participants):
        for screen, _, game in play_directly(study, Person(seed, number, population), study.conditions):
            if screen.kind == "round":
                found += game.trajectories(participant=str(number), condition=screen.condition)
    return found
