"""What code prints with compiled kernels and where they run as plain Python."""

from __future__ import annotations

import os
import subprocess
import sys


def printed(code: str, *, compiled: bool) -> str:
    """What ``code`` prints in a process of its own."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": str(int(not compiled))}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def printed_both_ways(code: str) -> tuple[str, str]:
    """What ``code`` prints compiled, and as plain Python."""
    return printed(code, compiled=True), printed(code, compiled=False)
