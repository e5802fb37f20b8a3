"""Hostile inputs, limits, headers and secrets: the server answers politely and goes on."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.websockets import WebSocketDisconnect

from benchmarks.study.server import protocol
from tests.benchmarks.study.pages_by_hand import DEVICE, WAY, Page, Served, served, tiny_study

HOSTILE: list[Any] = [
    "'; DROP TABLE participants; --",
    '" OR 1=1 --',
    "<script>alert(1)</script>",
    "</script><img src=x onerror=alert(1)>",
    "a\r\nSet-Cookie: x=1",
    "../../../../etc/passwd",
    "..%2f..%2fetc%2fpasswd",
    "nul\x00byte",
    "\ud800",
    "\U0001f469\u200d\U0001f373",
    "\u202egnp.exe",
    "x" * 5000,
    10**40,
    -1,
    1e308,
    True,
    None,
    [],
    [[[[[[]]]]]],
    {"a": {"b": {}}},
]
BOMBS = [
    '{"type":"step","n":NaN}',
    "[" * 20_000,
    '{"a":' * 9_000,
    '"' + "\\u0000" * 5000,
    "",
    "null",
    "1e999",
    "{}",
    "\x00",
]


def is_well(server: Served) -> bool:
    """Whether the server still takes participants."""
    with server.page(server.join()) as page:
        return page.name == "device"


def test_every_answer_has_the_strict_headers(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        key = server.app.state.secrets.debug
        paths = [
            "/",
            f"/debug?key={key}",
            "/debug",
            "/monitor",
            "/static/page.css",
            "/static/none.js",
            "/healthz",
            "/no",
        ]
        for path in [*paths, "/api/monitor/overview"]:
            for method in ("GET", "POST"):
                headers = server.client.request(method, path).headers
                assert "default-src 'none'" in headers["content-security-policy"], (method, path)
                assert headers["x-content-type-options"] == "nosniff"
                assert headers["referrer-policy"] == "no-referrer"
                assert "set-cookie" not in headers
        with pytest.raises(Exception) as refusal, server.client.websocket_connect("/no"):  # noqa: PT011
            pass
        assert "content-security-policy" in refusal.value.headers  # type: ignore[attr-defined]


def test_an_error_shows_nothing_of_the_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> str:
        raise ValueError("a secret path")

    with served(tiny_study(tmp_path)) as server:
        monkeypatch.setattr("benchmarks.study.server.pages.participant_page", fail)
        answer = server.client.get("/")
        assert (answer.status_code, answer.text) == (500, "something went wrong")
        assert "default-src 'none'" in answer.headers["content-security-policy"]


def test_names_of_files_reach_no_other_file(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        for name in (
            "../__init__.py",
            "..%2f__init__.py",
            "__init__.py",
            "index.html.j2",
            "%00",
            "page.css%00.js",
            "/etc/passwd",
        ):
            assert server.client.get(f"/static/{name}").status_code == 404, name


@pytest.mark.parametrize("value", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_values_of_every_field_are_answered_politely(tmp_path: Path, value: Any) -> None:
    study = tiny_study(tmp_path, recruitment={"source": "prolific"})
    with served(study) as server:
        body = json.dumps({"query": {"PROLIFIC_PID": value, "STUDY_ID": value, "key": value}})
        assert server.client.post("/api/join", content=body).status_code in (200, 400, 403)
        if isinstance(value, str):
            text = server.client.get("/", params={"PROLIFIC_PID": value.encode("utf-8", "replace")}).text
            assert "<script>alert" not in text
        token = server.join(PROLIFIC_PID="w")
        with server.page(token) as page:  # some twenty messages that are not understood end a connection
            _send_everywhere(page, value)
            page.agree()
            page.say("next")
        with server.page(token) as page:
            _send_everywhere(page, value)
            page.play(WAY)
            assert page.finish()["ending"] == "complete"
        assert server.rows("SELECT COUNT(*) FROM participants WHERE state = 'complete'")[0][0] == 1


def _send_everywhere(page: Page, value: Any) -> None:
    """A hostile value in every field of every message that changes nothing where it is not understood."""
    fields: dict[str, list[str]] = {
        "step": ["n", "action", "down"], "pointer": ["n", "samples"], "answers": ["values"],
        "event": ["kind", "at", "detail"], "device": list(DEVICE), "hello": ["token", "tab"],
    }  # fmt: skip
    for kind, names in fields.items():
        for name in names:
            if kind == "device" and page.name == "device":
                continue
            good: dict[str, Any] = {"step": {"n": 999, "action": 0}, "device": dict(DEVICE)}.get(kind, {})
            message = json.dumps({"type": kind, **good, name: value})
            if len(message) < 60_000:
                page.socket.send_text(message)
    page.send("ping", at=123)
    while page.read().get("at") != 123:
        pass


def test_bombs_are_answered_politely(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        for bomb in BOMBS:
            assert server.client.post("/api/join", content=bomb.encode()).status_code == 400
            with server.client.websocket_connect("/socket") as socket:
                socket.send_text(bomb)
                assert socket.receive_json()["type"] == "refused"
            with server.page(server.join()) as page:
                page.socket.send_text(bomb)
                assert page.read()["reason"] == "this message was not understood"
                page.socket.send_bytes(b"\xff\xfe")
                assert page.read()["type"] == "refused"
        assert server.client.post("/api/join", content=b"x" * 20_000).status_code == 400
        assert is_well(server)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)
KINDS = ["device", "consent", "next", "step", "pointer", "answers", "event", "ping", "hello", "x"]
FIELDS = ["n", "action", "down", "samples", "values", "kind", "at", "detail", "agreed", "token"]
MESSAGES = JSON | st.builds(
    lambda kind, more: {**more, "type": kind}, st.sampled_from(KINDS), st.dictionaries(st.sampled_from(FIELDS), JSON)
)


def test_any_json_leaves_the_game_as_it_was_unless_it_is_acknowledged(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path, rounds={"max_steps": 100_000}), messages=1e6, burst=1e6) as server:
        token = server.join()
        with server.page(token) as page:
            page.agree()
            page.say("next")

        @settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
        @given(messages=st.lists(MESSAGES, max_size=8))
        def check(messages: list[Any]) -> None:
            server.app.state.hubs["live"]._connects.clear()
            with server.page(token) as page:
                known = page.state
                for message in messages:
                    page.socket.send_text(json.dumps(message))
                    page.send("ping", at=77.5)
                    while (answer := page.read()).get("at") != 77.5:
                        known = answer["state"] if answer["type"] == "state" else known
            with server.page(token) as page:
                assert page.state == known

        check()
        assert "error" not in server.kinds()


def test_floods_are_cut_off_and_leave_few_rows(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path), messages=1, burst=50, event_burst=10, events=0.01) as server:
        token = server.join()
        with server.page(token) as page, pytest.raises(WebSocketDisconnect) as ending:  # noqa: PT012
            for _ in range(60):
                page.send("event", kind="focus", at=1)
            while True:
                page.read()
        assert ending.value.code == 4429
        assert server.kinds().count("page_focus") == 10
        with server.page(token) as page, pytest.raises(WebSocketDisconnect) as ending:  # noqa: PT012
            for _ in range(30):
                page.say("nonsense")
        assert ending.value.code == 4400


def test_joins_and_connections_are_limited(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path), joins=1, connects=0.001) as server:
        answers = [server.client.post("/api/join", json={"query": {}}) for _ in range(8)]
        assert {answer.status_code for answer in answers} == {200, 429}
        token = answers[0].json()["token"]
        for _ in range(20):
            with server.page(token):
                pass
        with server.page(token) as page:
            assert page.screen == {}
        assert server.kinds().count("connect") == 20


def test_tokens_open_nothing_else(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        secrets = server.app.state.secrets
        tokens = {server.join(), server.join(), server.join(key=secrets.debug), secrets.admin, secrets.debug}
        assert len(tokens) == 5
        for wrong in (secrets.admin, secrets.debug, "P001", "", "é"):
            with server.client.websocket_connect("/socket") as socket:
                socket.send_json({"type": "hello", "token": wrong, "tab": "t"})
                assert socket.receive_json()["type"] == "refused"
                with pytest.raises(WebSocketDisconnect) as ending:
                    socket.receive_json()
                assert ending.value.code == 4401
        assert server.rows("SELECT COUNT(*) FROM events WHERE kind = 'connect'")[0][0] == 0


def test_secrets_are_in_no_log_and_no_database(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG, logger="legible.study")
    with served(tiny_study(tmp_path)) as server:
        secrets, token = server.app.state.secrets, server.join()
        server.client.get("/debug", params={"key": secrets.debug})
        with server.page(token) as page:
            page.say("hello", token=token, extra=1)
            page.say("hello", token=token)
            page.finish()
        server.client.get("/api/monitor/overview", headers={"Authorization": f"Bearer {secrets.admin}"})
    content = b"".join(file.read_bytes() for file in (tmp_path / "data").glob("*.sqlite*"))
    for secret in (secrets.admin, secrets.debug, token, secrets.key.hex()):
        assert secret.encode() not in content
        assert secret not in caplog.text
    modes = {file.name: file.stat().st_mode & 0o077 for file in (tmp_path / "data").iterdir()}
    assert set(modes.values()) == {0}, modes


def test_what_is_wrong_with_a_message_is_said_without_the_message() -> None:
    for text in ('{"type":"hello","token":"SECRET"}', '{"type":"hello","token":"SECRET","tab":5}', '{"SECRET'):
        with pytest.raises(ValueError, match=r".") as problem:
            protocol.read_message(text)
        assert "SECRET" not in str(problem.value)
