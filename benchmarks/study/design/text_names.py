"""The texts of a study: which there are, what each is for, and which of them a design needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from benchmarks.study.design.models import StudyContent

__all__ = ["TEXTS", "known_texts", "needed_texts"]

TEXTS: Final[Mapping[str, str]] = {
    "welcome": "the first page, above the check of the device",
    "consent": "what participants agree to",
    "instructions": "how the game is played",
    "practice": "before the practice",
    "round": "before each round",
    "pause": "between two sittings",
    "complete": "the end of those who have done everything",
    "refused": "the end of those who do not agree to take part",
    "device_failed": "the end of those whose device does not suit",
    "practice_failed": "the end of those who did not finish the practice",
    "timed_out": "the end of those who were away for too long",
    "blocked": "the end of those who reloaded, where the study does not allow it",
    "expired": "the end of those who came back too late",
    "withdrawn": "the end of those who leave the study",
    "closed": "for those who come while nobody is wanted",
    "already": "for workers who took part before",
    "preview": "for workers who look at the study before they accept it",
}
"""What each text is for; its file is ``NAME.md`` in the folder of texts."""

_WITH_PRACTICE: Final = ("practice", "practice_failed")
_WITH_SITTINGS: Final = ("pause",)


def known_texts() -> tuple[str, ...]:
    """Names of all texts."""
    return tuple(TEXTS)


def needed_texts(content: StudyContent) -> tuple[str, ...]:
    """Names of the texts that a design shows: those about practice and sittings only where there are some."""
    without = (() if content.practice is not None else _WITH_PRACTICE) + (
        () if len(content.sittings) > 1 else _WITH_SITTINGS
    )
    return tuple(name for name in TEXTS if name not in without)
