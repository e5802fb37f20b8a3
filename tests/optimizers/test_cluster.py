"""The way to a scheduler: whoever answers something else, or nothing, is named within seconds."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from optimizers.cluster import check_address, connect, wait_for_workers

pytest.importorskip("distributed")

Serve = Callable[..., str]


@pytest.fixture
def serve() -> Iterator[Serve]:
    """Start a server that says something to everyone who comes, and then hangs up or waits; returns its address."""
    with contextlib.ExitStack() as opened:

        def start(says: bytes, *, waits: bool = True) -> str:
            door = opened.enter_context(socket.create_server(("127.0.0.1", 0)))

            def welcome() -> None:
                guests = []
                with contextlib.suppress(OSError):
                    while True:
                        guest, _ = door.accept()
                        guest.sendall(says)
                        guests.append(guest) if waits else guest.close()

            threading.Thread(target=welcome, daemon=True).start()
            return f"tcp://127.0.0.1:{door.getsockname()[1]}"

        yield start


@pytest.mark.parametrize(
    ("says", "waits", "reason"),
    [
        (b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n", True, "does not speak Dask"),
        (b"SSH-2.0-OpenSSH_9.6\r\n", True, "does not speak Dask"),
        (b"\0" * 64, True, "does not speak Dask"),
        (b"\x10" + b"\0" * 7 + b"0123456789abcdef", True, "does not speak Dask"),
        (b"220 mail\r\n", False, "does not speak Dask"),
        (b"", False, "hangs up"),
        (b"", True, "said nothing in 0.5 s"),
        (b"\0\0\0", True, "said nothing in 0.5 s"),
    ],
)
def test_who_speaks_no_dask_is_named_at_once(serve: Serve, says: bytes, waits: bool, reason: str) -> None:
    address = serve(says, waits=waits)
    started = time.monotonic()
    with pytest.raises(ConnectionError, match=rf"no Dask scheduler answers at '{address}': .*{reason}"):
        connect(address, timeout=0.5)
    assert time.monotonic() - started < 20


@pytest.mark.parametrize(
    ("address", "reason"),
    [("tcp://127.0.0.1:1", "refused"), ("tcp://no-such-host.invalid:8786", r"no-such-host\.invalid is not known here")],
)
def test_nobody_there_is_said(address: str, reason: str) -> None:
    with pytest.raises(ConnectionError, match=reason):
        connect(address, timeout=2.0)


@pytest.mark.parametrize(
    ("address", "parts"),
    [
        ("tcp://10.0.0.1:8786", ("tcp", "10.0.0.1", 8786)),
        ("here:8786", ("tcp", "here", 8786)),
        ("tls://here.org:1", ("tls", "here.org", 1)),
        ("tcp://[::1]:8786", ("tcp", "::1", 8786)),
        ("tcp://here:8786/", ("tcp", "here", 8786)),
    ],
)
def test_addresses_are_taken_apart(address: str, parts: tuple[str, str, int]) -> None:
    assert check_address(address) == parts


@pytest.mark.parametrize(
    "address", ["", "here", "tcp://here", "tcp://:8786", "http://here:80", "tcp://here:0", "tcp://here:99999",
                "tcp://here:one", "tcp://here:1/status", "tcp://[::1", "inproc://here:1", "8786"]
)  # fmt: skip
def test_other_texts_are_no_addresses(address: str) -> None:
    with pytest.raises(ValueError, match=r"is no address of a scheduler: .*; expected an address such as"):
        check_address(address)


class _Scheduler:
    """A scheduler whose workers come after so many questions."""

    def __init__(self, questions: int) -> None:
        self.questions = questions

    def nthreads(self) -> dict[str, int]:
        self.questions -= 1
        return {} if self.questions >= 0 else {"a worker": 2}


def test_workers_are_waited_for_and_that_is_said() -> None:
    with pytest.warns(UserWarning, match=r"tcp://x:1 has no workers; waiting up to 30 s .*`dask worker tcp://x:1`"):
        wait_for_workers(_Scheduler(3), "tcp://x:1", 30)  # type: ignore[arg-type]
    wait_for_workers(_Scheduler(0), "tcp://x:1", 0)  # type: ignore[arg-type]


def test_workers_are_not_waited_for_for_ever() -> None:
    with (
        pytest.warns(UserWarning, match="no workers"),
        pytest.raises(ConnectionError, match=r"no worker joined the scheduler at tcp://x:1 within 0.2 s"),
    ):
        wait_for_workers(_Scheduler(10_000), "tcp://x:1", 0.2)  # type: ignore[arg-type]
