"""What all sessions of a server share: the study, its database, its secret, the time."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from benchmarks.study.store import Store

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study
    from benchmarks.study.server.secrets import DatabaseSecrets

__all__ = ["Context", "Pace"]


@dataclass(frozen=True, slots=True)
class Pace:
    """How much a connection may ask for.

    Attributes:
        messages: A second, in the long run.
        burst: At once.
        events: Of a page's own events and of refusals, a second in the long run; more are not kept.
        event_burst: Of these at once.
        connects: Of a participant, a second in the long run; 20 at once.
        speed: How much faster than real time the pointer's clock may go (bots play faster than people).
        joins: New participants a second, from everywhere.
        connections: Open at a time, of everybody together.
    """

    messages: float = 60.0
    burst: float = 240.0
    events: float = 2.0
    event_burst: float = 60.0
    connects: float = 0.5
    speed: float = 1.05
    joins: float = 20.0
    connections: int = 2000


@dataclass
class Context:
    """See the module.

    Attributes:
        study: The design.
        store: The database.
        secrets: Of the database.
        now: Seconds since 1970.
        pace: Limits of connections.
    """

    study: Study
    store: Store
    secrets: DatabaseSecrets
    now: Callable[[], float] = time.time
    pace: Pace = field(default_factory=Pace)

    def __post_init__(self) -> None:
        last = self.store.read("SELECT COALESCE(MAX(visit), 0) FROM visits")[0][0]
        self._visits = itertools.count(int(last) + 1)

    def next_visit(self) -> int:
        """A number for a visit that no other has."""
        return next(self._visits)

    @cached_property
    def _markdown(self) -> Any:
        from markdown_it import MarkdownIt

        return MarkdownIt("commonmark", {"html": False, "linkify": False}).enable("table")

    def html(self, text: str) -> str:
        """A Markdown text as HTML; HTML in it is shown as it is written."""
        return str(self._markdown.render(text))

    def text(self, name: str) -> str:
        """A text of the study as HTML; empty where there is none."""
        return self.html(self.study.texts[name]) if name in self.study.texts else ""
