"""The server as an ASGI application."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import logging
import sqlite3
import time
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.server import pages
from benchmarks.study.server.context import Context, Pace
from benchmarks.study.server.guard import Guard, is_secret
from benchmarks.study.server.hub import Hub, NotAdmitted
from benchmarks.study.server.line import Doors
from benchmarks.study.server.rates import Bucket
from benchmarks.study.server.recruitment import is_open, worker_of
from benchmarks.study.server.secrets import Secrets
from benchmarks.study.server.socket import attend
from benchmarks.study.store import Mode, Store, database_path, rows

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

    from benchmarks.study.design.study import Study

__all__ = ["close_stores", "create_app"]

_LONGEST_BODY: Final = 16_384
_PATIENCE: Final = 10.0
"""Seconds in which a body has to be here."""
_log = logging.getLogger("legible.study")


def create_app(
    study: Study,
    *,
    modes: tuple[Mode, ...] = ("live", "debug"),
    pace: Pace | None = None,
    now: Callable[[], float] = time.time,
) -> Starlette:
    """The server of a study.

    Its databases are opened here and closed when the application shuts down.

    Args:
        study: The design.
        modes: Which databases it serves: live participants join at ``/``, debug ones at ``/debug`` with a key.
        pace: How much a connection may ask for.
        now: The clock, seconds since 1970.

    Returns:
        The application; ``app.state.hubs`` holds a :class:`~benchmarks.study.server.hub.Hub` for each mode, and
        ``app.state.secrets`` the study's secret.

    Raises:
        StudyError: A database cannot be used.
    """
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.routing import Route, WebSocketRoute

    secrets, pace = Secrets.of(study.folder), pace or Pace()
    hubs: dict[Mode, Hub] = {}
    try:
        for mode in modes:
            store = Store(database_path(study.folder, mode), mode=mode, name=study.content.name)
            own = secrets.of_database(mode, store.value("created"))
            hubs[mode] = Hub(Context(study, store, own, now=now, pace=pace))
    except BaseException:
        close_stores(hubs)
        raise
    doors = Doors(pace.connections)
    site = _Site(hubs, secrets, pace, doors)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        try:
            await _note(hubs, "server_started")
            yield
            with contextlib.suppress(sqlite3.Error):
                await _note(hubs, "server_stopped")
        finally:
            close_stores(hubs)

    from benchmarks.study.server.monitor import monitor_routes

    routes = [
        Route("/", site.index),
        Route("/debug", site.index_debug),
        Route("/static/{name}", site.static),
        Route("/api/join", site.join, methods=["POST"]),
        Route("/healthz", site.health),
        WebSocketRoute("/socket", site.socket),
        *monitor_routes(hubs, secrets, doors),
    ]
    app = Starlette(
        routes=routes,
        lifespan=lifespan,
        middleware=[Middleware(Guard)],
        exception_handlers={404: _missing_page, Exception: _failed},
    )
    app.state.hubs, app.state.secrets = hubs, secrets
    return app


def close_stores(hubs: Mapping[Mode, Hub]) -> None:
    """Write what waits, and let go of the databases; a second time does nothing."""
    for hub in hubs.values():
        hub.context.store.close()


async def _note(hubs: Mapping[Mode, Hub], kind: str) -> None:
    for hub in hubs.values():
        context = hub.context
        await context.store.write(rows.event_row("", context.study.design_hash, context.now(), kind))


async def _missing_page(_: Request, __: Exception) -> Response:
    return _missing()


async def _failed(request: Request, error: Exception) -> Response:
    """A page that failed: what went wrong is in the log of the server, not in the answer."""
    from starlette.responses import PlainTextResponse

    _log.error("%s %r failed: %s", request.method, request.url.path[:200], type(error).__name__)
    return PlainTextResponse("something went wrong", 500, headers=pages.headers(framed=False))


class _Site:
    """The routes of participants."""

    def __init__(self, hubs: Mapping[Mode, Hub], secrets: Secrets, pace: Pace, doors: Doors) -> None:
        self.hubs = hubs
        self.doors = doors
        self.secrets = secrets
        self.joins = Bucket(pace.joins, 4 * pace.joins)

    def _page(self, hub: Hub, request: Request) -> Response:
        from starlette.responses import HTMLResponse

        context = hub.context
        worker, reason = worker_of(context.study, request.query_params), ""
        if worker.is_preview and context.store.mode == "live":
            reason = "preview"
        elif not is_open(context.study, context.store) and not worker.worker:
            reason = "closed"  # a worker may be one who comes back
        html = pages.participant_page(context, reason=reason)
        return HTMLResponse(html, headers={**pages.headers(framed=True), "Cache-Control": "no-store"})

    async def index(self, request: Request) -> Response:
        """The participant's page."""
        hub = self.hubs.get("live")
        return _missing() if hub is None else self._page(hub, request)

    async def index_debug(self, request: Request) -> Response:
        """The same, for debug participants; the link has a key."""
        hub = self.hubs.get("debug")
        if hub is None or not is_secret(request.query_params.get("key", ""), self.secrets.debug):
            return _missing()
        return self._page(hub, request)

    async def static(self, request: Request) -> Response:
        """A file of the pages."""
        from starlette.responses import Response

        name = request.path_params["name"]
        content = pages.asset(name)
        if content is None:
            return _missing()
        tag = f'"{hashlib.sha256(content).hexdigest()[:20]}"'
        headers = {**pages.headers(framed=True), "Cache-Control": "no-cache", "ETag": tag}
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        kind = pages.KINDS[PurePosixPath(name).suffix]
        return Response(content, headers={**headers, "Content-Type": kind})

    async def join(self, request: Request) -> Response:
        """Take part: the token of a new participant, or of the worker's earlier participation."""
        from starlette.responses import JSONResponse

        headers = {**pages.headers(framed=True), "Cache-Control": "no-store"}
        if not self.joins.take():
            return JSONResponse({"reason": "too many people join at this moment; please try again"}, 429, headers)
        query = await _query_of(request)
        if query is None:
            return JSONResponse({"reason": 'expected {"query": {…}}'}, 400, headers)
        is_debug = "debug" in self.hubs and is_secret(query.get("key", ""), self.secrets.debug)
        hub = self.hubs.get("debug" if is_debug else "live")
        if hub is None:
            return JSONResponse({"reason": "no live participants are served"}, 403, headers)
        try:
            return JSONResponse({"token": await hub.join(query)}, headers=headers)
        except NotAdmitted as error:
            return JSONResponse({"reason": hub.context.text(error.text)}, 403, headers)

    async def health(self, _: Request) -> Response:
        """Whether the server answers."""
        from starlette.responses import PlainTextResponse

        return PlainTextResponse("ok", headers=pages.headers(framed=False))

    async def socket(self, socket: WebSocket) -> None:
        """A participant's connection."""
        async with self.doors.pass_through(socket) as line:
            if line is not None:
                await attend(line, self.hubs)


async def _query_of(request: Request) -> dict[str, Any] | None:
    """The parameters that a page passes on; None where the request is something else."""
    from legible_envs.support.plain_data import parse_json

    body = b""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_PATIENCE):
            async for part in request.stream():
                body += part
                if len(body) > _LONGEST_BODY:
                    return None
    try:
        query = parse_json(body.decode(), most=_LONGEST_BODY)["query"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    return query if isinstance(query, dict) and all(isinstance(v, str) for v in query.values()) else None


def _missing() -> Response:
    from starlette.responses import PlainTextResponse

    return PlainTextResponse("there is nothing here", 404, headers=pages.headers(framed=False))
