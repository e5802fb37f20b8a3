"""Ctrl-C at a random moment is an exception, whatever draws random numbers in compiled code."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.repeats import Repeats

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked, so that a hundred cost seconds"),
]


def test_no_interrupt_kills_python(repeats: Repeats):
    """Before kernels drew by addresses, 16 of 100 such processes died, and 8 of 10 that were interrupted repeatedly."""
    once, often = repeats(3, 100), repeats(100, 300)
    command = [sys.executable, "-m", "tests.reliability.interrupted", str(once), str(often)]
    done = subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    ends = json.loads(done.stdout)
    assert len(ends) == 10
    survived = {"interrupted": once, f"interrupted {often} times": 1}
    assert {name: end for name, end in ends.items() if end != survived} == {}, done.stderr
