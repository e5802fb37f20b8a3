"""What every answer of the server has, whatever made it: headers that keep browsers strict."""

from __future__ import annotations

import hmac
from typing import TYPE_CHECKING, Any

from benchmarks.study.server import pages

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["Guard", "is_secret"]


class Guard:
    """Adds the headers of :func:`benchmarks.study.server.pages.headers` to answers that lack them.

    Refused WebSockets are answers, too: they get a body of their own, since the ones of the server have no headers.

    Args:
        app: What answers.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._headers = [(k.lower().encode(), v.encode()) for k, v in pages.headers(framed=False).items()]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        is_accepted = False

        async def strict(message: Message) -> None:
            nonlocal is_accepted
            kind = message["type"]
            if kind == "websocket.accept":
                is_accepted = True
            elif kind in ("http.response.start", "websocket.http.response.start"):
                message = {**message, "headers": self._with_headers(message.get("headers", []))}
            elif kind == "websocket.close" and not is_accepted and "websocket.http.response" in _extensions(scope):
                start = {"status": 404, "headers": self._with_headers([(b"content-type", b"text/plain")])}
                await send({"type": "websocket.http.response.start", **start})
                message = {"type": "websocket.http.response.body", "body": b"there is nothing here"}
            await send(message)

        await self.app(scope, receive, strict)

    def _with_headers(self, given: Any) -> list[tuple[bytes, bytes]]:
        known = {bytes(name).lower() for name, _ in given}
        return [*given, *((name, value) for name, value in self._headers if name not in known)]


def _extensions(scope: Scope) -> Any:
    return scope.get("extensions") or {}


def is_secret(given: object, secret: str) -> bool:
    """Whether somebody gives a secret; takes as long for a wrong one as for the right one."""
    return isinstance(given, str) and hmac.compare_digest(given.encode("utf-8", "replace"), secret.encode())
