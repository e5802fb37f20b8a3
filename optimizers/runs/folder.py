"""The folder of a run: what a search leaves behind to look at, to report on and to continue from.

=============== ======================================================================================================
``config.json`` the manifest: versions, settings, seed, git revision, and the result once there is one
``metrics.csv`` one row per logged iteration (:data:`COLUMNS`)
``archive.npz`` the elites as plain arrays (:data:`optimizers.archives.FIELDS`)
``best.txt``    the best layout, drawn in characters; ``best.json`` instead where layouts have a ``to_json()``
``checkpoint/`` what :mod:`optimizers.runs.checkpoint` needs to continue
=============== ======================================================================================================

Every file is replaced in one step, so a run that is killed leaves whole files; ``metrics.csv`` alone is appended to.
The manifest is the first file that is written, and what makes a folder the folder of a run: whenever a search is
killed, its folder holds no run, one that has only begun (a manifest and no checkpoint), or one that can be continued.
The first file that an overwritten run loses is its manifest, so that it is there whole or not at all.

The manifest carries its own digest; that of a finished run also names those of archive and metrics
(:mod:`legible_envs.support.digests`).
"""

from __future__ import annotations

import csv
import io
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from legible_envs.support.digests import sealed
from legible_envs.support.files import is_leftover, remove_leftovers, write_text
from legible_envs.support.text import read_text
from optimizers.errors import CheckpointError, SearchError
from optimizers.runs.checkpoint import CheckpointFolder
from optimizers.runs.manifest import SCHEMA, manifest_from

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["COLUMNS", "RunFolder", "git_revision", "is_run_folder", "package_versions", "pickle_versions"]

COLUMNS = (
    "iteration",
    "phase",
    "evaluations",
    "seconds",
    "best",
    "qd_score",
    "coverage",
    "elites",
    "evaluations_per_second",
)
_MAY_BE_EMPTY = ("best",)
_COUNTS = ("iteration", "evaluations", "elites")
_REALS = tuple(name for name in COLUMNS if name not in (*_COUNTS, "phase"))


def is_run_folder(path: str | Path) -> bool:
    """Whether the path is a folder with the manifest of a search in it."""
    return (Path(path) / "config.json").is_file()


