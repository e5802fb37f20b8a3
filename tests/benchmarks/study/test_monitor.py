"""The monitor: who may see it, what it shows, and that a predictor's belief is that of the recorded walk."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.websockets import WebSocketDisconnect

from benchmarks.study.games.overcooked import KitchenGame
from benchmarks.study.server.belief import BeliefFollower, KitchenPredictors, KitchenWalk
from benchmarks.study.store import database_path
from legible_envs.overcooked.policies import ScriptedPlayer
from tests.benchmarks.study.pages_by_hand import ANSWERS, WAY, Clock, Served, served, tiny_study

BIG = "XXOXXTX\nX     X\nX  V  X\nD  1  P\nX  V  X\nX     X\nXXXSXXX"


def overview(server: Served, token: str | None = None) -> Any:
    given = server.app.state.secrets.admin if token is None else token
    return server.client.get("/api/monitor/overview", headers={"Authorization": f"Bearer {given}"})


@contextlib.contextmanager
def watching(server: Served, participant: str = "", mode: str = "live") -> Iterator[Any]:
    """A page of the monitor; yields a function that reads the next message of a type."""
    with server.client.websocket_connect("/monitor/socket") as socket:
        socket.send_json({"type": "hello", "token": server.app.state.secrets.admin})
        if participant:
            socket.send_json({"type": "watch", "mode": mode, "participant": participant})

        def read(kind: str) -> dict[str, Any]:
            while (message := socket.receive_json())["type"] != kind:
                pass
            found: dict[str, Any] = message
            return found

        yield read


def test_only_the_admin_token_opens_it(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        secrets, token = server.app.state.secrets, server.join()
        page = server.client.get("/monitor")
        assert (page.status_code, page.headers["cache-control"]) == (200, "no-store")
        assert "frame-ancestors 'none'" in page.headers["content-security-policy"]
        assert secrets.admin not in page.text
        for wrong in ("", token, secrets.debug, secrets.admin[:-1], secrets.admin + "x", "é"):
            headers = {"Authorization": f"Bearer {wrong}".encode()}
            assert server.client.get("/api/monitor/overview", headers=headers).status_code == 401
            body = {"mode": "live", "state": "closed"}
            assert server.client.post("/api/monitor/recruitment", json=body, headers=headers).status_code == 401
            with server.client.websocket_connect("/monitor/socket") as socket:
                socket.send_json({"type": "hello", "token": wrong})
                assert socket.receive_json()["type"] == "refused"
                with pytest.raises(WebSocketDisconnect) as ending:
                    socket.receive_json()
                assert ending.value.code == 4401
        assert server.client.get("/api/monitor/overview", params={"token": secrets.admin}).status_code == 401
        with server.client.websocket_connect("/monitor/socket") as socket:
            socket.send_text('{"type":"watch","mode":"live","participant":"P001"}')
            assert socket.receive_json()["type"] == "refused"
        assert overview(server).status_code == 200
        assert secrets.admin not in server.client.get("/").text


def test_it_says_how_participants_are_doing(tmp_path: Path) -> None:
    clock = Clock()
    study = tiny_study(tmp_path, orders={"policy": "williams"}, recruitment={"source": "prolific", "wanted": 3})
    with served(study, clock=clock) as server:
        with server.page(server.join(PROLIFIC_PID="secret-worker", STUDY_ID="secret-study")) as page:
            while page.screen["kind"] != "questionnaire":
                page.pass_screen()
            page.say("answers", values={**ANSWERS, "look": "first"})
        with server.page(server.join(PROLIFIC_PID="2")) as page:
            page.say("withdraw")
        with server.page(server.join(PROLIFIC_PID="3")) as page:
            page.agree()
            page.play(WAY[:4])
            page.say("no such message")
            page.say("step", n=77, action=0)
            clock.time += 12
            answer = overview(server)
            found = answer.json()["modes"]["live"]
        assert "secret-worker" not in answer.text
        assert "secret-study" not in answer.text
        third, second, first = found["participants"]
        assert [person["state"] for person in (first, second, third)] == ["complete", "withdrawn", "active"]
        assert (third["name"], third["steps"], third["screens"]) == (f"round#{third['conditions'][0]}#1", 4, 6)
        assert (third["connected"], third["idle"], first["connected"]) == (True, 12.0, False)
        assert (first["attention"], third["attention"]) == ([0, 1], [0, 0])
        assert (found["complete"], found["wanted"], found["recruitment"]) == (1, 3, "open")
        assert found["endings"] == {"active": 1, "complete": 1, "withdrawn": 1}
        counted = sum(order["complete"] + order["active"] + order["ended"] for order in found["orders"])
        assert (counted, len(found["orders"])) == (3, 2)
        assert [event["kind"] for event in found["problems"]] == ["refused", "bad_message"]
        assert found["volume"]["rows"]["steps"] == 2 * len(WAY) + 4
        assert found["volume"]["bytes"] >= (tmp_path / "data" / "live.sqlite").stat().st_size
        debug = overview(server).json()["modes"]["debug"]
        assert debug["participants"] == []


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_steps_are_counted_from_the_first(tmp_path: Path, steps: int) -> None:
    with served(tiny_study(tmp_path)) as server, server.page(server.join()) as page:
        page.agree()
        page.play(WAY[:steps])
        assert overview(server).json()["modes"]["live"]["participants"][0]["steps"] == steps


def test_recruitment_is_paused_closed_and_opened(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        headers = {"Authorization": f"Bearer {server.app.state.secrets.admin}"}
        for state, may_join in (("paused", False), ("open", True), ("closed", False)):
            answer = server.client.post(
                "/api/monitor/recruitment", json={"mode": "live", "state": state}, headers=headers
            )
            assert answer.json()["recruitment"] == state
            joined = server.client.post("/api/join", json={"query": {}}).status_code == 200
            assert joined is may_join
            assert overview(server).json()["modes"]["live"]["recruitment"] == state
        for body in ({"mode": "live", "state": "x"}, {"mode": "debug", "state": "open"}, ["open"], "x" * 2000):
            answer = server.client.post("/api/monitor/recruitment", json=body, headers=headers)
            assert answer.status_code in (400, 413)
        assert [row["kind"] for row in server.rows("SELECT kind FROM events WHERE kind = 'recruitment'")] == (
            ["recruitment"] * 3
        )


def test_a_session_is_seen_as_its_page_sees_it(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server, server.page(server.join()) as page:
        page.agree()
        page.say("next")
        with watching(server, "P001") as read:
            told = read("told")
            assert told["message"]["scene"] == page.screen["scene"]
            page.step(WAY[0])
            assert read("told")["message"]["state"] == page.state
            page.say("withdraw")
            end = read("told")["message"]
            assert (end["ending"], "code" in end) == ("withdrawn", False)
            assert read("overview")["modes"]["live"]["participants"][0]["participant"] == "P001"
        assert server.app.state.hubs["live"].watchers == set()


def test_debug_sessions_and_live_ones_are_not_taken_for_each_other(tmp_path: Path) -> None:
    with served(tiny_study(tmp_path)) as server:
        live, debug = server.join(), server.join(key=server.app.state.secrets.debug)
        with server.page(live) as one, server.page(debug) as other, watching(server, "D001", "debug") as read:
            assert read("told")["message"]["name"] == "device"
            one.pass_screen()
            other.pass_screen()
            told = read("told")
            assert (told["participant"], told["message"]["name"]) == ("D001", "consent")


# -- belief ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_walk_that_is_followed_is_the_recorded_trajectory(seed: int) -> None:
    """Oracle: when it ends, start, candidates, cells and times are those that the environment tells afterwards."""
    game = KitchenGame(BIG, soups=[["onion", "tomato"], ["onion", "onion"]], seed=seed)
    walk, player, ended = KitchenWalk(game), ScriptedPlayer(game.env, np.random.default_rng(seed)), []
    view: Any = game
    while not game.is_over:
        before = (walk.start, walk.candidates, tuple(walk.cells), tuple(walk.ticks))
        game.step(int(player(view.obs, view.info)))
        walk.follow()
        if walk.start is None and before[0] is not None:
            ended.append(before)
    found = [
        (
            each.start,
            each.candidates,
            tuple(map(tuple, each.states[:-1].tolist())),
            tuple(np.rint(each.times[:-1] / 0.15)),
        )
        for each in game.trajectories(participant="p", condition="c")
    ]
    assert found
    for trajectory in found:
        assert trajectory in ended


def test_the_belief_is_the_predictors_own_about_the_walk_so_far(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, kitchen={"soups": [["onion"], ["onion"]], "cook_time": 1}, rounds={"max_steps": 60})
    with served(study) as server, server.page(server.join()) as page:
        page.agree()
        page.play(WAY)  # one soup is served: a walk begins at the serving hatch
        assert page.state["n"] == len(WAY)
        predictors = KitchenPredictors(study)
        follower = BeliefFollower(study, database_path(tmp_path, "live"), predictors)
        belief = follower.look("P001")
        assert belief is not None
        assert belief["n"] == len(WAY)
        assert {goal["name"] for goal in belief["goals"]} <= {"onion", "dish"}
        assert sum(goal["p"] for goal in belief["goals"]) == pytest.approx(1, abs=1e-3)
        page.step(3)
        again = follower.look("P001")
        assert again is not None
        assert again["n"] == len(WAY) + 1
        fresh = BeliefFollower(study, database_path(tmp_path, "live"), predictors).look("P001")
        assert fresh == again  # taken up in mid-round or followed from its begin
        follower.close()
        page.say("withdraw")


def test_a_predictor_that_cannot_be_used_says_why_and_hurts_nobody(tmp_path: Path) -> None:
    study = tiny_study(tmp_path, predictor="no-such-predictor", kitchen={"soups": [["onion"]] * 2, "cook_time": 1})
    with served(study) as server, server.page(server.join()) as page:
        page.agree()
        page.play(WAY)
        with watching(server, "P001") as read:
            message = read("belief")
            assert "no-such-predictor" in message["failure"]
            page.step(4)
            assert json.dumps(read("told")["message"]["state"]["n"]) == "15"
