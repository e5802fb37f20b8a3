"""Participants who are forgotten while they are here, and databases that are made again."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from starlette.websockets import WebSocketDisconnect

from benchmarks.cli.study_server import code
from benchmarks.study.analysis.person_data import TABLES_OF_A_PERSON, forget
from benchmarks.study.store import database_path
from tests.benchmarks.study.pages_by_hand import WAY, Clock, Page, Served, served, tiny_study


def rows_of(server: Served, participant: str) -> int:
    return sum(
        server.rows(f"SELECT COUNT(*) FROM {table} WHERE participant = ?", participant)[0][0]
        for table in TABLES_OF_A_PERSON
    )


def assert_dismissed(page: Page) -> None:
    """The page is told that it is nobody's, and is not to come back."""
    assert page.read() == {"type": "refused", "reason": "unknown participant", "fatal": True}
    with pytest.raises(WebSocketDisconnect) as ending:
        page.read()
    assert ending.value.code == 4401


MESSAGES: dict[str, dict[str, Any]] = {
    "step": {"n": 3, "action": 0, "down": 1.0, "shown": 0.5},
    "event": {"kind": "focus"},
    "withdraw": {},
    "no such message": {},
    "ping": {"at": 1.0},
}


@pytest.mark.parametrize("message", MESSAGES)
def test_who_is_forgotten_while_they_play_is_dismissed_and_leaves_no_row(tmp_path: Path, message: str) -> None:
    clock = Clock()
    with served(tiny_study(tmp_path), clock=clock) as server:
        token, other = server.join(), server.join()
        with server.page(other) as bystander, server.page(token) as page:
            page.agree()
            page.play(WAY[:3])
            forget(database_path(tmp_path, "live"), "P001")
            clock.time += 60  # pings are signs of life now and then
            page.send(message, **MESSAGES[message])
            assert_dismissed(page)
            bystander.agree()
            assert bystander.name == "round#A#1"
        hub = server.app.state.hubs["live"]
        while "P001" in hub.sessions:
            time.sleep(0.01)
        assert rows_of(server, "P001") == 0
        assert rows_of(server, "P002") > 0
        with server.client.websocket_connect("/socket") as socket:
            page = Page(socket)
            page.send("hello", token=token, tab="later")
            assert_dismissed(page)
        server.join()
        assert [row[0] for row in server.rows("SELECT participant FROM participants")] == ["P002", "P003"]


def test_who_is_forgotten_while_they_are_away_from_the_keys_is_dismissed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.study.server.socket._LOOK", 0.01)
    clock = Clock()
    study = tiny_study(tmp_path, limits={"idle_warning": 50, "idle_timeout": 100})
    with served(study, clock=clock) as server, server.page(server.join()) as page:
        forget(database_path(tmp_path, "live"), "P001")
        clock.time += 51
        assert_dismissed(page)
        assert rows_of(server, "P001") == 0


def test_a_forgotten_participant_who_opens_another_tab_is_nobody(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        token = server.join()
        with server.page(token):
            forget(database_path(tmp_path, "live"), "P001")
            with server.client.websocket_connect("/socket") as socket:
                page = Page(socket)
                page.send("hello", token=token, tab="other")
                assert_dismissed(page)
        assert rows_of(server, "P001") == 0


def test_links_and_codes_of_a_deleted_database_fit_nobody_in_the_next(tmp_path: Path) -> None:
    """Numbers begin again, the secret stays: P001 is another person then."""
    study = tiny_study(tmp_path, asked=False)
    with served(study) as server:
        token = server.join()
        with server.page(token) as page:
            given = page.finish()["code"]
        admin = server.app.state.secrets.admin
    kept = tmp_path / "kept"
    shutil.copytree(tmp_path / "data", kept / "data")
    for file in (tmp_path / "data").glob("live.sqlite*"):
        file.unlink()
    with served(study) as server:
        new = server.join()
        assert server.rows("SELECT participant FROM participants")[0][0] == "P001"
        assert new != token
        assert server.app.state.secrets.admin == admin
        with server.client.websocket_connect("/socket") as socket:
            page = Page(socket)
            page.send("hello", token=token, tab="t")
            assert_dismissed(page)
        with server.page(new) as page:
            assert page.finish()["code"] != given
    run = CliRunner().invoke
    assert run(code, [str(tmp_path), given]).exit_code == 1
    found = run(code, [str(kept), given])  # the copy still knows it
    assert (found.exit_code, found.output) == (0, "P001: complete (as the database says)\n")
