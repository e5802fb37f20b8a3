"""Looking through a pickle before it is loaded: no part may be larger than what is left of the file.

Python's unpickler takes the memory that a length in the file asks for, before it reads what follows; eight damaged
bytes are enough to ask for all there is. Likewise the number under which a value is kept sets the size of a table.
"""

from __future__ import annotations

import pickletools
from typing import Final

from legible_envs.datasets.overcooked_ai.games import RecordingsError

__all__ = ["check_sizes"]

_UP_TO_NEWLINE: Final = pickletools.UP_TO_NEWLINE
_PREFIX: Final = {
    pickletools.TAKEN_FROM_ARGUMENT1: (1, False),
    pickletools.TAKEN_FROM_ARGUMENT4: (4, True),
    pickletools.TAKEN_FROM_ARGUMENT4U: (4, False),
    pickletools.TAKEN_FROM_ARGUMENT8U: (8, False),
}
"""Bytes of the length that an argument begins with, and whether it may be negative."""
_ARGUMENTS: Final = {ord(op.code): 0 if op.arg is None else op.arg.n for op in pickletools.opcodes}
_LINES: Final = {ord(op.code): 2 if op.name in ("GLOBAL", "INST") else 1 for op in pickletools.opcodes}
_NAMES: Final = {ord(op.code): op.name for op in pickletools.opcodes}
_STOP: Final = ord(".")
_KEEPS: Final = {ord("p"), ord("q"), ord("r")}
_FRAME: Final = 0x95
_MOST_DIGITS: Final = 4_300


def check_sizes(data: bytes) -> None:
    """Check every length and every number of a kept value in a pickle.

    Raises:
        RecordingsError: One is larger than the file can fill, an opcode is unknown, or the pickle ends too early.
    """
    at = count = 0
    end = len(data)
    while at < end:
        code = data[at]
        at += 1
        count += 1
        argument = _ARGUMENTS.get(code)
        if argument is None:
            raise RecordingsError(f"byte {at - 1} is no step of a pickle")
        if argument == 0:
            if code == _STOP:
                return
            continue
        begin = at
        if argument > 0:
            at += argument
        elif argument == _UP_TO_NEWLINE:
            for _ in range(_LINES[code]):
                newline = data.find(b"\n", at)
                at = end + 1 if newline < 0 else newline + 1
            if code != ord("c") and at - begin > _MOST_DIGITS and code not in b"SVi":
                raise RecordingsError(f"byte {begin}: a number of {at - begin} digits")
        else:
            width, signed = _PREFIX[argument]
            length = int.from_bytes(data[at : at + width], "little", signed=signed)
            at += width + max(length, 0)
            if length < 0:
                raise RecordingsError(f"byte {begin}: a negative length")
        if code == _FRAME:
            at, length = begin + 8, int.from_bytes(data[begin : begin + 8], "little")
            if length > end - at:
                raise RecordingsError(f"byte {begin}: a frame of {length} bytes, of which {max(end - at, 0)} are there")
        if at > end:
            raise RecordingsError(f"byte {begin}: {_NAMES[code]} asks for {at - begin} bytes, {end - begin} are left")
        if code in _KEEPS and _kept(data[begin:at], code) > count:
            raise RecordingsError(f"byte {begin}: a value is kept under a number beyond all values so far")
    raise RecordingsError("the pickle ends too early")


def _kept(argument: bytes, code: int) -> int:
    if code != ord("p"):
        return int.from_bytes(argument, "little")
    digits = argument.strip()
    return int(digits) if digits.isdigit() else 1 << 62
