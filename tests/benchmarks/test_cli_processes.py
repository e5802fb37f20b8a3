"""The command line as processes: Ctrl-C at several moments, closed pipes, no screen, names in other encodings."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.support.signals import hear_ctrl_c

KITCHEN = "XTXPXXX\nX     O\nX V   X\nC     X\nX   V F\nX     X\nXXDXSXX\n"
PROGRAM = (sys.executable, "-m", "benchmarks.cli.entry")

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and pipes of POSIX")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "k.txt").write_text(KITCHEN)
    (tmp_path / "s.toml").write_text(
        'workspaces = [{workspace = "overcooked", shape = [5, 5]}]\nevaluations = 50_000_000\nseeds = 3\n'
    )
    root = Path(__file__).parents[2]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH")))))
    monkeypatch.setenv("LEGIBLE_DATA", str(tmp_path / "data"))
    return tmp_path


def _run(folder: Path, *arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    given: dict[str, Any] = {"capture_output": True, "text": True, "cwd": folder, "check": False, "timeout": 240}
    return subprocess.run([*PROGRAM, *arguments], **{**given, **options})


def _interrupted(folder: Path, arguments: tuple[str, ...], *delays: float) -> tuple[int, str]:
    """Start a command, send Ctrl-C to it and its children after each delay; its exit code and standard error."""
    process = subprocess.Popen([*PROGRAM, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               cwd=folder, start_new_session=True, preexec_fn=hear_ctrl_c)  # fmt: skip
    for delay in delays:
        time.sleep(delay)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
    try:
        _, error = process.communicate(timeout=120)
        assert not _left(process.pid), "it left processes behind"
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    return process.returncode, error


def _left(group: int) -> bool:
    """Whether processes of a group stay for longer than ten seconds."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.02)
    return True


LONG_COMMANDS = {
    "optimize": ("optimize", "overcooked", "--evaluations", "500000000", "--quiet", "--out", "run"),
    "demo": ("demo", "--offline", "--out", "demo"),
    "sweep": ("sweep", "s.toml", "--workers", "2", "--out", "sweep"),
    "sweep in one process": ("sweep", "s.toml", "--workers", "1", "--out", "sweep"),
    "reproduce": ("reproduce", "optimizers", "--quick", "--workers", "2", "--out", "again"),
    "bench": ("bench",),
}


MOMENTS = [
    *((command, (4.0,)) for command in LONG_COMMANDS),
    *((command, (1.0,)) for command in ("optimize", "reproduce")),  # while modules are loaded
    *((command, (4.0, 0.1)) for command in ("optimize", "sweep")),  # twice
]


@pytest.mark.slow
@pytest.mark.parametrize(("command", "delays"), MOMENTS, ids=str)
def test_ctrl_c_is_a_sentence_and_exit_code_130(command: str, delays: tuple[float, ...], folder: Path) -> None:
    code, error = _interrupted(folder, LONG_COMMANDS[command], *delays)
    assert code == 130, error
    assert error.startswith("stopped") or "\nstopped" in error
    for noise in ("Traceback", "Aborted", "Exception ignored", "KeyboardInterrupt", "leaked"):
        assert noise not in error


LOADING = """
import os, signal, sys, time
from benchmarks.cli.interrupts import spare_imports
spare_imports()
try:
    import loading  # interrupts itself
    time.sleep(10)
except KeyboardInterrupt:
    print("interrupted", "loading" in sys.modules)
"""
MODULE = """
import os, signal, time
for press in range({presses}):
    os.kill(os.getpid(), signal.SIGINT)
    end = time.monotonic() + 0.2
    while time.monotonic() < end:
        pass
"""


@pytest.mark.parametrize(("presses", "code", "said"), [(1, 0, "interrupted True"), (2, 130, "")])
def test_ctrl_c_waits_for_the_module_that_is_loaded(presses: int, code: int, said: str, folder: Path) -> None:
    """Where it does not, compiled modules of other packages may abort the process."""
    (folder / "loading.py").write_text(MODULE.format(presses=presses))
    (folder / "program.py").write_text(LOADING)
    done = subprocess.run([sys.executable, "program.py"], cwd=folder, capture_output=True, text=True, check=False,
                          timeout=60, preexec_fn=hear_ctrl_c)  # fmt: skip
    assert (done.returncode, done.stdout.strip()) == (code, said), done.stderr
    assert done.stderr == ("stopped\n" if code else "")


