"""Overcooked-AI, measured beside this project: in a virtual environment of its own, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import venv
from importlib.resources import as_file, files
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

__all__ = ["Peer", "PeerError", "open_peer"]

REQUIREMENTS: Final = ("overcooked-ai==1.1.0", "scipy", "numpy<2", "setuptools<81")
"""The peer, and what it needs without saying so."""
INSTALL_SECONDS: Final = 600


class PeerError(RuntimeError):
    """The peer cannot be measured; the message says why."""


class Peer:
    """A running Overcooked-AI that counts its steps on request.

    Args:
        python: Interpreter of the peer's environment.
    """

    def __init__(self, python: Path) -> None:
        # What it has to say goes to a file: a pipe that nobody reads would stop it once full.
        self._complaints = tempfile.TemporaryFile(mode="w+")  # noqa: SIM115  (closed in `close`)
        with as_file(files("benchmarks.throughput") / "peer_overcooked_ai.py") as script:
            self._process = subprocess.Popen(
                [str(python), str(script)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._complaints,
                text=True,
                env={**os.environ, "SDL_VIDEODRIVER": "dummy"},
            )
            self._answer("ready")

    def steps_per_second(self, seconds: float, *, observe: bool) -> float:
        """Steps per second with random actions.

        Args:
            seconds: How long to measure.
            observe: Whether each step also makes the grid of numbers that agents learn from.

        Raises:
            PeerError: It stopped.
        """
        assert self._process.stdin is not None
        self._process.stdin.write(f"{seconds} {int(observe)}\n")
        self._process.stdin.flush()
        return float(self._answer("rate").removeprefix("rate "))

    def _answer(self, start: str) -> str:
        """The next line that begins so; the peer's own prints are passed over."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(start):
                return line.strip()
        raise PeerError(f"it stopped: {self._last_words()}")

    def _last_words(self) -> str:
        self._complaints.seek(0)
        return " ".join(self._complaints.read().strip().splitlines()[-1:])

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(timeout=30)
        self._complaints.close()


def open_peer(folder: Path | None = None) -> Peer:
    """Install Overcooked-AI if it is not there yet, and start it.

    Args:
        folder: Where its environment lives; None means the user's cache folder.

    Raises:
        PeerError: It cannot be installed or does not run.
    """
    folder = folder or user_cache_path("legible-envs") / "peers" / "overcooked-ai"
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    marker = folder / "installed"
    try:
        if not marker.exists():
            venv.create(folder, with_pip=True, clear=folder.exists() and (folder / "pyvenv.cfg").exists())
            _pip_install(python)
            marker.write_text("\n".join(REQUIREMENTS) + "\n", encoding="utf-8")
        return Peer(python)
    except OSError as error:
        raise PeerError(f"no environment in {folder}: {error}") from error
    except subprocess.TimeoutExpired as error:
        raise PeerError(f"installing {REQUIREMENTS[0]} took longer than {INSTALL_SECONDS} s") from error


def _pip_install(python: Path) -> None:
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *REQUIREMENTS]
    done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_SECONDS, check=False)
    if done.returncode:
        raise PeerError(f"pip could not install {REQUIREMENTS[0]}: {' '.join(done.stderr.strip().splitlines()[-1:])}")
