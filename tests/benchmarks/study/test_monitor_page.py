"""The monitor in a browser: a session and the predictor's belief are seen, recruitment is paused by keyboard."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from benchmarks.study.server.run import serving
from tests.benchmarks.study.participants import begin, come, cook
from tests.benchmarks.study.small_studies import LEGIBLE_WAY, SMALL_WAY, SOUP

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.slow

TWO_GOALS = "XXPSX\nO1  D\nX V T\nXXXXX"
"""From the hatch the onions are to the west, the tomatoes to the south-east."""


def by_keyboard(page: Page, name: str) -> None:
    """Tab to the button of this name, and press it."""
    button = page.get_by_role("button", name=name, exact=True)
    button.wait_for()
    for _ in range(40):
        if button.evaluate("element => element === document.activeElement"):
            break
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")


def beliefs(page: Page) -> dict[str, float]:
    """``{goal: probability}`` as the monitor shows them."""
    rows = page.locator(".goals li:has(progress)")
    return {
        row.locator("span").first.inner_text(): row.locator("progress").evaluate("e => e.value") for row in rows.all()
    }


def test_a_session_is_watched_and_recruitment_is_paused(open_page: Callable[..., Page], write_study: Any) -> None:
    settings = {"kitchen.soups": [SOUP, ["onion", "tomato"]], "practice.soups": [SOUP]}
    study = write_study(
        "overcooked", settings, files={f"layouts/{name}.txt": TWO_GOALS for name in ("Legible", "Baseline")}
    )
    with serving(study) as (base, server):
        player = open_page()
        come(player, base, until="practice")
        cook(player, SMALL_WAY)
        begin(player)
        monitor = open_page()
        monitor.goto(f"{base}/monitor#{server.config.app.state.secrets.admin}")  # type: ignore[union-attr]
        by_keyboard(monitor, "Watch P001, here now")
        monitor.get_by_role("img", name="The game of P001").wait_for()
        cook(player, LEGIBLE_WAY)  # a soup is served: the next walk begins at the hatch
        monitor.get_by_text(f"Step {len(LEGIBLE_WAY)} of at most 120, 1 of 2 soups").wait_for()
        monitor.locator(".goals progress").nth(1).wait_for()
        assert set(beliefs(monitor)) == {"onion", "tomato"}
        assert sum(beliefs(monitor).values()) == pytest.approx(1, abs=1e-3)
        assert monitor.locator(".belief-mark").count() >= 1
        before = beliefs(monitor)
        cook(player, "WW")  # towards the onions
        monitor.wait_for_function(
            "p => Math.abs(document.querySelector('.goals progress[aria-label=onion]')?.value - p) > 0.01",
            arg=before["onion"],
        )
        assert beliefs(monitor)["onion"] > before["onion"]

        store = server.config.app.state.hubs["live"].context.store  # type: ignore[union-attr]
        for name, state in (("Pause", "paused"), ("Open", "open")):
            by_keyboard(monitor, name)
            monitor.locator(".recruitment strong", has_text=state).wait_for()
            assert store.value("recruitment") == state
        assert monitor.get_by_role("button", name="Watch P001, here now").get_attribute("aria-pressed") == "true"


def test_a_wrong_token_shows_nothing(open_page: Callable[..., Page], write_study: Any) -> None:
    with serving(write_study("overcooked")) as (base, server):
        come(open_page(), base, until="consent")
        page = open_page()
        page.goto(f"{base}/monitor#{server.config.app.state.secrets.debug}")  # type: ignore[union-attr]
        page.get_by_role("alert").wait_for()
        assert "P001" not in page.content()
        assert page.get_by_role("table").count() == 0
        page.get_by_label("Admin token").fill(server.config.app.state.secrets.admin)  # type: ignore[union-attr]
        page.keyboard.press("Enter")
        page.get_by_role("button", name="Watch P001, here now").wait_for()
