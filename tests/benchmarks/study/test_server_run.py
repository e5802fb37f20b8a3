"""Serving from the command's side: links, designs, locks, proxies, TLS, and how it stops."""

from __future__ import annotations

import shutil
import ssl
import subprocess
import urllib.request
from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.cli.study_server import code, recruit
from benchmarks.study.errors import StudyError
from benchmarks.study.server.run import Address, accept_design, listening, make_server, serving
from benchmarks.study.store import Store, database_path
from tests.benchmarks.study.pages_by_hand import served, tiny_study


def test_two_servers_do_not_write_one_database(tmp_path: Path) -> None:
    study = tiny_study(tmp_path)
    with served(study), pytest.raises(StudyError, match="another server is writing"):
        make_server(study, Address())
    with served(study) as server:  # what failed has let go of everything
        assert server.join()


def test_designs_are_mixed_only_where_somebody_says_so(tmp_path: Path) -> None:
    old, new = tiny_study(tmp_path), tiny_study(tmp_path, design="b" * 16)
    with served(old) as server:
        store = server.app.state.hubs["live"].context.store
        accept_design(old, store, new_design=False)
        server.join()
        with pytest.raises(StudyError, match="1 participants of another design"):
            accept_design(new, store, new_design=False)
        accept_design(new, store, new_design=True)
        accept_design(new, store, new_design=False)  # remembered
        with pytest.raises(StudyError, match="another design"):
            accept_design(tiny_study(tmp_path, design="c" * 16), store, new_design=False)


def test_a_port_that_is_taken_is_said_in_a_sentence() -> None:
    with (  # noqa: SIM117
        listening(Address(port=0)) as listener,
        pytest.raises(StudyError, match=r"port \d+ of 127.0.0.1 cannot be used"),
    ):
        with listening(Address(port=listener.getsockname()[1])):
            pass


def test_a_real_server_under_a_path_of_a_proxy(tmp_path: Path) -> None:
    """The proxy takes its path off; links in the page are relative, so that none of them leaves it."""
    from starlette.testclient import TestClient

    from benchmarks.study.server.app import create_app

    with TestClient(create_app(tiny_study(tmp_path)), root_path="/study") as client:
        for path in ("/study/", "/study/static/page.css", "/study/healthz", "/study/monitor"):
            answer = client.get(path)
            assert answer.status_code == 200, path
            assert 'src="/' not in answer.text
            assert 'href="/' not in answer.text


def test_forwarded_headers_are_believed_only_when_asked(tmp_path: Path) -> None:
    server = make_server(tiny_study(tmp_path), Address())
    try:
        assert server.config.proxy_headers is False
        assert server.config.access_log is False
    finally:
        for hub in server.config.app.state.hubs.values():  # type: ignore[union-attr]
            hub.context.store.close()


def test_tls_by_files(tmp_path: Path) -> None:
    if shutil.which("openssl") is None:
        pytest.skip("there is no openssl to make a certificate with")
    cert, key = tmp_path / "c.pem", tmp_path / "k.pem"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-keyout", str(key)]
    subprocess.run([*command, "-out", str(cert), *subject], check=True, capture_output=True)
    import threading
    import time

    address = Address(port=0, tls_cert=str(cert), tls_key=str(key))
    with listening(address) as listener:
        server = make_server(tiny_study(tmp_path), address)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        while not server.started and thread.is_alive():
            time.sleep(0.01)
        url = f"https://127.0.0.1:{listener.getsockname()[1]}/healthz"
        with urllib.request.urlopen(url, context=ssl.create_default_context(cafile=str(cert)), timeout=20) as answer:
            assert answer.read() == b"ok"
        server.should_exit = True
        thread.join(20)
    with pytest.raises(StudyError, match="both"):
        make_server(tiny_study(tmp_path), Address(tls_cert=str(cert)))


def test_recruitment_and_codes_from_the_command(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path, asked=False)) as server:
        with server.page(server.join()) as page:
            given = page.finish()["code"]
        run = CliRunner().invoke
        assert "paused (was open)" in run(recruit, [str(tmp_path), "pause"]).output
        assert server.client.post("/api/join", json={"query": {}}).status_code == 403
        found = run(code, [str(tmp_path), given.lower()])
        assert (found.exit_code, found.output) == (0, "P001: complete (as the database says)\n")
        assert run(code, [str(tmp_path), "AAAAA-AAAAA"]).exit_code == 1


def test_a_server_that_is_stopped_writes_what_waits_and_lets_go(tmp_path: Path) -> None:
    study = tiny_study(tmp_path)
    with serving(study) as (base, _), urllib.request.urlopen(f"{base}/healthz", timeout=20) as answer:
        assert answer.status == 200
    store = Store(database_path(tmp_path, "live"), mode="live", name="tiny")
    kinds = [row[0] for row in store.read("SELECT kind FROM events ORDER BY event")]
    store.close()
    assert kinds == ["server_started", "server_stopped"]
