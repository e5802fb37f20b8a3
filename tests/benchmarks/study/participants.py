"""Participants in a browser: what their hands do on the page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from tests.benchmarks.study.small_studies import BUTTONS, KEYS, LEGIBLE_WAY, PLACES, SMALL_WAY

if TYPE_CHECKING:
    from playwright.sync_api import Page

SLOTS = ([0.66, 0.35], [0.66, 0.18])
HOME = [0.40, 0.06]
SIZE = [0.8, 0.5]
MARGIN = 0.018  # of the picture's width
FRAME = 16  # milliseconds


def press(page: Page, name: str) -> None:
    """Press the button of this name once it is there."""
    page.get_by_role("button", name=name, exact=True).click()


def come(page: Page, base: str, *, until: str = "round") -> None:
    """Open the link and go on until ``device``, ``consent``, ``text``, ``before`` (a game) or the practice's board."""
    page.goto(base)
    press(page, "Begin")
    page.get_by_role("button", name="Continue", exact=True).wait_for()
    if until == "device":
        return
    press(page, "Continue")
    page.locator("#agree").wait_for()
    if until == "consent":
        return
    page.locator("#agree").check()
    press(page, "Agree and continue")
    page.get_by_role("heading", name="How the game works").wait_for()
    if until == "text":
        return
    press(page, "Continue")
    page.get_by_role("button", name="Begin", exact=True).wait_for()
    if until == "before":
        return
    begin(page)


def begin(page: Page) -> None:
    """Begin the game that is announced."""
    press(page, "Begin")
    page.locator(".board .chef use, .board .hand use").first.wait_for(state="attached")


def steps(page: Page) -> int:
    """Steps of the kitchen that the page shows."""
    return int(page.locator(".count").inner_text().split()[-1])


def cook(page: Page, way: Iterable[str], *, touch: bool = False) -> None:
    """Take steps in a kitchen, each once the one before is on the screen."""
    for number, move in enumerate(way, steps(page) + 1):
        if touch:
            page.locator(f".control.{BUTTONS[move]}").tap()
        else:
            page.keyboard.press(KEYS[move])
        page.wait_for_function(
            "n => Number(document.querySelector('.count')?.textContent.split(' ').at(-1)) >= n || "
            "!document.querySelector('.count')",
            arg=number,
        )
        # People act on what they have seen: on the frame after the one in which the step was drawn.
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def cook_everything(page: Page, *, touch: bool = False) -> None:
    """Practice and both conditions of the small study."""
    cook(page, SMALL_WAY, touch=touch)
    for way in (LEGIBLE_WAY, SMALL_WAY):
        begin(page)
        cook(page, way, touch=touch)


class Hand:
    """A mouse at the table that moves as hands do: from where it is, at a speed, and rests where it arrives."""

    def __init__(self, page: Page, size: Sequence[float] = SIZE) -> None:
        self.page = page
        self.size = size
        box = page.locator(".board").bounding_box()
        assert box is not None
        self.box = box
        self.at: list[float] = [-1.0, -1.0]

    def pixel(self, at: Sequence[float]) -> tuple[float, float]:
        """Where a point of the table is on the page."""
        scale = self.box["width"] * (1 - 2 * MARGIN) / self.size[0]
        margin = self.box["width"] * MARGIN
        return self.box["x"] + margin + at[0] * scale, self.box["y"] + margin + (self.size[1] - at[1]) * scale

    def take_up(self, at: Sequence[float]) -> None:
        """Move onto the hand, so that the round's clock starts."""
        self.page.mouse.move(*self.pixel(at))
        self.at = list(at)
        self.page.locator(".board.running").wait_for()

    def move(self, to: Sequence[float], speed: float = 0.6) -> None:
        """Glide to a point, at most ``speed`` metres a second, slower at both ends."""
        count = max(2, math.ceil(1.5 * math.dist(self.at, to) / speed / (FRAME / 1000)))
        start = self.at
        for i in range(1, count + 1):
            s = i / count
            share = s * s * (3 - 2 * s)
            self.page.mouse.move(*self.pixel([a + (b - a) * share for a, b in zip(start, to, strict=True)]))
            self.page.wait_for_timeout(FRAME)
        self.at = list(to)

    def bring(self, cube: Sequence[float], slot: Sequence[float]) -> None:
        """Take a cube and put it down at its place."""
        self.move(cube)
        self.page.locator(".hud .count", has_text="In your hands").wait_for()
        self.move(slot)
        self.page.locator(".hud .count", has_text="empty").or_(self.page.locator(".toast:visible")).first.wait_for()


def build(page: Page, condition: str, reaches: int = 2) -> None:
    """Bring the cubes of a small table to their places."""
    hand = Hand(page)
    hand.take_up(HOME)
    for cube, slot in list(zip(PLACES[condition], SLOTS, strict=True))[:reaches]:
        hand.bring(cube, slot)


def rows(store: Any, query: str) -> list[tuple[Any, ...]]:
    """Rows of a study's database."""
    return [tuple(row) for row in store.read(query)]
