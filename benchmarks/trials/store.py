"""The files of an experiment: one per finished trial, one per failed one.

Each file carries the SHA-256 of its own content (schema 2), so that a changed bit never becomes a number in a table: a
damaged file counts as none, is named, set aside, and its trial is run again. Files of schema 1, of earlier versions,
have no digest; they are read after the same checks of their keys and values, and cannot be verified beyond them.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from pydantic import BeforeValidator

from benchmarks.trials.functions import TrialName
from legible_envs.support.digests import broken_seal, sealed, unsealed
from legible_envs.support.files import remove_leftovers, write_text
from legible_envs.support.models import FileModel, Real, Text, Whole, validated
from legible_envs.support.plain_data import MOST_CHARACTERS, parse_json
from legible_envs.support.text import decode_text
from legible_envs.support.validation import shown

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Rows", "Trial", "TrialStore", "plain"]

Trial = Mapping[str, Any]
Rows = list[dict[str, Any]]

SCHEMA: Final = 2
_UNSEALED: Final = 1
_LONGEST: Final = MOST_CHARACTERS // 2
"""Characters of the rows of one trial; a file with what is around them can then be read in any case."""


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
        self.damaged: dict[Path, str] = {}
        """Files that were met and could not be read, and why."""
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
            as_kept = json.loads(json.dumps(dict(trial), allow_nan=False))
            text = json.dumps([name, as_kept], sort_keys=True)
        except (TypeError, ValueError) as error:
            raise ValueError(f"a trial must hold plain JSON data ({error}); got {dict(trial)!r}") from error
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def load(self, trial: Trial) -> Rows | None:
        """The rows of a finished trial; None where it has to be run.

        A file that is damaged counts as none, and is noted in :attr:`damaged`.
        """
        for path in self._paths("cells", trial):
            found = self._read(path, _Finished)
            if found is not None:
                return [{key: math.nan if value is None else value for key, value in row.items()} for row in found.rows]
        return None

    def set_damaged_aside(self) -> list[str]:
        """Rename the damaged files met so far, so that they are in nobody's way; a line for each says what it was.

        ``NAME.json`` becomes ``NAME.json.damaged``, and replaces an earlier one of that name.
        """
        said = []
        for path, why in sorted(self.damaged.items()):
            aside = path.with_name(f"{path.name}.damaged")
            os.replace(path, aside)
            said.append(f"{path}: {why}; kept as {aside.name}")
        self.damaged.clear()
        return said

    def save(self, trial: Trial, rows: Rows, seconds: float, worker: str) -> None:
        """Keep the rows of a finished trial, and forget that it failed before."""
        content = {"schema": SCHEMA, "function": self.name.name, "cell": dict(trial), "rows": rows}
        self._write("cells", trial, content | {"seconds": round(seconds, 3), "worker": worker})
        self.forget_failure(trial)

    def forget_failure(self, trial: Trial) -> None:
        """Remove the traceback of a trial that failed before; no harm where it never did."""
        for path in self._paths("failed", trial):
            path.unlink(missing_ok=True)

    def save_failure(self, trial: Trial, traceback: str, attempts: int, worker: str) -> None:
        """Keep the traceback of a failed trial."""
        traceback = traceback.encode("utf-8", "backslashreplace").decode()  # names of files may be no Unicode
        content = {"schema": SCHEMA, "function": self.name.name, "cell": dict(trial), "attempts": attempts}
        self._write("failed", trial, content | {"worker": worker, "traceback": traceback})
        for path in list(self._paths("failed", trial))[1:]:
            path.unlink(missing_ok=True)

    def failures(self) -> list[dict[str, Any]]:
        """What is known of every trial that failed last time it was run; damaged files are noted and passed over."""
        paths = sorted((self.folder / "failed").glob("*.json"))
        found = (self._read(path, _Failed) for path in paths)
        return [{"schema": SCHEMA, **failure.model_dump()} for failure in found if failure is not None]

    def table(self, trials: Iterable[Trial]) -> pd.DataFrame:
        """Rows of those trials that are finished, in the order of ``trials``; each row begins with its trial."""
        import pandas as pd

        rows = [dict(_columns(trial)) | row for trial in trials for row in self.load(trial) or ()]
        self.warn_of_damaged()
        return pd.DataFrame(rows)

    def warn_of_damaged(self) -> None:
        """Warn that rows are missing where damaged files were met and not set aside."""
        if self.damaged:
            files = "; ".join(f"{path}: {why}" for path, why in sorted(self.damaged.items()))
            warnings.warn(f"results are missing, run the same again: {files}", stacklevel=3)

    def _paths(self, kind: str, trial: Trial) -> Iterator[Path]:
        """Where a trial's file may be: under the name of the function, then under its former ones."""
        for name in (self.name.name, *self.name.former):
            yield self.folder / kind / f"{self._key(name, trial)}.json"

    def _write(self, kind: str, trial: Trial, content: Mapping[str, Any]) -> None:
        path = next(self._paths(kind, trial))
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(sealed(content), indent=1, ensure_ascii=False, allow_nan=False)
        write_text(path, text)

    def _read(self, path: Path, model: type[_Kept]) -> Any:
        """What a file holds; None where there is none, or a damaged one."""
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            return None
        try:
            kept = _kept(data, model)
            if self._key(kept.function, kept.cell) != path.stem:
                raise ValueError("it holds another trial than its name says")
        except ValueError as error:
            self.damaged[path] = str(error)
            return None
        return kept


