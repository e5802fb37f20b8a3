"""Simulated people who take part in a study: how each walks or reaches, and every choice they make.

A person is a seed and a number. Whatever they decide comes from generators made of these two and of the screen that
they are at, so the same person plays a round alike whether a server is in between or not, and in whichever order they
meet the conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol
from zlib import crc32

import numpy as np

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.games.base import Game
    from benchmarks.study.timeline import Screen

__all__ = ["POPULATIONS", "Person", "Player", "advance", "make_player"]

POPULATIONS: Final = ("boltzmann", "planner")
"""How people in kitchens choose their steps; both fitted to recorded participants, as in ``legible reproduce``."""


@dataclass(frozen=True, slots=True)
class Person:
    """A simulated person.

    Attributes:
        seed: Of the whole simulation.
        number: From 0.
        population: In kitchens: one of :data:`POPULATIONS`.
    """

    seed: int
    number: int
    population: str = "boltzmann"

    def rng(self, *words: object) -> np.random.Generator:
        """A generator of this person's own for one purpose, the same whenever it is asked for."""
        keys = [crc32(str(word).encode()) for word in words]
        return np.random.default_rng(np.random.SeedSequence([self.seed, self.number, *keys]))


class Player(Protocol):
    """Chooses moves in a game."""

    def choose(self) -> Any:
        """The next move.

        Returns:
            In a kitchen an action 0..5; at a table the point ``(x, y)`` to which the pointer goes, in metres, rounded
            to 0.1 mm as a page would tell it.
        """


class _Cook:
    """Walks and cooks as a fitted walker does."""

    def __init__(self, game: Any, person: Person, rng: np.random.Generator) -> None:
        from benchmarks.experiments.overcooked.sweep import FITTED, PREFERENCE
        from legible_envs.overcooked.humans.planner_fitting import draw_person
        from legible_envs.overcooked.policies import WalkingPlayer

        people = {"walker": person.population, "preference": PREFERENCE, **FITTED[person.population]}
        walker = draw_person(people)(game.layout.shape, person.rng("walker"))
        self._game = game
        self._policy = WalkingPlayer(game.env, walker, rng)

    def choose(self) -> int:
        return int(self._policy(self._game.obs, self._game.info))


class _Reacher:
    """Reaches and carries as a person of the population of reaches does; the hand is a pointer."""

    def __init__(self, game: Any, person: Person, rng: np.random.Generator) -> None:
        from benchmarks.study.games.tabletop import MAX_SPEED, RATE
        from legible_envs.tabletop.humans import sample_person
        from legible_envs.tabletop.policies import ReachingPlayer

        self._game = game
        self._step = MAX_SPEED / RATE
        self._policy = ReachingPlayer(_OwnAims(game.env), sample_person(person.rng("reaches")), rng)  # type: ignore[arg-type]

    @property
    def goal(self) -> str | None:
        """The object that the person means to take, of which the hand knows nothing."""
        return self._policy.goal

    def choose(self) -> tuple[float, float]:
        x, y = (float(v) for v in self._policy(self._game.obs, self._game.info))
        hand = self._game.env.game.hand
        return round(hand[0] + x * self._step, 4), round(hand[1] + y * self._step, 4)


class _OwnAims:
    """A table on which the person's goal stays in the person's head.

    ``ReachingPlayer`` tells the environment its goal, so that the hand takes no other object. A participant's page has
    no such means: there, and here, a slow hand takes whatever valid object it touches.
    """

    def __init__(self, env: Any) -> None:
        self._env = env
        self.goal: str | None = None

    @property
    def unwrapped(self) -> _OwnAims:
        return self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._env, name)


def make_player(study: Study, game: Game, person: Person, screen: Screen, attempt: int) -> Player:
    """A person at a game.

    Args:
        study: The design.
        game: Just begun; the player reads its state at every choice.
        person: Who plays.
        screen: Which round it is.
        attempt: From 1.
    """
    kind = _Cook if study.content.domain == "overcooked" else _Reacher
    return kind(game, person, person.rng(screen.name, attempt))


def advance(game: Game, move: Any) -> None:
    """Take a move of a player, with the action that the server makes of it."""
    game.step(move if isinstance(move, int) else game.action_to(*move))  # type: ignore[attr-defined]
