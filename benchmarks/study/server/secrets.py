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

__all__ = ["Secrets"]

_FILE: Final = "secret.json"
_BYTES: Final = 32


@dataclass(frozen=True, slots=True, repr=False)
class Secrets:
    """The secret of a study, and what is made from it.

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

    def _mac(self, *words: str) -> bytes:
        return hmac.new(self.key, json.dumps(words).encode(), hashlib.sha256).digest()

    def token(self, mode: str, participant: str) -> str:
        """What lets a browser act for a participant: 192 bits."""
        return _letters(self._mac("participant", mode, participant)[:24])

    @property
    def admin(self) -> str:
        """What lets a researcher watch."""
        return _letters(self._mac("admin")[:24])

    @property
    def debug(self) -> str:
        """What lets anybody join as a debug participant."""
        return _letters(self._mac("debug")[:12])

    def code(self, participant: str, ending: str) -> str:
        """The completion code of a participant: 50 bits as ``ABCDE-FGHIJ``."""
        text = base64.b32encode(self._mac("code", participant, ending)).decode()[:10]
        return f"{text[:5]}-{text[5:]}"

    def is_code(self, code: str, participant: str, ending: str) -> bool:
        """Whether a code is this participant's."""
        return hmac.compare_digest(code.strip().upper().encode(), self.code(participant, ending).encode())


def fingerprint(token: str) -> str:
    """What is stored of a token."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


def _letters(content: bytes) -> str:
    return base64.urlsafe_b64encode(content).decode().rstrip("=")
