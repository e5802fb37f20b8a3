"""What people who run studies in browsers have learned to ask for: a test for each."""

from __future__ import annotations

import contextlib
import hashlib
import json
import sqlite3
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import WebSocketDenialResponse
from starlette.websockets import WebSocketDisconnect

from benchmarks.study.server.completion import is_complete, missing
from benchmarks.study.store import Store
from tests.benchmarks.study.pages_by_hand import ANSWERS, DEVICE, WAY, Clock, Page, Served, served, tiny_study

HOUR = 3600.0


@contextlib.contextmanager
def in_round(server: Served, steps: int = 3, tab: str = "tab") -> Iterator[tuple[str, Page]]:
    """A page in the first round, some steps into it."""
    token = server.join()
    with server.page(token, tab) as page:
        page.agree()
        page.play(WAY[:steps])
        yield token, page


# -- reloads and tabs --------------------------------------------------------------------------------------------------


def test_a_reload_resumes_at_the_same_step_with_the_same_held_item(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        with in_round(server) as (token, page):
            before = page.state
            assert before["players"][0]["held"] == ["onion", []]
        with server.page(token, tab="after the reload") as page:
            assert (page.name, page.state) == ("round#A#1", before)
            page.play(WAY[3:])
            assert page.name == "round#B#1"


def test_a_server_that_starts_again_resumes_at_the_same_step_with_the_same_held_item(tmp_path: Path) -> None:
    study = tiny_study(tmp_path)
    with served(study) as server, in_round(server) as (token, page):
        before = page.state
    with served(study) as server, server.page(token) as page:
        assert (page.name, page.state) == ("round#A#1", before)
        page.play(WAY[3:])
        page.finish()
        assert page.screen["ending"] == "complete"
        assert [row["attempt"] for row in server.rows("SELECT attempt FROM visits WHERE kind = 'round'")] == [1, 1]


def test_restart_begins_the_round_again_and_the_earlier_try_does_not_count(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path, limits={"resume": "restart"})) as server:
        with in_round(server) as (token, _):
            pass
        with server.page(token, tab="after the reload") as page:
            assert (page.screen["begun"], page.screen["attempt"]) == (False, 2)
            page.finish()
        visits = server.rows("SELECT * FROM visits WHERE name = 'round#A#1' ORDER BY visit")
        assert [row["attempt"] for row in visits] == [1, 2]
        assert [json.loads(row["outcome"]).get("restarted", False) for row in visits] == [True, False]
        assert len({row["seed"] for row in visits}) == 2


def test_block_ends_the_study_on_a_reload(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path, limits={"resume": "block"})) as server:
        with in_round(server) as (token, _):
            pass
        with server.page(token, tab="after the reload") as page:
            assert page.screen["ending"] == "blocked"


@pytest.mark.parametrize("policy", ["restart", "block"])
@pytest.mark.parametrize("starts_again", [False, True], ids=["same server", "server starts again"])
def test_a_lost_connection_of_the_same_tab_is_no_reload(tmp_path: Path, policy: str, starts_again: bool) -> None:
    study = tiny_study(tmp_path, limits={"resume": policy})
    with contextlib.ExitStack() as stack:
        server = stack.enter_context(served(study))
        with in_round(server, tab="mine") as (token, page):
            before = page.state
        if starts_again:
            stack.close()
            server = stack.enter_context(served(study))
        for _ in range(2):
            with server.page(token, tab="mine") as page:
                assert (page.name, page.screen["begun"], page.state) == ("round#A#1", True, before)


def test_a_tab_that_was_another_before_a_crash_is_still_a_reload(tmp_path: Path) -> None:
    """The server dies while it takes up a reloaded page, which then comes back: the policy still holds."""
    study = tiny_study(tmp_path, limits={"resume": "block"})
    with served(study) as server, in_round(server, tab="first") as (token, _):
        pass
    with served(study) as server:
        broken = _break(server)
        with pytest.raises(WebSocketDisconnect), server.page(token, tab="second") as page:
            assert page.read()
        broken.clear()
        with server.page(token, tab="second") as page:
            assert page.screen["ending"] == "blocked"


