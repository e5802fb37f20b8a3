"""Tokens and codes. They are made from one secret of the study, so that none has to be stored."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import hmac
import json
import os
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.study.errors import StudyError
from legible_envs.support.plain_data import parse_json

__all__ = ["DatabaseSecrets", "Secrets", "fingerprint"]

_FILE: Final = "secret.json"
_BYTES: Final = 32


@dataclass(frozen=True, slots=True, repr=False)
class Secrets:
    """The secret of a study, and what is made from it for researchers.

    Attributes:
        key: Of all HMACs.
    """

    key: bytes

    @classmethod
    def of(cls, folder: Path) -> Secrets:
        """Those of a study, in ``data/secret.json``; made when they are needed first, readable by their owner alone.

        Raises:
            StudyError: The file is damaged.
        """
        path = folder / "data" / _FILE
        path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "w") as stream:
                json.dump({"key": secrets.token_hex(_BYTES)}, stream)
                stream.flush()
                os.fsync(stream.fileno())
        try:
            key = bytes.fromhex(parse_json(path.read_text(encoding="ascii"))["key"])
        except (ValueError, KeyError, TypeError) as error:
            raise StudyError(
                f"{path} is damaged; without it codes cannot be verified. Restore it from a copy"
            ) from error
        if len(key) != _BYTES:
            raise StudyError(f"{path} is damaged: its key has {len(key)} bytes instead of {_BYTES}")
        return cls(key)

    @property
    def admin(self) -> str:
        """What lets a researcher watch."""
        return _letters(_mac(self.key, "admin")[:24])

    @property
    def debug(self) -> str:
        """What lets anybody join as a debug participant."""
        return _letters(_mac(self.key, "debug")[:12])

    def of_database(self, mode: str, created: str) -> DatabaseSecrets:
        """What is made for the participants of one database.

        Args:
            mode: ``"live"`` or ``"debug"``.
            created: When it was made, as its table ``study`` has it. Numbers of participants begin again in a new
                database; links and codes of the one before must not fit them.
        """
        return DatabaseSecrets(_mac(self.key, "database", mode, created))


@dataclass(frozen=True, slots=True, repr=False)
class DatabaseSecrets:
    """What is made for the participants of one database; see :meth:`Secrets.of_database`.

    Attributes:
        key: Of the HMACs of this database.
    """

    key: bytes

    def token(self, participant: str) -> str:
        """What lets a browser act for a participant: 192 bits."""
        return _letters(_mac(self.key, "participant", participant)[:24])

    def code(self, participant: str, ending: str) -> str:
        """The completion code of a participant: 50 bits as ``ABCDE-FGHIJ``."""
        text = base64.b32encode(_mac(self.key, "code", participant, ending)).decode()[:10]
        return f"{text[:5]}-{text[5:]}"

    def is_code(self, code: str, participant: str, ending: str) -> bool:
        """Whether a code is this participant's."""
        return hmac.compare_digest(code.strip().upper().encode(), self.code(participant, ending).encode())


def fingerprint(token: str) -> str:
    """What is stored of a token."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


def _mac(key: bytes, *words: str) -> bytes:
    return hmac.new(key, json.dumps(words).encode(), hashlib.sha256).digest()


def _letters(content: bytes) -> str:
    return base64.urlsafe_b64encode(content).decode().rstrip("=")
