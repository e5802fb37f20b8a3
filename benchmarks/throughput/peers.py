"""Packages of other authors, measured beside this project: each in its own virtual environment and process."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Final

from platformdirs import user_cache_path

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["IMITATION", "IRL_MAXENT", "OVERCOOKED_AI", "Package", "Peer", "PeerError", "open_peer", "opened"]

INSTALL_SECONDS: Final = 1200


class PeerError(RuntimeError):
    """The peer cannot be measured; the message says why."""


@dataclass(frozen=True)
class Package:
    """A peer, and how it is installed and asked.

    Attributes:
        name: What tables call it; the name of its environment too.
        script: The program beside this file that runs in its environment.
        requirements: What each call of pip installs, one after the other.
    """

    name: str
    script: str
    requirements: tuple[tuple[str, ...], ...]


OVERCOOKED_AI: Final = Package(
    "overcooked-ai", "peer_overcooked_ai.py", (("overcooked-ai==1.1.0", "scipy", "numpy<2", "setuptools<81"),)
)
"""Its own metadata lacks the last two requirements."""

# A torch that is there already keeps pip from pulling in a build with CUDA.
IMITATION: Final = Package(
    "imitation", "peer_maxent_irl.py", (("torch==2.13.0",), ("imitation==1.0.1", "setuptools<81"))
)

IRL_MAXENT: Final = Package("irl-maxent", "peer_maxent_irl.py", (("irl-maxent==0.1.0",),))


class Peer:
    """A running peer that measures itself on request.

    Args:
        python: Interpreter of the peer's environment.
        package: The peer.
        arguments: Of its program.

    Raises:
        PeerError: It does not run.
    """

    def __init__(self, python: Path, package: Package, arguments: Sequence[str] = ()) -> None:
        # Its errors go to a file: a full pipe that is never read would stop it.
        self._complaints = tempfile.TemporaryFile(mode="w+")  # noqa: SIM115  (closed in `close`)
        with as_file(files("benchmarks.throughput") / package.script) as script:
            self._process = subprocess.Popen(
                [str(python), str(script), *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._complaints,
                text=True,
                env={**os.environ, "SDL_VIDEODRIVER": "dummy", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )
            self._answer("ready")

    def rate(self, request: str) -> float:
        """How much it does per second of processor time; see its program for requests.

        Raises:
            PeerError: It stopped.
        """
        return float(self.ask(request, "rate"))

    def steps_per_second(self, seconds: float, *, observe: bool) -> float:
        """Steps of Overcooked-AI per second with random actions.

        Args:
            seconds: How long to measure.
            observe: Whether each step also computes the grid observation that agents learn from.

        Raises:
            PeerError: It stopped.
        """
        return self.rate(f"{seconds} {int(observe)}")

    def ask(self, request: str, answer: str) -> str:
        """What follows the word ``answer`` in its reply."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has stopped: the error below quotes its last line
            self._process.stdin.write(f"{request}\n")
            self._process.stdin.flush()
        return self._answer(answer).removeprefix(answer).strip()

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
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._complaints.close()


def open_peer(package: Package, folder: Path | None = None, arguments: Sequence[str] = ()) -> Peer:
    """Install a peer if it is not there yet, and start it.

    Args:
        package: The peer.
        folder: Where the peers' environments live; None means the user's cache folder.
        arguments: Of its program.

    Raises:
        PeerError: It cannot be installed or does not run.
    """
    home = (folder or user_cache_path("legible-envs") / "peers") / package.name
    python = home / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    marker = home / "installed"
    wanted = "".join(f"{each}\n" for together in package.requirements for each in together)
    try:
        if not marker.exists() or marker.read_text(encoding="utf-8") != wanted:
            venv.create(home, with_pip=True, clear=(home / "pyvenv.cfg").exists())
            for requirements in package.requirements:
                _pip_install(python, requirements)
            marker.write_text(wanted, encoding="utf-8")
        return Peer(python, package, arguments)
    except OSError as error:
        raise PeerError(f"no environment in {home}: {error}") from error
    except subprocess.TimeoutExpired as error:
        raise PeerError(f"installing {package.name} took longer than {INSTALL_SECONDS} s") from error


def _pip_install(python: Path, requirements: Sequence[str]) -> None:
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *requirements]
    done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_SECONDS, check=False)
    if done.returncode:
        raise PeerError(f"pip could not install {requirements[0]}: {' '.join(done.stderr.strip().splitlines()[-1:])}")


@contextlib.contextmanager
def opened(
    packages: Mapping[Package, Sequence[str]], folder: Path | None, remarks: list[str], console: Console
) -> Iterator[dict[str, Peer]]:
    """Running peers by name while a benchmark lasts; those that cannot run are left out, with a remark that says why.

    Args:
        packages: The peers, and the arguments of their programs.
        folder: See :func:`open_peer`.
        remarks: Where remarks are added.
        console: Shows the progress of installations.
    """
    peers: dict[str, Peer] = {}
    with contextlib.ExitStack() as stack:
        for package, arguments in packages.items():
            try:
                with console.status(f"installing {package.name} into an environment of its own (once)"):
                    peers[package.name] = open_peer(package, folder, arguments)
                stack.callback(peers[package.name].close)
            except PeerError as error:
                remarks.append(f"{package.name} was not measured: {error}")
        yield peers
