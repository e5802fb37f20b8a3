"""``legible study serve`` as a process of its own: links, exit codes and designs."""

from __future__ import annotations

import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.benchmarks.study.small_studies import write_small_study
from tests.support.signals import hear_ctrl_c

ROOT = Path(__file__).parents[3]
LONGEST = 120.0


@contextmanager
def serve(folder: Path, *options: str) -> Iterator[tuple[subprocess.Popen[str], dict[str, str]]]:
    """The process, once it serves or has ended; and the links that it printed."""
    command = [sys.executable, "-m", "benchmarks.cli.app", "study", "serve", str(folder), "--port", "0", *options]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8",
        env=os.environ | {"PYTHONUNBUFFERED": "1"}, preexec_fn=hear_ctrl_c,
    )  # fmt: skip
    timer = threading.Timer(LONGEST, process.kill)
    timer.start()
    try:
        assert process.stdout is not None
        links = {}
        for line in process.stdout:
            if found := re.match(r"  (\w+): +(\S+)", line):
                links[found[1]] = found[2]
            if line.startswith("Ctrl-C"):
                break
        yield process, links
    finally:
        timer.cancel()
        if process.poll() is None:
            process.kill()
        process.communicate()


def join(link: str) -> str:
    base, _, query = link.partition("/debug?key=")
    body = json.dumps({"query": {"key": query} if query else {}}).encode()
    address = f"{base.rstrip('/')}/api/join"
    with urllib.request.urlopen(urllib.request.Request(address, body), timeout=60) as answer:
        return str(json.load(answer)["token"])


def events(folder: Path) -> list[str]:
    with closing(sqlite3.connect(folder / "data/live.sqlite")) as database:
        return [row[0] for row in database.execute("SELECT kind FROM events ORDER BY event")]


@pytest.mark.slow
def test_a_study_that_is_not_whole_is_not_served(tmp_path: Path) -> None:
    folder = write_small_study(tmp_path / "s", "overcooked", {}, {})
    (folder / "texts/consent.md").unlink()
    with serve(folder) as (process, links):
        _, said = process.communicate()
        assert (process.returncode, links) == (2, {})
        assert "texts/consent.md" in said
        assert "1 thing is missing or wrong" in said
    assert not (folder / "data").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sign", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)], ids=["Ctrl-C", "as services are stopped"]
)
def test_it_prints_links_and_ends_well(tmp_path: Path, sign: signal.Signals, code: int) -> None:
    folder = write_small_study(tmp_path / "s", "overcooked", {}, {})
    with serve(folder) as (process, links):
        assert set(links) == {"participants", "debug", "monitor"}
        for link in links.values():
            with urllib.request.urlopen(link, timeout=60) as answer:
                assert answer.status == 200
        assert join(links["participants"]) != join(links["debug"])
        process.send_signal(sign)
        _, said = process.communicate(timeout=60)
        assert process.returncode == code
        assert "Traceback" not in said
        for link in links.values():  # secrets are for whoever started it, not for logs
            assert link not in said
    assert events(folder) == ["design", "server_started", "joined", "server_stopped"]


@pytest.mark.slow
def test_a_changed_study_is_served_only_where_somebody_says_so(tmp_path: Path) -> None:
    folder = write_small_study(tmp_path / "s", "overcooked", {}, {})
    with serve(folder) as (process, links):
        join(links["participants"])
        process.terminate()
        process.wait(60)
    write_small_study(folder, "overcooked", {"rounds.max_steps": 99}, {})
    with serve(folder) as (process, links):
        _, said = process.communicate()
        assert (process.returncode, links) == (2, {})
        assert "1 participants of another design" in said
        assert "--new-design" in said
    with serve(folder, "--debug-only") as (_, links):  # trying it out needs nobody's leave
        assert set(links) == {"debug", "monitor"}
        assert join(links["debug"])
    for options in (["--new-design"], []):  # what was wanted once is remembered
        with serve(folder, *options) as (process, links):
            join(links["participants"])
            process.terminate()
            assert process.wait(60) == 0
    with closing(sqlite3.connect(folder / "data/live.sqlite")) as database:
        designs: list[Any] = database.execute("SELECT participant, design FROM participants ORDER BY 1").fetchall()
    assert [row[0] for row in designs] == ["P001", "P002", "P003"]
    assert designs[0][1] != designs[1][1] == designs[2][1]
