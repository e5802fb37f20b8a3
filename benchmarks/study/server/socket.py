"""A participant's connection: the first word, the messages after it, and the idle clock."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sqlite3
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.server import protocol as p
from benchmarks.study.server.hub import Connection
from benchmarks.study.server.rates import Bucket
from benchmarks.study.server.refusal import Gone, Refused

if TYPE_CHECKING:
    from benchmarks.study.server.hub import Hub
    from benchmarks.study.server.line import Line
    from benchmarks.study.server.session import Session

__all__ = ["attend"]

_FIRST_WORD: Final = 20.0
"""Seconds in which a new connection has to say who it is."""
_LOOK: Final = 1.0
"""Seconds between two looks at the idle clock."""
_MOST_BAD: Final = 20
"""Messages that are not understood, after which a connection ends."""
_NOT_STORED: Final = {"type": "refused", "reason": "this could not be stored", "fatal": True}
_log = logging.getLogger("legible.study")


async def attend(line: Line, hubs: Mapping[Any, Hub]) -> None:
    """Serve one connection until it ends.

    Args:
        line: The connection.
        hubs: By mode.
    """
    with contextlib.suppress(Gone):
        hello = await _first_word(line)
        if hello is None:
            await _dismiss(line, "the first message must be a hello", 4401)
            return
        for hub in hubs.values():
            session = hub.enter(hello.token)
            if session is not None:
                try:
                    await _Visitor(line, hub, session).serve(hello)
                finally:
                    hub.leave(session)
                return
        await _dismiss(line, "unknown participant", 4401)


async def _first_word(line: Line) -> p.Hello | None:
    try:
        async with asyncio.timeout(_FIRST_WORD):
            message = p.read_message(await line.receive())
    except (ValueError, TimeoutError):
        return None
    return message if isinstance(message, p.Hello) else None


async def _dismiss(line: Line, reason: str, code: int) -> None:
    await line.send({"type": "refused", "reason": reason, "fatal": True})
    await line.close(code)


class _Visitor:
    """A page of a participant whom the server knows."""

    def __init__(self, line: Line, hub: Hub, session: Session) -> None:
        self.line = line
        self.hub = hub
        self.session = session
        now = hub.context.now()
        self.connection = Connection(self.send, line.close, now, now)
        pace = hub.context.pace
        self._messages = Bucket(pace.messages, pace.burst)
        self._events = Bucket(pace.events, pace.event_burst)
        self._bad = 0

    async def send(self, message: Mapping[str, Any]) -> None:
        self.hub.told(self.session.participant, message)
        await self.line.send(message)

    async def serve(self, hello: p.Hello) -> None:
        session = self.session
        if not self.hub.may_connect(session.participant):
            await _dismiss(self.line, "too many connections", 4429)
            return
        try:
            await self.hub.attach(session, self.connection)
            page = {"width": hello.width, "height": hello.height, "touch": hello.touch}
            await self.send(await session.open(hello.tab, **page))
            await self._listen()
        except Refused as refusal:
            await self.send(refusal.reply)
            await self.line.close(4401)
        except sqlite3.Error as error:
            _log.error("participant %s: %s", session.participant, error)
            await self.send(_NOT_STORED)
            await self.line.close(1013)
        except Gone:
            pass
        except Exception as error:
            await self._failed(error)
            await _dismiss(self.line, "something went wrong", 1011)
        finally:
            self.hub.detach(session, self.connection)
            with contextlib.suppress(sqlite3.Error, Refused):
                await session.log("disconnect")

    async def _failed(self, error: Exception) -> None:
        """Keep an error that nobody expected, for the monitor and for the log of the server."""
        _log.error("participant %s: %s", self.session.participant, type(error).__name__, exc_info=error)
        with contextlib.suppress(sqlite3.Error, Refused):
            await self.session.log("error", error=f"{type(error).__name__}: {error}"[:1000])

    async def _listen(self) -> None:
        idle = asyncio.create_task(self._watch_idle())
        try:
            while True:
                text = await self.line.receive()
                if not self.hub.is_newest(self.session, self.connection):
                    return  # what an older tab had still on its way
                if not self._messages.take():
                    await self.session.log("too_fast")
                    await _dismiss(self.line, "too many messages", 4429)
                    return
                for reply in await self._replies(text):
                    await self.send(reply)
                    if reply.get("close"):
                        await self.line.close(reply["close"])
                        return
        finally:
            idle.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await idle

    async def _replies(self, text: str | bytes) -> list[Any]:
        session = self.session
        try:
            message = p.read_message(text)
        except ValueError as error:
            await self._note("bad_message", reason=str(error))
            self._bad += 1
            more = {"fatal": True, "close": 4400} if self._bad >= _MOST_BAD else {}
            return [{"type": "refused", "reason": "this message was not understood", **more}]
        if session.is_sign_of_life(message):
            self.connection.heard = session.context.now()
        if isinstance(message, p.Event) and (message.kind == "active" or not self._events.take()):
            return []
        try:
            return await session.handle(message)
        except Refused as refusal:
            await self._note("refused", reason=str(refusal)[:500], message=message.type)
            more = {"close": 4401} if refusal.reply.get("fatal") else {}
            return [{**refusal.reply, **more}]
        except sqlite3.Error as error:
            _log.error("participant %s: %s", session.participant, error)
            return [{**_NOT_STORED, "fatal": False}, await session.reopen()]

    async def _note(self, kind: str, **detail: Any) -> None:
        if self._events.take():
            await self.session.log(kind, **detail)

    async def _watch_idle(self) -> None:
        try:
            await self._end_idle()
        except Refused as refusal:  # they were forgotten meanwhile
            await _dismiss(self.line, str(refusal), 4401)

    async def _end_idle(self) -> None:
        """Warn a participant who does nothing, then end their session."""
        limits, session, connection = self.hub.context.study.content.limits, self.session, self.connection
        warned_at = -1.0
        with contextlib.suppress(Gone, sqlite3.Error):
            while session.state == "active" and (limits.idle_timeout or limits.idle_warning):
                await asyncio.sleep(_LOOK)
                screen = session.screen
                if screen is None or screen.kind == "pause":
                    connection.heard = self.hub.context.now()
                    continue
                idle = self.hub.context.now() - connection.heard
                if limits.idle_timeout and idle >= limits.idle_timeout:
                    await self.send(await session.time_out())
                    return
                if limits.idle_warning and idle >= limits.idle_warning and connection.heard != warned_at:
                    warned_at = connection.heard
                    await session.log("idle_warning")
                    left = round(limits.idle_timeout - idle) if limits.idle_timeout else None
                    await self.send({"type": "warning", "seconds": left})
