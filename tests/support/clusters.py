"""Real Dask clusters for tests: a scheduler and workers, each a process of its own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType

ROOT = Path(__file__).parents[2]


class LocalCluster:
    """A scheduler on this machine; it and its workers end with the ``with`` block.

    Args:
        folder: Where they leave their files.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.workers: list[subprocess.Popen[bytes]] = []
        where = folder / "scheduler.json"
        self.scheduler = self._start(ROOT, "scheduler", "--scheduler-file", str(where), "--port", "0")
        self.address = _address(where)

    def add_worker(self, root: Path = ROOT) -> subprocess.Popen[bytes]:
        """One more worker of one thread, whose packages are those below ``root``."""
        self.workers.append(self._start(root, "worker", self.address, "--nthreads", "1", "--no-nanny"))
        return self.workers[-1]

    def _start(self, root: Path, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments, "--host", "127.0.0.1", "--no-dashboard"]
        environment = os.environ | {"PYTHONPATH": str(root)}
        nothing = subprocess.DEVNULL
        return subprocess.Popen(command, env=environment, cwd=self.folder, stdout=nothing, stderr=nothing)

    def __enter__(self) -> LocalCluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


def _address(where: Path) -> str:
    for _ in range(600):
        try:
            return str(json.loads(where.read_text())["address"])
        except (FileNotFoundError, ValueError):
            time.sleep(0.05)
    raise AssertionError("the scheduler did not start")


def without_the_packages(folder: Path) -> Path:
    """Where this project cannot be imported from."""
    folder.mkdir()
    (folder / "optimizers.py").write_text("raise ModuleNotFoundError(\"No module named 'optimizers'\")\n")
    return folder


def copy_of_the_packages(folder: Path) -> Path:
    """A copy of this project with one more comment in a file that scores: other code with the same results."""
    for package in ("legible_envs", "optimizers", "predictors", "benchmarks", "tests"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__", "golden"))
    with (folder / "legible_envs" / "legibility.py").open("a", encoding="utf-8") as file:
        file.write("\n# edited\n")
    return folder
