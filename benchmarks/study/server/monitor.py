"""The monitor: how participants are doing, for researchers with the admin token.

The page itself is harmless, and the token is only in the fragment of its address, which browsers send to nobody: the
page's script gives it as ``Authorization: Bearer`` or as the first message of a WebSocket.

The page says ``{"type": "hello", "token"}`` first, then ``{"type": "watch", "mode", "participant"}`` (or with an empty
participant: nobody). The server sends ``overview`` (see :mod:`benchmarks.study.server.overview`) every two seconds,
and of the one who is watched ``told`` (what their page is told) and ``belief``.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import sqlite3
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from benchmarks.study.server import pages
from benchmarks.study.server.belief import BeliefFollower, KitchenPredictors
from benchmarks.study.server.guard import is_secret
from benchmarks.study.server.overview import Overviews
from benchmarks.study.server.rates import Bucket
from benchmarks.study.server.recruitment import set_recruitment
from benchmarks.study.server.refusal import Gone
from benchmarks.study.server.screens import describe

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

    from benchmarks.study.server.hub import Hub
    from benchmarks.study.server.line import Doors, Line
    from benchmarks.study.server.secrets import Secrets
    from benchmarks.study.store import Mode

__all__ = ["monitor_routes"]

_EVERY: Final = 2.0
"""Seconds between two overviews."""
_BELIEF_EVERY: Final = 0.4
_FIRST_WORD: Final = 20.0
_MOST_WAITING: Final = 200
"""Messages for a page that does not take them; the oldest are left out."""
_log = logging.getLogger("legible.study")


class _Hello(BaseModel):
    model_config = ConfigDict(extra="forbid")
    type: Literal["hello"]
    token: Annotated[str, Field(max_length=200)]


class _Watch(BaseModel):
    model_config = ConfigDict(extra="forbid")
    type: Literal["watch"]
    mode: Literal["live", "debug"]
    participant: Annotated[str, Field(max_length=40)]


class _Recruitment(BaseModel):
    model_config = ConfigDict(extra="forbid")
    mode: Literal["live"]
    state: Literal["open", "paused", "closed"]


_HELLO: Final = TypeAdapter(_Hello)
_WATCH: Final = TypeAdapter(_Watch)
_RECRUITMENT: Final = TypeAdapter(_Recruitment)


def monitor_routes(hubs: Mapping[Mode, Hub], secrets: Secrets, doors: Doors) -> list[Any]:
    """The routes of the monitor.

    Args:
        hubs: By mode.
        secrets: The admin token.
        doors: Of all connections.
    """
    from starlette.routing import Route, WebSocketRoute

    monitor = _Monitor(hubs, secrets, doors)
    return [
        Route("/monitor", monitor.page),
        Route("/api/monitor/overview", monitor.overview),
        Route("/api/monitor/recruitment", monitor.recruitment, methods=["POST"]),
        WebSocketRoute("/monitor/socket", monitor.socket),
    ]


class _Monitor:
    def __init__(self, hubs: Mapping[Mode, Hub], secrets: Secrets, doors: Doors) -> None:
        self.hubs = hubs
        self.doors = doors
        self._secrets = secrets
        self._overviews = {
            mode: Overviews(hub.context.study, hub.context.store.path, mode) for mode, hub in hubs.items()
        }
        study = next(iter(hubs.values())).context.study
        self.study = study
        self.predictors = KitchenPredictors(study)
        self._latest: tuple[float, dict[str, Any]] | None = None
        self._reading = asyncio.Lock()

    def is_admin(self, token: object) -> bool:
        return is_secret(token, self._secrets.admin)

    async def page(self, _: Request) -> Response:
        """The page, the same for everybody: there is nothing in it."""
        from starlette.responses import HTMLResponse

        content = self.study.content
        words = dict(self.study.words)
        data = {"title": content.title, "domain": content.domain, "theme": content.look.theme, "words": words}
        html = pages.page_of("monitor.html.j2", data, title=content.title)
        return HTMLResponse(html, headers={**pages.headers(framed=False), "Cache-Control": "no-store"})

    def _refusal(self, request: Request) -> Response | None:
        from starlette.responses import JSONResponse

        kind, _, token = request.headers.get("authorization", "").partition(" ")
        if kind.lower() == "bearer" and self.is_admin(token.strip()):
            return None
        headers = {**pages.headers(framed=False), "Cache-Control": "no-store", "WWW-Authenticate": "Bearer"}
        return JSONResponse({"reason": "the admin token is missing or wrong"}, 401, headers)

    async def overview(self, request: Request) -> Response:
        """Everything, once."""
        from starlette.responses import JSONResponse

        headers = {**pages.headers(framed=False), "Cache-Control": "no-store"}
        return self._refusal(request) or JSONResponse(await self.read(), headers=headers)

    async def read(self) -> dict[str, Any]:
        """The overview; who asks within a second gets the same."""
        loop = asyncio.get_running_loop()
        async with self._reading:
            if self._latest is None or loop.time() - self._latest[0] > 1.0:
                self._latest = (loop.time(), await self._read())
            return self._latest[1]

    async def _read(self) -> dict[str, Any]:
        found = {}
        for mode, hub in self.hubs.items():
            heard = {name: connection.heard for name, connection in hub.connections.items()}
            found[mode] = await asyncio.to_thread(self._overviews[mode].read, heard, hub.context.now())
        content = self.study.content
        return {
            "type": "overview",
            "study": {"name": content.name, "title": content.title, "design": self.study.design_hash},
            "predictor": content.partner.predictor if content.partner is not None else content.predictor,
            "now": next(iter(self.hubs.values())).context.now(),
            "connections": self.doors.open,
            "modes": found,
        }

    async def recruitment(self, request: Request) -> Response:
        """Open, pause or close it."""
        from starlette.responses import JSONResponse

        if (refusal := self._refusal(request)) is not None:
            return refusal
        headers = {**pages.headers(framed=False), "Cache-Control": "no-store"}
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > 1000:
                return JSONResponse({"reason": "too long"}, 413, headers)
        try:
            wanted = _RECRUITMENT.validate_json(body)
        except ValueError:
            reason = 'expected {"mode": "live", "state": "open" | "paused" | "closed"}'
            return JSONResponse({"reason": reason}, 400, headers)
        if wanted.mode not in self.hubs:
            return JSONResponse({"reason": "no live participants are served"}, 400, headers)
        path = self.hubs[wanted.mode].context.store.path
        before = await asyncio.to_thread(set_recruitment, path, wanted.state)
        self._latest = None
        return JSONResponse({"recruitment": wanted.state, "before": before}, headers=headers)

    async def socket(self, socket: WebSocket) -> None:
        """What goes on, as long as somebody watches."""
        async with self.doors.pass_through(socket) as line:
            if line is None:
                return
            with contextlib.suppress(Gone):
                if not await self._is_allowed(line):
                    await line.send({"type": "refused", "reason": "the admin token is missing or wrong"})
                    await line.close(4401)
                    return
                await _Watcher(self, line).serve()

    async def _is_allowed(self, line: Line) -> bool:
        try:
            async with asyncio.timeout(_FIRST_WORD):
                return self.is_admin(_HELLO.validate_json(await line.receive()).token)
        except (ValueError, TimeoutError):
            return False


class _Watcher:
    """One page of the monitor."""

    def __init__(self, monitor: _Monitor, line: Line) -> None:
        self._monitor = monitor
        self._line = line
        self._watched: tuple[Hub, str] | None = None
        self._waiting: asyncio.Queue[Mapping[str, Any]] = asyncio.Queue(_MOST_WAITING)

    async def serve(self) -> None:
        """Until the page is gone."""
        hubs = list(self._monitor.hubs.values())
        ears = {hub: self._ear(hub) for hub in hubs}
        for hub, ear in ears.items():
            hub.watchers.add(ear)
        tasks = [asyncio.create_task(work) for work in (self._send(), self._overviews(), self._beliefs())]
        try:
            await self._listen()
        finally:
            for hub, ear in ears.items():
                hub.watchers.discard(ear)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _ear(self, hub: Hub) -> Any:
        def hear(participant: str, message: Mapping[str, Any]) -> None:
            if self._watched == (hub, participant) and message.get("type") in ("screen", "state", "warning"):
                self._put({"type": "told", "participant": participant, "message": _harmless(message)})

        return hear

    def _put(self, message: Mapping[str, Any]) -> None:
        if self._waiting.full():
            self._waiting.get_nowait()
        self._waiting.put_nowait(message)

    async def _send(self) -> None:
        while True:
            await self._line.send(await self._waiting.get())

    async def _overviews(self) -> None:
        while True:
            try:
                self._put(await self._monitor.read())
            except (sqlite3.Error, ValueError) as error:
                _log.error("the monitor cannot read the database: %s", error)
            await asyncio.sleep(_EVERY)

    async def _beliefs(self) -> None:
        follower, watched = None, None
        while True:
            if self._watched != watched:
                follower, watched = None, self._watched
                if watched is not None:
                    context = watched[0].context
                    follower = BeliefFollower(context.study, context.store.path, self._monitor.predictors)
            if follower is not None and watched is not None:
                belief = await self._believe(follower, watched[1])
                if self._watched == watched:
                    self._put({"type": "belief", "participant": watched[1], **belief})
                if belief.get("failure"):
                    follower = None
            await asyncio.sleep(_BELIEF_EVERY)

    async def _believe(self, follower: BeliefFollower, participant: str) -> dict[str, Any]:
        try:
            return await asyncio.to_thread(follower.look, participant) or {"n": 0, "goals": []}
        except Exception as error:  # a predictor is anybody's code
            _log.error("belief of %s: %s", self._monitor.study.content.predictor, error)
            return {"n": 0, "goals": [], "failure": f"{type(error).__name__}: {error}"[:500]}

    async def _listen(self) -> None:
        bucket = Bucket(5, 50)
        while True:
            text = await self._line.receive()
            try:
                wish = _WATCH.validate_json(text)
            except ValueError:
                await self._line.send({"type": "refused", "reason": "this message was not understood"})
                continue
            finally:
                if not bucket.take():
                    await self._line.close(4429)
            hub = self._monitor.hubs.get(wish.mode)
            self._watched = (hub, wish.participant) if hub is not None and wish.participant else None
            session = hub.sessions.get(wish.participant) if hub is not None else None
            message = None if session is None else _harmless(describe(session))
            self._put({"type": "told", "participant": wish.participant, "message": message})


def _harmless(message: Mapping[str, Any]) -> Mapping[str, Any]:
    """What a page was told, without completion codes: who watches need not have them."""
    return {key: value for key, value in message.items() if key not in ("code", "url")}
