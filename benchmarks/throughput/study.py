"""Speed of a study's server: round trips of many participants at once, and what each of them costs.

The server has one core for itself; the participants are connections that send what was prepared before, from a process
on the other cores, and do no more with the answers than to look at their beginning.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.throughput.measure import Figure

if TYPE_CHECKING:
    from benchmarks.study.bots.process import ServerProcess
    from benchmarks.study.design.study import Study
    from benchmarks.throughput.sweep import Settings

__all__ = ["study_speed"]

KEYS: Final = 5.0
"""Actions a second of a participant in a kitchen."""
SAMPLES: Final = 60
"""Samples a second of a pointer."""
TOLD: Final = 15
"""Messages a second that a page sends them in."""
CONDITIONS: Final = 1
_PAGE: Final = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


@dataclass
class _Load:
    """What was measured with so many participants at once.

    Attributes:
        participants: How many.
        trips: Seconds of every round trip.
        wall: Seconds that it took.
        cpu: Seconds of processor time that the server used in them.
        steps: That the server took.
        memory: Of the server at the end, bytes.
    """

    participants: int
    trips: list[float] = field(default_factory=list)
    wall: float = 0.0
    cpu: float = 0.0
    steps: int = 0
    memory: int = 0

    def percentile(self, share: float) -> float:
        """Of the round trips, seconds."""
        return float(np.percentile(self.trips, share))

    @property
    def share(self) -> float:
        """Of a core, for each participant."""
        return self.cpu / self.wall / self.participants


def study_speed(settings: Settings) -> list[Figure]:
    """Round trips in kitchens with 20, 60 and 200 participants, memory, and the cost of each; then the same of tables.

    None where the system does not tell a process's time and memory (``/proc``), or has no cores to pin to.
    """
    if not sys.platform.startswith("linux") or not Path("/proc/self/stat").exists():
        return []
    with tempfile.TemporaryDirectory() as scratch:
        kitchens = _measure(Path(scratch) / "kitchens", "overcooked", settings.study_participants, settings)
        tables = _measure(Path(scratch) / "tables", "tabletop", (settings.study_tables,), settings)
    few, most = kitchens[0], kitchens[-1]
    figures = []
    for load in kitchens:
        what = f"study: step to answer, {load.participants} participants at {KEYS:g} keys/s"
        figures += [
            Figure(f"study p{share} {load.participants}", f"{what}, p{share}", "s", (load.percentile(share),))
            for share in (50, 95, 99)
        ]
        cost = f"study: processor time of a step, {load.participants} participants"
        figures.append(Figure(f"study cost {load.participants}", cost, "s", (load.cpu / load.steps,)))
    ratio = (most.cpu / most.steps) / (few.cpu / few.steps)
    table = tables[0]
    return [
        *figures,
        Figure("study flat", f"its cost with {most.participants} over {few.participants} participants", "x", (ratio,)),
        Figure("study memory", f"study: memory of the server, {most.participants} participants", "MB",
               (most.memory / 1e6,)),
        Figure("study core", f"study: share of a core, {most.participants} participants", "share",
               (most.cpu / most.wall,)),
        Figure("study table p95", f"study: pointer to answer, {table.participants} tables with robots, p95", "s",
               (table.percentile(95),)),
        Figure("study tables", "study: tables with robots that a core carries (30 steps/s, 60 samples/s)", "count",
               (1.0 / table.share,)),
    ]  # fmt: skip


# -- a study to be played ---------------------------------------------------------------------------------------------


def _write_study(folder: Path, domain: str) -> Study:
    """One condition, nothing to answer, rounds that do not end while they are measured."""
    import re

    from benchmarks.study.design.new import new_study
    from benchmarks.study.design.study import load_study

    file = new_study(folder, domain=domain)
    text = file.read_text(encoding="utf-8")
    for entry in re.findall(r"\[\[conditions\]\]\nname = .*\nlayout = .*\n\n", text)[CONDITIONS:]:
        text = text.replace(entry, "")
    text = re.sub(r"(?s)\[practice\].*?(?=\[rounds\])", "", text)
    text = re.sub(r"(?s)\[\[questionnaires\]\]\nname = .*?(?=# --)", "", text)
    text = re.sub(r"(?m)^max_steps = \d+", "max_steps = 100000", text)
    if domain == "overcooked":
        text = re.sub(r"(?m)^soups = .*", f"soups = {json.dumps([['onion', 'onion', 'fish']] * 16)}", text)
    file.write_text(text, encoding="utf-8")
    return load_study(folder)


def _messages(study: Study, seconds: float) -> list[str]:
    """What a participant sends in the round, as JSON."""
    from benchmarks.study.bots.people import Person, advance, make_player
    from benchmarks.study.games import make_game
    from benchmarks.study.timeline import timeline

    screen = next(screen for screen in timeline(study, study.conditions) if screen.kind == "round")
    game = make_game(study, screen, 0)
    player = make_player(study, game, Person(0, 0), screen, 1)
    found: list[str] = []
    if study.content.domain == "overcooked":
        while len(found) < seconds * KEYS and not game.is_over:
            action = player.choose()
            message = {"type": "step", "n": game.steps, "action": action, "down": 200.0 * len(found), "shown": 0.0}
            found.append(json.dumps(message))
            advance(game, action)
        return found
    points = [game.env.game.hand]
    while len(points) < seconds * 30 and not game.is_over:
        points.append(player.choose())
        advance(game, points[-1])
    for first in range(0, len(points) - 2, 30 // TOLD):
        samples = []
        for part in range(SAMPLES // TOLD):
            before, share = divmod(part + 1, SAMPLES // 30)
            a, b = points[first + before], points[min(first + before + 1, len(points) - 1)]
            at = (first + before + share * 30 / SAMPLES) * 1000 / 30
            samples.append([at, *(a[i] + share * 30 / SAMPLES * (b[i] - a[i]) for i in (0, 1))])
        found.append(json.dumps({"type": "pointer", "n": first, "samples": samples}))
    return found


# -- participants -----------------------------------------------------------------------------------------------------


def _measure(folder: Path, domain: str, crowds: Sequence[int], settings: Settings) -> list[_Load]:
    from benchmarks.study.bots.process import ServerProcess

    study = _write_study(folder, domain)
    messages = _messages(study, settings.study_seconds)
    interval = 1 / KEYS if domain == "overcooked" else 1 / TOLD
    cores = sorted(os.sched_getaffinity(0))
    with ServerProcess(folder, cores=cores[:1]) as server, _pinned(cores[1:] or cores):
        return [asyncio.run(_load(server, count, messages, interval)) for count in crowds]


@contextlib.contextmanager
def _pinned(cores: Sequence[int]) -> Iterator[None]:
    """This process on some cores alone."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(cores))
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


