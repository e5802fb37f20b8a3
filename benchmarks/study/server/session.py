"""One participant's way through a study: what a message does, and what is shown next. No sockets in here."""

from __future__ import annotations

import asyncio
import hashlib
import json
import sqlite3
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.games import make_game, reaches_left
from benchmarks.study.server import protocol as p
from benchmarks.study.server.completion import is_complete
from benchmarks.study.server.device import failures
from benchmarks.study.server.screens import describe
from benchmarks.study.store import rows
from benchmarks.study.timeline import GAMES, Ending, Screen, timeline

if TYPE_CHECKING:
    from benchmarks.study.games.base import Game
    from benchmarks.study.server.context import Context

__all__ = ["Refused", "Session"]

_HOUR: Final = 3600.0


class Refused(Exception):
    """A message that did nothing; what is told to the page."""

    def __init__(self, reason: str, **more: Any) -> None:
        super().__init__(reason)
        self.reply = {"type": "refused", "reason": reason, **more}


class Session:
    """A participant's session, as the database has it.

    Args:
        context: What sessions share.
        participant: Whose.

    Attributes:
        index: Of the present screen in ``screens``.
        state: ``active``, or the ending.
        game: The round in play, or None.
        visit: Number of the visit that is open, or 0.
        attempt: Of a game, from 1.
    """

    def __init__(self, context: Context, participant: str) -> None:
        self.context = context
        self.participant = participant
        row = context.store.read("SELECT * FROM participants WHERE participant = ?", (participant,))[0]
        self.order: list[str] = json.loads(row["conditions"])
        self.seed = int(row["seed"])
        self.design = str(row["design"])
        self.index = int(row["screen"])
        self.state = str(row["state"])
        self.last_seen = float(row["seen"])
        self.ended: float | None = row["ended"]
        self.screens = timeline(context.study, self.order)
        self.game: Game | None = None
        self.visit = 0
        self.attempt = 1
        self.clock_begun = 0.0
        self._track: Any = None
        self._samples = 0
        self.tab = ""
        self._earlier: list[tuple[Screen, dict[str, Any]]] = []
        self._lock = asyncio.Lock()

    # -- where the participant is -------------------------------------------------------------------------------------

    @property
    def screen(self) -> Screen | None:
        """The present screen; None after the end."""
        return self.screens[self.index] if self.state == "active" and self.index < len(self.screens) else None

    def visits(self) -> list[sqlite3.Row]:
        """All visits of the participant, in order."""
        return self.context.store.read("SELECT * FROM visits WHERE participant = ? ORDER BY visit", (self.participant,))

    def _rounds(self) -> list[tuple[Screen, dict[str, Any]]]:
        """Finished rounds and what they came to."""
        return [
            (self.screens[row["screen"]], json.loads(row["outcome"]))
            for row in self.visits()
            if row["finished"] is not None and row["kind"] == "round"
        ]

    async def open(self, tab: str) -> dict[str, Any]:
        """The participant is here, with a new page or an old one.

        Args:
            tab: Random, of the browser's tab: a page that comes back after a lost connection still has it, a reloaded
                one does not.

        Returns:
            The ``screen`` to show.
        """
        async with self._lock:
            now = self.context.now()
            if self.state == "active":
                is_same_page = tab == (self.tab or self._last_tab())
                await self._restore(now, is_same_page)
            self.tab = tab
            return await self._show()

    def _last_tab(self) -> str:
        found = self.context.store.read(
            "SELECT detail FROM events WHERE participant = ? AND kind = 'connect' ORDER BY event DESC LIMIT 1 OFFSET 1",
            (self.participant,),
        )
        return str(json.loads(found[0]["detail"]).get("tab", "")) if found else ""

    async def _restore(self, now: float, is_same_page: bool) -> None:
        """Take up the open visit where the database has it, as far as the study's policy lets a page be reloaded."""
        limits, screen = self.context.study.content.limits, self.screen
        if screen is None:
            return
        if screen.kind != "pause" and now - self.last_seen > limits.resume_hours * _HOUR > 0:
            await self._end("expired")
            return
        if self.game is None:
            await self._take_up(screen)
        if self.game is not None and self.game.is_over:  # the server died between the last step and what follows it
            await self._game_over(self.game)
            return
        if self.game is not None and not is_same_page and limits.resume != "resume":
            if limits.resume == "block":
                await self._end("blocked")
                return
            outcome = {**self.game.outcome(), "restarted": True}
            await self._write(rows.finish_visit(self.visit, now, outcome))
            self.game, self.visit, self.attempt = None, 0, self.attempt + 1

    async def _take_up(self, screen: Screen) -> None:
        own = [row for row in self.visits() if row["screen"] == self.index]
        unfinished = [row for row in own if row["finished"] is None]
        self.attempt = max((row["attempt"] for row in own), default=0) + (0 if unfinished else 1)
        if not unfinished:
            return
        self._earlier = self._rounds()
        self.visit = unfinished[-1]["visit"]
        if screen.kind in GAMES:
            seed = int(unfinished[-1]["seed"])
            steps = self.context.store.read("SELECT action FROM steps WHERE visit = ? ORDER BY step", (self.visit,))
            actions = [json.loads(row["action"]) for row in steps]
            self.game = await asyncio.to_thread(self._played, screen, seed, actions)
            count = "SELECT COUNT(*) FROM pointer WHERE visit = ?"
            self._samples = int(self.context.store.read(count, (self.visit,))[0][0])
            self._start_clock()

    def _played(self, screen: Screen, seed: int, actions: Sequence[Any]) -> Game:
        """A game, played up to where it was."""
        left = reaches_left(self.context.study, screen, self._earlier) if screen.kind == "round" else None
        game = make_game(self.context.study, screen, seed, reaches_left=left)
        for action in actions:
            game.step(game.read_action(action))
        return game

    def _start_clock(self) -> None:
        if self.context.study.content.domain == "tabletop" and self.game is not None:
            from benchmarks.study.games.pointer import PointerTrack

            self._track = PointerTrack(self.game.env.game.hand, self.game.steps)
            self.clock_begun = self.context.now() - self._track.time / 1000.0

    async def _show(self) -> dict[str, Any]:
        """The present screen, its visit begun."""
        screen = self.screen
        if self.state == "active":
            while screen is not None and self._is_needless(screen):
                self.index += 1
                screen = self.screen
            if screen is None:
                await self._finish()
            elif screen.kind not in GAMES and not self.visit:
                await self._begin_visit(screen)
        return describe(self)

    def _is_needless(self, screen: Screen) -> bool:
        """Whether a round is left out because the reaches of its condition are made."""
        self._earlier = self._rounds()
        return self.visit == 0 and reaches_left(self.context.study, screen, self._earlier) == 0

    async def _begin_visit(self, screen: Screen, layout_id: str = "", seed: int = 0) -> None:
        self.visit = self.context.next_visit()
        now = self.context.now()
        await self._write(
            rows.visit_row(
                self.visit, self.participant, self.design, self.index, screen, now,
                attempt=self.attempt, layout_id=layout_id, seed=seed,
            ),
            rows.moved_on(self.participant, self.index, now),
        )  # fmt: skip

    async def _write(self, *statements: Any) -> None:
        await self.context.store.write(*statements)

    # -- what messages do ---------------------------------------------------------------------------------------------

    async def handle(self, message: p.Message) -> list[dict[str, Any]]:
        """Do what a message asks for.

        Returns:
            What the page is told, once it is on disk.

        Raises:
            Refused: It does not fit the present screen.
        """
        async with self._lock:
            if isinstance(message, p.Ping):
                return [{"type": "pong", "at": message.at}]
            if isinstance(message, p.Event):
                detail = {"at": message.at, "detail": message.detail}
                await self.log(f"page_{message.kind}", **detail)
                return []
            if self.state != "active":
                return [await self._show()]
            if isinstance(message, p.Withdraw):
                await self._end("withdrawn")
                return [await self._show()]
            return await self._handle_here(message)

    async def _handle_here(self, message: p.Message) -> list[dict[str, Any]]:
        screen = self.screen
        assert screen is not None
        kind = screen.kind
        if isinstance(message, p.Step) and kind in GAMES:
            return await self._step(message)
        if isinstance(message, p.Pointer) and kind in GAMES:
            return await self._move(message)
        if isinstance(message, p.Next) and kind in (*GAMES, "text", "pause"):
            return await self._next(screen)
        if isinstance(message, p.Device) and kind == "device":
            return await self._check_device(message)
        if isinstance(message, p.Consent) and kind == "consent":
            return await self._consent(message)
        if isinstance(message, p.Answers) and kind == "questionnaire":
            return await self._answer(screen, message)
        raise Refused(f"a message of type {message.type!r} does not belong to the present screen ({kind})")

    async def _next(self, screen: Screen) -> list[dict[str, Any]]:
        if screen.kind in GAMES:
            if self.game is not None:
                raise Refused("the round has begun")
            await self._begin_game(screen)
            return [await self._show()]
        if screen.kind == "pause":
            opens, closes = self.gap()
            now = self.context.now()
            if opens is not None and now < opens:
                raise Refused("the next part cannot begin yet")
            if closes is not None and now > closes:
                await self._end("expired")
                return [await self._show()]
        return await self._advance({})

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

    async def _check_device(self, message: p.Device) -> list[dict[str, Any]]:
        found = message.model_dump(exclude={"type"})
        failed = failures(self.context.study, found)
        if not failed:
            return await self._advance(found)
        await self._write(rows.finish_visit(self.visit, self.context.now(), {**found, "failed": failed}))
        await self._end("device_failed")
        return [{**await self._show(), "failed": failed}]

    async def _consent(self, message: p.Consent) -> list[dict[str, Any]]:
        if not message.agreed:
            await self._write(rows.finish_visit(self.visit, self.context.now(), {"agreed": False}))
            await self._end("refused")
            return [await self._show()]
        text, now = self.context.study.texts["consent"], self.context.now()
        digest = hashlib.sha256(text.encode()).hexdigest()
        return await self._advance(
            {"agreed": True},
            rows.text_row(digest, "consent", text, now),
            rows.answer_rows(self.visit, self.participant, self.design, "consent", {"consent": digest}, now),
        )

    async def _answer(self, screen: Screen, message: p.Answers) -> list[dict[str, Any]]:
        from benchmarks.study.design.questionnaires import read_answers

        asked = self.context.study.questionnaires[screen.questionnaire]
        try:
            values = read_answers(asked, message.values)
        except ValueError as error:
            return [{**describe(self), "errors": getattr(error, "problems", {"": str(error)})}]
        stored = rows.answer_rows(
            self.visit, self.participant, self.design, screen.questionnaire, values, self.context.now()
        )
        return await self._advance({"seconds": message.seconds}, stored)

    async def _advance(self, outcome: dict[str, Any], *statements: Any) -> list[dict[str, Any]]:
        """Finish the present visit and show what comes next."""
        now = self.context.now()
        await self._write(
            *statements,
            rows.finish_visit(self.visit, now, outcome),
            rows.moved_on(self.participant, self.index + 1, now),
        )
        self.index, self.visit, self.attempt, self.game = self.index + 1, 0, 1, None
        return [await self._show()]

    # -- games --------------------------------------------------------------------------------------------------------

    async def _begin_game(self, screen: Screen) -> None:
        number = self.index * 1000 + self.attempt
        seed = int.from_bytes(hashlib.sha256(f"{self.seed}/{number}".encode()).digest()[:6], "big")
        self._earlier = self._rounds()
        game = await asyncio.to_thread(self._played, screen, seed, ())
        await self._begin_visit(screen, game.env.layout.layout_id, seed)
        self.game, self._samples = game, 0
        self._start_clock()

    def _running(self, n: int) -> Game:
        """The game, if a message speaks of its present state."""
        if self.game is None:
            raise Refused("the round has not begun")
        if n != self.game.steps:
            raise Refused("the game is at another step", state=self._state())
        return self.game

    def _state(self) -> dict[str, Any]:
        assert self.game is not None
        return self.game.state(self.context.study.content.look.show_belief)

    async def _step(self, message: p.Step) -> list[dict[str, Any]]:
        if self._track is not None and self.context.study.content.domain == "tabletop":
            raise Refused("a table is played by the pointer")
        game = self._running(message.n)
        try:
            action = game.read_action(message.action)
        except ValueError as error:
            raise Refused(str(error)) from error
        row = (game.steps, action, game.digest(), message.down, message.shown, self.context.now())
        game.step(action)
        return await self._store_steps([row])

    async def _move(self, message: p.Pointer) -> list[dict[str, Any]]:
        if self.context.study.content.domain != "tabletop":
            raise Refused("a kitchen is played by keys")
        if self.game is None:
            raise Refused("the round has not begun")
        game, track, now = self.game, self._track, self.context.now()
        samples = track.add(message.samples)
        allowed = int((now - self.clock_begun) * self.context.pace.speed * 30) + 30 - game.steps
        taken = []
        for _ in range(min(track.ready(), max(0, allowed))):
            action = game.action_to(*track.take())
            taken.append((game.steps, action, game.digest(), track.time, message.shown, now))
            game.step(action)
            if game.is_over:
                break
        extra = [rows.sample_rows(self.visit, self.participant, self.design, self._samples, samples)] if samples else []
        self._samples += len(samples)
        return await self._store_steps(taken, *extra)

    async def _store_steps(self, taken: Sequence[Sequence[Any]], *extra: Any) -> list[dict[str, Any]]:
        """Put steps that were played on disk, and say where the game is; what cannot be stored was not played."""
        game, now = self.game, self.context.now()
        assert game is not None
        statements = list(extra)
        if taken:
            statements.append(rows.step_rows(self.visit, self.participant, self.design, taken))
        try:
            if statements:
                await self._write(*statements, *self._sign_of_life(now))
        except sqlite3.Error:
            self.game = None  # it is taken up again as the database has it
            raise
        state: dict[str, Any] = {"type": "state", "state": self._state()}
        if self._track is not None:
            state["t"] = self._track.time
        return [state] if not game.is_over else [state, *await self._game_over(game)]

    def _sign_of_life(self, now: float) -> list[Any]:
        if now - self.last_seen < 5.0:
            return []
        self.last_seen = now
        return [rows.seen(self.participant, now)]

    async def _game_over(self, game: Game) -> list[dict[str, Any]]:
        screen, outcome = self.screen, game.outcome()
        assert screen is not None
        game.close()
        practice = self.context.study.content.practice
        self._track = None
        if screen.kind == "practice" and practice is not None and not self._is_practised(outcome):
            await self._write(rows.finish_visit(self.visit, self.context.now(), outcome))
            self.game, self.visit, self.attempt = None, 0, self.attempt + 1
            if self.attempt > practice.attempts:
                await self._end("practice_failed")
            return [await self._show()]
        return await self._advance(outcome)

    def _is_practised(self, outcome: dict[str, Any]) -> bool:
        practice = self.context.study.content.practice
        wanted = practice.reaches if practice is not None and self.context.study.content.domain == "tabletop" else 0
        return bool(outcome["finished"]) or bool(wanted and outcome.get("reaches", 0) >= wanted)

    # -- endings ------------------------------------------------------------------------------------------------------

    async def _finish(self) -> None:
        """All screens are done: complete, if the database says so."""
        if is_complete(self.context.store, self.context.study, self.participant):
            await self._end("complete")
            return
        await self.log("incomplete", screen=self.index)
        raise Refused("not everything is stored; please reload the page")

    async def _end(self, ending: Ending) -> None:
        now = self.context.now()
        await self._write(
            rows.moved_on(self.participant, self.index, now, state=ending),
            rows.event_row(self.participant, self.design, now, "ended", ending=ending, screen=self.index),
        )
        self.state, self.ended, self.game = ending, now, None

    async def time_out(self) -> dict[str, Any]:
        """End because nothing came for too long."""
        async with self._lock:
            if self.state == "active":
                await self._end("timed_out")
            return await self._show()

    async def log(self, kind: str, **detail: Any) -> None:
        """Keep an event."""
        now = self.context.now()
        await self._write(rows.event_row(self.participant, self.design, now, kind, **detail), *self._sign_of_life(now))
