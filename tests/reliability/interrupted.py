"""Interrupts processes at random moments while they call what draws random numbers in compiled code.

``python -m tests.reliability.interrupted ONCE OFTEN`` prints, as JSON, how processes ended per entry point: ``ONCE`` of
them were interrupted once, and one more ``OFTEN`` times, catching its interrupts and going on. They are forked from one
process that has compiled everything, so that a hundred of them cost seconds.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from typing import NoReturn

import gymnasium
import numpy as np

from legible_envs.overcooked import OvercookedWorkspace
from legible_envs.overcooked.humans import simulate_participants
from legible_envs.tabletop import TabletopWorkspace

SEED = 12
ONCE_WITHIN = 0.01
OFTEN_WITHIN = 0.004
LIMIT = 120.0


def entry_points() -> dict[str, Callable[[], object]]:
    """Everything public that hands a random generator to compiled code, in small calls: entering is what failed."""
    rng = np.random.default_rng(SEED)
    kitchens, tables = OvercookedWorkspace(), TabletopWorkspace()
    obstacles = TabletopWorkspace(condition="obstacles", max_detour=None)
    kitchen, table = kitchens.sample(1, rng), tables.sample(1, rng)
    env = gymnasium.make("LegibleOvercooked-v0", layouts="random")
    vector = gymnasium.make_vec("LegibleOvercooked-v0", 2, layouts="random")
    layout = kitchens.decode(kitchen[0])
    return {
        "kitchens: sample": lambda: kitchens.sample(1, rng),
        "kitchens: perturb": lambda: kitchens.perturb(kitchen, 1, rng),
        "tables: sample objects": lambda: tables.sample(1, rng),
        "tables: sample obstacles": lambda: obstacles.sample(2, rng),
        "tables: perturb objects": lambda: tables.perturb(table, 1, rng, 0),
        "tables: perturb obstacles": lambda: tables.perturb(table, 1, rng, 1),
        "kitchen: reset": lambda: env.reset(seed=SEED),
        "kitchens: reset of a vector": lambda: vector.reset(seed=SEED),
        "participants: boltzmann": lambda: simulate_participants(layout, 1, rng, population="boltzmann"),
        "participants: planner": lambda: simulate_participants(layout, 1, rng, population="planner"),
    }


def run(call: Callable[[], object], interrupts: int, ready: int) -> NoReturn:
    """In a forked process: call until so many interrupts were caught; exit by 0, or 1 where anything else happened."""
    code = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        caught = 0
        os.write(ready, b".")
        while caught < interrupts:
            try:
                while True:
                    call()
            except KeyboardInterrupt:
                caught += 1
        code = 0
    except KeyboardInterrupt:  # while counting the one before
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def ending(call: Callable[[], object], interrupts: int, within: float, moments: random.Random) -> str:
    """How a process ends that is interrupted so often, each time after a random moment."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        run(call, interrupts, writer)
    os.close(writer)
    os.read(reader, 1)
    os.close(reader)
    deadline = time.monotonic() + LIMIT
    gone, status = 0, 0
    while not gone and time.monotonic() < deadline:
        time.sleep(moments.uniform(0.0, within))
        os.kill(child, signal.SIGINT)
        for _ in range(1000 if interrupts == 1 else 1):
            gone, status = os.waitpid(child, os.WNOHANG)
            if gone or interrupts > 1:
                break
            time.sleep(0.001)
    if not gone:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return f"hung for {LIMIT:g} s"
    code = os.waitstatus_to_exitcode(status)
    return {0: "interrupted", 1: "another error"}.get(code) or signal.Signals(-code).name


def main(once: int, often: int) -> dict[str, dict[str, int]]:
    """How often processes ended how, per entry point."""
    points = entry_points()
    moments = random.Random(SEED)
    found = {}
    for name, call in points.items():
        call()
        ends = Counter(ending(call, 1, ONCE_WITHIN, moments) for _ in range(once))
        if often:
            ends[f"{ending(call, often, OFTEN_WITHIN, moments)} {often} times"] += 1
        found[name] = dict(ends)
    return found


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]), int(sys.argv[2]))))
