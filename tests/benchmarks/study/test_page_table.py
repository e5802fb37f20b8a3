"""Whole studies at tables, played in a browser by a mouse, a finger and keys."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from benchmarks.study.server.run import serving
from tests.benchmarks.study.participants import HOME, SLOTS, Hand, begin, build, come, rows
from tests.benchmarks.study.small_studies import BAR, PLACES, small_table

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow

FOUR = {
    "conditions": [
        {"name": name, "layout": f"layouts/{layout}.json"}
        for name, layout in (
            ("Baseline", "Baseline"),
            ("Placement-Optimized", "Baseline"),
            ("Virtual-Obstacle-Optimized", "Legible"),
            ("Jointly-Optimized", "Legible"),
        )
    ],
    "rounds.reaches": 2,
}


def database(server: Any) -> Any:
    return server.config.app.state.hubs["live"].context.store


def game(server: Any) -> Any:
    return next(iter(server.config.app.state.hubs["live"].sessions.values())).game


def test_a_whole_study_by_mouse_in_four_conditions(open_page: Callable[..., Page], write_study: Any) -> None:
    study = write_study("tabletop", FOUR)
    with serving(study) as (base, server):
        page = open_page()
        come(page, base, until="practice")
        build(page, "Baseline", reaches=1)
        for condition in ("Baseline", "Baseline", "Legible", "Legible"):
            begin(page)
            build(page, condition)
        page.locator("#code").wait_for()
        store = database(server)
        assert rows(store, "SELECT state FROM participants") == [("complete",)]
        visits = rows(store, "SELECT visit, kind, outcome FROM visits WHERE kind IN ('practice', 'round')")
        assert [json.loads(outcome)["reaches"] for _, _, outcome in visits] == [1, 2, 2, 2, 2]
        # The table was played in the time of the pointer, thirty steps a second, and the pointer was sampled oftener.
        for visit, _, outcome in visits:
            samples = rows(store, f"SELECT at, x, y FROM pointer WHERE visit = {visit} ORDER BY sample")
            times = np.array(samples)[:, 0]
            assert (np.diff(times) > 0).all()
            assert abs(times[-1] / 1000 * 30 - json.loads(outcome)["steps"]) < 12
            assert len(samples) > json.loads(outcome)["steps"] * 0.8
            # The pointer's first sample is the hand, so that the hand never has to run after it.
            assert math.dist(samples[0][1:], HOME) < 0.04


def test_a_hand_does_not_jump_through_a_hard_obstacle(open_page: Callable[..., Page], write_study: Any) -> None:
    wall = {**BAR, "at": [0.40, 0.19], "size": [0.5, 0.02]}
    files = {"layouts/practice.json": small_table("Baseline", [wall])}
    with serving(write_study("tabletop", files=files)) as (base, server):
        page = open_page()
        come(page, base, until="practice")
        hand = Hand(page)
        hand.take_up(HOME)
        page.mouse.move(*hand.pixel([0.40, 0.40]))  # straight across, at once
        page.wait_for_timeout(900)
        x, y = game(server).env.game.hand
        assert y < 0.19, (x, y)
        assert game(server).info["crossings"] == 0


def test_a_reload_goes_on_with_the_same_cube_in_the_hand(open_page: Callable[..., Page], write_study: Any) -> None:
    with serving(write_study("tabletop")) as (base, server):
        page = open_page()
        come(page, base, until="practice")
        hand = Hand(page)
        hand.take_up(HOME)
        hand.move(PLACES["Baseline"][0])
        page.locator(".hud .count", has_text="red-circle").wait_for()
        hand.move([0.4, 0.3])
        page.wait_for_timeout(300)
        taken = game(server).steps
        page.reload()
        page.locator(".hand use").first.wait_for(state="attached")
        page.wait_for_timeout(500)
        # Nothing happens until the pointer takes up the hand again.
        assert 0 <= game(server).steps - taken <= 6
        again = Hand(page)
        again.take_up(game(server).env.game.hand)
        page.locator(".hud .count", has_text="red-circle").wait_for()
        again.move(SLOTS[0])
        begin(page)


def test_a_table_can_be_played_by_keys_alone(open_page: Callable[..., Page], write_study: Any) -> None:
    with serving(write_study("tabletop")) as (base, server):
        page = open_page()
        come(page, base, until="practice")

        def go(to: list[float]) -> None:
            """Hold arrow keys, an axis after the other, until the hand is nearly there."""
            for axis, keys in ((0, ("ArrowLeft", "ArrowRight")), (1, ("ArrowDown", "ArrowUp"))):
                for _ in range(8):
                    if game(server) is None:  # the reach is made
                        return
                    apart = to[axis] - game(server).env.game.hand[axis]
                    if abs(apart) < 0.012:
                        break
                    key = keys[apart > 0]
                    page.keyboard.down(key)
                    page.wait_for_timeout(max(20, abs(apart) / 0.3 * 1000 - 30))
                    page.keyboard.up(key)
                    page.wait_for_timeout(350)

        go(PLACES["Baseline"][0])
        page.locator(".hud .count", has_text="red-circle").wait_for()
        go(SLOTS[0])
        begin(page)


def test_a_finger_drags_the_hand_without_covering_it(open_page: Callable[..., Page], write_study: Any) -> None:
    with serving(write_study("tabletop", {"device.min_height": 300})) as (base, _):
        page = open_page(viewport={"width": 740, "height": 360}, has_touch=True, is_mobile=True)
        come(page, base, until="practice")
        client = page.context.new_cdp_session(page)
        hand = Hand(page)
        finger = [0.6, 0.1]  # not on the hand

        def touch(kind: str, *at: list[float]) -> None:
            points = [dict(zip("xy", hand.pixel(p), strict=True)) for p in at]
            client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", finger)
        where = list(HOME)
        for goal in (PLACES["Baseline"][0], SLOTS[0]):
            start, from_finger = list(where), list(finger)
            for i in range(1, 41):
                share = i / 40
                where = [a + (b - a) * share for a, b in zip(start, goal, strict=True)]
                finger = [f + w - s for f, w, s in zip(from_finger, where, start, strict=True)]
                touch("touchMove", finger)
                page.wait_for_timeout(20)
            page.wait_for_timeout(500)
        touch("touchEnd")
        begin(page)
        assert page.evaluate("[scrollX, scrollY, visualViewport.scale]") == [0, 0, 1]


def test_the_robots_time_goes_on_while_the_hand_rests(open_page: Callable[..., Page], write_study: Any) -> None:
    with serving(write_study("tabletop", {"partner": {"kind": "robot"}})) as (base, server):
        page = open_page()
        come(page, base, until="practice")
        hand = Hand(page)
        hand.take_up(HOME)
        hand.move(PLACES["Baseline"][0])
        page.locator(".hud .count", has_text="red-circle").wait_for()
        before, seen = game(server).steps, page.locator(".robot g").last.get_attribute("transform")
        page.wait_for_timeout(1500)
        assert game(server).steps > before + 20
        if game(server).state()["robot"][:2] != pytest.approx(game(server).env.team.gripper, abs=1e-3):
            assert page.locator(".robot g").last.get_attribute("transform") != seen


@pytest.mark.parametrize("belief", [False, True])
def test_belief_is_shown_only_where_the_study_says_so(
    open_page: Callable[..., Page], write_study: Any, belief: bool
) -> None:
    with serving(write_study("tabletop", {"look.show_belief": belief})) as (base, _):
        page = open_page()
        come(page, base, until="practice")
        hand = Hand(page)
        hand.take_up(HOME)
        hand.move([0.33, 0.16])
        page.wait_for_timeout(300)
        assert (page.locator(".belief rect").count() > 0) == belief


def test_the_board_is_the_picture_that_render_draws(open_page: Callable[..., Page], write_study: Any) -> None:
    from PIL import Image

    from legible_envs.tabletop.rendering import draw_scene

    with serving(write_study("tabletop", {"practice.layout": "layouts/Legible.json"})) as (base, server):
        page = open_page(reduced_motion="reduce")
        come(page, base, until="practice")

        def apart() -> float:
            page.evaluate("document.activeElement.blur(); document.querySelector('.halo').remove()")
            shot = Image.open(io.BytesIO(page.locator(".board").screenshot())).convert("RGB")
            view = game(server).env.view()
            drawn = draw_scene(view, width=shot.width, hud=False).astype(np.int64)
            seen = np.asarray(shot.resize(drawn.shape[1::-1]), dtype=np.int64)
            return float((np.abs(seen - drawn).mean(axis=2) > 60).mean())

        assert apart() < 0.01
