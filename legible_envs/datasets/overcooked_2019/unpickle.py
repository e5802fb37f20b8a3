"""Reading a pickled table without running anything that the pickle asks for.

A pickle is a program: it names functions and has them called. Here every admitted name stands for an inert record that
only remembers what it was given; every other name is refused. The table is rebuilt from those records, so that it
depends on neither the installed pandas nor numpy's pickling, and no object of either is ever constructed.
"""

from __future__ import annotations

import io
import pickle
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_2019.games import RecordingsError

__all__ = ["ADMITTED", "read_table"]

ADMITTED: Final = (
    ("pandas.core.frame", "DataFrame"),
    ("pandas.core.internals.managers", "BlockManager"),
    ("pandas.core.indexes.base", "_new_Index"),
    ("pandas.core.indexes.base", "Index"),
    ("pandas.core.indexes.numeric", "Int64Index"),
    ("numpy.core.multiarray", "_reconstruct"),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
)
"""Every name a table of the 2019 recordings uses; each becomes a record, none is imported."""

_DTYPES: Final = {"b1": np.bool_, "i8": np.int64, "f8": np.float64}
_BLOCKS: Final = "0.14.1"


class _Record:
    """Remembers its arguments and its state, and does nothing."""

    __slots__ = ("args", "state")
    args: tuple[Any, ...]
    state: Any

    def __new__(cls, *args: Any) -> _Record:
        record = super().__new__(cls)
        record.args = args
        record.state = None
        return record

    def __init__(self, *args: Any) -> None:
        pass

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Reader(pickle.Unpickler):
    def __init__(self, data: bytes) -> None:
        super().__init__(io.BytesIO(data))
        # Fresh classes for every load: whatever a pickle does to them ends with it.
        self._records = {name: type(name[1], (_Record,), {"__slots__": ()}) for name in ADMITTED}

    def find_class(self, module: str, name: str) -> Any:
        try:
            return self._records[module, name]
        except KeyError:
            raise RecordingsError(
                f"the pickle asks for {module}.{name}, which a table of recorded games has no use for; nothing was run"
            ) from None


def read_table(data: bytes) -> dict[str, npt.NDArray[Any]]:
    """Columns of a pandas table, as pickled by the pandas of 2019.

    Args:
        data: The pickle.

    Returns:
        ``{column: (rows,) array}``; text columns hold Python strings (dtype object).

    Raises:
        RecordingsError: The pickle names anything outside ``ADMITTED``, or does not hold such a table.
    """
    try:
        table = _Reader(data).load()
        manager = _expect(table, "DataFrame").state["_data"]
        axes, _, _, versions = _expect(manager, "BlockManager").state
        # An index is a call of _new_Index(class, {"data": array, "name": …}).
        names = _array(_expect(axes[0], "_new_Index").args[1]["data"])
        columns: dict[str, npt.NDArray[Any]] = {}
        for block in versions[_BLOCKS]["blocks"]:
            values = _array(block["values"])
            for row, position in enumerate(_array(block["mgr_locs"])):
                columns[str(names[position])] = values[row]
        if len(columns) != len(names):
            raise ValueError(f"{len(names)} column names, {len(columns)} columns")
        return columns
    except RecordingsError:
        raise
    except Exception as error:  # a hostile pickle can provoke any exception; none may escape as something else
        raise RecordingsError(
            f"expected a pickled table of recorded games, got something else ({type(error).__name__}: {error})"
        ) from error


def _expect(record: Any, name: str) -> _Record:
    if not isinstance(record, _Record) or type(record).__name__ != name:
        raise ValueError(f"expected a {name}, got {type(record).__name__}")
    return record


def _array(record: Any) -> npt.NDArray[Any]:
    """The array of a record of numpy's ``__reduce__``: state = (version, shape, dtype, Fortran order, data)."""
    _, shape, dtype, fortran, data = _expect(record, "_reconstruct").state
    kind = _expect(dtype, "dtype").args[0]
    if kind == "O8":
        flat = np.empty(len(data), dtype=object)
        flat[:] = data
    else:
        if dtype.state[1] == ">":
            raise ValueError("big-endian numbers")
        flat = np.frombuffer(data, dtype=_DTYPES[kind])
    return flat.reshape(shape, order="F" if fortran else "C")
