"""How often a test of reliability tries: a few times in the suite, very often with ``--thorough``."""

from __future__ import annotations

from collections.abc import Callable

import pytest

Repeats = Callable[[int, int], int]


@pytest.fixture
def repeats(request: pytest.FixtureRequest) -> Repeats:
    """``repeats(few, many)``: the number of attempts."""
    thorough = request.config.getoption("thorough")
    return lambda few, many: many if thorough else few
