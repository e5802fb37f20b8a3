"""Reading a pickled table without running anything that the pickle asks for.

A pickle is a program: it names functions and has them called. Here every admitted name stands for an inert record that
only remembers what it was given; every other name is refused. The table is rebuilt from those records, so that it
depends on neither the installed pandas nor numpy's pickling, and no object of either is ever constructed.

A pickle also says how much memory to take. So it is looked through before it is loaded (:mod:`.pickle_sizes`), and what
it makes its records and columns hold is bounded by its own size.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from legible_envs.datasets.overcooked_ai.games import RecordingsError
from legible_envs.datasets.overcooked_ai.pickle_sizes import check_sizes

__all__ = ["ADMITTED", "read_table"]

ADMITTED: Final = (
    ("pandas", "DataFrame"),
    ("pandas", "Index"),
    ("pandas", "RangeIndex"),
    ("pandas", "StringDtype"),
    ("pandas._libs.arrays", "__pyx_unpickle_NDArrayBacked"),
    ("pandas._libs.internals", "_unpickle_block"),
    ("pandas.arrays", "StringArray"),
    ("pandas.core.arrays.string_", "StringArray"),
    ("pandas.core.arrays.string_", "StringArrayNumpySemantics"),
    ("pandas.core.arrays.string_", "StringDtype"),
    ("pandas.core.frame", "DataFrame"),
    ("pandas.core.indexes.base", "Index"),
    ("pandas.core.indexes.base", "_new_Index"),
    ("pandas.core.indexes.numeric", "Int64Index"),
    ("pandas.core.indexes.range", "RangeIndex"),
    ("pandas.core.internals.managers", "BlockManager"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.numeric", "_frombuffer"),
    ("numpy.core.multiarray", "_reconstruct"),
    ("numpy.core.numeric", "_frombuffer"),
    ("builtins", "slice"),
    ("__builtin__", "slice"),
    ("_codecs", "encode"),
)
"""Every name that a table of text and numbers uses, in any pandas since 2019; each is a record, none is imported."""

_DTYPES: Final = {"b1": np.bool_, "i1": np.int8, "i4": np.int32, "i8": np.int64, "f4": np.float32, "f8": np.float64}
_BLOCKS: Final = "0.14.1"
_MOST_ARGUMENTS: Final = 16


class _Record:
    """Remembers its arguments and its state, and does nothing."""

    __slots__ = ("args", "state")
    args: tuple[Any, ...]
    state: Any

    def __new__(cls, *args: Any) -> _Record:
        if len(args) > _MOST_ARGUMENTS:  # the same long tuple, given to many records, would be copied for each
            raise RecordingsError(f"the pickle calls {cls.__name__} with {len(args)} arguments; no table does")
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
    """Columns of a pandas table, as pickled by any pandas since 2019.

    Args:
        data: The pickle.

    Returns:
        ``{column: (rows,) array}``; text columns hold Python strings (dtype object).

    Raises:
        RecordingsError: The pickle names anything outside ``ADMITTED``, asks for more memory than it can fill, or does
            not hold such a table.
    """
    try:
        check_sizes(data)
        names, blocks = _parts(_expect(_Reader(data).load(), "DataFrame"))
        columns: dict[str, npt.NDArray[Any]] = {}
        room = len(data)
        for values, places in blocks:
            array = np.atleast_2d(_array(values))
            room -= array.size
            if room < 0:  # every value takes a byte or more, so some are there many times
                raise ValueError("it repeats its columns")
            for row, position in zip(array, _places(places, len(array)), strict=True):
                columns[str(names[position])] = row
        if len(columns) != len(names):
            raise ValueError(f"{len(names)} column names, {len(columns)} columns")
        return columns
    except RecordingsError:
        raise
    except Exception as error:  # a hostile pickle can provoke any exception; none may escape as something else
        raise RecordingsError(
            f"expected a pickled table of recorded games, got something else ({type(error).__name__}: {_short(error)})"
        ) from error


def _parts(table: _Record) -> tuple[npt.NDArray[Any], Iterator[tuple[Any, Any]]]:
    """Names of the columns, and blocks of values with the places of their columns."""
    manager = _expect(table.state["_data"] if "_data" in table.state else table.state["_mgr"], "BlockManager")
    if manager.state is not None:  # until pandas 1.3
        axes, _, _, versions = manager.state
        blocks = ((block["values"], block["mgr_locs"]) for block in versions[_BLOCKS]["blocks"])
    else:
        found, axes = manager.args
        blocks = (_expect(block, "_unpickle_block").args[:2] for block in found)
    # An index is a call of _new_Index(class, {"data": array, "name": …}).
    return _array(_expect(axes[0], "_new_Index").args[1]["data"]), blocks


def _short(error: Exception) -> str:
    try:
        return str(error)[:200]
    except Exception:  # such as that of a text that nests too deep
        return "no message"


def _expect(record: Any, *names: str) -> _Record:
    if not isinstance(record, _Record) or type(record).__name__ not in names:
        raise ValueError(f"expected a {' or '.join(names)}, got {type(record).__name__}")
    return record


def _places(record: Any, count: int) -> list[int]:
    """Positions of a block's columns: an array, or a slice ``(start, stop, step)``."""
    if isinstance(record, _Record) and type(record).__name__ == "slice":
        start, stop, step = record.args
        places = range(start, stop, 1 if step is None else step)
    else:
        places = _array(record).tolist()
    if len(places) != count:
        raise ValueError(f"{count} columns at {len(places)} places")
    return [int(place) for place in places]


def _array(record: Any) -> npt.NDArray[Any]:
    """The array of a record of numpy's or pandas' ``__reduce__``."""
    name = type(record).__name__
    if name == "__pyx_unpickle_NDArrayBacked":  # text of pandas 3: state = (dtype, array[, attributes])
        return _array(next(part for part in _expect(record, name).state if type(part).__name__ == "_reconstruct"))
    if name == "_frombuffer":  # protocol 5: arguments = (buffer, dtype, shape, order)
        data, dtype, shape, order = _expect(record, name).args
        return np.frombuffer(data, dtype=_dtype(dtype)).reshape(shape, order="F" if order == "F" else "C")
    # state = (version, shape, dtype, Fortran order, data)
    _, shape, dtype, fortran, data = _expect(record, "_reconstruct").state
    if _expect(dtype, "dtype").args[0] == "O8":
        if not isinstance(data, list):
            raise ValueError(f"expected a list of values, got {type(data).__name__}")
        flat = np.empty(len(data), dtype=object)
        flat[:] = data
    else:
        flat = np.frombuffer(_bytes(data), dtype=_dtype(dtype))
    return flat.reshape(shape, order="F" if fortran else "C")


def _bytes(data: Any) -> bytes:
    """Bytes; before protocol 3 as a call of ``encode(text, "latin1")``."""
    if isinstance(data, _Record):
        text, encoding = _expect(data, "encode").args
        if encoding != "latin1":
            raise ValueError("bytes in another encoding than latin1")
        return bytes(text.encode("latin1"))
    if not isinstance(data, bytes):
        raise ValueError(f"expected bytes, got {type(data).__name__}")
    return data


def _dtype(record: Any) -> Any:
    dtype = _expect(record, "dtype")
    if dtype.state is not None and dtype.state[1] == ">":
        raise ValueError("big-endian numbers")
    return _DTYPES[dtype.args[0]]
