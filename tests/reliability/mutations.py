"""Damage to files: of their bytes, of the data they hold, and of the arrays in an ``.npz``."""

from __future__ import annotations

import copy
import io
import json
import math
import random
import zipfile
from collections.abc import Callable
from typing import Any, Final

import numpy as np

__all__ = ["as_toml", "damage_arrays", "damage_bytes", "damage_data", "npz_bytes"]

DEEP: Final = json.loads("[" * 150 + "]" * 150)

HOSTILE: Final[tuple[Any, ...]] = (
    None, True, False, -1, 0, 1, 7, 255, 2**31, 2**63, -(2**63), 10**18, 10**400, 0.5, -0.0, 5e-324, 1e308, -1e308,
    math.nan, math.inf, -math.inf, "", " ", "x", "x" * 100_000, "\0", "a\nb", "\ud800", "[/foo]", "=1+1", "../..",
    "nan", "1", "b'bytes'", [], {}, [[]], [[[[]]]], [None, None], [0, 0], {"a": {}}, {"": None}, DEEP,
)  # fmt: skip
"""What no file of ours holds in most places."""

_LETTERS: Final = b"\x00\xff\n\r\t ,;:[]{}()\"'#&*!|>-+.eE019aZ/\\"


def damage_bytes(content: bytes, rng: random.Random, others: tuple[bytes, ...]) -> bytes:
    """One to four flips, deletions, insertions, repetitions, splices of another file, or a cut."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        at = rng.randrange(len(data) + 1)
        length = rng.choice((1, 1, 2, 8, 64))
        kind = rng.randrange(7)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[at : at + length]
        elif kind == 2:
            data[at:at] = bytes(rng.choice(_LETTERS) for _ in range(length))
        elif kind == 3:
            data[at:at] = data[at : at + length] * rng.choice((1, 3, 50))
        elif kind == 4:
            other = rng.choice(others)
            begin = rng.randrange(len(other) + 1)
            data[at : at + length] = other[begin : begin + rng.choice((1, 8, 64, 4096))]
        elif kind == 5:
            del data[at:]
        elif at < len(data):
            data[at] = rng.choice(_LETTERS)
    return bytes(data)


def damage_data(data: Any, rng: random.Random) -> Any:
    """One to three values replaced, removed, doubled, moved elsewhere, or repeated; keys renamed."""
    whole = [copy.deepcopy(data)]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_places(whole))
        holder, key = rng.choice(places)
        kind = rng.randrange(10)
        if kind <= 4:
            holder[key] = copy.deepcopy(rng.choice(HOSTILE))
        elif kind == 5 and holder is not whole:
            del holder[key]
        elif kind == 6:
            holder_of_other, other = rng.choice(places)
            holder[key] = copy.deepcopy(holder_of_other[other]) if holder_of_other is not whole else 0
        elif kind == 7 and isinstance(holder, dict):
            holder[rng.choice(("", "x", "name", str(key) + "s", str(key).upper()))] = holder.pop(key)
        elif kind == 8 and isinstance(holder[key], list):
            holder[key] = holder[key] * rng.choice((2, 2, 2, 3, 30, 30, 300 if rng.random() < 0.9 else 5000))
        else:
            holder[key] = [holder[key]] if rng.random() < 0.5 else {str(key): holder[key]}
    return whole[0]


def _places(container: Any) -> Any:
    """``(holder, key)`` of every value, outer ones first."""
    waiting, seen = [container], 0
    while waiting and seen < 5000:
        holder = waiting.pop()
        for key in list(holder) if isinstance(holder, dict) else range(len(holder)):
            seen += 1
            yield holder, key
            if isinstance(holder[key], dict | list):
                waiting.append(holder[key])


def as_toml(data: Any) -> bytes:
    """Plain data as TOML, with all inner tables inline; what TOML has not becomes a text."""
    if not isinstance(data, dict):
        return json.dumps(data).encode("utf-8", "replace")
    return "".join(f"{_toml_key(key)} = {_toml(value)}\n" for key, value in data.items()).encode("utf-8", "replace")


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml_key(key)} = {_toml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return '"none"' if value is None else json.dumps(value, ensure_ascii="\ud800" not in str(value))


def _toml_key(key: str) -> str:
    return json.dumps(key)


def npz_bytes(arrays: dict[str, Any], *, compressed: bool = True) -> bytes:
    """The bytes of an ``.npz``, pickles and all."""
    stream = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(stream, **arrays)
    return stream.getvalue()


def damage_arrays(arrays: dict[str, Any], rng: random.Random) -> bytes:
    """The bytes of an ``.npz`` with one to three arrays of another dtype, shape or content, or with a false header."""
    changed = dict(arrays)
    for _ in range(rng.choice((1, 1, 2, 3))):
        name = rng.choice(list(changed))
        kind = rng.randrange(12)
        if kind == 0 and len(changed) > 1:
            del changed[name]
        elif kind == 1:
            changed[rng.choice(("x", "", name + "s", "../" + name))] = changed.pop(name)
        elif kind == 2:
            changed[name] = changed[rng.choice(list(changed))]
        else:
            changed[name] = _damaged(np.asarray(changed[name]), rng)
    if rng.random() < 0.05:
        return _with_false_header(changed, rng)
    return npz_bytes(changed, compressed=rng.random() < 0.3)


_DTYPES: Final = ("i1", "u8", ">i4", "f2", "f4", ">f8", "c16", "?", "U3", "S4", "M8[s]", "O", "u1")
_NUMBERS: Final = (-1, 0, 1, 2, 6, 255, 2**31 - 1, 2**62, -(2**62), 1e300, -1e300, math.nan, math.inf, 0.5)


def _damaged(array: np.ndarray, rng: random.Random) -> np.ndarray:
    flat = array.reshape(-1)
    changes: list[Callable[[], Any]] = [
        lambda: array.astype(rng.choice(_DTYPES)),
        lambda: flat[0] if flat.size else np.float64(0),
        lambda: array[None],
        lambda: array[..., None],
        lambda: array[: rng.randrange(len(array) + 1)],
        lambda: np.repeat(array, rng.choice((2, 3, 100)), axis=rng.randrange(max(array.ndim, 1))),
        lambda: array.T,
        lambda: array[::-1],
        lambda: np.array([{"a": array}], dtype=object),
        lambda: np.array(rng.choice(HOSTILE[:22])),
        lambda: np.zeros(rng.choice(((0,), (0, 0), (3, 0), (2, 2, 2)))),
        lambda: _with_number(array, rng),
        lambda: _with_number(array, rng),
    ]
    try:
        with np.errstate(all="ignore"):
            return np.asarray(rng.choice(changes)())
    except (TypeError, ValueError, OverflowError, IndexError):
        return array


def _with_number(array: np.ndarray, rng: random.Random) -> np.ndarray:
    changed = array.copy()
    changed.reshape(-1)[rng.randrange(array.size)] = rng.choice(_NUMBERS)
    return changed


def _with_false_header(arrays: dict[str, Any], rng: random.Random) -> bytes:
    """One array says that it is larger, or of another type, than what follows."""
    stream, wrong = io.BytesIO(), rng.choice(list(arrays))
    with zipfile.ZipFile(stream, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as file:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.save(member, np.asarray(array), allow_pickle=True)
            content = member.getvalue()
            if name == wrong:
                header = {
                    "descr": rng.choice(("<f8", "|O", "<U99999999", "<i8", "|V8")),
                    "fortran_order": rng.random() < 0.5,
                    "shape": rng.choice(((10**12,), (2**62, 4), (-1,), (), (3, 10**9), (1,) * 40)),
                }
                head = io.BytesIO()
                np.lib.format.write_array_header_1_0(head, header)
                content = head.getvalue() + content[128:]
            file.writestr(f"{name}.npy", content)
    return stream.getvalue()
