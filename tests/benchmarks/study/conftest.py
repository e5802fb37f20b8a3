"""A browser, and studies that are played in seconds."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser

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


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A Chromium without a window; tests are skipped where there is none, or fail with ``LEGIBLE_REQUIRE_BROWSER=1``."""
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
def write_study(tmp_path: Path) -> Callable[..., Study]:
    """Writes and loads a small study: ``write_study("overcooked", {"limits.resume": "block"}, files={...})``."""

    def write(domain: str, settings: dict[str, Any] | None = None, files: dict[str, str] | None = None) -> Study:
        from benchmarks.study.design.study import load_study
        from tests.benchmarks.study.small_studies import write_small_study

        return load_study(write_small_study(tmp_path / f"study-{domain}", domain, settings or {}, files or {}))

    return write


@pytest.fixture
def serve() -> Iterator[Callable[..., str]]:
    """Serves a study from a thread until the test ends, and gives its address."""
    from benchmarks.study.server.run import serving

    with ExitStack() as stack:
        yield lambda study, **options: stack.enter_context(serving(study, **options))[0]
