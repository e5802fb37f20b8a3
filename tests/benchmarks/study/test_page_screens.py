"""What is round the games: device check, consent, questionnaires, pauses, endings; who reads the page, and where."""

from __future__ import annotations

import functools
import json
import threading
from collections.abc import Callable, Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from benchmarks.study.server.run import serving
from tests.benchmarks.study.participants import begin, come, cook, press, rows
from tests.benchmarks.study.small_studies import KEYS, SMALL_WAY

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow

ITEMS = """
title = "All kinds"
[[items]]
name = "agree"
kind = "likert"
text = "It was easy."
labels = ["No", "Yes"]
[[items]]
name = "demand"
kind = "slider"
text = "Demand"
labels = ["Low", "High"]
[[items]]
name = "side"
kind = "choice"
text = "Which hand?"
options = ["Left", "Right"]
[[items]]
name = "owns"
kind = "choice"
several = true
text = "Which do you own?"
options = ["Phone", "Tablet", "Computer"]
required = false
[[items]]
name = "grid"
kind = "matrix"
text = "How far?"
points = 3
labels = ["Not", "Half", "Fully"]
rows = ["First", "Second"]
[[items]]
name = "check"
kind = "attention"
text = "Choose blue."
options = ["red", "blue"]
expected = "blue"
[[items]]
name = "free"
kind = "text"
text = "Anything else?"
most = 40
"""
ASKED = {"practice": None, "questionnaires": [{"name": "mixed", "after": "study"}], "rounds.max_steps": 1}
FILES = {"questionnaires/mixed.toml": ITEMS}
NO_PRACTICE = {"practice": None}
HOSTILE = [
    "<img src=x onerror=alert(1)>",
    "</script><script>alert(1)</script>",
    "'; DROP TABLE answers; --",
    '"><svg onload=alert(1)>',
]


def database(server: Any) -> Any:
    return server.config.app.state.hubs["live"].context.store


def to_questions(page: Page, base: str) -> None:
    """Both rounds, a step each, then the questionnaire."""
    come(page, base, until="practice")
    page.keyboard.press("Period")
    begin(page)
    page.keyboard.press("Period")
    page.get_by_role("button", name="Send answers").wait_for()


