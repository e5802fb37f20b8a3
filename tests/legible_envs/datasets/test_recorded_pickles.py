"""Pickles of recorded games are read without running anything in them."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.datasets.overcooked_2019 import (
    RecordingsError,
)
from legible_envs.datasets.overcooked_ai.pickle_sizes import check_sizes
from legible_envs.datasets.overcooked_ai.unpickle import ADMITTED, read_table
from tests.legible_envs.datasets.old_pickles import Call, array, dumps, named, table_pickle


def test_tables_are_rebuilt_without_their_libraries() -> None:
    columns = {
        "text": ["a", "b", "ä"],
        "x": [0.5, 1.5, -2.0],
        "more": ["1", "2", "3"],
        "y": [1.0, 2.0, 3.0],
        "n": [1, 2, 3],
    }
    table = read_table(table_pickle(columns))
    assert list(table) == ["x", "y", "n", "text", "more"]
    for name, values in columns.items():
        assert table[name].tolist() == values
    fortran = Call(
        named("numpy.core.multiarray", "_reconstruct"),
        named("numpy", "ndarray"),
        (0,),
        b"b",
        state=(1, (2, 2), Call(named("numpy", "dtype"), "i8", 0, 1, state=(3, "<")), True, np.arange(4).tobytes()),
    )
    from legible_envs.datasets.overcooked_ai.unpickle import _array, _Reader

    assert _array(_Reader(dumps(fortran)).load()).tolist() == [[0, 2], [1, 3]]
    assert _array(_Reader(dumps(array([[True], [False]], "b1"))).load()).tolist() == [[True], [False]]


class Evil:
    """A pickle that runs a command when it is read by ``pickle``."""

    def __init__(self, function: Any, *args: Any) -> None:
        self.call = function, args

    def __reduce__(self) -> Any:
        return self.call


def test_hostile_pickles_are_refused_and_nothing_runs(tmp_path: Path) -> None:
    mark = tmp_path / "it-ran"
    pickles = {
        "system": pickle.dumps(Evil(os.system, f"touch {mark}")),
        "eval": pickle.dumps(Evil(eval, f"open({str(mark)!r}, 'w')")),
        "open": pickle.dumps(Evil(open, str(mark), "w")),
        "in a table": table_pickle({"a": ["x"]}, index=Call(named("os", "system"), f"touch {mark}")),
        "dotted": dumps(Call(named("numpy", "ndarray.tofile"), str(mark))),
        "other numpy": dumps(Call(named("numpy", "save"), str(mark), 1)),
        "other pandas": dumps(Call(named("pandas.io.pickle", "read_pickle"), str(mark))),
        "persistent": b"\x80\x04\x8c\x04nameQ.",
        "class state": dumps([named("numpy", "ndarray")])[:-1] + b"}b.",
        "not a pickle": b"hello",
        "empty": b"",
        "wrong value": pickle.dumps({"a": 1}),
    }
    pickle.loads(pickles["open"]).close()
    assert mark.exists(), "the test's pickles must be dangerous to be worth refusing"
    mark.unlink()
    for name, data in pickles.items():
        with pytest.raises(RecordingsError) as caught:
            read_table(data)
        assert not mark.exists(), name
        if name in ("system", "in a table", "other numpy", "other pandas"):
            assert "nothing was run" in str(caught.value)


def test_admitted_names_are_never_imported() -> None:
    program = (
        "import sys\n"
        "from legible_envs.datasets.overcooked_ai.unpickle import ADMITTED, _Reader\n"
        "reader = _Reader(b'')\n"
        "found = [reader.find_class(*name) for name in ADMITTED]\n"
        "assert all(type(f.__new__(f)).__mro__[1].__name__ == '_Record' for f in found)\n"
        "assert 'pandas' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
    assert len(ADMITTED) == 25


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_damaged_pickles_never_do_anything_but_fail(data: st.DataObject) -> None:
    whole = table_pickle({"a": ["x", "y"], "b": [1.0, 2.0]})
    broken = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        broken[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    try:
        table = read_table(bytes(broken))
    except RecordingsError:
        table = {}
    for name, column in table.items():
        assert isinstance(name, str)
        assert isinstance(column, np.ndarray)


# -- sizes ------------------------------------------------------------------------------------------------------------

HUGE = (2**31 - 1).to_bytes(4, "little"), (2**62).to_bytes(8, "little")
GREEDY = {
    "long bytes": (b"\x80\x04\x8e" + HUGE[1], "BINBYTES8 asks for"),
    "bytes": (b"\x80\x04B" + HUGE[0], "BINBYTES asks for"),
    "text": (b"\x80\x04X" + HUGE[0] + b"abc", "BINUNICODE asks for"),
    "long text": (b"\x80\x04\x8d" + HUGE[1] + b"abc.", "BINUNICODE8 asks for"),
    "buffer": (b"\x80\x05\x96" + HUGE[1] + b"abc.", "BYTEARRAY8 asks for"),
    "number": (b"\x80\x02\x8b" + HUGE[0] + b".", "LONG4 asks for"),
    "negative": (b"\x80\x02\x8b\xff\xff\xff\xff.", "a negative length"),
    "frame": (b"\x80\x04\x95" + HUGE[1] + b"N.", "a frame of"),
    "kept": (b"\x80\x04Nr" + HUGE[0] + b".", "kept under a number"),
    "kept as text": (b"Np99999999999\n.", "kept under a number"),
    "many digits": (b"I" + b"9" * 10_000 + b"\n.", "a number of 10001 digits"),
    "end": (b"\x80\x04N", "ends too early"),
    "cut": (b"\x80\x04X\x05", "asks for"),
    "unknown": (b"\x80\x04\xff.", "no step of a pickle"),
}


@pytest.mark.parametrize("name", GREEDY)
def test_a_pickle_that_asks_for_more_than_it_fills_is_refused_before_it_is_loaded(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, message = GREEDY[name]
    monkeypatch.setattr("legible_envs.datasets.overcooked_ai.unpickle._Reader", None)
    with pytest.raises(RecordingsError, match=message):
        read_table(data)


def test_a_small_pickle_cannot_grow() -> None:
    """References are small, what they stand for is not: long arguments given again and again, one column many times."""
    long = tuple(range(40))
    with pytest.raises(RecordingsError, match="with 40 arguments"):
        read_table(dumps([Call(named("numpy", "ndarray"), *long)]))
    column = array([["a"] * 1000], "O8")
    blocks = [{"values": column, "mgr_locs": array([0], "i8")} for _ in range(500)]
    index = Call(
        named("pandas.core.indexes.base", "_new_Index"),
        named("pandas.core.indexes.base", "Index"),
        {"data": array(["a"], "O8")},
    )
    manager = Call(
        named("pandas.core.internals.managers", "BlockManager"),
        state=([index], [], [], {"0.14.1": {"blocks": blocks}}),
    )
    with pytest.raises(RecordingsError, match="it repeats its columns"):
        read_table(dumps(Call(named("pandas.core.frame", "DataFrame"), state={"_data": manager})))


PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text()
    | st.binary()
    | st.just("a" * 300)
    | st.just(b"b" * 300),
    lambda inner: (
        st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner) | st.frozensets(st.integers())
    ),
    max_leaves=30,
)


@settings(max_examples=200, deadline=None)
@given(value=PLAIN, protocol=st.integers(0, 5))
def test_every_honest_pickle_passes(value: Any, protocol: int) -> None:
    check_sizes(pickle.dumps(value, protocol))
    check_sizes(pickle.dumps([value, bytearray(b"abc"), {1: value}, range(3), 10**400], protocol))


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_whatever_passes_is_loaded_within_its_own_size(data: st.DataObject) -> None:
    """No damaged byte makes the unpickler take more than a small multiple of the file."""
    whole = bytearray(table_pickle({"a": ["x", "y"] * 20, "b": [1.0, 2.0] * 20}))
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(whole) - 9))
        whole[at : at + 8] = data.draw(
            st.sampled_from([HUGE[1], HUGE[0] * 2, b"\xff" * 8, bytes(8), b"r" + HUGE[0] + b"00N"])
        )
    tracemalloc.start()
    try:
        read_table(bytes(whole))
    except RecordingsError:
        pass
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < 2_000_000
