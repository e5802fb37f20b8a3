"""The files of an experiment: one per finished cell, one per failed one."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from legible_envs.support.files import remove_leftovers, write_atomically

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Cell", "CellStore", "Rows", "plain"]

Cell = Mapping[str, Any]
Rows = list[dict[str, Any]]

SCHEMA: Final = 1


class CellStore:
    """Results of cells as JSON files in ``folder/cells`` and tracebacks in ``folder/failed``.

    A file is named after the content of its cell and the function that ran it: asking for the same cell again finds
    it, whatever else was run meanwhile.

    Args:
        folder: Folder of the experiment; made when something is written.
        function: ``module:name`` of the function.

    Raises:
        FileExistsError: ``folder`` is a file.
    """

    def __init__(self, folder: str | Path, function: str) -> None:
        self.folder = Path(folder)
        if self.folder.exists() and not self.folder.is_dir():
            raise FileExistsError(f"{self.folder} is a file; results need a folder")
        self.function = function
        for name in ("cells", "failed"):
            remove_leftovers(self.folder / name)

    def key(self, cell: Cell) -> str:
        """Sixteen hexadecimal digits that identify a cell.

        Raises:
            ValueError: The cell holds something JSON cannot, such as NaN or an array.
        """
        try:
            text = json.dumps([self.function, dict(cell)], sort_keys=True, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ValueError(f"a cell must hold plain JSON data ({error}); got {dict(cell)!r}") from error
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def load(self, cell: Cell) -> Rows | None:
        """The rows of a finished cell; None where it has to be run (a file that cannot be read counts as none)."""
        try:
            content = json.loads(self._path("cells", cell).read_text(encoding="utf-8"))
        except (FileNotFoundError, ValueError):
            return None
        if (
            not isinstance(content, dict)
            or content.get("schema") != SCHEMA
            or not isinstance(content.get("rows"), list)
        ):
            return None
        return [{key: math.nan if value is None else value for key, value in row.items()} for row in content["rows"]]

    def save(self, cell: Cell, rows: Rows, seconds: float, worker: str) -> None:
        """Keep the rows of a finished cell, and forget that it failed before."""
        content = {"schema": SCHEMA, "function": self.function, "cell": dict(cell), "rows": rows}
        self._write("cells", cell, content | {"seconds": round(seconds, 3), "worker": worker})
        self._path("failed", cell).unlink(missing_ok=True)

    def save_failure(self, cell: Cell, traceback: str, attempts: int, worker: str) -> None:
        """Keep the traceback of a failed cell."""
        content = {"schema": SCHEMA, "function": self.function, "cell": dict(cell), "attempts": attempts}
        self._write("failed", cell, content | {"worker": worker, "traceback": traceback})

    def failures(self) -> list[dict[str, Any]]:
        """What is known of every cell that failed last time it was run."""
        paths = sorted((self.folder / "failed").glob("*.json"))
        return [json.loads(path.read_text(encoding="utf-8")) for path in paths]

    def table(self, cells: Iterable[Cell]) -> pd.DataFrame:
        """Rows of those cells that are finished, in the order of ``cells``; each row begins with its cell."""
        import pandas as pd

        rows = [dict(_columns(cell)) | row for cell in cells for row in self.load(cell) or ()]
        return pd.DataFrame(rows)

    def _path(self, kind: str, cell: Cell) -> Path:
        return self.folder / kind / f"{self.key(cell)}.json"

    def _write(self, kind: str, cell: Cell, content: Mapping[str, Any]) -> None:
        path = self._path(kind, cell)
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
        write_atomically(path, lambda stream: stream.write(text.encode()))


def _columns(cell: Cell, prefix: str = "") -> Iterable[tuple[str, Any]]:
    """The settings of a cell as columns: mappings inside become ``outer.inner``, lists their text."""
    for key, value in cell.items():
        if isinstance(value, Mapping):
            yield from _columns(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", json.dumps(value) if isinstance(value, list | tuple) else value


def plain(result: Any) -> Rows:
    """What a cell's function returned, as rows of plain data; numbers that are not finite become None.

    Raises:
        TypeError: It is neither a mapping nor a sequence of mappings, or a value is no text, number, truth value or
            None.
    """
    rows = [result] if isinstance(result, Mapping) else result
    if not isinstance(rows, Sequence) or isinstance(rows, str) or not all(isinstance(row, Mapping) for row in rows):
        raise TypeError(
            f"a cell's function must return a mapping or a list of mappings, it returned {type(result).__name__}"
        )
    return [{str(key): _plain_value(str(key), value) for key, value in row.items()} for row in rows]


def _plain_value(key: str, value: Any) -> Any:
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(f"column {key!r} of a result row holds a {type(value).__name__}; expected text, a number or None")
