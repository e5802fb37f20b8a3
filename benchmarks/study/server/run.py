"""Running the server: on an address, with or without TLS, warm before the first participant comes."""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.study.errors import StudyError
from benchmarks.study.games import make_game
from benchmarks.study.server.app import create_app
from benchmarks.study.server.context import Pace
from benchmarks.study.timeline import GAMES, timeline

if TYPE_CHECKING:
    import uvicorn

    from benchmarks.study.design.study import Study
    from benchmarks.study.server.secrets import Secrets
    from benchmarks.study.store import Mode

__all__ = ["Address", "Links", "make_server", "serving", "warm_up"]

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
    """

    host: str = "127.0.0.1"
    port: int = 8000
    root_path: str = ""
    tls_cert: str = ""
    tls_key: str = ""


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
    """A server that is ready to run; ``server.config.loaded_app`` or ``app`` is the application.

    Raises:
        StudyError: A database cannot be used.
    """
    import uvicorn

    app = create_app(study, modes=modes, pace=pace)
    config = uvicorn.Config(
        app,
        host=address.host,
        port=address.port,
        root_path=address.root_path,
        ssl_certfile=address.tls_cert or None,
        ssl_keyfile=address.tls_key or None,
        access_log=False,  # paths hold keys
        log_level="warning",
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=65_536,
        ws_per_message_deflate=False,  # messages are small; a compressor for each connection takes 300 kB
        ws_ping_interval=20.0,
        ws_ping_timeout=30.0,
        timeout_graceful_shutdown=3,
        lifespan="on",
    )
    return uvicorn.Server(config)


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
