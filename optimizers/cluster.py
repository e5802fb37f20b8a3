"""The way to a Dask scheduler: an address, someone there who speaks Dask, and workers."""

from __future__ import annotations

import socket
import time
import warnings
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["SILENCE", "WORKERS", "check_address", "connect", "wait_for_workers"]

_SCHEMES: Final = ("tcp", "tls", "ws", "wss")

SILENCE: Final = 5.0
"""Seconds after which someone who has not said a word is taken not to speak Dask; schedulers speak first."""

WORKERS: Final = 60.0
"""Seconds to wait for the first worker."""

_GREETING: Final = 1 << 16
"""Bytes that no scheduler's greeting reaches."""


def check_address(address: str) -> tuple[str, str, int]:
    """Scheme, host and port of an address such as ``"tcp://10.0.0.1:8786"``; TCP where it names no scheme.

    Raises:
        ValueError: It is something else; says what is wrong with it.
    """
    expected = "expected an address such as tcp://10.0.0.1:8786"
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ValueError(f"{address!r} is no address of a scheduler: {error}; {expected}") from error
    if parts.scheme not in _SCHEMES:
        raise ValueError(f"{address!r} is no address of a scheduler: {parts.scheme}:// is none of its protocols "
                         f"({', '.join(f'{scheme}://' for scheme in _SCHEMES)}); {expected}")  # fmt: skip
    if not host or not port:
        raise ValueError(f"{address!r} is no address of a scheduler: its {'port' if host else 'host'} is missing; "
                         f"{expected}")  # fmt: skip
    if parts.path.strip("/") or parts.query or parts.fragment:
        raise ValueError(f"{address!r} is no address of a scheduler: it goes on after the port; {expected}")
    return parts.scheme, host, port


def connect(scheduler: str, timeout: float = 10.0) -> Client:
    """A client of a running scheduler.

    Args:
        scheduler: Its address, such as ``"tcp://10.0.0.1:8786"``.
        timeout: Seconds to wait for it.

    Raises:
        ImportError: Dask is not installed; the message says how to get it.
        ValueError: That is no address.
        ConnectionError: Nobody answers at that address, or someone who does not speak Dask.
    """
    scheme, host, port = check_address(scheduler)
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError("a cluster needs Dask: pip install 'legible-envs[distributed]'") from error
    how = "start one with `dask scheduler` and workers with `dask worker ADDRESS`"
    if scheme == "tcp" and (problem := _greeting_problem(host, port, min(timeout, SILENCE))):
        raise ConnectionError(f"no Dask scheduler answers at {scheduler!r}: {problem}; {how}")
    try:
        return Client(scheduler, timeout=timeout, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConnectionError(f"no Dask scheduler answers at {scheduler!r} ({error}); {how}") from error


def _greeting_problem(host: str, port: int, patience: float) -> str:
    """Why whoever listens there is no scheduler; empty if its first words are those of one.

    Dask's own client takes the first bytes of any answer for the length of a message, and waits for ever for one that
    does not come.
    """
    heard = b""
    try:
        with socket.create_connection((host, port), timeout=patience) as line:
            deadline = time.monotonic() + patience
            while len(heard) < 8 or len(heard) < 8 + int.from_bytes(heard[:8], "little"):
                line.settimeout(max(0.01, deadline - time.monotonic()))
                piece = line.recv(4096)
                heard += piece
                if not piece or int.from_bytes(heard[:8].ljust(8, b"\0"), "little") > _GREETING:
                    break
    except socket.gaierror as error:
        return f"the name {host} is not known here ({error.strerror})"
    except TimeoutError:
        return f"whoever listens there said nothing in {patience:g} s" if _listens(host, port) else "it does not answer"
    except OSError as error:
        return error.strerror or str(error)
    if b"compression" in heard and b"pickle-protocol" in heard:
        return ""
    return "whoever listens there does not speak Dask" if heard else "whoever listens there hangs up"


def _listens(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host, port), timeout=1.0):
            return True
    except OSError:
        return False


def wait_for_workers(client: Client, scheduler: str, seconds: float = WORKERS) -> None:
    """Wait until a scheduler has a worker, and say so.

    Raises:
        ConnectionError: None came in time.
    """
    if client.nthreads():
        return
    warnings.warn(
        f"the scheduler at {scheduler} has no workers; waiting up to {seconds:g} s for one: `dask worker {scheduler}`",
        stacklevel=2,
    )
    deadline = time.monotonic() + seconds
    while not client.nthreads():
        if time.monotonic() > deadline:
            raise ConnectionError(
                f"no worker joined the scheduler at {scheduler} within {seconds:g} s; start some with "
                f"`dask worker {scheduler}`"
            )
        time.sleep(0.1)