async def _load(server: ServerProcess, count: int, messages: Sequence[str], interval: float) -> _Load:
    """So many participants at once, who begin at moments spread over an interval."""
    from benchmarks.study.bots.link import join

    sockets = []
    for number in range(count):
        sockets.append(await _at_a_game(server, await join(server.link), str(number)))
    load = _Load(count)
    begun, cpu = time.perf_counter(), _cpu_seconds(server.pid)
    await asyncio.gather(
        *(
            _send(socket, messages, interval, begun + 0.2 + interval * number / count, load)
            for number, socket in enumerate(sockets)
        )
    )
    load.wall, load.cpu = time.perf_counter() - begun - 0.2, _cpu_seconds(server.pid) - cpu
    load.memory = _memory(server.pid)
    await asyncio.gather(*(socket.close() for socket in sockets))
    return load


async def _at_a_game(server: ServerProcess, token: str, tab: str) -> Any:
    """A connection whose round has begun."""
    from websockets.asyncio.client import connect

    socket = await connect(
        f"ws://127.0.0.1:{server.port}/socket", compression=None, ping_interval=None, open_timeout=60
    )
    device = {"type": "device", "keyboard": True, "pointer": "fine", "width": 1280, "height": 800, "round_trip": 1}
    screen = await _ask(socket, {"type": "hello", "token": token, "tab": tab})
    while not screen.get("begun"):
        says = {"device": device, "consent": {"type": "consent", "agreed": True}}.get(screen["kind"], {"type": "next"})
        screen = await _ask(socket, says)
    return socket


async def _ask(socket: Any, message: dict[str, Any]) -> dict[str, Any]:
    await socket.send(json.dumps(message))
    found: dict[str, Any] = json.loads(await socket.recv())
    return found


async def _send(socket: Any, messages: Sequence[str], interval: float, at: float, load: _Load) -> None:
    for message in messages:
        await asyncio.sleep(max(0.0, at - time.perf_counter()))
        begun = time.perf_counter()
        await socket.send(message)
        answer = await socket.recv()
        load.trips.append(time.perf_counter() - begun)
        if not answer.startswith('{"type":"state"'):
            raise RuntimeError(f"a step was answered by {answer[:200]}")
        load.steps += 1
        at += interval


def _cpu_seconds(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _PAGE


def _memory(pid: int) -> int:
    """Bytes that a process holds in memory."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024
    return 0
