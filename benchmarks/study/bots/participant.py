"""A simulated participant: a person at a page, who does what every screen asks for, and looks the server in the cards.

The bot plays every game on a board of its own, made by the same :func:`~benchmarks.study.games.make_game`, and compares
what the server says after each step with what it has there. Where the two differ, it says so loudly.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.bots.answers import random_answers
from benchmarks.study.bots.link import BotError, Link, Lost, join
from benchmarks.study.bots.people import Person, Player, advance, make_player
from benchmarks.study.games import make_game
from benchmarks.study.timeline import GAMES, Screen, timeline

if TYPE_CHECKING:
    import numpy as np

    from benchmarks.study.design.study import Study
    from benchmarks.study.games.base import Game

__all__ = ["Acknowledged", "Pace", "Participant"]

_BATCH: Final = 30
"""Steps at a table that are told at once when nothing has to look like real time."""
_TOLD: Final = 2
"""The same in real time: 15 messages a second, as the page sends them."""
_PINGS: Final = 3


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a bot is.

    Attributes:
        factor: 0: as fast as the server answers; 1: as fast as people; 0.5: twice as fast. The times that the bot tells
            the server are those of people in any case.
        key: Seconds between two keys of a person, median.
        screen: Seconds at a text or questionnaire, median.
    """

    factor: float = 0.0
    key: float = 0.2
    screen: float = 4.0


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """A step that the server has acknowledged."""

    screen: str
    attempt: int
    step: int
    action: Any


@dataclass(eq=False)
class _Round:
    """A game in play: the bot's own board, when keys come, and ``(move, action)`` that are not acknowledged yet."""

    screen: Screen
    attempt: int
    game: Game
    player: Player
    keys: np.random.Generator
    told: int = 0
    moves: list[Any] = field(default_factory=list)

    @property
    def key(self) -> tuple[str, int]:
        return self.screen.name, self.attempt


