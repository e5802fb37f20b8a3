"""A participant's connection: the first word, the messages after it, and the idle clock."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import sqlite3
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.server import protocol as p
from benchmarks.study.server.hub import Connection
from benchmarks.study.server.rates import Bucket
from benchmarks.study.server.session import Refused, Session

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from benchmarks.study.server.hub import Hub

__all__ = ["attend"]

_FIRST_WORD: Final = 20.0
"""Seconds in which a new connection has to say who it is."""
_LOOK: Final = 1.0
"""Seconds between two looks at the idle clock."""
_log = logging.getLogger("legible.study")


async def attend(socket: WebSocket, hubs: Mapping[str, Hub]) -> None:
    """Serve one connection until it ends.

    Args:
        socket: Not yet accepted.
        hubs: By mode.
    """
    from starlette.websockets import WebSocketDisconnect

    await socket.accept()
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        found = await _first_word(socket, hubs)
        if found is None:
            return
        hub, session, hello = found
        connection = _connection(socket, hub, session)
        await session.log("connect", tab=hello.tab, width=hello.width, height=hello.height, touch=hello.touch)
        await hub.attach(session, connection)
        try:
            await connection.send(await session.open(hello.tab))
            async with asyncio.TaskGroup() as group:
                idle = group.create_task(_watch_idle(hub, session, connection))
                await _listen(socket, hub, session, connection)
                idle.cancel()
        except* (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            hub.detach(session, connection)
            with contextlib.suppress(sqlite3.Error):
                await session.log("disconnect")


async def _first_word(socket: WebSocket, hubs: Mapping[str, Hub]) -> tuple[Hub, Session, p.Hello] | None:
    try:
        message = p.read_message(await asyncio.wait_for(socket.receive_text(), _FIRST_WORD))
    except (ValueError, KeyError, TimeoutError):
        message = None
    if isinstance(message, p.Hello):
        for hub in hubs.values():
            session = hub.session_of(message.token)
            if session is not None:
                return hub, session, message
    await socket.send_text(json.dumps({"type": "refused", "reason": "unknown participant", "fatal": True}))
    await socket.close(4401)
    return None


def _connection(socket: WebSocket, hub: Hub, session: Session) -> Connection:
    async def send(message: Mapping[str, Any]) -> None:
        hub.told(session.participant, message)
        with contextlib.suppress(RuntimeError):  # it is closed already
            await socket.send_text(json.dumps(message, separators=(",", ":"), allow_nan=False))

    async def close() -> None:
        with contextlib.suppress(RuntimeError):
            await socket.close(4409)

    now = hub.context.now()
    return Connection(send, close, now, now)


async def _listen(socket: WebSocket, hub: Hub, session: Session, connection: Connection) -> None:
    pace = hub.context.pace
    bucket = Bucket(pace.messages, pace.burst)
    while True:
        text = await socket.receive_text()
        if not bucket.take():
            await session.log("too_fast")
            await connection.send({"type": "refused", "reason": "too many messages", "fatal": True})
            await socket.close(4429)
            return
        for reply in await _replies(session, connection, text):
            await connection.send(reply)


async def _replies(session: Session, connection: Connection, text: str) -> list[Any]:
    try:
        message = p.read_message(text)
    except ValueError as error:
        await session.log("bad_message", reason=str(error)[:500])
        return [{"type": "refused", "reason": "this message was not understood"}]
    if not isinstance(message, p.Ping | p.Event):
        connection.heard = session.context.now()
    try:
        return await session.handle(message)
    except Refused as refusal:
        return [refusal.reply]
    except sqlite3.Error as error:
        _log.error("participant %s: %s", session.participant, error)
        return [
            {"type": "refused", "reason": "this could not be stored", "fatal": True},
            await session.open(session.tab),
        ]


async def _watch_idle(hub: Hub, session: Session, connection: Connection) -> None:
    """Warn a participant who does nothing, then end their session."""
    limits = hub.context.study.content.limits
    warned_at = 0.0
    while session.state == "active" and limits.idle_timeout:
        await asyncio.sleep(_LOOK)
        screen = session.screen
        if screen is None or screen.kind == "pause":
            continue
        idle = hub.context.now() - connection.heard
        if idle >= limits.idle_timeout:
            await connection.send(await session.time_out())
            return
        if limits.idle_warning and idle >= limits.idle_warning and connection.heard != warned_at:
            warned_at = connection.heard
            await session.log("idle_warning")
            await connection.send({"type": "warning", "seconds": round(limits.idle_timeout - idle)})
