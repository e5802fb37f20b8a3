"""Running the server: on an address, with or without TLS, warm before the first participant comes."""

from __future__ import annotations

import contextlib
import logging
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.errors import StudyError
from benchmarks.study.games import make_game
from benchmarks.study.server.app import close_stores, create_app
from benchmarks.study.server.context import Pace
from benchmarks.study.server.recruitment import other_designs
from benchmarks.study.store import rows
from benchmarks.study.timeline import GAMES, timeline

if TYPE_CHECKING:
    import uvicorn

    from benchmarks.study.design.study import Study
    from benchmarks.study.server.secrets import Secrets
    from benchmarks.study.store import Mode, Store

__all__ = ["Address", "Links", "accept_design", "check_tls", "listening", "make_server", "serve", "serving", "warm_up"]

_PATIENCE: Final = 30.0
"""Seconds in which a server has to start."""


@dataclass(frozen=True, slots=True)
class Address:
    """Where a study is served.

    Attributes:
        host: Name or number of the interface.
        port: 0 for any that is free.
        root_path: Behind a reverse proxy: the path under which it passes requests on, such as ``"/study"``.
        tls_cert: File of the certificate chain; empty without TLS.
        tls_key: File of its key.
        trusted: Addresses of reverse proxies whose ``X-Forwarded-*`` headers are believed; empty: nobody's.
    """

    host: str = "127.0.0.1"
    port: int = 8000
    root_path: str = ""
    tls_cert: str = ""
    tls_key: str = ""
    trusted: str = ""


@dataclass(frozen=True, slots=True)
class Links:
    """What to open in a browser.

    Attributes:
        participant: To be given to participants.
        debug: For trying it out: what is played there goes to the debug database.
        monitor: For researchers; holds the admin token.
    """

    participant: str
    debug: str
    monitor: str

    @classmethod
    def of(cls, base: str, secrets: Secrets, source: str = "none") -> Links:
        """The links under a base address without a slash at its end."""
        query = {
            "prolific": "?PROLIFIC_PID={{%PROLIFIC_PID%}}&STUDY_ID={{%STUDY_ID%}}&SESSION_ID={{%SESSION_ID%}}",
        }.get(source, "")
        return cls(f"{base}/{query}", f"{base}/debug?key={secrets.debug}", f"{base}/monitor#{secrets.admin}")


def warm_up(study: Study) -> None:
    """Compile what games need, so that the first participant does not wait for it: a few steps of every round.

    Raises:
        LayoutError: A layout that cannot be played (``legible study check`` says so before).
    """
    for screen in {s.condition: s for s in timeline(study, study.conditions) if s.kind in GAMES}.values():
        game = make_game(study, screen, 0)
        game.digest()
        for _ in range(3):
            action: Any = 5 if study.content.domain == "overcooked" else [0.3, 0.3]
            game.step(action)
            game.state(True)
            game.digest()
        game.outcome()
        game.close()


def make_server(
    study: Study, address: Address, *, modes: tuple[Mode, ...] = ("live", "debug"), pace: Pace | None = None
) -> uvicorn.Server:
    """A server that is ready to run; ``server.config.app`` is the application.

    Raises:
        StudyError: A database cannot be used.
    """
    import uvicorn

    check_tls(address)
    pace = pace or Pace()
    config = uvicorn.Config(
        create_app(study, modes=modes, pace=pace),
        host=address.host,
        port=address.port,
        root_path=address.root_path,
        ssl_certfile=address.tls_cert or None,
        ssl_keyfile=address.tls_key or None,
        proxy_headers=bool(address.trusted),
        forwarded_allow_ips=address.trusted or None,
        access_log=False,  # paths hold keys
        log_level="warning",
        server_header=False,
        limit_concurrency=pace.connections + 500,
        h11_max_incomplete_event_size=16_384,
        ws="websockets-sansio",
        ws_max_size=65_536,
        ws_per_message_deflate=False,  # messages are small; memory of each connection would not be
        ws_ping_interval=20.0,
        ws_ping_timeout=30.0,
        timeout_graceful_shutdown=3,
        lifespan="on",
    )
    return uvicorn.Server(config)


