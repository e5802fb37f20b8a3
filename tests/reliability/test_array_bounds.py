"""No compiled function reads or writes outside its arrays, whatever arguments pass the door."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.repeats import Repeats

pytestmark = [pytest.mark.slow, pytest.mark.timeout(0)]  # compiling takes minutes on a busy machine

ROOT = Path(__file__).parents[2]
CHECKED = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_OPT": "1"}
"""Optimised less, because what is run once is compiled for longer than it runs."""


def test_bad_arguments_never_lead_outside_an_array(repeats: Repeats):
    """Also that every kernel of the project was called, so that none is left out, and none takes a generator."""
    command = [sys.executable, "-m", "tests.reliability.doors", str(repeats(2, 1000))]
    done = subprocess.run(command, env={**os.environ, **CHECKED}, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {"checked": True, "errors": {}, "never called": [], "take a generator": []}


def test_the_suite_never_leads_outside_an_array(request: pytest.FixtureRequest):
    """The tests of everything that is compiled, with ``--thorough``: they take longer than all others together."""
    if not request.config.getoption("thorough"):
        pytest.skip("all tests with bounds checking run with --thorough")
    folders = ["tests/legible_envs", "tests/predictors", "tests/optimizers"]
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "--timeout", "0", *folders]
    done = subprocess.run(command, env={**os.environ, **CHECKED}, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-10_000:]
