"""The files of an experiment: one per finished trial, one per failed one."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.trials.functions import TrialName
from legible_envs.support.files import remove_leftovers, write_text

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Rows", "Trial", "TrialStore", "plain"]

Trial = Mapping[str, Any]
Rows = list[dict[str, Any]]

SCHEMA: Final = 1


class TrialStore:
    """Results of trials as JSON files in ``folder/cells`` and tracebacks in ``folder/failed``.

    A file is named after the content of its trial and the name of the function that ran it: asking for the same trial
    again finds it, whatever else was run meanwhile. Results under a former name of the function are found, too.

    Args:
        folder: Folder of the experiment; made when something is written.
        name: Of the function.

    Raises:
        FileExistsError: ``folder`` is a file.
    """

    def __init__(self, folder: str | Path, name: TrialName) -> None:
        self.folder = Path(folder)
        if self.folder.exists() and not self.folder.is_dir():
            raise FileExistsError(f"{self.folder} is a file; results need a folder")
        self.name = name
        for kind in ("cells", "failed"):
            remove_leftovers(self.folder / kind)

    def key(self, trial: Trial) -> str:
        """Sixteen hexadecimal digits that identify a trial.

        Raises:
            ValueError: The trial holds something JSON cannot, such as NaN or an array.
        """
        return self._key(self.name.name, trial)

    @staticmethod
    def _key(name: str, trial: Trial) -> str:
        try:
            text = json.dumps([name, dict(trial)], sort_keys=True, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ValueError(f"a trial must hold plain JSON data ({error}); got {dict(trial)!r}") from error
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def load(self, trial: Trial) -> Rows | None:
        """The rows of a finished trial; None where it has to be run (a file that cannot be read counts as none)."""
        rows = next((rows for path in self._paths("cells", trial) if (rows := _read(path)) is not None), None)
        if rows is None:
            return None
        return [{key: math.nan if value is None else value for key, value in row.items()} for row in rows]

    def save(self, trial: Trial, rows: Rows, seconds: float, worker: str) -> None:
        """Keep the rows of a finished trial, and forget that it failed before."""
        content = {"schema": SCHEMA, "function": self.name.name, "cell": dict(trial), "rows": rows}
        self._write("cells", trial, content | {"seconds": round(seconds, 3), "worker": worker})
        for path in self._paths("failed", trial):
            path.unlink(missing_ok=True)

    def save_failure(self, trial: Trial, traceback: str, attempts: int, worker: str) -> None:
        """Keep the traceback of a failed trial."""
        content = {"schema": SCHEMA, "function": self.name.name, "cell": dict(trial), "attempts": attempts}
        self._write("failed", trial, content | {"worker": worker, "traceback": traceback})
        for path in list(self._paths("failed", trial))[1:]:
            path.unlink(missing_ok=True)

    def failures(self) -> list[dict[str, Any]]:
        """What is known of every trial that failed last time it was run."""
        paths = sorted((self.folder / "failed").glob("*.json"))
        return [json.loads(path.read_text(encoding="utf-8")) for path in paths]

    def table(self, trials: Iterable[Trial]) -> pd.DataFrame:
        """Rows of those trials that are finished, in the order of ``trials``; each row begins with its trial."""
        import pandas as pd

        rows = [dict(_columns(trial)) | row for trial in trials for row in self.load(trial) or ()]
        return pd.DataFrame(rows)

    def _paths(self, kind: str, trial: Trial) -> Iterator[Path]:
        """Where a trial's file may be: under the name of the function, then under its former ones."""
        for name in (self.name.name, *self.name.former):
            yield self.folder / kind / f"{self._key(name, trial)}.json"

    def _write(self, kind: str, trial: Trial, content: Mapping[str, Any]) -> None:
        path = next(self._paths(kind, trial))
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
        write_text(path, text)


def _read(path: Path) -> Rows | None:
    """The rows in a file; None where there is none, or one that is damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA or not isinstance(content.get("rows"), list):
        return None
    return content["rows"]


def _columns(trial: Trial, prefix: str = "") -> Iterable[tuple[str, Any]]:
    """The settings of a trial as columns: mappings inside become ``outer.inner``, lists their text."""
    for key, value in trial.items():
        if isinstance(value, Mapping):
            yield from _columns(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", json.dumps(value) if isinstance(value, list | tuple) else value


def plain(result: Any) -> Rows:
    """What a trial's function returned, as rows of plain data; numbers that are not finite become None.

    Raises:
        TypeError: It is neither a mapping nor a sequence of mappings, or a value is no text, number, truth value or
            None.
    """
    rows = [result] if isinstance(result, Mapping) else result
    if not isinstance(rows, Sequence) or isinstance(rows, str) or not all(isinstance(row, Mapping) for row in rows):
        raise TypeError(
            f"a trial's function must return a mapping or a list of mappings, it returned {type(result).__name__}"
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
