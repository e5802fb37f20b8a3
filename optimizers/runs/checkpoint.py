"""Checkpoints: the whole state of a search in one file, so that a killed run continues to the identical archive.

A checkpoint is a line of JSON (settings, versions, digest) followed by a pickle. Settings, versions and digest are
checked *before* anything is unpickled. The pickle is for continuing a run on the machine that began it: unpickling runs
code, so continue only runs whose folder you trust. What a run publishes (``archive.npz``, ``config.json``) has none.

The workspace and the objective are not stored: they are given again on resuming, and settings that differ are refused.
"""

from __future__ import annotations

import hashlib
import io
import json
import pickle
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from legible_envs.support.files import remove_leftovers, write_atomically
from optimizers.errors import CheckpointError

__all__ = ["SCHEMA", "CheckpointFolder", "Header"]

SCHEMA = 1
_MAGIC = b"legible-envs checkpoint\n"
_KEEP = 2


@dataclass(frozen=True)
class Header:
    """What a checkpoint says of itself.

    Attributes:
        settings: Everything the result depends on; a search with other settings may not continue from here.
        versions: Packages whose pickles are only good within a version.
        iteration: Iterations completed.
    """

    settings: dict[str, Any]
    versions: dict[str, str]
    iteration: int


class CheckpointFolder:
    """The newest two checkpoints of a run.

    Args:
        folder: Where they lie; created on the first :meth:`save`.
        shared: Objects that are referred to by name instead of being stored, ``{name: object}``.
    """

    def __init__(self, folder: Path, shared: Mapping[str, Any]) -> None:
        self.folder = folder
        self._shared = dict(shared)

    def __bool__(self) -> bool:
        return bool(self._files())

    def save(self, header: Header, state: Any) -> None:
        """Write a checkpoint, then drop all but the newest two.

        Raises:
            CheckpointError: The state does not pickle.
            OSError: The file could not be written; earlier checkpoints are intact.
        """
        payload = self._pickled(state)
        line = json.dumps(
            {
                "schema": SCHEMA,
                "settings": header.settings,
                "versions": header.versions,
                "iteration": header.iteration,
                "bytes": len(payload),
                "sha256": hashlib.sha256(payload).hexdigest(),
            }
        ).encode()

        def write(stream: BinaryIO) -> None:
            stream.write(_MAGIC + line + b"\n")
            stream.write(payload)

        self.folder.mkdir(parents=True, exist_ok=True)
        remove_leftovers(self.folder)
        write_atomically(self.folder / f"{header.iteration:012d}.checkpoint", write)
        for old in self._files()[:-_KEEP]:
            old.unlink(missing_ok=True)

    def load(self, settings: Mapping[str, Any], versions: Mapping[str, str]) -> Any:
        """Read the newest checkpoint that is whole.

        Args:
            settings: Settings of the search that wants to continue.
            versions: Versions of the running packages.

        Returns:
            The state that was saved.

        Raises:
            CheckpointError: There is none, all are damaged, or settings or versions differ.
        """
        files = self._files()
        if not files:
            raise CheckpointError(
                f"nothing to resume: no checkpoint in {self.folder}. Check the folder, or start the search without "
                "resume (resume='auto' does whichever is possible)."
            )
        damage = []
        for path in reversed(files):
            try:
                header, payload = _read(path)
            except _Damaged as error:
                damage.append(f"{path.name}: {error}")
                continue
            _refuse_other_versions(path, header.versions, versions)
            _refuse_other_settings(path, header.settings, settings)
            if damage:
                warnings.warn(f"damaged checkpoint passed over ({'; '.join(damage)}); resuming from {path.name}")
            return self._unpickled(path, payload)
        raise CheckpointError(
            f"no checkpoint in {self.folder} can be read ({'; '.join(damage)}). What the run had found by then is in "
            "archive.npz beside it; to search again, use another folder or overwrite=True."
        )

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob("*.checkpoint")) if self.folder.is_dir() else []

    def _pickled(self, state: Any) -> bytes:
        names = {id(shared): name for name, shared in self._shared.items()}

        class Pickler(pickle.Pickler):
            def persistent_id(self, value: Any) -> str | None:
                return names.get(id(value))

        stream = io.BytesIO()
        try:
            Pickler(stream, protocol=5).dump(state)
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            raise CheckpointError(
                f"the search cannot be checkpointed, part of its emitter does not pickle: {error}. "
                "Use picklable attributes (no lambdas, open files, local classes), or search without checkpoint=."
            ) from error
        return stream.getvalue()

    def _unpickled(self, path: Path, payload: bytes) -> Any:
        shared = self._shared

        class Unpickler(pickle.Unpickler):
            def persistent_load(self, name: str) -> Any:
                return shared[name]

        try:
            return Unpickler(io.BytesIO(payload)).load()
        except Exception as error:  # whatever a pickle of other code may raise
            raise CheckpointError(
                f"{path} is whole but cannot be restored ({type(error).__name__}: {error}). It was probably written by "
                "other code: restore the emitter's code as it was, or start anew in another folder."
            ) from error


class _Damaged(Exception):
    """A checkpoint file is damaged."""


def _read(path: Path) -> tuple[Header, bytes]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise _Damaged(str(error)) from error
    if not content.startswith(_MAGIC):
        raise _Damaged("not a checkpoint")
    line, _, payload = content[len(_MAGIC) :].partition(b"\n")
    try:
        fields = json.loads(line)
        schema, size, digest = fields["schema"], fields["bytes"], fields["sha256"]
        header = Header(fields["settings"], fields["versions"], fields["iteration"])
    except (ValueError, KeyError, TypeError) as error:
        raise _Damaged("unreadable header") from error
    if schema != SCHEMA:
        raise CheckpointError(
            f"{path} has checkpoint format {schema}, this version reads {SCHEMA}: resume with the version of "
            f"legible-envs that wrote it ({header.versions.get('legible-envs', 'unknown')}), or start anew."
        )
    if len(payload) != size or hashlib.sha256(payload).hexdigest() != digest:
        raise _Damaged(f"truncated or changed ({len(payload)} of {size} bytes)")
    return header, payload


def _refuse_other_versions(path: Path, theirs: Mapping[str, str], ours: Mapping[str, str]) -> None:
    for package, version in ours.items():
        if theirs.get(package) != version:
            raise CheckpointError(
                f"{path} was written with {package} {theirs.get(package)}, this is {package} {version}, and a "
                f"checkpoint is only good within a version: install {package}=={theirs.get(package)} to resume, or "
                "start anew in another folder. The archive found so far (archive.npz) can be read with any version."
            )


def _refuse_other_settings(path: Path, theirs: Mapping[str, Any], ours: Mapping[str, Any]) -> None:
    for name in sorted({*theirs, *ours}):
        before, now = theirs.get(name), ours.get(name)
        grown = name == "evaluations" and isinstance(before, int) and isinstance(now, int) and now > before
        if before != now and not grown:
            where, before, now = _first_difference(name, before, now)
            raise CheckpointError(
                f"cannot resume {path.parent.parent}: {where} was {before!r}, now it is {now!r}. Resume with the same "
                "settings (only evaluations may grow), or start anew in another folder."
            )


def _first_difference(name: str, before: Any, now: Any) -> tuple[str, Any, Any]:
    """Follow nested dicts down to the entry that differs."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted({*before, *now}):
            if before.get(key) != now.get(key):
                return _first_difference(f"{name}.{key}", before.get(key), now.get(key))
    return name, before, now
