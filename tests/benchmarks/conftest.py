"""What the tests of commands and pages share."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def width_of_output(monkeypatch: pytest.MonkeyPatch) -> None:
    """Output is as wide as in a file, also where tests run in parallel: their workers are told of a narrow terminal."""
    monkeypatch.delenv("COLUMNS", raising=False)
