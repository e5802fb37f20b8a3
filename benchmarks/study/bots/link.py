"""A bot's connection to a server: joining, one WebSocket, and coming back when it breaks."""

from __future__ import annotations

import asyncio
import json
import time
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl, urlsplit

from benchmarks.study.errors import StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from websockets.asyncio.client import ClientConnection

__all__ = ["BotError", "Link", "Lost", "join"]

_RETRY: Final = 0.1
"""Seconds between attempts to reach a server that is away."""
_ANSWER: Final = 60.0
"""Seconds in which a server answers."""


class BotError(StudyError):
    """The server said what it must not say."""


class Lost(Exception):
    """The connection broke, or the server did not answer: the bot has to come back."""


async def join(link: str, *, patience: float = 30.0) -> str:
    """Take part by a participants' link.

    Args:
        link: As ``legible study serve`` prints it; with its key for a debug participant.
        patience: Seconds to wait for a server that cannot be reached.

    Returns:
        The participant's token.

    Raises:
        BotError: The server admits nobody.
        TimeoutError: It could not be reached.
    """
    parts = urlsplit(link)
    body = json.dumps({"query": dict(parse_qsl(parts.query))}).encode()
    base = f"{parts.scheme}://{parts.netloc}{parts.path.removesuffix('/debug').rstrip('/')}"
    deadline = time.monotonic() + patience
    while True:
        try:
            status, answer = await asyncio.to_thread(_post, f"{base}/api/join", body)
        except OSError:
            if time.monotonic() > deadline:
                raise TimeoutError(f"no server answers at {base}") from None
            status, answer = 503, {}
        if status == 200:
            return str(answer["token"])
        if status not in (429, 503):
            raise BotError(f"the server refuses to let a bot join: {status} {answer}")
        await asyncio.sleep(_RETRY)


def _post(address: str, body: bytes) -> tuple[int, dict[str, Any]]:
    from http.client import HTTPConnection, HTTPException, HTTPSConnection

    parts = urlsplit(address)
    kind = HTTPSConnection if parts.scheme == "https" else HTTPConnection
    connection = kind(parts.netloc, timeout=_ANSWER)
    try:
        connection.request("POST", parts.path, body, {"Content-Type": "application/json"})
        response = connection.getresponse()
        content = response.read()
    except HTTPException as error:  # the server was stopped while it answered
        raise ConnectionError(str(error)) from error
    finally:
        connection.close()
    return response.status, json.loads(content) if response.status == 200 else {"reason": content.decode()}


class Link:
    """The WebSocket of one participant.

    Args:
        base: Address of the server, ``http://…`` without a slash at its end.
        token: The participant's.
        tab: Of the bot's page; a page that comes back has the same.
        patience: Seconds to wait for a server that is away.

    Attributes:
        lost: How often the connection broke.
    """

    def __init__(self, base: str, token: str, tab: str, *, patience: float = 30.0) -> None:
        self.address = f"{base.replace('http', 'ws', 1)}/socket"
        self.token = token
        self.tab = tab
        self.patience = patience
        self.lost = 0
        self._socket: ClientConnection | None = None

    async def open(self) -> dict[str, Any]:
        """Connect, again if need be.

        Returns:
            The ``screen`` to show.

        Raises:
            TimeoutError: The server stayed away.
            BotError: It does not know the participant.
        """
        deadline = time.monotonic() + self.patience
        hello = {"type": "hello", "token": self.token, "tab": self.tab, "width": 1280, "height": 800, "touch": False}
        while True:
            try:
                await self._connect()
                return await self.ask(hello)
            except (OSError, Lost, EOFError) as error:
                await self.close()
                if time.monotonic() > deadline:
                    raise TimeoutError(f"no server answers at {self.address}: {error}") from None
            await asyncio.sleep(_RETRY)

    async def _connect(self) -> None:
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException

        try:
            self._socket = await connect(
                self.address, compression=None, ping_interval=None, open_timeout=self.patience, close_timeout=1.0,
                max_size=2**22,
            )  # fmt: skip
        except WebSocketException as error:
            raise Lost(str(error)) from error

    async def send(self, message: Mapping[str, Any]) -> None:
        """Say something.

        Raises:
            Lost: It did not get out.
        """
        from websockets.exceptions import ConnectionClosed

        if self._socket is None:
            raise Lost("there is no connection")
        try:
            await self._socket.send(json.dumps(message, separators=(",", ":")))
        except ConnectionClosed as error:
            raise Lost(str(error)) from error

    async def hear(self) -> dict[str, Any]:
        """What the server says next, warnings left out.

        Raises:
            Lost: The connection is gone, or nothing came for a minute.
            BotError: A refusal, or word of another page.
        """
        from websockets.exceptions import ConnectionClosed

        if self._socket is None:
            raise Lost("there is no connection")
        while True:
            try:
                async with asyncio.timeout(_ANSWER):
                    message: dict[str, Any] = json.loads(await self._socket.recv())
            except (ConnectionClosed, TimeoutError) as error:
                raise Lost(str(error) or type(error).__name__) from error
            if message["type"] in ("refused", "replaced"):
                raise BotError(f"the server answers {json.dumps(message)[:500]}")
            if message["type"] != "warning":
                return message

    async def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Say something, and hear what comes of it."""
        await self.send(message)
        return await self.hear()

    async def close(self) -> None:
        """Hang up."""
        socket, self._socket = self._socket, None
        if socket is not None:
            self.lost += 1
            await socket.close()
