"""Tests that need recorded games: skipped where there are none, failed where they are required."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from tests import conftest

NEEDS_DATA = SimpleNamespace(get_closest_marker=lambda name: pytest.mark.data if name == "data" else None)
NEEDS_NONE = SimpleNamespace(get_closest_marker=lambda name: None)


@pytest.fixture
def _no_recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LEGIBLE_DATA", str(tmp_path))
    monkeypatch.setattr(conftest, "missing_recordings", conftest.missing_recordings.__wrapped__)


@pytest.mark.usefixtures("_no_recordings")
@pytest.mark.parametrize("required", [None, "", "0"])
def test_missing_recordings_skip(monkeypatch: pytest.MonkeyPatch, required: str | None) -> None:
    monkeypatch.delenv("LEGIBLE_REQUIRE_DATA", raising=False)
    if required is not None:
        monkeypatch.setenv("LEGIBLE_REQUIRE_DATA", required)
    with pytest.raises(pytest.skip.Exception, match="legible humans fetch"):
        conftest.pytest_runtest_setup(NEEDS_DATA)  # type: ignore[arg-type]
    conftest.pytest_runtest_setup(NEEDS_NONE)  # type: ignore[arg-type]


@pytest.mark.usefixtures("_no_recordings")
def test_missing_recordings_fail_where_they_are_required(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LEGIBLE_REQUIRE_DATA", "1")
    with pytest.raises(pytest.fail.Exception, match=r"LEGIBLE_REQUIRE_DATA is set, but .*legible humans fetch"):
        conftest.pytest_runtest_setup(NEEDS_DATA)  # type: ignore[arg-type]
    conftest.pytest_runtest_setup(NEEDS_NONE)  # type: ignore[arg-type]
