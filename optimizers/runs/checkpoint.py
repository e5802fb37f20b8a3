"""Checkpoints: the whole state of a search in one file, so that a killed run continues to the identical archive.

A checkpoint is a line of JSON (settings, versions, and the digest of all) followed by a pickle. Digest, versions and
settings are checked *before* anything is unpickled. The pickle is for continuing a run on the machine that began it:
unpickling runs code, so continue only runs whose folder you trust. What a run publishes (``archive.npz``,
``config.json``) has none.

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

from legible_envs.support.digests import SEAL, digest_of_json
from legible_envs.support.files import remove_leftovers, write_atomically
from legible_envs.support.validation import shown
from optimizers.errors import CheckpointError

__all__ = ["SCHEMA", "CheckpointFolder", "Header", "refuse_other_settings"]

SCHEMA = 2
_UNSEALED_HEADER = 1
"""The format before: its digest is of the pickle alone. It is still read."""
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

    def check(self, state: Any) -> None:
        """Make sure that a state can be saved, before anything is written.

        Raises:
            CheckpointError: It does not pickle.
        """
        self._pickled(state)

    def save(self, header: Header, state: Any) -> None:
        """Write a checkpoint, then drop all but the newest two.

        Raises:
            CheckpointError: The state does not pickle.
            OSError: The file could not be written; earlier checkpoints are intact.
        """
        payload = self._pickled(state)
        fields = {
            "schema": SCHEMA,
            "settings": header.settings,
            "versions": header.versions,
            "iteration": header.iteration,
            "bytes": len(payload),
        }
        line = json.dumps({**fields, SEAL: _digest(fields, payload)}).encode()

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
                "resume (resume='auto' does whichever is possible; what is left of a search there is only replaced "
                "with overwrite=True)."
            )
        path, header, payload, damage = self._newest()
        _refuse_other_versions(path, header.versions, versions)
        refuse_other_settings(path.parent.parent, header.settings, settings)
        if damage:
            warnings.warn(f"damaged checkpoint passed over ({'; '.join(damage)}); resuming from {path.name}")
        return self._unpickled(path, payload)

    def settings(self) -> dict[str, Any] | None:
        """Settings of the search that the newest whole checkpoint is of; None where there is no checkpoint.

        Raises:
            CheckpointError: All are damaged.
        """
        return self._newest()[1].settings if self else None

    def _newest(self) -> tuple[Path, Header, bytes, list[str]]:
        """The newest checkpoint that is whole, and what is wrong with newer ones."""
        damage: list[str] = []
        for path in reversed(self._files()):
            try:
                return path, *_read(path), damage
            except _OtherFormat as error:
                damage.append(str(error))
            except _Damaged as error:
                damage.append(f"{path.name}: {error}")
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


class _OtherFormat(_Damaged):
    """A checkpoint file says that it has a format that is not known here."""


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
        schema, size, digest = fields["schema"], fields["bytes"], fields.pop(SEAL)
        header = Header(dict(fields["settings"]), dict(fields["versions"]), fields["iteration"])
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise _Damaged("unreadable header") from error
    if schema not in (SCHEMA, _UNSEALED_HEADER):
        raise _OtherFormat(
            f"{path} has checkpoint format {shown(schema)}, this version reads {SCHEMA}: resume with the version of "
            f"legible-envs that wrote it ({header.versions.get('legible-envs', 'unknown')}), or start anew"
        )
    if len(payload) != size:
        raise _Damaged(f"truncated or changed ({len(payload)} of {size} bytes)")
    if digest != (_digest(fields, payload) if schema == SCHEMA else hashlib.sha256(payload).hexdigest()):
        raise _Damaged("changed since it was written: it does not fit its digest")
    return header, payload


def _digest(fields: Mapping[str, Any], payload: bytes) -> str:
    """Of a whole checkpoint: what its header says, and the pickle."""
    return hashlib.sha256(digest_of_json(fields).encode("ascii") + payload).hexdigest()


def _refuse_other_versions(path: Path, theirs: Mapping[str, str], ours: Mapping[str, str]) -> None:
    for package, version in ours.items():
        if theirs.get(package) != version:
            raise CheckpointError(
                f"{path} was written with {package} {theirs.get(package)}, this is {package} {version}, and a "
                f"checkpoint is only good within a version: install {package}=={theirs.get(package)} to resume, or "
                "start anew in another folder. The archive found so far (archive.npz) can be read with any version."
            )


def refuse_other_settings(folder: Path, theirs: Mapping[str, Any], ours: Mapping[str, Any]) -> None:
    """Refuse to continue a search with settings that are not its own; only evaluations may have grown.

    Args:
        folder: Of the run.
        theirs: Settings of the search that lies there.
        ours: Settings of the search that wants to continue it.

    Raises:
        CheckpointError: They differ; the message names the first setting that does, before and now.
    """
    for name in sorted({*theirs, *ours}):
        before, now = theirs.get(name), ours.get(name)
        grown = name == "evaluations" and isinstance(before, int) and isinstance(now, int) and now > before
        if before != now and not grown:
            where, before, now = _first_difference(name, before, now)
            raise CheckpointError(
                f"cannot resume {folder}: {where} was {before!r}, now it is {now!r}. Resume with the same "
                "settings (only evaluations may grow), or start anew in another folder."
            )


def _first_difference(name: str, before: Any, now: Any) -> tuple[str, Any, Any]:
    """Follow nested dicts down to the entry that differs."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted({*before, *now}):
            if before.get(key) != now.get(key):
                return _first_difference(f"{name}.{key}", before.get(key), now.get(key))
    return name, before, now