@pytest.mark.slow
@pytest.mark.parametrize(("command", "delay"), [("score", 0.3), ("show", 0.6), ("score", 1.2)])
def test_ctrl_c_while_a_layout_is_scored(command: str, delay: float, folder: Path) -> None:
    code, error = _interrupted(folder, (command, "k.txt"), delay)
    assert (code, error.strip()) in ((130, "stopped"), (0, "")), "stopped, or done before"


@pytest.mark.slow
def test_ctrl_c_during_a_search_says_how_to_go_on(folder: Path) -> None:
    process = subprocess.Popen([*PROGRAM, *LONG_COMMANDS["optimize"]], stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True, cwd=folder, start_new_session=True,
                               preexec_fn=hear_ctrl_c)  # fmt: skip
    deadline = time.monotonic() + 200
    metrics = folder / "run" / "metrics.csv"
    # Two rows: the search is under way, and not merely about to begin.
    while not (metrics.exists() and metrics.read_text().count("\n") > 2) and time.monotonic() < deadline:
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=200)
    assert process.returncode == 130
    first, second = error.strip().splitlines()
    assert first.startswith("stopped after ")
    assert first.endswith("everything is saved in run")
    assert second == "to go on: legible optimize overcooked --resume --out run"


def test_interrupts_inside_code_that_a_library_executes_give_the_same_exit_code() -> None:
    """Python remembers Ctrl-C in an exec() of text and ends by the signal instead."""
    code = (
        "import sys, types\n"
        "app = types.ModuleType('benchmarks.cli.app')\n"
        "app.main = lambda prog_name: exec('raise KeyboardInterrupt')\n"
        "sys.modules['benchmarks.cli.app'] = app\n"
        "from benchmarks.cli.entry import run\n"
        "run()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, env=_with_root())
    assert (done.returncode, done.stderr.strip()) == (130, "stopped")


def _with_root() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}


def test_readers_of_the_output_may_leave(folder: Path) -> None:
    for command in ("show", "score"):
        reading, writing = os.pipe()
        os.close(reading)
        done = _run(folder, command, "k.txt", capture_output=False, stdout=writing, stderr=subprocess.PIPE)
        os.close(writing)
        assert done.stderr == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_is_an_error(folder: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = _run(folder, "score", "k.txt", capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stderr.startswith("Error: ")
    assert "No space left" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_output_may_be_closed(folder: Path) -> None:
    for redirected in (">&-", "2>&-", ">&- 2>&-"):
        line = f"{' '.join(PROGRAM)} score k.txt {redirected}"
        assert subprocess.run(["sh", "-c", line], cwd=folder, check=False, capture_output=True).returncode == 0
        line = f"{' '.join(PROGRAM)} score nowhere {redirected}"
        assert subprocess.run(["sh", "-c", line], cwd=folder, check=False, capture_output=True).returncode == 2


def test_names_that_are_no_utf_8_are_read_written_and_shown(folder: Path) -> None:
    name, picture = os.fsdecode(b"k\xff.txt"), os.fsdecode(b"p\xff.png")
    try:
        (folder / name).write_text(KITCHEN)
    except OSError:
        pytest.skip("this disk takes UTF-8 only")
    done = _run(folder, "show", name, "--out", picture, errors="surrogateescape")
    assert done.returncode == 0, done.stderr
    assert (folder / picture).read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(sys.platform != "linux", reason="screens of Linux")
def test_play_without_a_screen_says_so(folder: Path) -> None:
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER")
    done = _run(folder, "play", "k.txt", "--record", "mine.npz",
                env={name: value for name, value in os.environ.items() if name not in hidden})  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("Error: cannot open a window: there is no screen here")
    assert not (folder / "mine.npz").exists()


def test_width_and_colours_of_the_terminal_are_respected(folder: Path) -> None:
    narrow = _run(folder, "show", "k.txt", env={**os.environ, "COLUMNS": "60"})
    assert max(map(len, narrow.stdout.splitlines())) <= 60
    assert "\x1b" not in _run(folder, "show", "k.txt", env={**os.environ, "NO_COLOR": "1"}).stdout
