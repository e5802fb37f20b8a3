"""A published-looking archive of simulated games."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pytest

from legible_envs.datasets.overcooked_2019 import (
    source,
)
from tests.legible_envs.datasets.old_pickles import HALL, ROOM, archive, simulated_table, table_pickle


@pytest.fixture(scope="module")
def tables() -> dict[str, dict[str, Any]]:
    first, second = simulated_table(ROOM, "room", [1, 2], 300, 0), simulated_table(HALL, "hall", [2], 400, 1)
    train = {key: first[key] + second[key] for key in first}
    return {"train": train, "test": simulated_table(ROOM, "room", [3], 200, 2)}


@pytest.fixture
def published(tables: dict[str, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that the code takes for the published one."""
    pickles = {split: table_pickle(table) for split, table in tables.items()}
    members = {split: (f"overcooked/{split}.pickle", len(data)) for split, data in pickles.items()}
    content = archive({"overcooked/setup.py": b"raise SystemExit", **{members[s][0]: pickles[s] for s in pickles}})
    path = tmp_path / "index" / "overcooked-ai" / source.FILE_NAME
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    monkeypatch.setattr(source, "SHA256", hashlib.sha256(content).hexdigest())
    monkeypatch.setattr(source, "SIZE", len(content))
    monkeypatch.setattr(source, "MEMBERS", members)
    return path
