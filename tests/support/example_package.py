"""Installs a package of docs/examples into a folder of its own, as pip would: its files and its entry points."""

from __future__ import annotations

import importlib
import shutil
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest


def install(source: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Copy a package into ``folder``, put it on the path, and forget its modules afterwards."""
    project = tomllib.loads((source / "pyproject.toml").read_text(encoding="utf-8"))
    about, packages = project["project"], project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    for package in packages:
        shutil.copytree(source / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    info = folder / f"{about['name'].replace('-', '_')}-{about['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {about['name']}\nVersion: {about['version']}\n")
    lines = []
    for group, points in about["entry-points"].items():
        lines += [f"[{group}]", *(f"{name} = {target}" for name, target in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    _forget(packages)
    monkeypatch.syspath_prepend(folder)
    importlib.invalidate_caches()
    yield folder
    _forget(packages)


def _forget(packages: list[str]) -> None:
    for module in [name for name in sys.modules if name.partition(".")[0] in packages]:
        del sys.modules[module]