def _row_value(value: object) -> object:
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise ValueError(f"a value of `rows` must be a text, a number or null, got {shown(value)}")


Value = Annotated[Any, BeforeValidator(_row_value)]


class _Kept(FileModel):
    """What all kept files hold, but for ``schema`` and digest."""

    function: Annotated[str, Text(10_000)]
    cell: dict[str, Any]
    worker: Annotated[str, Text(10_000, empty=True)] = ""


class _Finished(_Kept):
    rows: list[dict[str, Value]]
    seconds: Annotated[float, Real(0)] = 0.0


class _Failed(_Kept):
    attempts: Annotated[int, Whole(1)]
    traceback: Annotated[str, Text(MOST_CHARACTERS, empty=True)]


def _kept(data: bytes, model: type[_Kept]) -> _Kept:
    """The content of a file, checked.

    Raises:
        ValueError: It is damaged, or of another version; says how.
    """
    content = parse_json(decode_text(data, "it", unify=False))
    if not isinstance(content, dict) or "schema" not in content:
        raise ValueError("it is no result of a trial: it lacks `schema`")
    schema = content["schema"]
    if isinstance(schema, bool) or schema not in (_UNSEALED, SCHEMA):
        raise ValueError(f"it has schema {shown(schema)}, this version reads schema {SCHEMA}")
    plain = unsealed(content) if schema == SCHEMA else content
    kept = validated(model, {key: value for key, value in plain.items() if key != "schema"}, "it")
    if schema == SCHEMA and (why := broken_seal(content)):
        raise ValueError(why)
    return kept


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
        ValueError: There is too much of it to be kept and read back: more than 8 million characters as JSON, or a whole
            number of more than 128 bits; or a text that is no Unicode.
    """
    rows = [result] if isinstance(result, Mapping) else result
    if not isinstance(rows, Sequence) or isinstance(rows, str) or not all(isinstance(row, Mapping) for row in rows):
        raise TypeError(
            f"a trial's function must return a mapping or a list of mappings, it returned {type(result).__name__}"
        )
    plain_rows = [{str(key): _plain_value(str(key), value) for key, value in row.items()} for row in rows]
    text = json.dumps(plain_rows, ensure_ascii=False)
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ValueError(f"a text of a result row is no Unicode ({error})") from error
    if len(text) > _LONGEST:
        raise ValueError(f"the result rows take {len(text):,} characters as JSON; at most {_LONGEST:,} are kept")
    return plain_rows


def _plain_value(key: str, value: Any) -> Any:
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, int) and value.bit_length() > 128:
        raise ValueError(f"column {key!r} of a result row holds a whole number of more than 128 bits")
    if value is None or isinstance(value, str | int | float):
        return value
    raise TypeError(f"column {key!r} of a result row holds a {type(value).__name__}; expected text, a number or None")
