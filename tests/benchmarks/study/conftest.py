"""A browser, and studies that are played in seconds."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from benchmarks.study.design.study import Study

_NAMES = ("chromium", "chromium-browser", "google-chrome")


@cache
def chromium() -> str:
    """Path of a Chromium; empty where there is none. ``LEGIBLE_CHROMIUM`` names another."""
    named = os.environ.get("LEGIBLE_CHROMIUM", "")
    return next((found for name in filter(None, (named, *_NAMES)) if (found := shutil.which(name))), "")


def _without(reason: str) -> None:
    if os.environ.get("LEGIBLE_REQUIRE_BROWSER", "0") not in ("", "0"):
        pytest.fail(f"LEGIBLE_REQUIRE_BROWSER is set, but {reason}", pytrace=False)
    pytest.skip(reason)


@pytest.fixture(scope="module")  # Playwright keeps an event loop running in its thread while it is open
def browser() -> Iterator[Browser]:
    """A Chromium without a window; without one tests are skipped, or fail with ``LEGIBLE_REQUIRE_BROWSER=1``."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        _without("Playwright is not installed")
    if not chromium():
        _without(f"no browser was found: expected LEGIBLE_CHROMIUM, or one of {', '.join(_NAMES)} on the PATH")
    with sync_playwright() as playwright:
        # The sandbox needs rights that containers withhold; the pages opened here are our own.
        found = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages of contexts of their own; a test fails if a script on one of them did."""
    contexts, errors = [], []

    def open_one(**options: Any) -> Page:
        context = browser.new_context(**({"viewport": {"width": 1280, "height": 800}} | options))
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(20_000)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda m: errors.append(m.text) if "Security Policy" in m.text else None)
        return page

    yield open_one
    for context in contexts:
        context.close()
    assert not errors


@pytest.fixture
def write_study(tmp_path: Path) -> Callable[..., Study]:
    """Writes and loads a small study: ``write_study("overcooked", {"limits.resume": "block"}, files={...})``."""

    def write(domain: str, settings: dict[str, Any] | None = None, files: dict[str, str] | None = None) -> Study:
        from benchmarks.study.design.study import load_study
        from tests.benchmarks.study.small_studies import write_small_study

        return load_study(write_small_study(tmp_path / f"study-{domain}", domain, settings or {}, files or {}))

    return write
