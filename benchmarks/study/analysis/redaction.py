"""What no export may hold: ids of workers, tokens of participants, completion codes."""

from __future__ import annotations

import hashlib
import re
import sqlite3
from collections.abc import Iterable
from typing import Any, Final

from benchmarks.study.design.study import Study

__all__ = ["REMOVED", "Redaction"]

REMOVED: Final = "[removed]"
_SHORTEST: Final = 4
"""Characters of an id that is looked for: a shorter one would be found in everything."""
_WORDS: Final = re.compile(r"[A-Za-z0-9_\-.~]{12,}")


class Redaction:
    """Takes what identifies people out of texts: participants may type their id anywhere, pages report addresses.

    Args:
        names: Texts to take out wherever they stand.
        token_hashes: SHA-256, in hexadecimal, of tokens; a word with such a hash is taken out.
    """

    def __init__(self, names: Iterable[str], token_hashes: Iterable[str] = ()) -> None:
        known = sorted({name for name in names if len(name) >= _SHORTEST}, key=len, reverse=True)
        self._names = re.compile("|".join(map(re.escape, known))) if known else None
        self._hashes = frozenset(token_hashes)

    @classmethod
    def of(cls, study: Study, connection: sqlite3.Connection) -> Redaction:
        """For everybody in a database."""
        names = [
            str(value)
            for row in connection.execute("SELECT worker, session, study FROM workers")
            for value in row
            if value
        ]
        hashes = [str(row[0]) for row in connection.execute("SELECT token_sha256 FROM participants")]
        return cls([*names, *_codes(study)], hashes)

    def __call__(self, value: Any) -> Any:
        """A text, or a list or mapping of them, without; other values as they are."""
        if isinstance(value, str):
            return self._text(value)
        if isinstance(value, list):
            return [self(each) for each in value]
        if isinstance(value, dict):
            return {self(key): self(each) for key, each in value.items()}
        return value

    def _text(self, text: str) -> str:
        if self._names is not None:
            text = self._names.sub(REMOVED, text)
        if self._hashes:
            text = _WORDS.sub(self._word, text)
        return text

    def _word(self, found: re.Match[str]) -> str:
        word = found.group()
        for part in (word, word.rstrip(".-~")):
            if hashlib.sha256(part.encode()).hexdigest() in self._hashes:
                return REMOVED
        return word


def _codes(study: Study) -> list[str]:
    """The completion codes and address that the study's file names."""
    recruitment = study.content.recruitment
    return [*recruitment.codes.values(), *([recruitment.completion_url] if recruitment.completion_url else [])]
