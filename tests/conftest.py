"""What all tests share: the recorded games that some need, and the example package that others install.

``LEGIBLE_REQUIRE_DATA=1`` turns the skips of tests marked ``data`` into failures, so that none stays out unseen.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.support.example_package import install

EXAMPLES = Path(__file__).parent.parent / "docs" / "examples"


@cache
def _missing_recordings() -> str:
    """Why the recorded games cannot be read; empty where they can."""
    from legible_envs.datasets.overcooked_2019 import RecordingsError, load_recorded_games

    try:
        load_recorded_games(layouts=())
    except RecordingsError as error:
        return str(error)
    return ""


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs recorded games where there are none, or fail where they are required."""
    if item.get_closest_marker("data") is None or not (reason := _missing_recordings()):
        return
    if os.environ.get("LEGIBLE_REQUIRE_DATA", "0") not in ("", "0"):
        pytest.fail(f"LEGIBLE_REQUIRE_DATA is set, but {reason}", pytrace=False)
    pytest.skip(reason)


@pytest.fixture
def aisle_package(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The package docs/examples/legible-workspace-example, installed outside the tree for the time of a test."""
    folder = tmp_path_factory.mktemp("site")
    yield from install(EXAMPLES / "legible-workspace-example", folder, monkeypatch)
