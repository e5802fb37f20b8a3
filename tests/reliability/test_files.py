"""Damaged files of every format: read as before or refused in words, quickly and in little memory."""

from __future__ import annotations

import multiprocessing
import random
import resource
import time
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.reliability.file_formats import FORMATS
from tests.support.repeats import Repeats

FEW = dict.fromkeys(("trajectory npz", "trajectory CSV", "recorded games npz", "archive npz", "network npz"), 1000)
"""Attempts in the suite where 2,000 take too long: numpy writes a damaged ``.npz`` in milliseconds."""

MOST_SECONDS = 1.0
MOST_BYTES = 10**9


class Outcome(NamedTuple):
    """Of many attempts with one format."""

    attempts: int
    accepted: int
    slowest: float
    grown: int


def attempts(name: str, count: int, folder: Path) -> Outcome:
    """Damage a file of a format many times, and read it.

    Raises:
        AssertionError: Something else than a documented error was raised; names the attempt, whose file is kept.
    """
    known = FORMATS[name]()
    path = folder / f"file{known.suffix}"
    for example in known.examples:
        path.write_bytes(known.whole(example))
        known.use(path)  # also imports and compiles what reading takes
    messages: set[str] = set()
    before, accepted, slowest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0, 0.0
    for number in range(count):
        content = known.damaged(random.Random(f"{name} {number}"))
        path.write_bytes(content)
        begin = time.process_time()
        try:
            known.use(path)
            accepted += 1
        except known.errors as error:
            messages.add(str(error))
        except Exception as error:
            kept = folder / f"attempt-{number}{known.suffix}"
            kept.write_bytes(content)
            raise AssertionError(f"attempt {number} with {name} ({kept}): {type(error).__name__}: {error}") from error
        slowest = max(slowest, time.process_time() - begin)
    assert "" not in messages
    grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    return Outcome(count, accepted, slowest, grown)


def _limited(name: str, count: int, folder: Path) -> Outcome:
    """The same in a process that may take a gigabyte more than it has."""
    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    FORMATS[name]()  # imports and compiled code are no part of a file
    resource.setrlimit(resource.RLIMIT_AS, (own + 3 * MOST_BYTES, own + 3 * MOST_BYTES))
    return attempts(name, count, folder)


@pytest.mark.parametrize("name", FORMATS)
def test_damaged_files_are_refused_in_words_or_are_good_for_use(name: str, tmp_path: Path, repeats: Repeats) -> None:
    few = FEW.get(name, 2000)
    count = repeats(few, 15_000)
    if count == few:
        outcome = attempts(name, count, tmp_path)
    else:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            outcome = pool.apply(_limited, (name, count, tmp_path))
        assert outcome.slowest < MOST_SECONDS
        assert outcome.grown < MOST_BYTES
    print(f"{name}: {outcome}")
    assert 0 < outcome.accepted < 0.6 * count  # the damage neither destroys every file nor leaves most whole