class Participant:
    """A bot; :meth:`run` takes part from the first screen to the last.

    Args:
        study: The design, as the server has it.
        person: Who plays.
        link: The participants' link.
        pace: How fast.
        leaves_at: ``(progress, steps)``: the bot leaves for good at the first screen so far on (0 to 1); if that is a
            game, after so many steps. None: never.
        keep_log: Whether to keep every acknowledged step.
        patience: Seconds to wait for a server that is away.

    Attributes:
        token: Of the participant, once it has joined.
        ending: Of the session; ``"left"`` where the bot went away; empty before.
        steps: Acknowledged steps.
        log: Them, where they are kept.
        code: What the last page shows.
        lost: How often the connection broke.
    """

    def __init__(
        self,
        study: Study,
        person: Person,
        link: str,
        *,
        pace: Pace | None = None,
        leaves_at: tuple[float, int] | None = None,
        keep_log: bool = False,
        patience: float = 30.0,
    ) -> None:
        self.study = study
        self.person = person
        self.link = link
        self.pace = pace or Pace()
        self.leaves_at = leaves_at
        self.patience = patience
        self.token = self.ending = self.code = ""
        self.steps = self.lost = 0
        self.log: list[Acknowledged] | None = [] if keep_log else None
        self._screens = {screen.name: screen for screen in timeline(study, study.conditions)}
        self._round: _Round | None = None
        self._habits = person.rng("habits")
        self._leaves_from = ""
        self._clock = 1000.0

    async def run(self) -> str:
        """Take part.

        Returns:
            The ending.

        Raises:
            BotError: The server said what it must not say, or has another state than the bot.
            TimeoutError: It stayed away.
        """
        self.token = await join(self.link, patience=self.patience)
        base = self.link.split("/debug")[0].split("/?")[0].rstrip("/")
        link = Link(base, self.token, f"bot-{self.person.seed}-{self.person.number}", patience=self.patience)
        try:
            screen = await link.open()
            while not self.ending:
                try:
                    screen = await self._act(link, screen)
                except Lost:
                    await link.close()
                    screen = await link.open()
        finally:
            await link.close()
            self.lost = link.lost - 1
        return self.ending

    async def _act(self, link: Link, screen: dict[str, Any]) -> dict[str, Any]:
        """Do what a screen asks for; returns the next one."""
        if screen["type"] != "screen":
            raise BotError(f"expected a screen, got {json.dumps(screen)[:300]}")
        kind = screen["kind"]
        if kind == "end":
            self.ending, self.code = screen["ending"], screen["code"]
            return screen
        if kind in GAMES:
            return await self._play(link, screen)
        if self._has_left(screen):
            return screen
        await self._think(float(self._habits.lognormal(0.0, 0.5)) * self.pace.screen)
        if kind == "device":
            return await link.ask(await self._device(link, screen))
        if kind == "consent":
            return await link.ask({"type": "consent", "agreed": True})
        if kind == "questionnaire":
            return await link.ask(self._answers(screen))
        if kind in ("text", "pause"):
            return await link.ask({"type": "next"})
        raise BotError(f"a bot does not know screens of kind {kind!r}")

    async def _think(self, seconds: float) -> None:
        """Let the person's own clock go on, and wait as much as the pace says."""
        self._clock += 1000.0 * seconds
        if self.pace.factor > 0:
            await asyncio.sleep(self.pace.factor * seconds)

    def _has_left(self, screen: dict[str, Any], steps: int = 0) -> bool:
        if self.leaves_at is None or screen["progress"] < self.leaves_at[0]:
            return False
        self._leaves_from = self._leaves_from or screen["name"]
        plays_on = screen["kind"] in GAMES and screen["name"] == self._leaves_from and steps < self.leaves_at[1]
        if not plays_on:
            self.ending = "left"
        return not plays_on

    async def _device(self, link: Link, screen: dict[str, Any]) -> dict[str, Any]:
        """What a good device finds, and the true way to the server and back."""
        needs, trips = screen["needs"], []
        for _ in range(_PINGS):
            begun = time.monotonic()
            await link.ask({"type": "ping", "at": self._clock})
            trips.append(1000.0 * (time.monotonic() - begun))
        return {
            "type": "device",
            "keyboard": True,
            "pointer": "touch" if needs["pointer"] == "touch" else "fine",
            "width": max(1280, needs["min_width"]),
            "height": max(800, needs["min_height"]),
            "round_trip": statistics.median(trips),
        }

    def _answers(self, screen: dict[str, Any]) -> dict[str, Any]:
        if screen["errors"]:
            raise BotError(f"answers of a bot on {screen['name']!r} were refused: {screen['errors']}")
        asked = self.study.questionnaires[self._screens[screen["name"]].questionnaire]
        expected = {item.name: item.expected for item in asked.items if item.kind == "attention"}
        rng = self.person.rng(screen["name"])
        values = random_answers(screen["items"], rng, expected=expected)
        return {"type": "answers", "values": values, "seconds": float(rng.lognormal(3.0, 0.5))}

    # -- games --------------------------------------------------------------------------------------------------------

    async def _play(self, link: Link, screen: dict[str, Any]) -> dict[str, Any]:
        if not screen["begun"]:
            await self._think(self.pace.screen)
            return await link.ask({"type": "next"})
        current = self._take_up(screen)
        while current.told < current.game.steps or not current.game.is_over:
            if self._has_left(screen, current.told):
                return screen
            message, played = await self._next_message(current)
            answer = await link.ask(message)
            if answer["type"] != "state":
                raise BotError(f"a step is answered by {json.dumps(answer)[:300]}")
            self._acknowledge(current, answer["state"], played)
        self._round = None
        current.game.close()
        return await link.hear()

    def _take_up(self, screen: dict[str, Any]) -> _Round:
        """The round of a screen: a new one, or the one in play as far as the server has it."""
        key, state = (screen["name"], screen["attempt"]), screen["state"]
        current = self._round
        if current is None or current.key != key:
            if state["n"]:
                raise BotError(f"{key} has {state['n']} steps that the bot has not played")
            shown = self._screens[screen["name"]]
            # The seed is the server's secret: nothing in these games is random.
            game = make_game(self.study, shown, 0, reaches_left=screen["scene"].get("wanted"))
            player = make_player(self.study, game, self.person, shown, screen["attempt"])
            keys = self.person.rng("keys", *key)
            current = self._round = _Round(shown, screen["attempt"], game, player, keys)
            self._compare(current, state)
            return current
        if not current.told <= state["n"] <= current.game.steps:
            raise BotError(f"{key} was at step {current.told}, now it is at {state['n']}: acknowledged steps are lost")
        self._acknowledge(current, state, None)
        return current

    def _acknowledge(self, current: _Round, state: dict[str, Any], played: int | None) -> None:
        """Take note of steps that are on disk, and compare the boards."""
        n = state["n"]
        if played is not None and not current.told <= n <= played:
            raise BotError(f"{current.key}: the server is at step {n}, the bot has told {played}")
        for step, (_, action) in enumerate(current.moves[: n - current.told], current.told):
            self.steps += 1
            if self.log is not None:
                self.log.append(Acknowledged(current.screen.name, current.attempt, step, action))
        del current.moves[: n - current.told]
        current.told = n
        self._compare(current, state)

    def _compare(self, current: _Round, state: dict[str, Any]) -> None:
        """Whether server and bot have the same state, where both are at the same step."""
        if state["n"] != current.game.steps:
            return
        own = current.game.state(self.study.content.look.show_belief)
        if own != state:
            differing = sorted(key for key in own.keys() | state.keys() if own.get(key) != state.get(key))
            raise BotError(
                f"bot {self.person.number} at step {state['n']} of {current.key} differs from the server in "
                f"{differing}:\nbot    {json.dumps(own)}\nserver {json.dumps(state)}"
            )

    async def _next_message(self, current: _Round) -> tuple[dict[str, Any], int]:
        """The next steps to tell, played on the bot's own board first; and up to which step they lead."""
        if self.study.content.domain == "overcooked":
            if not current.moves:
                self._move(current)
            shown = self._clock
            await self._think(float(current.keys.lognormal(0.0, 0.35)) * self.pace.key)
            message = {"type": "step", "n": current.told, "action": current.moves[0][0]}
            return {**message, "down": round(self._clock, 1), "shown": round(shown, 1)}, current.told + 1
        batch = _BATCH if self.pace.factor == 0 else _TOLD
        while len(current.moves) < batch and not current.game.is_over:
            self._move(current)
        told, shown = current.moves[:batch], self._clock
        await self._think(len(told) / 30)
        samples = [[(current.told + k) * 1000.0 / 30, *point] for k, (point, _) in enumerate(told, 1)]
        message = {"type": "pointer", "n": current.told, "samples": samples, "shown": round(shown, 1)}
        return message, current.told + len(told)

    def _move(self, current: _Round) -> None:
        """Choose a move and take it on the bot's own board."""
        move, game = current.player.choose(), current.game
        action = move if isinstance(move, int) else game.action_to(*move)  # type: ignore[attr-defined]
        advance(game, move)
        current.moves.append((move, action))
