"""The way to a scheduler: whoever answers something else, or nothing, is named within seconds."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import importlib
import os
import re
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from optimizers.cluster import check_address, connect
from optimizers.fingerprint import Fingerprint, OtherCodeError, differences, expect, fingerprint, package_of, remarks

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


OURS = Fingerprint("0.2", {"a": "12", "b": "34"}, "3.11.7", {"numpy": "2.1.3", "numba": "0.61.0"}, "Linux x86_64")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"digests": {"a": "12", "b": "35"}}, r"^its files of b are others \(digest 35, ours 34\)$"),
        ({"digests": {"a": "12", "b": "35"}, "version": "0.1"}, r"version 0\.1, ours 0\.2; digest 35, ours 34"),
        ({"digests": {"a": "12", "b": ""}}, r"^it lacks the package b$"),
        ({"digests": {}}, "it lacks the package a"),
        ({"changed": ("a.x", "a.y")}, r"^a\.x and 1 more changed on its disk since it was started: start it again$"),
        ({"python": "3.12.0"}, r"^it runs Python 3\.12\.0, we 3\.11\.7$"),
        ({"libraries": {"numpy": "2.2.0", "numba": "0.61.0"}}, r"^it has numpy 2\.2\.0, we 2\.1\.3$"),
        ({"libraries": {"numpy": "2.1.3"}}, "^it lacks numba$"),
    ],
)
def test_other_code_is_told_apart(change: dict[str, Any], reason: str) -> None:
    theirs = dataclasses.replace(OURS, **change)
    assert re.search(reason, "; ".join(differences(OURS, theirs)))
    assert differences(OURS, OURS) == remarks(OURS, OURS) == []


@pytest.mark.parametrize(
    "change",
    [{"machine": "Darwin arm64"}, {"libraries": {"numpy": "2.1.4", "numba": "0.61.0"}}, {"python": "3.11.9"},
     {"version": "0.3"}, {"libraries": OURS.libraries | {"torch": "2.4"}}],
)  # fmt: skip
def test_smaller_differences_are_no_reason_to_refuse(change: dict[str, Any]) -> None:
    theirs = dataclasses.replace(OURS, **change)
    assert differences(OURS, theirs) == []
    assert len(remarks(OURS, theirs)) == ("machine" in change or change.get("libraries", {}).get("numpy") == "2.1.4")


def test_a_digest_is_of_the_code_and_its_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not of line ends, nor of what else lies in the folder."""
    monkeypatch.syspath_prepend(tmp_path)
    files = {"__init__.py": b"", "x.py": b"a = 1\nb = 2\n", "sub/y.yaml": b"z: 1\n"}
    changes = {
        "same": {"x.py": b"a = 1\r\nb = 2\r\n", "notes.txt": b"?", ".#x.py": b"?", "__pycache__/x.pyc": b"?"},
        "edited": {"x.py": b"a = 1\nb = 3\n"},
        "data": {"sub/y.yaml": b"z: 2\n"},
        "moved": {"x.py": b"", "y.py": b"a = 1\nb = 2\n"},
    }
    digests = {}
    for name, change in {"plain": {}, **changes}.items():
        for path, content in {**files, **change}.items():
            where = tmp_path / f"digest_{name}" / path
            where.parent.mkdir(parents=True, exist_ok=True)
            where.write_bytes(content)
        importlib.invalidate_caches()
        digests[name] = fingerprint(f"digest_{name}").digests[f"digest_{name}"]
    assert digests["same"] == digests["plain"] != ""
    assert len(set(digests.values())) == 4
    assert fingerprint("no_such_package", "").digests == {"no_such_package": ""}


def test_work_checks_the_code_itself() -> None:
    expect(fingerprint("optimizers").digests)
    with pytest.raises(OtherCodeError, match="this worker has other files of optimizers than"):
        expect({"optimizers": "another"})


def test_a_module_that_was_edited_later_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "edited_module.py").write_text("a = 1\n")
    monkeypatch.setitem(sys.modules, "edited_module", importlib.import_module("edited_module"))
    os.utime(tmp_path / "edited_module.py", (time.time() + 60,) * 2)
    assert fingerprint("edited_module").changed == ("edited_module",)


def test_packages_of_functions_and_objects() -> None:
    assert package_of(fingerprint) == package_of(OURS) == "optimizers"
    assert package_of(len) == package_of(functools.partial(len)) == package_of(3) == ""
