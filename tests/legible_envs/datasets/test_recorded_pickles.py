"""Pickles of recorded games are read without running anything in them."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legible_envs.datasets.overcooked_2019 import (
    RecordingsError,
)
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
    assert len(ADMITTED) == 23


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
