"""Messages that do nothing, and connections that are no more."""

from __future__ import annotations

from typing import Any

__all__ = ["Gone", "Refused"]


class Gone(Exception):
    """The other end of a connection is gone, or takes nothing any more."""


class Refused(Exception):
    """A message that did nothing; what is told to the page.

    Args:
        reason: Why.
        **more: Of the reply; ``fatal=True`` where the page cannot go on.
    """

    def __init__(self, reason: str, **more: Any) -> None:
        super().__init__(reason)
        self.reply = {"type": "refused", "reason": reason, **more}