def test_two_tabs_that_alternate_are_reloads(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path, limits={"resume": "restart"})) as server:
        with in_round(server, tab="a") as (token, _):
            pass
        for attempt, tab in enumerate(["b", "a", "b"], 2):
            with server.page(token, tab=tab) as page:
                assert page.screen["attempt"] == attempt
                page.play(WAY[:2])


def test_a_session_can_be_resumed_up_to_a_maximum_age(tmp_path: Path) -> None:
    clock = Clock()
    with served(tiny_study(tmp_path, limits={"resume_hours": 24}), clock=clock) as server:
        with in_round(server) as (token, _):
            pass
        clock.time += 24 * HOUR - 60
        with server.page(token) as page:
            assert page.screen["kind"] == "round"
        clock.time += 24 * HOUR + 60
        with server.page(token) as page:
            assert page.screen["ending"] == "expired"


def test_the_newest_tab_wins_and_the_older_is_told(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server, in_round(server, tab="old") as (token, old):  # noqa: SIM117
        with server.page(token, tab="new") as new:
            assert new.state == old.state
            assert old.read() == {"type": "replaced"}
            with pytest.raises(WebSocketDisconnect) as ending:
                old.read()
            assert ending.value.code == 4409
            old_state = new.state
            with contextlib.suppress(Exception):
                old.send("step", n=old_state["n"], action=0)
            assert new.step(WAY[3])["state"]["n"] == old_state["n"] + 1


def test_joining_again_makes_no_second_participant(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, recruitment={"source": "prolific"})
    with served(study) as server:
        token = server.join(PROLIFIC_PID="w1", STUDY_ID="s", SESSION_ID="x")
        assert server.join(PROLIFIC_PID="w1", STUDY_ID="s", SESSION_ID="y") == token
        assert server.join(PROLIFIC_PID="w2") != token
        assert len(server.rows("SELECT * FROM participants")) == 2


def test_a_preview_counts_as_no_participant(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, recruitment={"source": "mturk"})
    with served(study) as server:
        for query in ({}, {"workerId": "w", "assignmentId": "ASSIGNMENT_ID_NOT_AVAILABLE"}):
            page = server.client.get("/", params=query)
            assert page.status_code == 200
            answer = server.client.post("/api/join", json={"query": query})
            assert (answer.status_code, answer.json()["reason"]) == (403, "<h1>preview</h1>\n")
        assert server.rows("SELECT * FROM participants") == []


def test_links_without_a_platform_make_a_participant_each(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        assert server.join() != server.join()
        assert [row[0] for row in server.rows("SELECT participant FROM participants")] == ["P001", "P002"]


def test_connects_disconnects_focus_blur_and_visibility_are_rows(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        with server.page(server.join()) as page:
            for kind in ("focus", "blur", "hidden", "visible", "resize", "fullscreen"):
                page.send("event", kind=kind, at=5)
            page.say("ping", at=1)
        expected = ["joined", "connect", "page_focus", "page_blur", "page_hidden", "page_visible", "page_resize"]
        while "disconnect" not in server.kinds():
            time.sleep(0.01)
        assert server.kinds() == [*expected, "page_fullscreen", "disconnect"]


# -- the end -----------------------------------------------------------------------------------------------------------


def test_the_code_comes_after_the_last_row_and_again_on_return(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, recruitment={"completion_url": "https://example.org/?cc={code}"})
    with served(study) as server:
        token = server.join()
        with server.page(token) as page:
            while page.screen["kind"] != "questionnaire":
                assert "code" not in page.screen
                page.pass_screen()
            end = page.say("answers", values=ANSWERS, seconds=1)
            assert len(server.rows("SELECT * FROM answers WHERE item = 'why'")) == 1
            assert server.rows("SELECT state FROM participants")[0][0] == "complete"
        assert end["url"] == f"https://example.org/?cc={end['code']}"
        with server.page(token, tab="days later") as page:
            assert page.screen == end


def test_codes_are_a_participants_own_and_can_be_verified_later(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        codes = []
        for _ in range(2):
            with server.page(server.join()) as page:
                codes.append(page.finish()["code"])
        secrets = server.app.state.hubs["live"].context.secrets
        assert codes[0] != codes[1]
        assert secrets.is_code(f" {codes[0].lower()} ", "P001", "complete")
        assert not secrets.is_code(codes[0], "P002", "complete")
        assert not secrets.is_code(codes[0], "P001", "withdrawn")


@pytest.mark.parametrize(
    ("deleted", "screen"),
    [
        (
            "DELETE FROM steps WHERE step = 5 AND visit = (SELECT visit FROM visits WHERE name = 'round#A#1')",
            "round#A#1",
        ),
        ("DELETE FROM steps WHERE step = 13", "round#A#1"),
        ("DELETE FROM answers WHERE item = 'easy'", "study#asked"),
        ("DELETE FROM answers WHERE item = 'consent'", "consent"),
        ("DELETE FROM visits WHERE name = 'round#B#1'", "round#B#1"),
    ],
)
def test_complete_is_decided_by_the_rows_that_are_there(tmp_path: Path, deleted: str, screen: str) -> None:
    """Who lacks a row goes back to that screen alone, and is complete after it."""
    study = tiny_study(tmp_path)
    with served(study) as server:
        token = server.join()
        with server.page(token) as page:
            while page.screen["kind"] != "questionnaire":
                page.pass_screen()
            if screen == "study#asked":
                page.pass_screen()
                server.rows("UPDATE participants SET state = 'active', screen = 6")
        server.rows(deleted)
        store: Store = server.app.state.hubs["live"].context.store
        assert not is_complete(store, study, "P001")
        assert screen in missing(store, study, "P001")
        with server.page(token, tab="again") as page:
            if screen != "study#asked":
                assert page.screen["kind"] == "questionnaire"
                page.pass_screen()
            assert page.screen["kind"] != "end"
            assert page.finish()["ending"] == "complete"
        assert "incomplete" in server.kinds()


def test_consent_is_refused_without_the_tick(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        token = server.join()
        with server.page(token) as page:
            page.say("device", **DEVICE)
            assert page.say("next")["type"] == "refused"
            end = page.say("consent", agreed=False)
            assert (end["ending"], end["kind"]) == ("refused", "end")
        with server.page(token) as page:
            assert page.screen["ending"] == "refused"
        assert server.rows("SELECT * FROM answers") == []


def test_the_consent_and_its_hash_are_stored_as_they_were(tmp_path: Path) -> None:
    study = tiny_study(tmp_path)
    with served(study) as server:
        for _ in range(2):
            with server.page(server.join()) as page:
                page.agree()
        texts = server.rows("SELECT * FROM texts")
        assert [(row["name"], row["text"]) for row in texts] == [("consent", study.texts["consent"])]
        assert texts[0]["sha256"] == hashlib.sha256(study.texts["consent"].encode()).hexdigest()
        answers = server.rows("SELECT * FROM answers WHERE item = 'consent'")
        assert [json.loads(row["value"]) for row in answers] == [texts[0]["sha256"]] * 2


def test_a_device_that_will_not_do_stops_the_study_in_words(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, device={"keyboard": True, "min_width": 500, "pointer": "fine", "max_round_trip": 100})
    with served(study) as server:
        token = server.join()
        with server.page(token) as page:
            small = {"keyboard": False, "pointer": "touch", "width": 360, "height": 700, "round_trip": 250}
            end = page.say("device", **small)
            assert (end["ending"], len(end["failed"])) == ("device_failed", 4)
            assert "500" in " ".join(end["failed"])
            assert not any("{" in text for text in end["failed"])
            assert page.say("next")["ending"] == "device_failed"
        with server.page(token) as page:
            assert page.screen["failed"] == end["failed"]


def test_the_practice_has_so_many_attempts_and_an_ending_of_its_own(tmp_path: Path) -> None:
    practice = {"layout": "k.txt", "soups": [["onion"]], "attempts": 3, "max_steps": 14}
    study = tiny_study(tmp_path, practice=practice)
    with served(study) as server:
        token = server.join()
        for attempt in (1, 2, 3):
            with server.page(token, tab=f"tab {attempt}") as page:
                if attempt == 1:
                    page.agree()
                assert (page.screen["attempt"], page.screen["attempts"]) == (attempt, 3)
                page.play([4] * 5)
            with server.page(token, tab=f"other {attempt}") as page:  # taken up in mid-practice
                assert (page.state["n"], page.screen["attempt"]) == (5, attempt)
                page.play([4] * 9)
        with server.page(token) as page:
            assert page.screen["ending"] == "practice_failed"
            assert page.screen["code"]
        with server.page(server.join()) as page:
            page.agree()
            page.play([4] * 14)
            page.play(WAY)
            assert page.name == "round#A#1"
            assert page.finish()["ending"] == "complete"


def test_a_reload_in_the_practice_costs_no_attempt(tmp_path: Path) -> None:
    practice = {"layout": "k.txt", "soups": [["onion"]], "attempts": 1, "max_steps": 20}
    with served(tiny_study(tmp_path, practice=practice, limits={"resume": "restart"})) as server:
        token = server.join()
        for tab in "abc":
            with server.page(token, tab=tab) as page:
                if tab == "a":
                    page.agree()
                assert (page.screen["begun"], page.screen["attempt"]) == (False, 1)
                page.play(WAY[:4])
        with server.page(token, tab="d") as page:
            page.play(WAY)
            assert page.name == "round#A#1"


# -- being away --------------------------------------------------------------------------------------------------------


@pytest.fixture
def quick_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The idle clock is looked at all the time."""
    monkeypatch.setattr("benchmarks.study.server.socket._LOOK", 0.01)


@pytest.mark.usefixtures("quick_looks")
def test_who_does_nothing_is_warned_and_then_timed_out(tmp_path: Path) -> None:
    clock = Clock()
    study = tiny_study(tmp_path, limits={"idle_warning": 100, "idle_timeout": 300})
    with served(study, clock=clock) as server, in_round(server) as (token, page):
        clock.time += 99
        page.say("ping", at=1)  # says nothing about a person
        clock.time += 2
        assert page.read() == {"type": "warning", "seconds": 199}
        page.send("event", kind="active", at=2)
        page.say("ping", at=3)
        clock.time += 99
        page.say("ping", at=4)
        clock.time += 3
        assert page.read()["type"] == "warning"
        clock.time += 200
        assert page.read()["ending"] == "timed_out"
        assert page.say("next")["ending"] == "timed_out"
        assert [kind for kind in server.kinds() if kind in ("idle_warning", "ended")] == [
            "idle_warning", "idle_warning", "ended",
        ]  # fmt: skip
    assert token


@pytest.mark.usefixtures("quick_looks")
def test_either_of_warning_and_time_out_can_be_switched_off(tmp_path: Path) -> None:
    clock = Clock()
    with (
        served(tiny_study(tmp_path / "1", limits={"idle_warning": 10, "idle_timeout": 0}), clock=clock) as server,
        server.page(server.join()) as page,
    ):
        clock.time += 10_000
        assert page.read() == {"type": "warning", "seconds": None}
        assert page.say("device", **DEVICE)["kind"] == "consent"
    with (
        served(tiny_study(tmp_path / "2", limits={"idle_warning": 0, "idle_timeout": 50}), clock=clock) as server,
        server.page(server.join()) as page,
    ):
        clock.time += 51
        assert page.read()["ending"] == "timed_out"


@pytest.mark.usefixtures("quick_looks")
def test_waiting_that_the_page_does_by_itself_is_no_sign_of_life(tmp_path: Path) -> None:
    clock = Clock()
    study = tiny_study(tmp_path, limits={"idle_warning": 0, "idle_timeout": 50})
    with served(study, clock=clock) as server, in_round(server) as (_, page):
        clock.time += 40
        page.say("step", n=3, action=4, shown=1.0)
        clock.time += 11
        assert page.read()["ending"] == "timed_out"


def test_an_attention_check_is_an_item_whose_answer_the_page_does_not_know(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server, server.page(server.join()) as page:
        while page.screen["kind"] != "questionnaire":
            page.pass_screen()
        item = next(item for item in page.screen["items"] if item["kind"] == "attention")
        assert "expected" not in item
        again = page.say("answers", values={"easy": 4})
        assert (again["kind"], set(again["errors"])) == ("questionnaire", {"look"})
        page.say("answers", values={**ANSWERS, "look": "first"})
        assert page.screen["ending"] == "complete"
        stored = server.rows("SELECT value FROM answers WHERE item = 'look'")
        assert json.loads(stored[0][0]) == "first"


# -- who takes part ----------------------------------------------------------------------------------------------------


def test_worker_ids_are_in_one_table(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, recruitment={"source": "prolific"})
    with served(study) as server:
        with server.page(server.join(PROLIFIC_PID="secret-worker", STUDY_ID="st", SESSION_ID="se")) as page:
            page.finish()
        tables = [row[0] for row in server.rows("SELECT name FROM sqlite_master WHERE type = 'table'")]
        found = [
            name for name in tables if "secret-worker" in str([tuple(r) for r in server.rows(f"SELECT * FROM {name}")])
        ]
        assert found == ["workers"]


@pytest.mark.parametrize("once", [True, False])
def test_one_participation_per_worker_is_a_setting(tmp_path: Path, once: bool) -> None:
    study = tiny_study(tmp_path, recruitment={"source": "prolific", "one_per_worker": once})
    with served(study) as server:
        token = server.join(PROLIFIC_PID="w")
        assert server.join(PROLIFIC_PID="w") == token  # goes on
        with server.page(token) as page:
            page.say("withdraw")
        assert (server.join(PROLIFIC_PID="w") == token) is once


def test_debug_participants_have_a_link_and_a_database_of_their_own(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        key = server.app.state.secrets.debug
        assert server.client.get("/debug", params={"key": "wrong"}).status_code == 404
        assert server.client.get("/debug", params={"key": key}).status_code == 200
        with server.page(server.join(key=key)) as page:
            page.finish()
        assert server.rows("SELECT * FROM participants") == []
        assert [row["participant"] for row in server.rows("SELECT * FROM participants", mode="debug")] == ["D001"]


def test_orders_of_drop_outs_are_filled_again(tmp_path: Path) -> None:
    clock = Clock()
    study = tiny_study(tmp_path, asked=False, orders={"policy": "williams", "recent_minutes": 60})
    with served(study, clock=clock) as server:
        tokens = [server.join() for _ in range(4)]
        with server.page(tokens[0]) as page:
            page.finish()
        with server.page(tokens[3]) as page:
            page.say("withdraw")
        orders = [row[0] for row in server.rows("SELECT order_number FROM participants ORDER BY participant")]
        assert sorted(orders) == [0, 0, 1, 1]
        clock.time += 2 * HOUR  # two were last seen long ago, one left: only the first one counts
        for _ in range(3):
            server.join()
        orders = [row[0] for row in server.rows("SELECT order_number FROM participants ORDER BY participant")]
        counted = [orders[0], *orders[4:]]
        assert sorted(counted) == [0, 0, 1, 1]


def test_sittings_begin_within_their_gap(tmp_path: Path) -> None:
    sittings = [
        {"name": "on", "conditions": ["A"]},
        {"name": "off", "conditions": ["A"], "obstacles": False, "min_gap_hours": 20, "max_gap_hours": 48},
    ]
    clock = Clock()
    study = tiny_study(tmp_path, asked=False, sittings=sittings)
    with served(study, clock=clock) as server:
        early, late = server.join(), server.join()
        for token in (early, late):
            with server.page(token) as page:
                while page.screen["kind"] != "pause":
                    page.pass_screen()
                ended = clock.time
                assert (page.screen["from"], page.screen["until"]) == (ended + 20 * HOUR, ended + 48 * HOUR)
                assert page.say("next")["type"] == "refused"
        clock.time += 30 * HOUR
        with server.page(early, tab="next day") as page:
            page.say("next")
            assert page.name == "off#round#A#1"
            assert page.finish()["ending"] == "complete"
        clock.time += 30 * HOUR
        with server.page(late, tab="too late") as page:
            assert page.say("next")["ending"] == "expired"


def test_recruitment_closes_by_itself_once_so_many_are_complete(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, asked=False, recruitment={"source": "prolific", "wanted": 1})
    with served(study) as server:
        first, second = server.join(PROLIFIC_PID="1"), server.join(PROLIFIC_PID="2")
        with server.page(first) as page:
            page.finish()
        closed = server.client.post("/api/join", json={"query": {"PROLIFIC_PID": "3"}})
        assert (closed.status_code, closed.json()["reason"]) == (403, "<h1>closed</h1>\n")
        assert server.join(PROLIFIC_PID="2") == second  # who has begun may finish
        with server.page(second) as page:
            assert page.finish()["ending"] == "complete"


# -- the disk ----------------------------------------------------------------------------------------------------------


def _break(server: Served) -> list[str]:
    """From now on nothing can be stored; until the list that is returned is emptied."""
    store: Any = server.app.state.hubs["live"].context.store
    broken, execute = ["full"], store._execute

    def fail(job: Any) -> Exception | None:
        if broken:
            raise sqlite3.OperationalError("database or disk is full")
        found: Exception | None = execute(job)
        return found

    store._execute = fail
    return broken


def test_a_step_that_cannot_be_stored_is_not_acknowledged_and_the_game_goes_back(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server, in_round(server) as (_, page):
        before = page.state
        broken = _break(server)
        page.send("step", n=3, action=WAY[3])
        answer = page.read()
        assert (answer["type"], answer["reason"]) == ("refused", "this could not be stored")
        assert page.read()["type"] == "screen"
        assert page.state == before
        broken.clear()
        page.play(WAY[3:])
        assert page.name == "round#B#1"
        assert page.finish()["ending"] == "complete"


@pytest.mark.parametrize("after", ["last step", "answers", "consent", "begin"])
def test_what_cannot_be_stored_has_not_happened(tmp_path: Path, after: str) -> None:
    """Also where a screen ends or begins: the page stays or is let go, and everything goes on afterwards."""
    with served(tiny_study(tmp_path)) as server:
        token = server.join()
        with server.page(token) as page:
            kind = {"last step": "round", "answers": "questionnaire", "consent": "consent", "begin": "round"}[after]
            while page.screen["kind"] != kind:
                page.pass_screen()
            if after == "last step":
                page.play(WAY[:-1])
            name, broken = page.name, _break(server)
            message, fields = {
                "last step": ("step", {"n": len(WAY) - 1, "action": WAY[-1]}),
                "answers": ("answers", {"values": ANSWERS}),
                "consent": ("consent", {"agreed": True}),
                "begin": ("next", {}),
            }[after]
            assert page.say(message, **fields)["type"] == "refused"  # type: ignore[arg-type]
            broken.clear()
        with server.page(token) as page:
            assert page.name == name
            assert page.finish()["ending"] == "complete"
        assert len(server.rows("SELECT DISTINCT name FROM visits WHERE finished IS NULL")) == 0


def test_who_joined_under_another_design_is_told(tmp_path: Path) -> None:
    """The timeline of another design does not fit: nothing of it is touched, and new participants are not mixed in."""
    with served(tiny_study(tmp_path)) as server, in_round(server) as (token, _):
        pass
    fewer = tiny_study(tmp_path, design="b" * 16, conditions=[{"name": "C", "layout": "k.txt"}])
    with served(fewer) as server:
        before = [tuple(row) for row in server.rows("SELECT * FROM visits")]
        with server.page(token) as page:
            assert page.screen["ending"] == "expired"
            assert page.say("next")["ending"] == "expired"
        assert [tuple(row) for row in server.rows("SELECT * FROM visits")] == before
        assert server.rows("SELECT state FROM participants")[0][0] == "active"
        with server.page(server.join()) as page:
            assert page.finish()["ending"] == "complete"


def test_nobody_else_can_connect_where_the_server_is_full(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path), connections=1) as server, server.page(server.join()):
        with pytest.raises(WebSocketDenialResponse) as refusal, server.page(server.join()):
            pass
        assert refusal.value.status_code == 503
        assert "default-src 'none'" in refusal.value.headers["content-security-policy"]
