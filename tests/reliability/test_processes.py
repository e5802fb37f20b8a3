"""Processes that are killed: none stays behind, nothing finished is lost, and the tables are those of a quiet run."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.trials import run_trials
from tests.reliability.worker_functions import draw
from tests.support.repeats import Repeats

psutil = pytest.importorskip("psutil")

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

PROGRAM = (sys.executable, "-m", "benchmarks.cli.entry")
ROOT = Path(__file__).parents[2]
SWEEP = 'workspaces = [{workspace = "overcooked", shape = [5, 5]}]\nevaluations = 20_000\nseeds = 6\n'
LEFT_AFTER = 10.0
"""Seconds after which no process may be left."""

PARENT = """
import sys
from benchmarks.trials import run_trials
if __name__ == "__main__":
    function, folder = sys.argv[1:]
    trials = [{"seed": seed, "marks": folder, "seconds": 60} for seed in range(4)]
    run_trials("tests.reliability.worker_functions:" + function, trials, folder + "/run", workers=2)
"""


SCRIPT = """
import sys
from benchmarks.trials import run_trials
if __name__ == "__main__":
    trials = [{"seed": seed, "seconds": 0.2} for seed in range(12)]
    table = run_trials("tests.reliability.worker_functions:draw", trials, "run", workers=int(sys.argv[1]))
    table.to_csv("run/results.csv")
"""


class Session:
    """A process and all that it starts, in a session of their own by which they are found again.

    Args:
        folder: Where it runs, and writes its standard error.
        command: What it runs.
    """

    def __init__(self, folder: Path, *command: str) -> None:
        self.folder = folder
        self._errors = (folder / "errors").open("w")
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        self.parent = subprocess.Popen(command, cwd=folder, env=environment, start_new_session=True,
                                       stdout=subprocess.DEVNULL, stderr=self._errors,
                                       preexec_fn=_hear_of_closed_terminals)  # fmt: skip

    def processes(self) -> list[psutil.Process]:
        """Those of the session that are there."""
        found = []
        for process in psutil.process_iter(["status"]):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                alive = process.info["status"] != psutil.STATUS_ZOMBIE
                if alive and os.getsid(process.pid) == self.parent.pid:
                    found.append(process)
        return found

    def workers(self) -> list[psutil.Process]:
        """Processes that run trials."""
        found = []
        for process in self.processes():
            with contextlib.suppress(psutil.Error):
                if process.pid != self.parent.pid and "spawn_main" in " ".join(process.cmdline()):
                    found.append(process)
        return found

    def end(self, number: int) -> None:
        """Send a signal to the parent alone."""
        self.parent.send_signal(number)
        self.parent.wait(timeout=LEFT_AFTER)

    def left(self) -> list[str]:
        """Processes that stay for longer than they may."""
        deadline = time.monotonic() + LEFT_AFTER
        while (found := self.processes()) and time.monotonic() < deadline:
            time.sleep(0.05)
        return [" ".join(process.cmdline()) for process in found]

    def errors(self) -> str:
        """What was printed to standard error."""
        self._errors.close()
        return (self.folder / "errors").read_text()

    def kill(self) -> None:
        """Leave nothing behind, whatever a test found."""
        for process in self.processes():
            with contextlib.suppress(psutil.Error):
                process.kill()
        self.parent.wait()


def _hear_of_closed_terminals() -> None:
    """Where the tests themselves run under nohup, what they start would ignore them, too."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture
def sessions() -> Iterator[contextlib.ExitStack]:
    """Where a test puts its sessions."""
    with contextlib.ExitStack() as stack:
        yield stack


def wait_for(what: object, seconds: float = 120.0) -> None:
    """Until ``what()`` is true."""
    assert callable(what)
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "it did not come so far"
        time.sleep(0.02)


def started(stack: contextlib.ExitStack, folder: Path, *command: str) -> Session:
    folder.mkdir(parents=True, exist_ok=True)
    session = Session(folder, *command)
    stack.callback(session.kill)
    return session


