"""What all tests share: recorded games that some need, registries that some fill, a package that some install.

``LEGIBLE_REQUIRE_DATA=1`` turns the skips of tests marked ``data`` into failures, so that none stays out unseen.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

os.environ.setdefault("MPLBACKEND", "Agg")  # before anything imports matplotlib: tests open no windows

from tests.support.example_package import install
from tests.support.repeats import Repeats

PACKAGES = ("legible_envs", "optimizers", "predictors", "benchmarks")
TESTS = Path(__file__).parent
EXAMPLES = TESTS.parent / "docs" / "examples"


@cache
def missing_recordings() -> str:
    """Why the recorded games cannot be read; empty where they can."""
    from legible_envs.datasets.overcooked_2019 import RecordingsError, load_recorded_games

    try:
        load_recorded_games(layouts=())
    except RecordingsError as error:
        return str(error)
    return ""


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--thorough``, for tests that count their attempts (`repeats`)."""
    parser.addoption("--thorough", action="store_true", help="random cases in full numbers; takes hours")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what coverage of the three libraries can do without: tests of the command line, and of reliability."""
    for item in items:
        if any(item.path.is_relative_to(TESTS / folder) for folder in ("benchmarks", "reliability")):
            item.add_marker("untraced")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs recorded games where there are none, or fail where they are required."""
    if item.get_closest_marker("data") is None or not (reason := missing_recordings()):
        return
    if os.environ.get("LEGIBLE_REQUIRE_DATA", "0") not in ("", "0"):
        pytest.fail(f"LEGIBLE_REQUIRE_DATA is set, but {reason}", pytrace=False)
    pytest.skip(reason)


@pytest.fixture
def repeats(request: pytest.FixtureRequest) -> Repeats:
    """``repeats(few, many)``: how often to try; ``many`` with ``--thorough``."""
    thorough = request.config.getoption("thorough")
    return lambda few, many: many if thorough else few


@pytest.fixture
def clean_registries(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plug-ins that a test registers are known to it alone; built-in and installed ones stay."""
    from legible_envs.support.plugins import Registry

    modules = [vars(module) for name, module in sys.modules.items() if name.partition(".")[0] in PACKAGES]
    for registry in (found for names in modules for found in list(names.values()) if isinstance(found, Registry)):
        monkeypatch.setattr(registry, "_registered", {})


@pytest.fixture
def aisle_package(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The package docs/examples/legible-workspace-example, installed outside the tree for the time of a test."""
    folder = tmp_path_factory.mktemp("site")
    yield from install(EXAMPLES / "legible-workspace-example", folder, monkeypatch)
