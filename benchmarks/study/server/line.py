"""A WebSocket that speaks JSON: one kind of error for all ways in which the other end can be gone."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.server.refusal import Gone

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

__all__ = ["Doors", "Line"]

_SLOW: Final = 20.0
"""Seconds in which the other end has to take a message; until then at most the socket's buffer waits for it."""


class Line:
    """A connection.

    Args:
        socket: Accepted.
    """

    def __init__(self, socket: WebSocket) -> None:
        self._socket = socket

    async def receive(self) -> str | bytes:
        """The next message.

        Raises:
            Gone: None will come.
        """
        try:
            message = await self._socket.receive()
        except RuntimeError as error:  # it was closed from this side
            raise Gone from error
        if message["type"] != "websocket.receive":
            raise Gone
        return message.get("text") or message.get("bytes") or ""

    async def send(self, message: Mapping[str, Any]) -> None:
        """Send a message.

        Raises:
            Gone: It does not arrive.
        """
        from starlette.websockets import WebSocketDisconnect

        text = json.dumps(message, separators=(",", ":"), allow_nan=False)
        try:
            async with asyncio.timeout(_SLOW):
                await self._socket.send_text(text)
        except (WebSocketDisconnect, RuntimeError, TimeoutError) as error:
            raise Gone from error

    async def close(self, code: int) -> None:
        """End the connection; nothing where it has ended."""
        from starlette.websockets import WebSocketDisconnect

        with contextlib.suppress(WebSocketDisconnect, RuntimeError, TimeoutError):
            async with asyncio.timeout(_SLOW):
                await self._socket.close(code)


class Doors:
    """Counts open connections.

    Args:
        most: How many there may be.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self.open = 0

    @contextlib.asynccontextmanager
    async def pass_through(self, socket: WebSocket) -> AsyncIterator[Line | None]:
        """Accept a socket and let go of it at the end; yields a :class:`Line`, or None where there is no room."""
        from starlette.responses import PlainTextResponse

        from benchmarks.study.server import pages

        if self.open >= self.most:
            refusal = PlainTextResponse("too many connections", 503, headers=pages.headers(framed=False))
            with contextlib.suppress(RuntimeError):
                await socket.send_denial_response(refusal)
            yield None
            return
        self.open += 1
        try:
            await socket.accept()
            yield Line(socket)
        finally:
            self.open -= 1
