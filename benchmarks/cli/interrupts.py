"""Ctrl-C while modules are loaded: it waits for the end of the import.

Compiled modules of other packages run Python code while they begin. Some (those made with pybind11) end the process by
``abort()`` where a KeyboardInterrupt arises in there.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType

__all__ = ["spare_imports"]

_PAUSE = 0.02
"""Seconds after which it is tried again."""

_IMPORTING = "<frozen importlib._bootstrap>"


def spare_imports() -> None:
    """Let Ctrl-C interrupt whatever runs, but an import only after its end; pressed again, it ends the process at once.

    Does nothing where Ctrl-C is ignored, as under ``nohup``, or not to be handled here.
    """
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) not in (
        signal.SIG_IGN,
        None,
    ):
        signal.signal(signal.SIGINT, _Interrupt())


class _Interrupt:
    """A handler of SIGINT, which sends the signal again until no import is under way."""

    def __init__(self) -> None:
        self._waits = False
        self._is_mine = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        mine, self._is_mine = self._is_mine, False
        if self._waits and not mine:
            print("stopped", file=sys.stderr, flush=True)
            os._exit(130)
        self._waits = _is_importing(frame)
        if not self._waits:
            raise KeyboardInterrupt
        again = threading.Timer(_PAUSE, self._again)
        again.daemon = True
        again.start()

    def _again(self) -> None:
        self._is_mine = True
        signal.raise_signal(signal.SIGINT)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == _IMPORTING:
            return True
        frame = frame.f_back
    return False
