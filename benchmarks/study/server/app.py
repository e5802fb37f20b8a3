"""The server as an ASGI application."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import AsyncIterator, Mapping
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.server import pages
from benchmarks.study.server.context import Context, Pace
from benchmarks.study.server.hub import Hub, NotAdmitted
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

__all__ = ["create_app"]

_LONGEST_BODY: Final = 16_384
_log = logging.getLogger("legible.study")


def create_app(study: Study, *, modes: tuple[Mode, ...] = ("live", "debug"), pace: Pace | None = None) -> Starlette:
    """The server of a study.

    Its databases are opened here and closed when the application shuts down.

    Args:
        study: The design.
        modes: Which databases it serves: live participants join at ``/``, debug ones at ``/debug`` with a key.
        pace: How much a connection may ask for.

    Returns:
        The application; ``app.state.hubs`` holds a :class:`~benchmarks.study.server.hub.Hub` for each mode, and
        ``app.state.secrets`` the study's secret.

    Raises:
        StudyError: A database cannot be used.
    """
    from starlette.applications import Starlette
    from starlette.routing import Route, WebSocketRoute

    secrets = Secrets.of(study.folder)
    hubs: dict[Mode, Hub] = {}
    for mode in modes:
        store = Store(database_path(study.folder, mode), mode=mode, name=study.content.name)
        hubs[mode] = Hub(Context(study, store, secrets, pace=pace or Pace()))
    site = _Site(hubs, secrets, pace or Pace())

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        for hub in hubs.values():
            await hub.context.store.write(rows.event_row("", study.design_hash, hub.context.now(), "server_started"))
        yield
        for hub in hubs.values():
            hub.context.store.close()

    from benchmarks.study.server.monitor import monitor_routes

    routes = [
        Route("/", site.index),
        Route("/debug", site.index_debug),
        Route("/static/{name}", site.static),
        Route("/api/join", site.join, methods=["POST"]),
        Route("/healthz", site.health),
        WebSocketRoute("/socket", site.socket),
        *monitor_routes(hubs, secrets),
    ]
    app = Starlette(routes=routes, lifespan=lifespan, exception_handlers={Exception: _failed})
    app.state.hubs, app.state.secrets = hubs, secrets
    return app


async def _failed(request: Request, error: Exception) -> Response:
    """A page that failed: what went wrong is in the log of the server, not in the answer."""
    from starlette.responses import PlainTextResponse

    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return PlainTextResponse("something went wrong", 500, headers=pages.HEADERS(framed=False))


class _Site:
    """The routes of participants."""

    def __init__(self, hubs: Mapping[Mode, Hub], secrets: Secrets, pace: Pace) -> None:
        self.hubs = hubs
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
        return HTMLResponse(html, headers={**pages.HEADERS(framed=True), "Cache-Control": "no-store"})

    async def index(self, request: Request) -> Response:
        """The participant's page."""
        hub = self.hubs.get("live")
        return _missing() if hub is None else self._page(hub, request)

    async def index_debug(self, request: Request) -> Response:
        """The same, for debug participants; the link has a key."""
        hub = self.hubs.get("debug")
        if hub is None or not _is_same(request.query_params.get("key", ""), self.secrets.debug):
            return _missing()
        return self._page(hub, request)

    async def static(self, request: Request) -> Response:
        """A file of the pages."""
        from starlette.responses import Response

        name = request.path_params["name"]
        content = pages.asset(name)
        if content is None:
            return _missing()
        kind = pages.KINDS[PurePosixPath(name).suffix]
        headers = {**pages.HEADERS(framed=True), "Cache-Control": "no-cache", "Content-Type": kind}
        return Response(content, headers=headers)

    async def join(self, request: Request) -> Response:
        """Take part: the token of a new participant, or of the worker's earlier participation."""
        from starlette.responses import JSONResponse

        headers = {**pages.HEADERS(framed=True), "Cache-Control": "no-store"}
        if not self.joins.take():
            return JSONResponse({"reason": "too many people join at this moment; please try again"}, 429, headers)
        query = await _query_of(request)
        if query is None:
            return JSONResponse({"reason": 'expected {"query": {…}}'}, 400, headers)
        is_debug = "debug" in self.hubs and _is_same(query.get("key", ""), self.secrets.debug)
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

        return PlainTextResponse("ok", headers=pages.HEADERS(framed=False))

    async def socket(self, socket: WebSocket) -> None:
        """A participant's connection."""
        await attend(socket, self.hubs)


async def _query_of(request: Request) -> dict[str, Any] | None:
    """The parameters that a page passes on; None where the request is something else."""
    from legible_envs.support.plain_data import parse_json

    body = b""
    async for part in request.stream():
        body += part
        if len(body) > _LONGEST_BODY:
            return None
    try:
        query = parse_json(body.decode())["query"]
    except (ValueError, KeyError, TypeError):
        return None
    return query if isinstance(query, dict) and all(isinstance(v, str) for v in query.values()) else None


def _is_same(given: object, secret: str) -> bool:
    import hmac

    return isinstance(given, str) and hmac.compare_digest(given.encode("utf-8", "replace"), secret.encode())


def _missing() -> Response:
    from starlette.responses import PlainTextResponse

    return PlainTextResponse("there is nothing here", 404, headers=pages.HEADERS(framed=False))