def test_a_device_that_is_too_small_is_told_why_and_the_study_stops(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked", {"device.min_width": 2000})) as (base, server):
        page = open_page()
        come(page, base, until="device")
        page.get_by_text("this study needs at least 2000 by 400").wait_for()
        press(page, "Continue")
        page.locator("#code").wait_for()
        assert "at least 2000 by 400" in page.locator(".failed").inner_text()
        assert rows(database(server), "SELECT state FROM participants") == [("device_failed",)]
        page.reload()
        page.locator("#code").wait_for()


def test_a_keyboard_that_is_needed_has_to_be_used(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked", {"device.keyboard": True})) as (base, server):
        page = open_page()
        page.goto(base)
        press(page, "Begin")
        page.locator(".prompt", has_text="Please press any arrow key").wait_for()
        assert not page.get_by_role("button", name="Continue", exact=True).is_visible()
        page.keyboard.press("ArrowUp")
        press(page, "Continue")
        page.locator("#agree").wait_for()
        (outcome,) = rows(database(server), "SELECT outcome FROM visits WHERE kind = 'device'")
        found = json.loads(outcome[0])
        assert found["keyboard"] is True
        assert found["pointer"] == "fine"
        assert (found["width"], found["height"]) == (1280, 800)
        assert 0 < found["round_trip"] < 1000


def test_consent_needs_the_tick_and_can_be_refused(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked")) as (base, server):
        page = open_page()
        come(page, base, until="consent")
        button = page.get_by_role("button", name="Agree and continue")
        button.dispatch_event("click")
        page.wait_for_timeout(200)
        assert page.locator("#agree").is_visible()
        press(page, "I do not want to take part")
        page.locator("#code").wait_for()
        assert rows(database(server), "SELECT state FROM participants") == [("refused",)]
        assert rows(database(server), "SELECT COUNT(*) FROM answers") == [(0,)]


def test_questionnaires_say_what_is_missing_and_store_what_is_answered(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked", ASKED, FILES)) as (base, server):
        page = open_page()
        to_questions(page, base)
        press(page, "Send answers")
        wrong = page.locator(".item.wrong")
        names = wrong.evaluate_all("all => all.map(one => one.dataset.item)")
        assert names == ["agree", "demand", "side", "grid", "check", "free"]
        assert page.evaluate("document.activeElement.closest('.item').dataset.item") == "agree"
        page.get_by_role("radio", name="1, No").check(force=True)
        assert not page.locator(".item[data-item=agree].wrong").count()  # the error goes as soon as it is answered
        slider = page.locator("input[type=range]")
        box = slider.bounding_box()
        page.mouse.click(box["x"] + box["width"] * 0.25, box["y"] + box["height"] / 2)
        page.get_by_label("Right").check()
        page.get_by_label("Computer").check()
        page.get_by_label("Phone").check()
        page.get_by_role("radiogroup", name="First").get_by_role("radio").nth(2).check(force=True)
        page.get_by_role("radiogroup", name="Second").get_by_role("radio").nth(0).check(force=True)
        page.get_by_label("red").check()
        page.locator("textarea").fill("fine " * 20)
        assert len(page.locator("textarea").input_value()) == 40
        press(page, "Send answers")
        page.locator("#code").wait_for()
        stored = dict(rows(database(server), "SELECT item, value FROM answers WHERE questionnaire = 'mixed'"))
        found = {name: json.loads(value) for name, value in stored.items()}
        assert found.pop("demand") in (20, 25, 30)
        assert found == {
            "agree": 1, "side": "Right", "owns": ["Phone", "Computer"], "grid/1": 3, "grid/2": 1, "check": "red",
            "free": "fine " * 8,
        }  # fmt: skip
        assert "expected" not in page.content()


def test_answers_survive_a_lost_connection(open_page: Any, write_study: Any) -> None:
    study = write_study("overcooked", ASKED, FILES)
    with serving(study) as (base, _):
        page = open_page()
        to_questions(page, base)
        page.locator("textarea").fill("typed before")
    page.locator("#banner:visible").wait_for()
    with serving(study, port=int(base.rsplit(":", 1)[1])):
        page.locator("#banner").wait_for(state="hidden")
        assert page.locator("textarea").input_value() == "typed before"


@pytest.mark.parametrize("hostile", HOSTILE)
def test_hostile_texts_are_shown_nowhere_as_html(open_page: Any, write_study: Any, hostile: str) -> None:
    title = f"Study {hostile}"
    items = f'title = {json.dumps(title)}\n[[items]]\nname = "free"\nkind = "text"\ntext = {json.dumps(hostile)}\n'
    files = {"questionnaires/mixed.toml": items, "texts/welcome.md": f"# Hello\n\n{hostile}\n"}
    with serving(write_study("overcooked", ASKED | {"title": title}, files)) as (base, server):
        page = open_page()
        dialogs: list[str] = []
        page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
        page.goto(f"{base}/?PROLIFIC_PID={hostile}")
        page.get_by_text(hostile).first.wait_for()
        to_questions(page, f"{base}/?worker={hostile}")
        assert page.get_by_text(hostile).count() >= 2
        page.locator("textarea").fill(hostile)
        press(page, "Send answers")
        page.locator("#code").wait_for()
        assert page.locator("main img, main svg, main script").count() == 0
        assert not dialogs
        assert rows(database(server), "SELECT value FROM answers WHERE item = 'free'") == [(json.dumps(hostile),)]


def test_everything_can_be_done_by_keyboard_alone(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked", NO_PRACTICE | {"conditions": [
        {"name": "Baseline", "layout": "layouts/Baseline.txt"}
    ]})) as (base, _):  # fmt: skip
        page = open_page()
        page.goto(base)

        def tab_to(name: str, key: str = "Enter") -> None:
            page.get_by_role("button", name=name, exact=True).or_(page.get_by_role("checkbox", name=name)).wait_for()
            for _ in range(12):
                here = page.evaluate("(document.activeElement.labels?.[0] || document.activeElement).innerText || ''")
                if here.strip() == name:
                    focused = "document.activeElement.closest('label') || document.activeElement"
                    outline = page.evaluate(f"getComputedStyle({focused}).outlineStyle")
                    assert outline == "solid", name  # where the focus is can be seen
                    page.keyboard.press(key)
                    return
                page.keyboard.press("Tab")
            raise AssertionError(f"Tab never came to {name!r}")

        for name, key in (
            ("Begin", "Enter"), ("Continue", "Space"), ("I have read this, and I agree to take part", "Space"),
            ("Agree and continue", "Enter"), ("Continue", "Enter"), ("Begin", "Space"),
        ):  # fmt: skip
            tab_to(name, key)
        page.locator(".chef use").first.wait_for(state="attached")
        cook(page, SMALL_WAY)
        tab_to("Copy the code")


def test_the_buttons_of_a_kitchen_can_be_pressed_by_keyboard(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked")) as (base, server):
        page = open_page()
        come(page, base, until="practice")
        page.locator(".control.west").focus()
        page.keyboard.press("Space")  # the button, not the key that takes and puts down
        page.locator(".count", has_text="Step 1").wait_for()
        page.locator(".control.interact").focus()
        page.keyboard.press("Enter")
        page.locator(".hands", has_text="onion").wait_for()
        assert rows(database(server), "SELECT action FROM steps") == [("3",), ("5",)]
        page.locator("#live", has_text="onion").wait_for(state="attached")


@pytest.fixture
def elsewhere(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    """Another site: its address, and the folder that it serves."""
    handler = functools.partial(SimpleHTTPRequestHandler, directory=tmp_path)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as site:
        threading.Thread(target=site.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{site.server_port}", tmp_path
        site.shutdown()


def test_the_page_works_in_a_frame_of_another_site(open_page: Any, write_study: Any, elsewhere: Any) -> None:
    with serving(write_study("overcooked", {"recruitment.completion_url": "https://example.org/{code}"})) as (base, _):
        address, folder = elsewhere
        (folder / "outside.html").write_text(f'<iframe src="{base}/" width="900" height="700"></iframe>')
        page = open_page()
        page.goto(f"{address}/outside.html")
        frame = page.frame_locator("iframe")
        frame.get_by_role("button", name="Begin").click()
        frame.get_by_role("button", name="Continue").click()
        frame.locator("#agree").check()
        frame.get_by_role("button", name="Agree and continue").click()
        frame.get_by_role("button", name="Continue").click()
        frame.get_by_role("button", name="Begin").click()
        frame.locator(".chef use").first.wait_for(state="attached")
        for move in SMALL_WAY[:2]:
            page.keyboard.press(KEYS[move])
            page.wait_for_timeout(200)
        frame.locator(".hands", has_text="onion").wait_for()


CONTRAST = """
() => {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour, under) => {
    canvas.fillStyle = `rgb(${under.join()})`; canvas.fillRect(0, 0, 1, 1);
    canvas.fillStyle = colour; canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data].slice(0, 3);
  };
  const light = (c) => c.map((v) => v / 255).map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (el) => el ? rgba(getComputedStyle(el).backgroundColor, ground(el.parentElement)) : [255, 255, 255];
  const bad = [];
  for (const el of document.querySelectorAll("body *")) {
    const own = [...el.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !el.checkVisibility() || el.closest("svg, [aria-disabled=true], script, .visually-hidden")) continue;
    const under = ground(el), ink = rgba(getComputedStyle(el).color, under);
    const [a, b] = [light(under), light(ink)].sort((x, y) => y - x);
    if ((a + 0.05) / (b + 0.05) < 4.5) bad.push([el.textContent.trim().slice(0, 40), (a + 0.05) / (b + 0.05)]);
  }
  return bad;
}
"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_can_be_read_in_light_and_dark(open_page: Any, write_study: Any, scheme: str) -> None:
    with serving(write_study("overcooked", ASKED, FILES)) as (base, _):
        page = open_page(color_scheme=scheme, reduced_motion="reduce")
        page.goto(base)
        assert page.evaluate(CONTRAST) == []
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (int(ground[4:].split(",")[0]) < 60) == (scheme == "dark")
        come(page, base, until="consent")
        assert page.evaluate(CONTRAST) == []
        page.locator("#agree").check()
        press(page, "Agree and continue")
        press(page, "Continue")
        begin(page)
        assert page.evaluate(CONTRAST) == []
        page.keyboard.press("Period")
        begin(page)
        page.keyboard.press("Period")
        page.get_by_role("button", name="Send answers").click()
        page.locator(".error:visible").first.wait_for()
        assert page.evaluate(CONTRAST) == []


@pytest.mark.parametrize("width", [360, 768])
def test_no_screen_is_wider_than_the_window(open_page: Any, write_study: Any, width: int) -> None:
    with serving(write_study("overcooked", ASKED, FILES)) as (base, _):
        page = open_page(viewport={"width": width, "height": 740})
        for until in ("device", "consent", "text"):
            come(page, f"{base}/?{until}", until=until)
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        to_questions(page, f"{base}/?questions")
        press(page, "Send answers")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_who_is_idle_is_warned_and_then_the_study_ends(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked", {"limits.idle_warning": 1, "limits.idle_timeout": 6})) as (base, server):
        page = open_page()
        come(page, base, until="consent")
        page.get_by_role("button", name="I am still here").click()
        page.wait_for_timeout(500)
        assert page.locator("dialog").count() == 0
        assert page.locator("#agree").is_visible()
        page.get_by_text("Are you still there?").wait_for()
        page.locator("#code").wait_for()
        assert page.locator("dialog").count() == 0
        assert rows(database(server), "SELECT state FROM participants") == [("timed_out",)]


def test_who_wants_to_leave_is_asked_and_may(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked")) as (base, server):
        page = open_page()
        come(page, base, until="practice")
        press(page, "Leave the study")
        press(page, "No, stay")
        assert rows(database(server), "SELECT state FROM participants") == [("active",)]
        press(page, "Leave the study")
        page.keyboard.press("ArrowLeft")  # the game does not hear what is pressed in a dialog
        press(page, "Yes, leave")
        page.locator("#code").wait_for()
        assert rows(database(server), "SELECT state FROM participants") == [("withdrawn",)]
        assert rows(database(server), "SELECT COUNT(*) FROM steps") == [(0,)]
        assert not page.get_by_role("button", name="Leave the study").is_visible()


def test_a_sitting_that_is_not_open_yet_says_when_it_will_be(open_page: Any, write_study: Any) -> None:
    sittings = [{"name": "one"}, {"name": "two", "obstacles": False, "min_gap_hours": 24, "max_gap_hours": 48}]
    with serving(write_study("overcooked", NO_PRACTICE | {"rounds.max_steps": 1, "sittings": sittings})) as (base, _):
        page = open_page(timezone_id="Asia/Tokyo")
        come(page, base, until="practice")
        page.keyboard.press("Period")
        begin(page)
        page.keyboard.press("Period")
        page.get_by_text("The next part opens on").wait_for()
        page.get_by_text("Please come back before").wait_for()
        assert not page.get_by_role("button", name="Begin").is_visible()


def test_the_end_leads_back_to_the_platform(open_page: Any, write_study: Any) -> None:
    settings = {
        "recruitment.completion_url": "https://platform.example/done?cc={code}",
        "recruitment.codes": {"refused": "NOPE"},
    }
    with serving(write_study("overcooked", settings)) as (base, _):
        page = open_page()
        come(page, base, until="consent")
        press(page, "I do not want to take part")
        link = page.get_by_role("link", name="Go back to platform.example")
        assert link.get_attribute("href") == "https://platform.example/done?cc=NOPE"
        assert page.locator("#code").inner_text() == "NOPE"


def test_a_preview_shows_the_study_and_makes_no_participant(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked", {"recruitment.source": "mturk"})) as (base, server):
        page = open_page()
        page.goto(f"{base}/?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE&hitId=H1")
        page.locator("main h1, main p").first.wait_for()
        assert page.get_by_role("button", name="Begin").count() == 0
        assert rows(database(server), "SELECT COUNT(*) FROM participants") == [(0,)]


def test_what_happens_to_the_page_is_stored(open_page: Any, write_study: Any) -> None:
    with serving(write_study("overcooked")) as (base, server):
        page = open_page()
        come(page, base, until="consent")
        page.set_viewport_size({"width": 1000, "height": 700})
        page.evaluate("dispatchEvent(new Event('blur')); dispatchEvent(new Event('focus'))")
        page.evaluate("dispatchEvent(new ErrorEvent('error', { message: 'a test' }))")
        page.wait_for_timeout(600)
        kinds = [kind for (kind,) in rows(database(server), "SELECT kind FROM events")]
        assert {"connect", "page_blur", "page_focus", "page_resize", "page_error"} <= set(kinds)


def test_an_unknown_token_leads_to_the_welcome(open_page: Callable[..., Page], write_study: Any) -> None:
    with serving(write_study("overcooked")) as (base, _):
        page = open_page()
        page.goto(f"{base}/#no-such-token")
        page.get_by_role("button", name="Begin").wait_for()
        assert "#" not in page.url