class RunFolder:
    """One run's folder.

    Args:
        path: The folder; created by :meth:`create`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checkpoints = path / "checkpoint"
        self.archive = path / "archive.npz"
        self.config = path / "config.json"
        self.metrics = path / "metrics.csv"
        self._best = path / "best.txt"
        self._best_json = path / "best.json"
        self._replaced = path / ".config.json.replaced"

    @property
    def holds_a_run(self) -> bool:
        """Whether something of a run lies there; what is left of one that was being overwritten does not count."""
        if self.config.exists():
            return True
        return not self._replaced.exists() and (self.archive.exists() or self._has_checkpoints)

    @property
    def has_only_begun(self) -> bool:
        """Whether the search there was stopped before its first checkpoint: nothing is known but its settings."""
        return self.config.exists() and not self.archive.exists() and not self._has_checkpoints

    def others(self) -> list[str]:
        """Names of what lies there and is no run, nor what is left of one that was killed or being overwritten."""
        if self.holds_a_run or self._replaced.exists() or not self.path.is_dir():
            return []
        return sorted(file.name for file in self.path.iterdir() if not is_leftover(file) and file != self.checkpoints)

    @property
    def has_saved(self) -> bool:
        """Whether the search there has saved layouts that :func:`optimizers.load_run` can read."""
        return is_run_folder(self.path) and self.archive.is_file()

    @property
    def _has_checkpoints(self) -> bool:
        return any(self.checkpoints.glob("*.checkpoint"))

    def create(self, *, overwrite: bool) -> None:
        """Make the folder ready for a new run.

        Raises:
            SearchError: It holds a run already and ``overwrite`` is False.
        """
        if self.holds_a_run and not overwrite:
            raise SearchError(
                f"{self.path} already holds a run: continue it with resume=True, choose another folder, or pass "
                "overwrite=True to replace it"
            )
        self.discard()
        self.path.mkdir(parents=True, exist_ok=True)
        remove_leftovers(self.path)

    def discard(self) -> None:
        """Remove the run that lies there, or what is left of one whose removal was interrupted.

        The manifest gets another name first, in one step: before it the run is whole, from then on it is none.
        """
        if not (self.holds_a_run or self._replaced.exists()):
            return
        if self.config.exists():
            os.replace(self.config, self._replaced)
        elif not self._replaced.exists():
            write_text(self._replaced, "")
        for file in (self.metrics, self.archive, self._best, self._best_json, *self.checkpoints.glob("*.checkpoint")):
            file.unlink(missing_ok=True)
        self._replaced.unlink(missing_ok=True)

    def settings(self) -> dict[str, Any]:
        """Settings of the search that lies there: of its manifest, or of its newest checkpoint where that is lost.

        Keys are those of the manifest: ``workspace``, ``objective``, ``emitter``, ``seed``, ...

        Raises:
            SearchError: Neither can be read.
        """
        try:
            return self.read_config()
        except SearchError as error:
            try:
                found = CheckpointFolder(self.checkpoints, {}).settings()
            except CheckpointError:
                found = None
            if found is None:
                raise error from None
            return found

    def read_config(self) -> dict[str, Any]:
        """The manifest, without its own digest.

        Raises:
            SearchError: There is none, it is damaged, or this version does not read it; names file and key.
        """
        try:
            text = read_text(self.config)
        except FileNotFoundError as error:
            raise SearchError(f"{self.path} is not the folder of a search: it has no config.json") from error
        except ValueError as error:
            raise SearchError(str(error)) from error
        return manifest_from(text, str(self.config))

    def write_config(self, config: Mapping[str, Any]) -> None:
        """Write the manifest, with its digest."""
        text = json.dumps(sealed({"schema": SCHEMA} | dict(config) | {"schema": SCHEMA}), indent=2) + "\n"
        write_text(self.config, text)

    def write_best(self, layout: object) -> None:
        """Write the best layout: as JSON where it can say itself so, else as its drawing."""
        as_json = getattr(layout, "to_json", None)
        text = (str(layout) if as_json is None else as_json()).rstrip("\n") + "\n"
        path = self._best if as_json is None else self._best_json
        write_text(path, text)

    def rewrite_metrics(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Write ``metrics.csv`` with exactly these rows."""
        text = ",".join(COLUMNS) + "\n" + _as_csv(rows)
        write_text(self.metrics, text)

    def append_metrics(self, row: Mapping[str, Any]) -> None:
        """Add one row to ``metrics.csv``."""
        with self.metrics.open("a", encoding="utf-8", newline="") as stream:
            stream.write(_as_csv([row]))

    def read_metrics(self) -> pd.DataFrame:
        """All whole rows of ``metrics.csv`` (:data:`COLUMNS`), numbers as they were written; NaN where one is empty.

        A killed process may leave the last line cut off; everything before it counts. No file is no rows.

        Raises:
            SearchError: The file is not a table of these columns.
        """
        import pandas as pd

        try:
            text = self.metrics.read_text(encoding="utf-8")
            whole_lines = text[: text.rfind("\n") + 1]
            table = pd.read_csv(io.StringIO(whole_lines), dtype=str, keep_default_na=False)
            missing = [name for name in COLUMNS if name not in table]
            if missing:
                raise SearchError(f"{self.metrics} is damaged: it lacks the columns {missing}")
            # An absent field reads as an empty one.
            needed = table[[name for name in COLUMNS if name not in _MAY_BE_EMPTY]]
            whole = table.loc[(needed != "").all(axis=1), list(COLUMNS)]
            return whole.assign(
                **{name: [int(text) for text in whole[name]] for name in _COUNTS},
                **{name: [float(text or "nan") for text in whole[name]] for name in _REALS},
            )
        except (FileNotFoundError, pd.errors.EmptyDataError):
            return pd.DataFrame(columns=list(COLUMNS))
        except ValueError as error:
            raise SearchError(f"{self.metrics} is damaged: {error}") from error


def package_versions() -> dict[str, str]:
    """Versions of what a run's numbers come from."""
    packages = ("legible-envs", "ribs", "numpy", "numba", "gymnasium")
    return {"python": platform.python_version(), **{package: _version(package) for package in packages}}


@cache
def _version(package: str) -> str:
    """Looked up once per process: it takes 9 ms, and every checkpoint names the versions."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def pickle_versions() -> dict[str, str]:
    """Versions within which a checkpoint is good."""
    found = package_versions()
    return {
        "python": ".".join(found["python"].split(".")[:2]),
        "numpy": ".".join(found["numpy"].split(".")[:2]),
        **{name: found[name] for name in ("ribs", "legible-envs")},
    }


@cache
def git_revision() -> str | None:
    """Revision of the checkout this package runs from, ``-dirty`` if changed; None outside a checkout.

    Looked up once per process: it is the code as it was loaded that matters.
    """
    here = Path(__file__)

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(here.parent), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=5, check=True).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", here.name)
        return git("describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")
    except (OSError, subprocess.SubprocessError):
        return None


def platform_name() -> str:
    """System, machine and Python implementation."""
    return f"{platform.system()} {platform.machine()}, {sys.implementation.name}"


def _as_csv(rows: Iterable[Mapping[str, Any]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for row in rows:
        writer.writerow(["" if row[name] is None else row[name] for name in COLUMNS])
    return stream.getvalue()
