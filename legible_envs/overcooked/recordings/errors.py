"""What can go wrong with recordings, as one error that says what was expected, what came and where."""

from __future__ import annotations

__all__ = ["RecordingsError"]


class RecordingsError(RuntimeError):
    """The recorded games cannot be found, downloaded, trusted or read."""
