"""Fixtures for the tests of environments."""

from __future__ import annotations

import pytest

from tests.legible_envs.environment_cases import CASES, DEFAULTS, Case


@pytest.fixture
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows open on a screen that does not exist."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


@pytest.fixture(params=CASES, ids=str)
def case(request: pytest.FixtureRequest) -> Case:
    """Every environment in every variant in turn; a test about some of them parametrises ``case`` itself."""
    return request.param


@pytest.fixture(params=DEFAULTS, ids=str)
def plain(request: pytest.FixtureRequest) -> Case:
    """Every environment in turn, made with its id alone."""
    return request.param