def serve(
    study: Study,
    address: Address,
    *,
    modes: tuple[Mode, ...],
    new_design: bool,
    ready: Callable[[int, Secrets], None],
) -> None:
    """Serve a study from the main thread until Ctrl-C (then a ``KeyboardInterrupt``) or SIGTERM (``SystemExit(0)``).

    Connections are told and closed, what waits is written, and the databases are closed before either.

    Args:
        study: The design.
        address: Where.
        modes: Which databases.
        new_design: Whether live data of another design may be there.
        ready: Called with the port and the study's secret once requests are answered.

    Raises:
        StudyError: The address or a database cannot be used, or live data of another design are there.
    """
    with _ends_at_sigterm(), listening(address) as listener:
        server = make_server(study, address, modes=modes)
        hubs = server.config.app.state.hubs  # type: ignore[union-attr]
        try:
            for hub in hubs.values():
                accept_design(study, hub.context.store, new_design=new_design)
            warm_up(study)
            server.config.load()
            ready(listener.getsockname()[1], server.config.app.state.secrets)  # type: ignore[union-attr]
            server.run(sockets=[listener])
        finally:
            close_stores(hubs)


@contextlib.contextmanager
def _ends_at_sigterm() -> Iterator[None]:
    """SIGTERM, the way in which services are stopped, ends the process as a success; what is open is closed before."""

    def leave(*_: object) -> None:
        raise SystemExit(0)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def listening(address: Address) -> Iterator[socket.socket]:
    """A socket at an address, which other programs cannot take meanwhile.

    Raises:
        StudyError: It cannot be used.
    """
    family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
    try:
        listener = socket.create_server((address.host, address.port), family=family)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise StudyError(f"port {address.port} of {address.host} cannot be used: {reason}") from error
    with listener:
        yield listener


def accept_design(study: Study, store: Store, *, new_design: bool) -> None:
    """Refuse to mix participants of two designs in a live database, unless somebody has said that this is wanted.

    What was wanted once is remembered. Rows of the old design stay; orders and numbers of participants count the new
    one's alone, and participants of the old one who come back are told that they cannot go on.

    Args:
        study: The design.
        store: The database.
        new_design: Whether it is wanted.

    Raises:
        StudyError: The database has participants of another design.
    """
    if store.value("design") == study.design_hash:
        return
    others = sum(other_designs(study, store).values())
    if others and store.mode == "live" and not new_design:
        raise StudyError(
            f"{store.path} has {others} participants of another design: the study was changed since. Undo the change, "
            "or give --new-design to go on with new participants; the old ones' data stay as they are"
        )
    store.write_now(
        rows.study_value("design", study.design_hash),
        rows.event_row("", study.design_hash, time.time(), "design", earlier=others),
    )


@contextlib.contextmanager
def serving(
    study: Study,
    *,
    port: int = 0,
    modes: tuple[Mode, ...] = ("live", "debug"),
    pace: Pace | None = None,
) -> Iterator[tuple[str, uvicorn.Server]]:
    """Serve a study from a thread of this process, on this machine alone.

    Yields:
        ``(base, server)``: the address without a slash at its end.

    Raises:
        StudyError: It does not start.
    """
    listener = socket.create_server(("127.0.0.1", port))
    base = f"http://127.0.0.1:{listener.getsockname()[1]}"
    server = make_server(study, Address(port=listener.getsockname()[1]), modes=modes, pace=pace)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    started = time.monotonic()
    while not server.started:
        if not thread.is_alive() or time.monotonic() - started > _PATIENCE:
            raise StudyError("the server did not start")
        time.sleep(0.01)
    try:
        yield base, server
    finally:
        server.should_exit = True
        thread.join(_PATIENCE)
        listener.close()
        logging.getLogger("legible.study").debug("stopped")


def check_tls(address: Address) -> None:
    """Whether the files of TLS can be read.

    Raises:
        StudyError: One is missing, or only one is given.
    """
    if bool(address.tls_cert) != bool(address.tls_key):
        raise StudyError("TLS needs both --tls-cert and --tls-key")
    for name in filter(None, (address.tls_cert, address.tls_key)):
        if not Path(name).is_file():
            raise StudyError(f"there is no file {name}")
