"""Digests: kept data says itself what it must be, so that a changed bit is found out and never becomes a number.

A digest guards against damage (a disk, a transfer, an edit by hand), not against forgers, who can make a new one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

__all__ = ["SEAL", "broken_seal", "digest_of_arrays", "digest_of_json", "sealed", "unsealed"]

SEAL: Final = "sha256"
"""The key under which JSON content carries its own digest."""


def digest_of_json(content: Any) -> str:
    """SHA-256, in hexadecimal, of plain data: the same for whatever white space and order of keys it was written in.

    Example:
        >>> digest_of_json({"a": 1, "b": [2.0]}) == digest_of_json({"b": [2.0], "a": 1})
        True
        >>> digest_of_json({"a": 1}) == digest_of_json({"a": 1.0})
        False
    """
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def digest_of_arrays(arrays: Mapping[str, npt.NDArray[Any]]) -> str:
    """SHA-256, in hexadecimal, of named arrays: names, types, shapes and values, however a file compresses them."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        values = values.astype(values.dtype.newbyteorder("<"), copy=False)
        digest.update(json.dumps([name, values.dtype.str, list(values.shape)]).encode("ascii"))
        digest.update(values.tobytes())
    return digest.hexdigest()


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data with its own digest as last entry.

    Example:
        >>> content = sealed({"rows": [1]})
        >>> broken_seal(content), unsealed(content)
        ('', {'rows': [1]})
        >>> "it was changed since" in broken_seal({**content, "rows": [2]})
        True
    """
    plain = json.loads(json.dumps(unsealed(content)))  # keys that are numbers become the texts that a file holds
    return {**plain, SEAL: digest_of_json(plain)}


def unsealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Plain data without its digest."""
    return {key: value for key, value in content.items() if key != SEAL}


def broken_seal(content: Mapping[str, Any]) -> str:
    """Why data is not what its digest says, as part of a sentence about its file; empty where it is."""
    if SEAL not in content:
        return f"it lacks `{SEAL}`, the digest of its content"
    found = digest_of_json(unsealed(content))
    if content[SEAL] == found:
        return ""
    return (
        f"its content has the SHA-256 {found[:12]}…, not the one it was written with: it was changed since, or damaged"
    )
