"""One participant's session: what a message does, and what is shown next. No sockets in here."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.server import protocol as p
from benchmarks.study.server.completion import is_practised
from benchmarks.study.server.device import failures
from benchmarks.study.server.play import Play
from benchmarks.study.server.progress import SEEN, Progress
from benchmarks.study.server.refusal import Refused
from benchmarks.study.server.screens import describe
from benchmarks.study.store import rows
from benchmarks.study.store.outcomes import RESTARTED
from benchmarks.study.store.values import from_row
from benchmarks.study.timeline import GAMES, Screen

if TYPE_CHECKING:
    from benchmarks.study.server.context import Context
    from benchmarks.study.store import Statement

__all__ = ["Refused", "Session"]

_HOUR: Final = 3600.0
_SEEN_IDLE: Final = 30.0
"""Seconds between two updates of when a participant was seen whose page alone says that it is there."""
_STAY: Final = 4
"""The action of waiting in kitchens, which pages take by themselves, too."""


class Session(Progress):
    """A participant's session; one message is done at a time.

    Args:
        context: What sessions share.
        participant: Whose.

    Attributes:
        tab: Of the page that was here last.
    """

    def __init__(self, context: Context, participant: str) -> None:
        super().__init__(context, participant)
        self.tab = ""
        self._is_stale = False
        self._pointer: tuple[float, float] | None = None
        self._lock = asyncio.Lock()

    @contextlib.asynccontextmanager
    async def _alone(self) -> AsyncIterator[None]:
        """One message at a time; what fails half-way leaves nothing in memory that may not be on disk."""
        async with self._lock:
            try:
                yield
            except Refused:
                raise
            except BaseException:
                self._forget_game()
                self._is_stale = True
                raise

    async def open(self, tab: str, **page: Any) -> dict[str, Any]:
        """The participant is here, with a new page or an old one.

        Args:
            tab: Random, of the browser's tab: a page that comes back after a lost connection still has it, a reloaded
                one does not.
            **page: What else is kept of it.

        Returns:
            The ``screen`` to show.

        Raises:
            Refused: They are no participant any more.
            sqlite3.Error: Something could not be stored.
        """
        async with self._alone():
            if self.state == "active":
                await self._restore(is_same_page=tab == (self.tab or self._last_tab()))
            # Only now: the policy for reloads would else not be applied to a page that comes back after a crash here.
            await self.log("connect", tab=tab, **page)
            self.tab, self._is_stale = tab, False
            return await self._show()

    async def reopen(self) -> dict[str, Any]:
        """Go back to what the database has, after something could not be stored.

        Returns:
            The ``screen`` to show.

        Raises:
            sqlite3.Error: Something could not be stored again.
        """
        async with self._alone():
            await self._refresh()
            return await self._show()

    async def _refresh(self) -> None:
        self._forget_game()
        if self.state == "active":
            await self._restore(is_same_page=True)
            await self._show()
        self._is_stale = False

    def _last_tab(self) -> str:
        found = self.context.store.read(
            "SELECT detail FROM events WHERE participant = ? AND kind = 'connect' ORDER BY event DESC LIMIT 1",
            (self.participant,),
        )
        return str(from_row(found[0]["detail"]).get("tab", "")) if found else ""

    async def _restore(self, *, is_same_page: bool) -> None:
        """Take up the open visit where the database has it, as far as the study's policy lets a page be reloaded."""
        limits, screen, now = self.context.study.content.limits, self.screen, self.context.now()
        if screen is None:
            return
        if screen.kind != "pause" and 0 < limits.resume_hours * _HOUR < now - self.last_seen:
            await self._end("expired")
            return
        if self.play is None:
            await self._take_up(screen)
        else:
            self.play.start_clock(now)
        if self.play is None:
            return
        if self.play.game.is_over:
            await self._game_over(self.play)
        elif not is_same_page and limits.resume == "block":
            await self._end("blocked")
        elif not is_same_page and limits.resume == "restart":
            outcome = {**self.play.game.outcome(), RESTARTED: True}
            await self._write(rows.finish_visit(self.visit, now, outcome))
            self._forget_game()
            self.attempt += screen.kind == "round"  # who reloads in the practice loses no attempt

    async def handle(self, message: p.Message) -> list[dict[str, Any]]:
        """Do what a message asks for.

        Returns:
            What the page is told, once it is on disk.

        Raises:
            Refused: It does not fit the present screen.
            sqlite3.Error: It could not be stored, so nothing of it happened.
        """
        async with self._alone():
            if self._is_stale:
                await self._refresh()
            if isinstance(message, p.Ping):
                await self._write(*self._sign_of_life(self.context.now(), _SEEN_IDLE))
                return [{"type": "pong", "at": message.at}]
            if isinstance(message, p.Event):
                await self.log(f"page_{message.kind}", page_time=message.at, detail=message.detail)
                return []
            screen = self.screen
            if screen is None:  # the end, or something could not be stored just before it
                return [await self._show()]
            if isinstance(message, p.Withdraw):
                await self._end("withdrawn")
                return [await self._show()]
            return await self._handle_here(screen, message)

    async def _handle_here(self, screen: Screen, message: p.Message) -> list[dict[str, Any]]:
        kind = screen.kind
        if isinstance(message, p.Step | p.Pointer) and kind in GAMES:
            return await self._act(message)
        if isinstance(message, p.Next) and kind in (*GAMES, "text", "pause"):
            return await self._next(screen)
        if isinstance(message, p.Device) and kind == "device":
            return await self._check_device(message)
        if isinstance(message, p.Consent) and kind == "consent":
            return await self._consent(message)
        if isinstance(message, p.Answers) and kind == "questionnaire":
            return await self._answer(screen, message)
        raise Refused(f"a message of type {message.type!r} does not belong to the present screen ({kind})")

    def is_sign_of_life(self, message: p.Message) -> bool:
        """Whether a message says that somebody is there, and not their page alone.

        Pages wait in kitchens by themselves, and tell where the pointer is although nobody moves it.
        """
        if isinstance(message, p.Step):
            return message.down is not None or message.action != _STAY
        if isinstance(message, p.Pointer):
            places = {sample[1:] for sample in message.samples}
            before, self._pointer = self._pointer, message.samples[-1][1:]
            return places != {before}
        if isinstance(message, p.Event):
            return message.kind in ("focus", "visible", "active")
        return not isinstance(message, p.Ping)

    async def _next(self, screen: Screen) -> list[dict[str, Any]]:
        if screen.kind in GAMES:
            if self.play is not None:
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

    async def _check_device(self, message: p.Device) -> list[dict[str, Any]]:
        found = message.model_dump(exclude={"type"})
        failed = failures(self.context.study, found)
        if not failed:
            return await self._advance(found)
        await self._end("device_failed", rows.finish_visit(self.visit, self.context.now(), {**found, "failed": failed}))
        return [await self._show()]

    async def _consent(self, message: p.Consent) -> list[dict[str, Any]]:
        now = self.context.now()
        if not message.agreed:
            await self._end("refused", rows.finish_visit(self.visit, now, {"agreed": False}))
            return [await self._show()]
        text = self.context.study.texts["consent"]
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
            return [{**describe(self), "errors": getattr(error, "problems", None) or {"": str(error)}}]
        now = self.context.now()
        stored = rows.answer_rows(self.visit, self.participant, self.design, screen.questionnaire, values, now)
        return await self._advance({"seconds": message.seconds}, stored)

    async def _advance(self, outcome: dict[str, Any], *statements: Statement) -> list[dict[str, Any]]:
        """Finish the present visit and show what comes next."""
        now, following = self.context.now(), self.index + 1
        if any(row["screen"] > self.index for row in self.visits()):
            following = len(self.screens)  # only this screen had lost rows
        await self._write(
            *statements,
            rows.finish_visit(self.visit, now, outcome),
            rows.moved_on(self.participant, following, now),
        )
        self.last_seen = now
        self._forget_game()
        self.index, self.attempt = following, 1
        return [await self._show()]

    async def _act(self, message: p.Step | p.Pointer) -> list[dict[str, Any]]:
        """Play, put what was played on disk, and say where the game is; what cannot be stored was not played."""
        play, now = self.play, self.context.now()
        if play is None:
            raise Refused("the round has not begun")
        statements: list[Statement] = []
        if isinstance(message, p.Step):
            taken = play.step(message, now)
        else:
            taken, samples = play.move(message, now, self.context.pace.speed)
            if samples:
                of = (play.visit, self.participant, self.design, play.samples)
                statements.append(rows.sample_rows(*of, samples))
                play.samples += len(samples)
        if taken:
            statements.append(rows.step_rows(play.visit, self.participant, self.design, taken))
        state = play.state()
        if play.game.is_over:
            return [state, *await self._game_over(play, *statements)]
        if statements:
            await self._write(*statements, *self._sign_of_life(now, SEEN))
        return [state]

    async def _game_over(self, play: Play, *statements: Statement) -> list[dict[str, Any]]:
        """Put the last steps of a game on disk together with what it came to."""
        screen, outcome = self.screen, play.game.outcome()
        assert screen is not None
        content = self.context.study.content
        if screen.kind == "round" or is_practised(content, outcome):
            return await self._advance(outcome, *statements)
        finished = rows.finish_visit(self.visit, self.context.now(), outcome)
        assert content.practice is not None
        if self.attempt >= content.practice.attempts:
            await self._end("practice_failed", *statements, finished)
        else:
            await self._write(*statements, finished)
        self._forget_game()
        self.attempt += 1
        return [await self._show()]

    async def time_out(self) -> dict[str, Any]:
        """End because nothing came for too long."""
        async with self._alone():
            if self.state == "active":
                await self._end("timed_out")
            return await self._show()
