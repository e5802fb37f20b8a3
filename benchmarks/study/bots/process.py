"""A study's server in a process of its own, as bots, kills and measurements need it.

``python -m benchmarks.study.bots.process FOLDER PORT`` serves debug participants on this machine until its standard
input ends: when whoever started it is gone, it goes too. It prints one line once it takes connections.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

from benchmarks.study.errors import StudyError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.study.design.study import Study

__all__ = ["ServerProcess", "without_gaps"]

_READY: Final = "ready"
_GENTLE: Final = 10.0
"""Seconds in which a server that is told to stop ends."""


class ServerProcess:
    """A server of the debug database of a study.

    Args:
        folder: Of the study.
        port: 0 for one that is free; the same again after :meth:`kill`.
        cores: To which it is pinned; None: any.
        patience: Seconds in which it has to start.

    Attributes:
        port: On which it listens.
        link: For participants.

    Raises:
        StudyError: It does not start; says why.

    Example:
        >>> with ServerProcess(folder) as server:  # doctest: +SKIP
        ...     print(server.link)
    """

    def __init__(
        self, folder: Path, *, port: int = 0, cores: Sequence[int] | None = None, patience: float = 120.0
    ) -> None:
        self.folder = folder
        self.port = port or _free_port()
        self.patience = patience
        self.cores = cores
        self._process: subprocess.Popen[str] | None = None
        self.start()

    @property
    def pid(self) -> int:
        """Number of the process."""
        assert self._process is not None
        return self._process.pid

    @property
    def link(self) -> str:
        """The debug participants' link."""
        from benchmarks.study.server.secrets import Secrets

        return f"http://127.0.0.1:{self.port}/debug?key={Secrets.of(self.folder).debug}"

    def start(self) -> None:
        """Start it, and wait until it takes connections.

        Raises:
            StudyError: It does not start; says why.
        """
        command = [sys.executable, "-m", __name__, str(self.folder), str(self.port), *map(str, self.cores or ())]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            start_new_session=True,  # Ctrl-C is for the one who started it, who then stops it
        )  # fmt: skip
        timer = threading.Timer(self.patience, self._process.kill)
        timer.start()
        try:
            assert self._process.stdout is not None
            line = self._process.stdout.readline()
        finally:
            timer.cancel()
        if line.strip() != _READY:
            self._process.kill()
            _, said = self._process.communicate()
            last = said.strip().splitlines()[-1:] or ["it says nothing"]
            raise StudyError(f"the server did not start: {last[0]}")
        # What it says is let through: nobody reads a pipe that is full.
        threading.Thread(target=self._pass_on, args=(self._process,), daemon=True).start()

    @staticmethod
    def _pass_on(process: subprocess.Popen[str]) -> None:
        with contextlib.suppress(ValueError, OSError):
            for line in process.stderr or ():
                sys.stderr.write(line)

    def kill(self) -> None:
        """End it as a loss of power would, as far as a process can (``SIGKILL``)."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._let_go()

    def stop(self) -> None:
        """End it in good order."""
        process = self._process
        if process is None:
            return
        if process.poll() is None:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_GENTLE)
        if process.poll() is None:
            process.kill()
        process.wait()
        self._let_go()

    def _let_go(self) -> None:
        assert self._process is not None
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    def __enter__(self) -> ServerProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _free_port() -> int:
    import socket

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def without_gaps(study: Study) -> Study:
    """The same study whose sittings follow each other at once: bots do not wait for days."""
    gaps = {"min_gap_hours": 0.0, "max_gap_hours": 0.0}
    sittings = [sitting.model_copy(update=gaps) for sitting in study.content.sittings]
    return dataclasses.replace(study, content=study.content.model_copy(update={"sittings": sittings}))


def _serve(folder: Path, port: int) -> None:
    from benchmarks.study.design.study import load_study
    from benchmarks.study.server.context import Pace
    from benchmarks.study.server.run import Address, make_server, warm_up

    study = without_gaps(load_study(folder))
    warm_up(study)
    swift = Pace(messages=1e6, burst=1e6, connects=1e6, speed=1e6, joins=1e6)
    server = make_server(study, Address(port=port), modes=("debug",), pace=swift)

    def announce() -> None:
        while not server.started:
            time.sleep(0.005)
        print(_READY, flush=True)

    def watch() -> None:
        while os.read(0, 1024):
            pass
        os.kill(os.getpid(), signal.SIGTERM)

    for task in (announce, watch):
        threading.Thread(target=task, daemon=True).start()
    server.run()


def _main(arguments: Sequence[str]) -> int:
    folder, port, *cores = arguments
    if cores and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core) for core in cores})
    try:
        _serve(Path(folder), int(port))
    except StudyError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1:]))
