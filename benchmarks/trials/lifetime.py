"""Processes that end with the one that started them, however that one ends."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from multiprocessing import connection
from typing import Final

__all__ = ["end_with_parent"]

_PR_SET_PDEATHSIG: Final = 1
"""Of Linux's prctl(2): the signal a process gets when its parent dies."""


def end_with_parent() -> None:
    """End this process as soon as the process that started it has ended; does nothing in a process of its own.

    A killed parent cannot tell its workers to stop. A thread waits for the parent's end; it works everywhere, but only
    once Python gives it a turn, which compiled code may withhold for as long as it runs. Linux needs no turn.
    """
    parent = multiprocessing.parent_process()
    if parent is None or parent.pid is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent.pid:  # it died before the kernel was asked
            os._exit(1)
    # At once, not by sys.exit: nobody is left who could take what this process still has.
    watch = threading.Thread(
        target=lambda: (connection.wait([parent.sentinel]), os._exit(1)), name="end with parent", daemon=True
    )
    watch.start()
