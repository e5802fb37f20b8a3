"""Where a participant is in a study: screens, visits, the round in play and the ending, in memory as on disk."""

from __future__ import annotations

import asyncio
import hashlib
import sqlite3
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.server.completion import counted_rounds, missing
from benchmarks.study.server.play import Play
from benchmarks.study.server.refusal import Refused
from benchmarks.study.server.screens import describe
from benchmarks.study.store import NoParticipant, rows
from benchmarks.study.store.outcomes import counted_outcome
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import GAMES, Ending, Screen, timeline

if TYPE_CHECKING:
    from benchmarks.study.games.base import Game
    from benchmarks.study.server.context import Context
    from benchmarks.study.store import Statement

__all__ = ["SEEN", "Progress"]

_HOUR: Final = 3600.0
SEEN: Final = 5.0
"""Seconds between two updates of when a participant was seen who acts."""


class Progress:
    """A participant's place in the study. What changes it is written first, and remembered once it is on disk.

    Args:
        context: What sessions share.
        participant: Whose.

    Attributes:
        index: Of the present screen in ``screens``.
        state: ``active``, or the ending. Who joined under another design of the study is ``expired`` here, but not in
            the database.
        play: The round in play, or None.
        visit: Number of the visit that is open, or 0.
        attempt: Of a game, from 1.
    """

    def __init__(self, context: Context, participant: str) -> None:
        self.context = context
        self.participant = participant
        row = context.store.read("SELECT * FROM participants WHERE participant = ?", (participant,))[0]
        self.order: list[str] = from_row(row["conditions"])
        self.seed = int(row["seed"])
        self.design = str(row["design"])
        self.index = int(row["screen"])
        self.state = str(row["state"])
        self.last_seen = float(row["seen"])
        self.is_of_other_design = self.design != context.study.design_hash
        self.screens: list[Screen] = [] if self.is_of_other_design else timeline(context.study, self.order)
        if self.is_of_other_design and self.state == "active":
            self.state = "expired"
        self.play: Play | None = None
        self.visit = 0
        self.attempt = 1

    @property
    def screen(self) -> Screen | None:
        """The present screen; None after the end."""
        return self.screens[self.index] if self.state == "active" and self.index < len(self.screens) else None

    @property
    def game(self) -> Game | None:
        """The round in play, or None."""
        return None if self.play is None else self.play.game

    def visits(self) -> list[sqlite3.Row]:
        """All visits of the participant, in order."""
        return self.context.store.read("SELECT * FROM visits WHERE participant = ? ORDER BY visit", (self.participant,))

    def gap(self) -> tuple[float | None, float | None]:
        """From when until when the sitting after a pause can begin, seconds since 1970; None: always."""
        screen = self.screen
        if screen is None or screen.kind != "pause":
            return None, None
        sitting = self.context.study.content.sittings[screen.sitting]
        before = [row["finished"] for row in self.visits() if row["finished"] is not None]
        last = max(before, default=self.context.now())
        opens = last + sitting.min_gap_hours * _HOUR if sitting.min_gap_hours else None
        return opens, last + sitting.max_gap_hours * _HOUR if sitting.max_gap_hours else None

    async def _take_up(self, screen: Screen) -> None:
        own = [row for row in self.visits() if row["screen"] == self.index]
        self.attempt = self._next_attempt(screen, own)
        unfinished = [row for row in own if row["finished"] is None]
        if not unfinished:
            self.visit = 0
            return
        visit = int(unfinished[-1]["visit"])
        if screen.kind in GAMES:
            steps = self.context.store.read("SELECT action FROM steps WHERE visit = ? ORDER BY step", (visit,))
            actions = [from_row(row["action"]) for row in steps]
            game = await asyncio.to_thread(
                self._played, screen, int(unfinished[-1]["seed"]), actions, self._counted_rounds()
            )
            count = self.context.store.read("SELECT COUNT(*) FROM pointer WHERE visit = ?", (visit,))[0][0]
            self._begin_play(game, visit, samples=int(count))
        self.visit = visit

    @staticmethod
    def _next_attempt(screen: Screen, own: Sequence[sqlite3.Row]) -> int:
        finished = [row for row in own if row["finished"] is not None]
        if screen.kind == "practice":
            finished = [row for row in finished if counted_outcome(row["finished"], row["outcome"]) is not None]
        return 1 + len(finished)

    def _counted_rounds(self) -> list[tuple[Screen, dict[str, Any]]]:
        return counted_rounds(self.screens, self.visits())

    def _played(
        self, screen: Screen, seed: int, actions: Sequence[Any], earlier: Sequence[tuple[Screen, dict[str, Any]]]
    ) -> Game:
        """A game, played up to where it was."""
        left = reaches_left(self.context.study, screen, earlier)
        game = make_game(self.context.study, screen, seed, reaches_left=left)
        for action in actions:
            game.step(game.read_action(action))
        return game

    def _begin_play(self, game: Game, visit: int, *, samples: int) -> None:
        belief = self.context.study.content.look.show_belief
        self.play = Play(game, visit, samples=samples, now=self.context.now(), belief=belief)

    def _forget_game(self) -> None:
        """No game is in play; it is taken up again as the database has it."""
        if self.play is not None:
            self.play.game.close()
        self.play, self.visit = None, 0

    async def _show(self) -> dict[str, Any]:
        """The present screen, its visit begun."""
        if self.state == "active":
            while self.screen is not None and self._is_needless(self.screen):
                self.index += 1
            if self.screen is None:
                await self._finish()
            screen = self.screen
            if screen is not None and screen.kind not in GAMES and not self.visit:
                await self._begin_visit(screen)
        return describe(self)

    def _is_needless(self, screen: Screen) -> bool:
        """Whether a round is left out because the reaches of its condition are made."""
        if screen.kind != "round" or self.visit:
            return False
        return reaches_left(self.context.study, screen, self._counted_rounds()) == 0

    async def _begin_visit(self, screen: Screen, layout_id: str = "", seed: int = 0) -> None:
        visit, now = self.context.next_visit(), self.context.now()
        await self._write(
            rows.visit_row(
                visit, self.participant, self.design, self.index, screen, now,
                attempt=self.attempt, layout_id=layout_id, seed=seed,
            ),
            rows.moved_on(self.participant, self.index, now),
        )  # fmt: skip
        self.visit = visit

    async def _begin_game(self, screen: Screen) -> None:
        number = self.index * 1000 + self.attempt
        seed = int.from_bytes(hashlib.sha256(f"{self.seed}/{number}".encode()).digest()[:6], "big")
        game = await asyncio.to_thread(self._played, screen, seed, (), self._counted_rounds())
        await self._begin_visit(screen, game.env.layout.layout_id, seed)
        self._begin_play(game, self.visit, samples=0)

    async def _finish(self) -> None:
        """All screens are done: complete, if the database says so; else back to the first one whose rows are lost.

        Raises:
            Refused: The database does not know the participant any more.
        """
        lacking = missing(self.context.store, self.context.study, self.participant)
        if not lacking:
            await self._end("complete")
            return
        await self.log("incomplete", screens=lacking)
        places = {screen.name: index for index, screen in enumerate(self.screens)}
        if lacking[0] not in places:
            raise Refused("unknown participant", fatal=True)
        self.index, self.visit = places[lacking[0]], 0
        own = [row for row in self.visits() if row["screen"] == self.index]
        self.attempt = self._next_attempt(self.screens[self.index], own)

    async def _end(self, ending: Ending, *statements: Statement) -> None:
        now = self.context.now()
        await self._write(
            *statements,
            rows.moved_on(self.participant, self.index, now, state=ending),
            rows.event_row(self.participant, self.design, now, "ended", ending=ending, screen=self.index),
        )
        self.state, self.last_seen = ending, now
        self._forget_game()

    async def _write(self, *statements: Statement) -> None:
        """Put rows on disk; of somebody who was forgotten meanwhile, nothing is written any more.

        Raises:
            Refused: The database does not know the participant any more.
            sqlite3.Error: It could not be stored.
        """
        if not statements:
            return
        try:
            await self.context.store.write(*statements, of=self.participant)
        except NoParticipant as error:
            self._forget_game()
            raise Refused("unknown participant", fatal=True) from error

    async def log(self, kind: str, /, **detail: Any) -> None:
        """Keep an event."""
        now = self.context.now()
        await self._write(
            rows.event_row(self.participant, self.design, now, kind, **detail), *self._sign_of_life(now, SEEN)
        )

    def _sign_of_life(self, now: float, every: float) -> list[Statement]:
        if now - self.last_seen < every:
            return []
        self.last_seen = now
        return [rows.seen(self.participant, now)]