@pytest.mark.slow
def test_workers_end_with_their_parent(tmp_path: Path, repeats: Repeats, sessions: contextlib.ExitStack) -> None:
    """However it ends, whatever they are doing: compiled code that gives no other thread a turn, or their start."""
    endings = [
        (signal.SIGKILL, "never_let_go", "running"),
        (signal.SIGTERM, "draw", "running"),
        (signal.SIGHUP, "never_let_go", "running"),
        (signal.SIGKILL, "draw", "starting"),
    ]
    for attempt in range(repeats(1, 20)):
        begun = []
        for number, (ending, function, moment) in enumerate(endings):
            folder = tmp_path / f"{attempt}-{number}"
            begun.append(
                (started(sessions, folder, sys.executable, "-c", PARENT, function, str(folder)), ending, moment)
            )
        for session, ending, moment in begun:
            if moment == "running":
                wait_for(lambda at=session: (at.folder / "0").exists() and (at.folder / "1").exists())
            else:
                wait_for(session.workers)
            assert session.workers()
            session.end(ending)
        for session, ending, moment in begun:
            assert session.left() == [], (ending, moment)
            assert session.errors() == "", (ending, moment)


@pytest.mark.slow
def test_a_killed_experiment_goes_on_to_the_same_table(
    tmp_path: Path, repeats: Repeats, sessions: contextlib.ExitStack
) -> None:
    """A worker is killed, then the parent: finished trials are kept, and every table is that of a quiet run."""
    rng = random.Random(1)
    for name, (command, tables) in experiments(thorough=bool(repeats(0, 1))).items():
        quiet = started_in(sessions, tmp_path / f"{name}-quiet", *command, "1")
        assert quiet.parent.wait(timeout=1200) == 0, quiet.errors()
        for attempt in range(repeats(1, 20)):
            folder = tmp_path / f"{name}-{attempt}"
            session = started_in(sessions, folder, *command, "2")
            wait_for(lambda at=session: ended(at) or (finished(at) and at.workers()))
            for victim in rng.sample(session.workers(), 1) if session.workers() else ():
                with contextlib.suppress(psutil.Error):
                    victim.kill()
            before = finished(session)
            wait_for(lambda at=session, before=before: ended(at) or finished(at) > before)
            session.end(signal.SIGKILL)
            assert session.left() == []
            assert session.errors() == ""
            kept = results(session)
            again = started_in(sessions, folder, *command, "2")
            assert again.parent.wait(timeout=1200) == 0, again.errors()
            assert kept.items() <= results(again).items(), "a finished trial was run again"
            for table in tables:
                assert without_times(folder / "run" / table) == without_times(quiet.folder / "run" / table)


def experiments(thorough: bool) -> dict[str, tuple[tuple[str, ...], tuple[str, ...]]]:
    """Commands, to which the number of workers is added, and the tables that they write."""
    small = {"trials": ((sys.executable, "-c", SCRIPT), ("results.csv",))}
    if not thorough:
        return small
    sweep = (*PROGRAM, "sweep", "s.toml", "--quiet", "--out", "run", "--workers")
    reproduce = (*PROGRAM, "reproduce", "optimizers", "--quick", "--seeds", "2", "--quiet", "--out", "run", "--workers")
    return {
        **small,
        "sweep": (sweep, ("results.csv", "summary.csv")),
        "reproduction": (reproduce, ("searches.csv",)),
    }


def started_in(stack: contextlib.ExitStack, folder: Path, *command: str) -> Session:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "s.toml").write_text(SWEEP)
    return started(stack, folder, *command)


def ended(session: Session) -> bool:
    return session.parent.poll() is not None


def results(session: Session) -> dict[Path, int]:
    """Files of finished trials, and when they were written."""
    return {path: path.stat().st_mtime_ns for path in (session.folder / "run").rglob("cells/*.json")}


def finished(session: Session) -> int:
    return len(results(session))


def without_times(table: Path) -> str:
    frame = pd.read_csv(table)
    return frame[[name for name in frame if "second" not in str(name)]].to_csv()


def test_the_pool_replaces_a_worker_that_dies_while_it_is_idle_or_busy(tmp_path: Path, repeats: Repeats) -> None:
    trials = [{"seed": seed} for seed in range(repeats(6, 60))]
    alone = run_trials(draw, trials, tmp_path / "alone", workers=1)
    rng = random.Random(2)
    killed: list[object] = []

    def kill_one(event: object) -> None:
        with contextlib.suppress(psutil.Error):
            ours = [child for child in psutil.Process().children() if "spawn_main" in " ".join(child.cmdline())]
            if ours and rng.random() < 0.2:
                rng.choice(ours).kill()
                killed.append(event)

    with contextlib.suppress(RuntimeError):  # a trial whose worker was killed twice
        run_trials(draw, trials, tmp_path / "killed", workers=2, progress=kill_one)
    after = run_trials(draw, trials, tmp_path / "killed", workers=2)
    assert killed
    pd.testing.assert_frame_equal(alone, after)
