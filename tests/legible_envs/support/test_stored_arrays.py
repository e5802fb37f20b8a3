"""Arrays of a file are what their reader expects, or the message says what came."""

from __future__ import annotations

import numpy as np
import pytest

from legible_envs.support.stored_arrays import stored_array, stored_json, stored_text, stored_whole

FILE = {
    "times": np.array([0.0, 1.0]),
    "gaps": np.array([[0.0, np.nan]]),
    "name": np.array("abc"),
    "schema": np.array(3, dtype=">i2"),
    "config": np.frombuffer(b'{"a": [1, null]}', dtype=np.uint8),
    "half": np.frombuffer("é".encode(), dtype=np.uint8),
    "twice": np.frombuffer(b'{"a": 1, "a": 2}', dtype=np.uint8),
    "long": np.zeros((), dtype="U1000001"),
    "beyond": np.array([0x110000], dtype="<u4").view("<U1")[0:1].reshape(()),
}


def test_what_fits_is_returned():
    assert stored_array(FILE, "times", "f", (2,), finite=True) is FILE["times"]
    assert stored_array(FILE, "times", "iuf", (None,)) is FILE["times"]
    assert (stored_text(FILE, "name"), stored_whole(FILE, "schema", 1), stored_json(FILE, "config")) == (
        "abc",
        3,
        {"a": [1, None]},
    )


@pytest.mark.parametrize(
    ("read", "message"),
    [
        (lambda: stored_array(FILE, "x", "f", ()), r"it lacks the array `x`; it has \['beyond', 'config'"),
        (lambda: stored_array(FILE, "times", "iu", (2,)), r"`times` must be whole numbers of shape \(2\), got float64"),
        (lambda: stored_array(FILE, "times", "f", (3,)), r"of shape \(3\), got float64 of shape \(2,\)"),
        (lambda: stored_array(FILE, "times", "f", (2, None)), r"of shape \(2, any\), got"),
        (lambda: stored_array(FILE, "gaps", "f", (1, 2), finite=True), r"`gaps` must be finite, got nan at \[0, 1\]"),
        (lambda: stored_text(FILE, "schema"), "`schema` must be texts of shape"),
        (lambda: stored_text(FILE, "long"), "`long` has room for 1,000,001 characters"),
        (lambda: stored_text(FILE, "beyond"), "`beyond` is no text"),
        (lambda: stored_whole(FILE, "schema", 1, 2), "`schema` must be an integer from 1 to 2, got 3"),
        (lambda: stored_json(FILE, "half"), "`half` is not ASCII"),
        (lambda: stored_json(FILE, "twice"), "`twice`: the key 'a' stands twice"),
        (lambda: stored_json(FILE, "config", most=10), "`config`: it has 16 characters; JSON of at most 10 is read"),
        (lambda: stored_json({"x": np.zeros(2, np.int64)}, "x"), r"`x` must be bytes \(uint8\), got int64"),
    ],
)
def test_what_does_not_fit_is_named(read, message):
    with pytest.raises(ValueError, match=message):
        read()
